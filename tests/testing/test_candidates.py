"""``focgen.testing``: candidates that are the reference, and such that are nearly so.

Red when a candidate that is nearly right passes, or one that is right fails.
"""

import math
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import focgen
from focgen.codegen.generate import generate
from focgen.errors import BuildError, InputError
from focgen.plan.plan import FLAG_HIGH, FLAG_LOW
from focgen.testing import assert_equivalent, equivalence, from_c
from tests.c_code import FUSED, compiler, fusing
from tests.conftest import paper_controller
from tests.verification.test_mutations import Fault, filter_controller, named, sow

ROOT = Path(__file__).resolve().parents[2]
PORT = ROOT / "examples" / "port"
SAMPLES = 1000


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    root = tmp_path_factory.mktemp("folders")
    controllers = {"spba": paper_controller(40), "filter": filter_controller()}
    for name, controller in controllers.items():
        for arithmetic in ("f32", "q31", "q15"):
            generate(controller, root / f"{name}_{arithmetic}", arithmetic)
    generate(paper_controller(), root / "modes_q15", "q15", memory="exponential")
    generate(PORT / "controller.toml", root / "port")
    return root


def edited(folders, tmp_path, name, fault):
    folder = Path(shutil.copytree(folders / name, tmp_path / name))
    sow(folder, name.split("_")[0], fault)
    return folder


# --------------------------------------------------------------------------------------------- folders


@pytest.mark.parametrize("within", ("bits", pytest.param("bound", marks=pytest.mark.long)))
@pytest.mark.parametrize("name", ("spba_f32", "spba_q31", "filter_f32", "filter_q15", "modes_q15"))
def test_what_is_generated_is_equivalent(folders, name, within):
    found = assert_equivalent(folders / name, folders / name, within, samples=SAMPLES, seed=3)
    assert found.samples > SAMPLES and found.runs > 9
    assert found.flags == (within == "bits") and (within == "bits" or 0.0 < found.share <= 1.0)


FAULTS = (
    ("spba_q31", Fault("a weight", "@.c", r"-(\d{6,})(\d),", r"-\g<1>0,")),
    ("spba_f32", Fault("the ring's wrap", "foc_rt.h", r"now \+ 1u < size", "now + 2u < size")),
    ("spba_q15", Fault("the ring's wrap", "foc_rt.h", r"now \+ 1u < size", "now + 1u <= size")),
    ("spba_q31", Fault("a lost clamp", "@.c", r"m = foc_clamp32\(meas,.*\);", "m = meas;")),
    ("spba_f32", Fault("a lost clamp", "@.c", r"foc_clamp_f32\(u_applied, @_U_MIN, @_U_MAX\)", "u_applied")),
    ("filter_q15", Fault("a lost carry", "@.c", r"s->carry = x - .*;", "s->carry = 0;")),
    ("modes_q15", Fault("a flag", "@.c", r"flags \|= @_FLAG_LOW", "flags |= 0u")),
)


@pytest.mark.parametrize("name, fault", FAULTS, ids=str)
def test_an_edited_folder_is_caught(folders, tmp_path, name, fault):
    if name == "modes_q15":
        fault = Fault(fault.name, "spba.c", named(fault.pattern, "spba"), fault.by)
    folder = edited(folders, tmp_path, name, fault)
    with pytest.raises(AssertionError, match=r"differ in a bit\nfirst in sample|crashed"):
        assert_equivalent(folders / name, folder, samples=SAMPLES)


def test_a_fault_that_leaves_the_bound(folders, tmp_path):
    """A part in a thousand of the largest weight does, the last digit of one does not."""
    name = "spba_f32"
    small = edited(folders, tmp_path, name, Fault("a digit", "@.c", r"-0\.0(\d{7})", r"-0.0\g<1>0000001"))
    assert 0.0 < assert_equivalent(folders / name, small, "bound", SAMPLES).share < 1.0
    large = re.search(r"(\d\d\.\d+)f,\n\};", (folders / name / "spba.c").read_text())[1]
    broken = Fault("a weight", "@.c", re.escape(large), f"{float(large) * 1.001:.9g}")
    folder = edited(folders, tmp_path / "large", name, broken)
    with pytest.raises(AssertionError, match=r"by more than the bound(.|\n)*apart, and .* is allowed"):
        assert_equivalent(folders / name, folder, "bound", SAMPLES)


def test_fused_multiply_adds_are_within_the_bound_and_other_bits(folders):
    flags = ["-O3", *fusing(), "-ffp-contract=fast"]
    compiler("cc", *flags, source=FUSED)
    fused = from_c(folders / "spba_f32" / "spba.c", "spba", flags=("-std=gnu99", *flags))
    assert 0.0 < assert_equivalent(folders / "spba_f32", fused, "bound", SAMPLES).share < 1.0
    with pytest.raises(AssertionError, match="differ in a bit"):
        assert_equivalent(folders / "spba_f32", fused, "bits", SAMPLES)


