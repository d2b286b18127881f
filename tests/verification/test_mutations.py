"""Whatever is broken in generated C, ``verify`` says so: one fault at a time, sown into the text.

The bytes tell of each before anything is compiled; compiled all the same, as ``edited`` asks for, the samples
must tell of it, too. A lost saturation of a *narrowing* is not among them: it is proved that none is ever
reached (codegen/test_runtime.py tries those functions by themselves); a lost clamp of an input or of the
integral is.

Red when a fault sown into C passes unseen.
"""

import json
import re
import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest

from focgen.cli.main import main
from focgen.codegen.generate import generate
from focgen.control.controller import ControllerRanges
from focgen.fractional.transfer import TransferFunction
from focgen.verification.verify import verify
from tests.conftest import paper_controller
from tests.controllers import simple

ARITHMETICS = ("q31", "q15", "f32")
SAMPLES = 3000


@dataclass(frozen=True)
class Fault:
    """``pattern`` in ``file`` becomes ``by``; "@" is the controller; ``where``: arithmetics that have it."""

    name: str
    file: str
    pattern: str
    by: str
    where: tuple[str, ...] = ARITHMETICS

    def __str__(self) -> str:
        return self.name


FIXED = ("q31", "q15")
_SHIFT = r"\(x \+ \(\(\(int(\d\d)_t\)1 << n\) >> 1\)\) >> n"

EITHER = (
    Fault("ring wraps a slot early", "foc_rt.h", r"now \+ 1u < size", "now + 2u < size"),
    Fault(
        "history read from the wrong slot", "foc_rt.h", r"now - lag : size", "now - lag + (lag > 2u) : size"
    ),
    Fault(
        "newest tap lost after the wrap",
        "foc_rt.h",
        r"for \(; i < taps; i\+\+\)",
        "for (; i + 1u < taps; i++)",
        ("f32", "q31"),
    ),
    Fault(
        "newest tap lost after the wrap",
        "foc_rt.h",
        r"\(uint16_t\)\(taps - wrap\)",
        "(uint16_t)(taps - wrap - (taps > wrap))",
        ("q15",),
    ),
    Fault(
        "a tap of eight twice",
        "foc_rt.h",
        r"weights\[5\] \* samples\[5\]",
        "weights[5] * samples[4]",
        ("q15",),
    ),
    Fault("a tap left out", "@.c", r"(foc_dot_f32\(@_numerator), (\d+)", r"\1, \2 - 1", ("f32",)),
    Fault("off-by-one tap", "@.c", r"(foc_dot_f32\(@_numerator.*), (\d+)\);", r"\1, \2 - 1);", ("f32",)),
    Fault("off-by-one tap", "@.c", r"\{7, 4, (\d+)\}", r"{6, 4, \1}", FIXED),
    Fault("a block's scale", "@.c", r"\{7, 4, (\d+)\}", r"{7, 4, \1 + 1}", FIXED),
    Fault("shift truncates", "foc_rt.h", _SHIFT, "x >> n", FIXED),
    Fault(
        "shift rounds halves down", "foc_rt.h", _SHIFT, r"(x + ((((int\1_t)1 << n) - 1) >> 1)) >> n", FIXED
    ),
    Fault("sums in double", "foc_rt.h", r"float sum = 0\.0f;", "double sum = 0.0;", ("f32",)),
    Fault("input clamp lost", "@.c", r"m = foc_clamp\d\d\(meas,.*\);", "m = meas;", FIXED),
    Fault("swapped input limits", "@.c", r"@_MEAS_MIN, @_MEAS_MAX", "@_MEAS_MAX, @_MEAS_MIN", FIXED),
    Fault("reset forgets the history", "@.c", r"@_settle\(s, .*r.* - m.*\);", "@_settle(s, 0);"),
    Fault("reset keeps the old history", "@.c", r"s->error\[i\] = e;", "(void)e;"),
    Fault("flag of the upper end lost", "@.c", r"flags \|= @_FLAG_HIGH", "flags |= 0u"),
    Fault("flag of the lower end lost", "@.c", r"flags \|= @_FLAG_LOW", "flags |= 0u"),
    Fault("flag of the inputs lost", "@.c", r"flags \|= @_FLAG_INPUT", "flags |= 0u", FIXED),
    Fault("a flag's bit moved", "@.h", r"(@_FLAG_LOW +)2u", r"\g<1>16u"),
    Fault("an output limit moved", "@.h", r"(@_U_MAX +)(\d[\d.]*)", r"\g<1>1 + \2"),
)

FLOAT = ("f32",)
UNUSABLE = (
    Fault("a bad reference gets in", "@.c", r"if \(!foc_usable_f32\(ref\) \|\| ", "if (", FLOAT),
    Fault("a bad measurement gets in", "@.c", r" \|\| !foc_usable_f32\(meas\)", "", FLOAT),
    Fault("only NaN is refused", "foc_rt.h", r"0x57800000u", "0x7f800001u", FLOAT),
    Fault("the largest usable input is refused", "foc_rt.h", r"< 0x57800000u", "< 0x577fffffu", FLOAT),
    Fault("negative inputs are refused", "foc_rt.h", r"bits & 0x7fffffffu", "bits & 0xffffffffu", FLOAT),
    Fault("flag of a step left out lost", "@.c", r"@_FLAG_INVALID \| @_ends", "0u | @_ends", FLOAT),
    Fault("ends of a held output lost", "@.c", r"@_FLAG_INVALID \| @_ends\(u\)", "@_FLAG_INVALID", FLOAT),
    Fault("reset takes a bad error", "@.c", r"known \? (ref - meas) : 0\.0f", r"\1", FLOAT),
)

PAPER = (
    Fault("a bad schedule gets in", "@.c", r" \|\| !foc_usable_f32\(sched\)", "", FLOAT),
    Fault("bad u0 leaves what was there", "@.c", r"    s->integral = .*u0 cannot be used \*/\n", "", FLOAT),
    Fault("a bad track gets in", "@.c", r"!foc_usable_f32\(u_applied\)", "0", FLOAT),
    Fault("increment counted twice", "@.c", r"\(d \+ s->increment\)", "(d + d)"),
    Fault(
        "integral's clamp lost",
        "@.c",
        r"s->integral = foc_clamp\w+\((.*),\s+\S+,\s+\S+\);",
        r"s->integral = \1;",
    ),
    Fault(
        "integral's limits swapped",
        "@.c",
        r"(s->integral = foc_clamp\w+\(s.*),\s+(\S+),\s+(\S+)\);",
        r"\1, \3, \2);",
    ),
    Fault("gain at the upper end", "foc_rt.h", r"return gains\[count - 1u\]", "return gains[count - 2u]"),
    Fault("gain at the lower end", "foc_rt.h", r"return gains\[0\]", "return gains[1]"),
    Fault(
        "a segment skipped",
        "foc_rt.h",
        r"i\+\+;\n    \}\n    return",
        "i += 1u + (i == 2u);\n    }\n    return",
    ),
    Fault("slope ignored", "foc_rt.h", r"slopes\[i\] \*", "0 *"),
    Fault(
        "track ignored",
        "@.c",
        r"s->integral = (.*u_applied.*|\(int\d\d_t\)u\b.*);",
        r"(void)u_applied;",
    ),
    Fault("track not limited", "@.c", r"foc_clamp\w+\(u_applied, @_U_MIN, @_U_MAX\)", "u_applied"),
    Fault("reset ignores u0", "@.c", r"@_track\(s, u0\);", "(void)u0;"),
    Fault("first gain forgotten", "@.c", r"s->starting = 1", "s->starting = 0"),
    Fault("starting for ever", "@.c", r"s->starting = 0", "s->starting = 1"),
    Fault("flag of the schedule lost", "@.c", r"flags \|= @_FLAG_SCHEDULE", "flags |= 0u"),
)