def test_the_first_difference_is_shown_with_all_that_led_to_it(folders, tmp_path):
    fault = Fault("track", "@.c", r"s->integral = \(int64_t\)u .*;", "(void)u;")
    folder = edited(folders, tmp_path, "spba_q31", fault)
    with pytest.raises(AssertionError) as failed:
        assert_equivalent(folders / "spba_q31", folder, samples=SAMPLES, seed=5)
    told = str(failed.value)
    assert re.search(r"\d+ of \d+ samples differ in a bit", told) and "run " in told and "seed 5" in told
    inputs = r"ref +-?\d+ \(\S+ 1/mm\)", r"sched +-?\d+ \(\S+ bar\)", r"before it: .*track\(\d+ \(\S+ V\)\)"
    outputs = (rf"{who} u = (\d+) \(\S+ V\), flags \d" for who in ("reference", "candidate"))
    for part in (*inputs, *outputs):
        assert re.search(part, told), told
    seen, wanted = (re.search(rf"{who} +u = (\d+)", told)[1] for who in ("candidate", "reference"))
    assert seen != wanted


# ----------------------------------------------------------------------------------------------- own C


@pytest.mark.parametrize(
    "old, new",
    (
        (r"s->oldest \+ 1 >= MIRRORED_TAPS", "s->oldest + 1 > MIRRORED_TAPS"),
        (r"-0\.0137890643f", "-0.0137990643f"),
        (r"u > 10\.0f \? 10\.0f : u", "u"),
        (r"counts\(limited\(u\)\)", "counts(u)"),
    ),
)
def test_slips_of_a_port_are_caught(folders, tmp_path, old, new):
    for file in PORT.glob("mirrored.*"):
        (tmp_path / file.name).write_text(file.read_text())
    source = tmp_path / "mirrored.c"
    changed, places = re.subn(old, new, source.read_text())
    assert places == 1
    source.write_text(changed)
    with pytest.raises(AssertionError, match="differ in a bit|crashed"):
        assert_equivalent(folders / "port", from_c(source, prefix="mirrored"), samples=SAMPLES)


OWN = """#include <stdint.h>
typedef struct {{ int8_t odd[3]; int32_t u; }} mine;
void my_reset(mine *s, int32_t ref, int32_t meas, int32_t u0) {{ s->u = u0; (void)ref; (void)meas; }}
int32_t my_update(mine *s, int32_t ref, int32_t meas) {{ {body} return s->u + ref - meas; }}
void my_track(mine *s, int32_t u) {{ s->u = u; }}
"""


def own(tmp_path, body="", **options):
    source = tmp_path / "my.c"
    source.write_text(OWN.format(body=body))
    return from_c(source, "my", **{"state": "mine", "names": {"step": "my_update"}, **options})


def test_names_and_a_state_of_ones_own(tmp_path):
    one = own(tmp_path)
    one.reset(5, 6, 100)
    assert one.step(2**31 - 1 - 100, 0) == 2**31 - 1, "every count passes through unchanged"
    one.track(-7)
    assert one.step(1, 2) == -8 and not one.scheduled and not hasattr(one, "flags")


@pytest.mark.parametrize("body, said", (("return *(volatile int32_t *)0;", "crashed .SIGSEGV"),
                                        ("for (;;) s->odd[0]++;", "it hangs")))  # fmt: skip
def test_c_that_does_not_come_back_is_a_failed_test(folders, tmp_path, monkeypatch, body, said):
    monkeypatch.setattr(equivalence, "_PATIENCE", 0.5)
    monkeypatch.setattr(equivalence, "_SLOW", 0.0)
    with pytest.raises(AssertionError, match=said):
        assert_equivalent(folders / "filter_q31", own(tmp_path, body), samples=10)


def test_c_that_a_factory_makes_is_run_apart_as_well(folders, tmp_path):
    """It ended the tests themselves."""
    crashing = "return *(volatile int32_t *)0;"
    with pytest.raises(AssertionError, match="crashed .SIGSEGV"):
        assert_equivalent(folders / "filter_q31", lambda: own(tmp_path, crashing), samples=10)


class Unsendable(Exception):
    """It does not fit through a pipe between processes."""

    def __reduce__(self):
        raise TypeError("not to be sent")


def test_an_error_that_cannot_be_sent_is_told_in_words(folders, tmp_path, capfd):
    one = own(tmp_path)
    one.step = raising
    with pytest.raises(RuntimeError, match="Unsendable: of my own"):
        assert_equivalent(folders / "filter_q31", one, samples=10)
    assert "Traceback" not in capfd.readouterr().err


def raising(*counts):
    raise Unsendable("of my own")


@pytest.mark.parametrize(
    "options, error, said",
    (
        ({"names": {}}, InputError, "has no function my_step; give its name"),
        ({"names": {"stop": "x"}}, InputError, "names 'stop'; name one of"),
        ({"state": "yours"}, BuildError, "does not compile: .*yours"),
        ({"names": {"step": "my_track"}}, InputError, "my_track takes neither"),
        ({"header": "absent.h"}, InputError, "is no file"),
        ({"flags": ("-DOWN", "-std=c99", "-Werror", "-Wall", "-Dmine=5")}, BuildError, "does not compile"),
    ),
)
def test_what_from_c_cannot_use_is_named(tmp_path, options, error, said):
    with pytest.raises(error, match=said):
        own(tmp_path, **options)


def test_sources_that_are_missing(tmp_path):
    with pytest.raises(InputError, match="nowhere.c: is no file"):
        from_c(tmp_path / "nowhere.c", "my")
    with pytest.raises(InputError, match="no source"):
        from_c([], "my")
    (tmp_path / "my.h").write_text("typedef int my_state; int my_step(my_state *, int, int);"
                                   "void my_reset(my_state *, int, int, int);")  # fmt: skip
    (tmp_path / "my.c").write_text('#include "my.h"\n')
    with pytest.raises(BuildError, match="does not link: .*name every C file"):
        from_c(tmp_path / "my.c", "my")


# ---------------------------------------------------------------------------------------------- Python


class Loop:
    """The C of a folder, behind a Python object of its own."""

    def __init__(self, folder, wrong=0):
        self.inside, self.wrong, self.count = focgen.load(folder, raw=True), wrong, 0
        self.reset, self.track = self.inside.reset, self.inside.track

    def step(self, *inputs):
        self.count += 1
        return self.inside.step(*inputs) + (self.count == self.wrong)

    def flags(self):
        return int(self.inside.flags)


def test_objects_classes_and_plain_functions(folders):
    """An object without init is reset to rest; a plain step is run once, from rest."""
    folder = folders / "spba_q31"
    loaded = focgen.load(folder)
    assert assert_equivalent(loaded, Loop(folder), samples=400).flags
    assert assert_equivalent(folder, loaded, samples=400).runs > 9
    assert assert_equivalent(folder, lambda: loaded.counts(), samples=400).flags
    once = assert_equivalent(folder, loaded.counts().step, samples=400)
    assert once.runs == 1 and once.samples > 800 and not once.flags
    assert assert_equivalent(folder, loaded.counts().step, "bound", 400).runs == 1
    with pytest.raises(AssertionError, match='1 of .*\nfirst in sample 776 of run 0, "all inputs in one'):
        assert_equivalent(folder, Loop(folder, wrong=777).step, samples=400)


def test_a_candidate_that_answers_nan_is_none(folders):
    class Lost:
        def reset(self, ref, meas, u0): ...

        def step(self, ref, meas):
            return math.nan

    for within in ("bits", "bound"):
        with pytest.raises(AssertionError, match="candidate u = nan"):
            assert_equivalent(folders / "filter_f32", Lost, within, samples=10)


def test_an_error_of_the_candidate_says_when(folders):
    class Broken(Loop):
        def step(self, *inputs):
            self.inside.step(*inputs)
            self.count += 1
            return 1 // (4 - self.count)

    with pytest.raises(ZeroDivisionError) as failed:
        assert_equivalent(folders / "spba_q15", Broken(folders / "spba_q15"), samples=10)
    assert "at sample" in failed.value.__notes__[0]


def test_the_reference_may_be_a_controller(folders, tmp_path):
    controller = PORT / "controller.toml"
    for reference in (controller, focgen.read_controller(controller), focgen.load(folders / "port")):
        assert assert_equivalent(reference, folders / "port", samples=100).flags
    folder = edited(folders, tmp_path, "port", Fault("c", "@.c", r"return s->flags;", "return 255u;"))
    assert assert_equivalent(folder, folders / "port", samples=100).flags, "its C takes no part"
    with pytest.raises(AssertionError):
        assert_equivalent(folder, folder, samples=100)
    (folder / "controller.toml").write_text((folder / "controller.toml").read_text().replace("3.0", "3.1"))
    for reference in (folder, focgen.load(folder, edited=True)):
        with pytest.raises(InputError, match="has been edited: controller.toml"):
            assert_equivalent(reference, folders / "port")