FILTER = (
    Fault("output is not kept", "@.c", r"s->output = u;", "(void)u;", FLOAT),
    Fault("output survives a reset", "@.c", r"s->output = 0\.0f;", "(void)e;", FLOAT),
    Fault("carry forgotten", "@.c", r"s->carry = x - .*;", "s->carry = 0;", FIXED),
    Fault("reset keeps the carry", "@.c", r"    s->carry = 0;\n", "", FIXED),
    Fault("recursion left out", "@.c", r"(-=? )@_denominator_sum\(s\)", r"\g<1>0 * @_denominator_sum(s)"),
    Fault("trapezoid is a rectangle", "@.c", r"s->inner_input = r;", "s->inner_input = 0;"),
    Fault("inner clamp lost", "@.c", r"s->inner = foc_clamp\w+\((.*),\s+\S+,\s+\S+\);", r"s->inner = \1;"),
    Fault("rest of the filtered error", "@.c", r"s->filtered\[i\] = v;", "s->filtered[i] = v + 1;"),
    Fault("constant gain", "@.c", r"(#define @_GAIN )(\d+)", r"\1(1 + \2)", FIXED),
    Fault("constant gain", "@.c", r"(#define @_GAIN )(\S+)", r"\1(1.0000002f * \2)", ("f32",)),
    Fault("output clamp lost", "@.c", r"foc_clamp\w+\(d, @_U_MIN, @_U_MAX\)", "d"),
    Fault("output limits swapped", "@.c", r"@_U_MIN, @_U_MAX", "@_U_MAX, @_U_MIN"),
)


def filter_controller():
    """A recursion, a term of negative order and no integrator: what the paper's controller lacks."""
    transfer = TransferFunction([(0.3, 0.5), (1.0, 0.0), (0.8, -0.7)], [(0.2, 0.9), (1.0, 0.0)])
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-3.0, 3.0))
    return simple(transfer, name="filter", gain=2.5, ranges=ranges, length=24)


CONTROLLERS = {"spba": paper_controller(40), "filter": filter_controller()}


def sound_folders(folder: Path) -> Path:
    """Sound folders, CONTROLLER_ARITHMETIC, in ``folder``."""
    for name, controller in CONTROLLERS.items():
        for arithmetic in ARITHMETICS:
            generate(controller, folder / f"{name}_{arithmetic}", arithmetic)
    return folder


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> Path:
    return sound_folders(tmp_path_factory.mktemp("sound"))


def copied(sound: Path, tmp_path: Path, name: str, arithmetic: str) -> Path:
    return Path(shutil.copytree(sound / f"{name}_{arithmetic}", tmp_path / "broken"))


def named(text: str, name: str) -> str:
    """The controller's name for "@", in capitals ahead of a macro."""
    return re.sub(r"@(?=_[A-Z])", name.upper(), text).replace("@", name)


def sow(folder: Path, name: str, fault: Fault) -> None:
    """Change the text, and make sure that it has changed."""
    path = folder / fault.file.replace("@", name)
    before = path.read_text()
    after, places = re.subn(named(fault.pattern, name), named(fault.by, name), before)
    assert places and after != before, f"{fault}: nothing to change"
    path.write_text(after)


def rewrite(folder: Path, change) -> None:
    """Change the manifest in place."""
    path = folder / "manifest.json"
    manifest = json.loads(path.read_text())
    change(manifest)
    path.write_text(json.dumps(manifest))


def cases():
    """Every other fault in one arithmetic of one controller, by turns; the others are in the long suite."""
    for which, (name, special) in enumerate((("spba", PAPER), ("filter", FILTER))):
        for turn, fault in enumerate(EITHER + UNUSABLE + special):
            here = turn % 2 == 0 if fault in special else turn % 4 == 2 * which
            for i, arithmetic in enumerate(fault.where):
                marks = () if here and i == turn // 2 % len(fault.where) else pytest.mark.long
                yield pytest.param(name, arithmetic, fault, id=f"{name}-{arithmetic}-{fault}", marks=marks)