@pytest.mark.parametrize(
    "call, said",
    (
        (lambda f: (f / "spba_q31", f / "spba_q15"), "is q15 with other counts .* is q31"),
        (lambda f: (f / "spba_q31", 5), "is 5; give a folder"),
        (lambda f: (f / "spba_q31", type("T", (), {"reset": len, "step": len})()), "has no track"),
        (lambda f: (f / "spba_q31", from_c(PORT / "mirrored.c", "mirrored")), "takes no scheduling signal"),
        (lambda f: (f / "nothing", 5), "is no folder"),
        (lambda f: (5, f / "spba_q31"), "reference: is 5; give a path"),
        (lambda f: (f / "spba_q31", f / "spba_q31", "bit"), "choose one of bits, bound"),
        (lambda f: (f / "spba_q31", f / "spba_q31", "bits", 0), "samples: is 0"),
        (lambda f: (f / "spba_q31", f / "spba_q31", "bits", 5, -1), "seed: is -1"),
    ),
)
def test_what_cannot_be_compared_is_named(folders, call, said):
    with pytest.raises(InputError, match=said):
        assert_equivalent(*call(folders))


# ---------------------------------------------------------------------------------------------- pytest


def test_the_example_holds_and_takes_the_plug_ins_options(tmp_path):
    """As a user runs it, with another seed and fewer samples; the plug-in is named since an entry point needs
    an installation.
    """
    (tmp_path / "test_wrong.py").write_text(
        "import focgen\n"
        "def test_wrong(assert_equivalent, tmp_path):\n"
        f"    focgen.generate({str(PORT / 'controller.toml')!r}, tmp_path)\n"
        "    assert_equivalent(tmp_path, lambda ref, meas: 0.0)\n"
    )
    command = [sys.executable, "-m", "pytest", "-q", "-p", "focgen.testing.plugin", "-p", "no:cacheprovider"]
    more = ["--focgen-samples", "300", "--focgen-seed", "9", "--rootdir", str(tmp_path), "-c", "/dev/null"]
    tests = [str(PORT), str(tmp_path)]
    done = subprocess.run([*command, *more, *tests], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 1 and "1 failed, 3 passed" in done.stdout, done.stdout + done.stderr
    assert "seed 9" in done.stdout and "candidate u = 0.0" in done.stdout


def test_the_entry_point_leads_to_the_plug_in():
    text = (ROOT / "pyproject.toml").read_text()
    module = re.search(r'\[project.entry-points.pytest11\]\n"(.*)" = "(.*)"', text)
    assert module[1] == module[2] == "focgen.testing.plugin", "one name, so that -p finds it already there"


def test_rest_is_a_reset_without_error(folders):
    from focgen.testing.candidates import at_rest

    for name in ("spba_q31", "filter_f32"):
        one = focgen.load(folders / name, raw=True)
        other = one.new()
        other.reset(*at_rest(one.plan))
        assert one._machine.content(one._state) == other._machine.content(other._state)
        assert not one.flags & (FLAG_HIGH | FLAG_LOW)


def test_nothing_of_it_is_imported_by_pytest_alone():
    """The plug-in is loaded in every run of pytest where focgen is installed."""
    listed = "[m for m in sys.modules if m.startswith(('numpy', 'focgen.plan'))]"
    code = f"import sys, focgen.testing.plugin; print({listed})"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert found.stdout.strip() == "[]"


# ------------------------------------------------------------------------------------- odd answers


@pytest.mark.parametrize("odd", ["0.5", b"1", None, 1j, [0.0], np.zeros(1), np.zeros((2, 2)), True, {}])
def test_an_answer_that_is_no_number_is_told(folders, odd):
    """Text of the right number passed."""
    with pytest.raises(InputError, match=f"type {type(odd).__name__} as its step; return a number"):
        assert_equivalent(folders / "filter_f32", lambda ref, meas: odd, samples=SAMPLES)


class Flagged:
    """The reference, with flags as a test wants them, or an output."""

    def __init__(self, folder, flags=int, u=float):
        self.own, self.flag, self.u = focgen.load(folder, raw=True), flags, u

    def reset(self, *given):
        self.own.reset(*given)

    def track(self, u):
        self.own.track(u)

    def step(self, *given):
        return self.u(self.own.step(*given))

    @property
    def flags(self):
        return self.flag(self.own.flags)


@pytest.mark.parametrize("odd", [str, float, lambda flags: None])
def test_flags_that_are_no_whole_number_are_told(folders, odd):
    with pytest.raises(InputError, match="as its flags; return a whole number"):
        assert_equivalent(folders / "spba_q31", Flagged(folders / "spba_q31", odd), samples=SAMPLES)


@pytest.mark.parametrize("u", [np.float64, np.int64, int, np.array])
def test_numbers_of_any_kind_are_answers(folders, u):
    whole = Flagged(folders / "spba_q31", np.uint8, u)
    assert assert_equivalent(folders / "spba_q31", whole, samples=SAMPLES).flags