@pytest.mark.parametrize(
    "name, arithmetic",
    [
        pytest.param(name, arithmetic, marks=() if i % 2 == j else pytest.mark.long)
        for j, name in enumerate(CONTROLLERS)
        for i, arithmetic in enumerate(ARITHMETICS)
    ],
)
def test_an_untouched_folder_holds(sound, name, arithmetic, capsys):
    assert main(["verify", str(sound / f"{name}_{arithmetic}"), "--samples", str(SAMPLES), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    host = found["targets"]["host"]
    assert (
        found["holds"] and host["mismatches"] == 0 and host["samples"] >= SAMPLES and not found["differences"]
    )
    assert 0.0 < host["max_error"]["operator"] <= host["error_bound"]["operator"]


@pytest.mark.parametrize("name, arithmetic, fault", list(cases()))
def test_a_fault_in_the_c_shows_in_the_samples(sound, tmp_path, name, arithmetic, fault):
    folder = copied(sound, tmp_path, name, arithmetic)
    sow(folder, name, fault)
    found = verify(folder, SAMPLES, edited=True)
    assert found.targets["host"].mismatches > 0, found
    assert found.targets["host"].first and not found.agrees and not found.holds
    changed = fault.file.replace("@", name)
    assert found.differences == (f"{changed}: is not what focgen writes for this controller.toml",)


@pytest.mark.parametrize(
    "place, arithmetic",
    [
        pytest.param(place, arithmetic, marks=() if i == j else pytest.mark.long)
        for i, place in enumerate((0, 20, 40))
        for j, arithmetic in enumerate(ARITHMETICS)
    ],
)
def test_one_weight_wrong_by_its_last_digit(sound, tmp_path, arithmetic, place):
    """The least change of a weight that the text can hold."""
    folder = copied(sound, tmp_path, "spba", arithmetic)
    path = folder / "spba.c"
    head, table, rest = re.split(r"(spba_numerator\[\d+\] = \{\n[^}]*\};)", path.read_text())
    numbers = list(
        re.finditer(r"-?\d[\d.e-]*f?(?=,)", re.sub(r"/\*.*?\*/", lambda m: " " * len(m[0]), table))
    )
    assert len(numbers) == 41
    begin, end = numbers[place].span()
    path.write_text(head + table[:begin] + neighbour(table[begin:end]) + table[end:] + rest)
    found = verify(folder, SAMPLES, edited=True).targets["host"]
    assert found.mismatches > 0
    seen, expected = re.search(r"C gives (.*); the reference (.*) \(ref", found.first).groups()
    assert seen != expected, "what is told is what differs"


def neighbour(text: str) -> str:
    """The next number of its type, away from zero."""
    import numpy as np

    if not text.endswith("f"):
        return str(int(text) + (1 if int(text) >= 0 else -1))
    value = np.float32(text[:-1])
    return f"{np.nextafter(value, np.copysign(np.float32(np.inf), value)):.9g}f"


@pytest.mark.parametrize(
    "macro, arithmetic",
    [
        pytest.param(macro, arithmetic, marks=() if i % 2 == j and i < 2 else pytest.mark.long)
        for i, macro in enumerate(("REF_LSB", "U_LSB", "SCHED_LSB", "SAMPLE_TIME"))
        for j, arithmetic in enumerate(("q31", "f32"))
    ],
)
def test_a_scale_of_the_header(sound, tmp_path, arithmetic, macro, capsys):
    """No sample depends on it, and every program that uses the controller does."""
    folder = copied(sound, tmp_path, "spba", arithmetic)
    sow(folder, "spba", Fault(macro, "@.h", rf"(@_{macro} +)([\d.e-]+f?)", r"\1(2.0f * \2)"))
    assert main(["verify", str(folder), "--samples", "500", "--edited"]) == 1
    assert f"spba_{macro}" in capsys.readouterr().out


def test_the_command_reports_a_mismatch(sound, tmp_path, capsys):
    folder = copied(sound, tmp_path, "spba", "q15")
    sow(folder, "spba", Fault("swapped sign", "@.c", r"\(int16_t\)\(r - m\)\)", "(int16_t)(m - r))"))
    assert main(["verify", str(folder), "--samples", "500", "--edited"]) == 1
    out, err = capsys.readouterr()
    assert "NOT verified" in out and "first difference" in out and not err


def test_c_that_crashes_is_a_mismatch_too(sound, tmp_path, capsys):
    """It must not take the caller with it."""
    folder = copied(sound, tmp_path, "spba", "q15")
    sow(folder, "spba", Fault("null", "@.c", r"s->error_now = 0;", "s = 0; s->error_now = 0;"))
    assert main(["verify", str(folder), "--samples", "500", "--edited"]) == 1
    assert "crashed" in capsys.readouterr().out
    assert main(["verify", str(folder), "--samples", "500", "--edited", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["targets"]["host"]["mismatches"] == 1


def test_another_runtime_is_not_the_one_that_was_proved(sound, tmp_path):
    """Not a bit changes, and it is not the file of the manifest."""
    folder = copied(sound, tmp_path, "spba", "q31")
    with open(folder / "foc_rt.h", "a") as runtime:
        runtime.write("/* improved */\n")
    found = verify(folder, 500, edited=True)
    assert found.targets["host"].mismatches == 0 and found.differences and found.agrees and not found.holds
