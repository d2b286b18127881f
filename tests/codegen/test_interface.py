"""What stands around the five functions: macros, conversions, saved states, and what stops a wrong build.

Red when a macro, a conversion or a saved state says another thing than the state, or a wrong build passes.
"""

import json
import re
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cffi import FFI

from focgen.cli.main import main
from focgen.codegen.conversions import period_us
from focgen.codegen.generate import generate
from focgen.compiler import compile_shared
from focgen.plan.build import build_plan
from focgen.plan.scenario import nearest_raw
from focgen.verification.verify import verify
from tests.c_code import STRICT, compiler, run
from tests.conftest import paper_controller
from tests.verification.test_mutations import Fault, copied, sound_folders, sow

ARITHMETICS = ("f64", "f32", "q31", "q15")
CALLS = """
    float as_float(SIG u) { return spba_u_to_f32(u); }
    SIG of_ref(float x) { return spba_ref_from_f32(x); }
    SIG of_meas(float x) { return spba_meas_from_f32(x); }
    SIG of_sched(float x) { return spba_sched_from_f32(x); }
    unsigned saved_bytes(void) { return SPBA_SAVED_BYTES; }
    unsigned state_bytes(void) { return (unsigned)sizeof(spba_state); }
"""


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> Path:
    return sound_folders(tmp_path_factory.mktemp("sound"))


@pytest.fixture(scope="module", params=ARITHMETICS)
def c(request, tmp_path_factory):
    """The paper's controller and its inline functions as a library: (ffi, library, plan)."""
    folder = tmp_path_factory.mktemp("interface")
    plan = generate(paper_controller(20), folder, request.param).plan
    sig, ffi = plan.output.ctype, FFI()
    text = CALLS.replace("SIG", sig)
    (folder / "calls.c").write_text('#include "spba.h"\n' + text)
    compile_shared([folder / "spba.c", folder / "calls.c"], folder / "all.so", ["-std=c99"], [folder])
    ffi.cdef(re.sub(r"\{.*?\}", ";", text) + f"""
        void spba_init(void *); void spba_reset(void *, {sig}, {sig}, {sig}); uint8_t spba_flags(void *);
        {sig} spba_step(void *, {sig}, {sig}, {sig}); void spba_track(void *, {sig});
        void spba_save(const void *, uint8_t *); uint8_t spba_restore(void *, const uint8_t *);
    """)  # fmt: skip
    return ffi, ffi.dlopen(str(folder / "all.so")), plan


# ----------------------------------------------------------------------------------------------- macros


def test_old_spellings_are_the_same_macros(tmp_path):
    generate(paper_controller(20), tmp_path, "q31")
    header = (tmp_path / "spba.h").read_text()
    names = re.findall(r"#define SPBA_(\w+)", header)
    assert len(names) > 15
    of_before = set(names) - {"PERIOD_US", "SAVED_BYTES", "HAS_F32"}
    assert {n for n in names if f"#define spba_{n} " in header} == of_before
    checks = "".join(f"#if spba_{n} != SPBA_{n}\n#error {n}\n#endif\n" for n in of_before if "LSB" not in n
                     and n != "SAMPLE_TIME")  # fmt: skip
    (tmp_path / "use.c").write_text(f'#include "spba.h"\n{checks}double x = spba_U_LSB + spba_SAMPLE_TIME;\n')
    run(*compiler("gcc"), "-std=c99", "-c", tmp_path / "use.c", "-o", tmp_path / "use.o")


def test_a_name_in_capitals_has_one_spelling(tmp_path):
    generate(paper_controller(20), tmp_path, "q15", name="PID")
    header = (tmp_path / "PID.h").read_text()
    assert header.count("#define PID_U_MAX") == 1
    assert verify(tmp_path, 200).holds


@pytest.mark.parametrize(
    "time, micros",
    ((0.01, 10_000), (0.0003, 300), (1e-6, 1), (1.5e-6, None), (1 / 3, None), (60.0, 60 * 10**6)),
)
def test_the_period_is_there_where_it_is_whole(time, micros):
    assert period_us(build_plan(paper_controller(5, sample_time=time), "f32")) == micros


# ------------------------------------------------------------------------------------------ conversions


def test_conversions_saturate_and_round_to_the_nearest(c):
    """Of random values, of halves and their neighbours, and of such as no type holds."""
    _ffi, library, plan = c
    rng = np.random.default_rng(2)
    for call, form in ((library.of_ref, plan.error), (library.of_meas, plan.error),
                       (library.of_sched, plan.schedule.signal)):  # fmt: skip
        top = np.float32((1 << (form.bits - 1)) * form.lsb) if not form.floating else np.float32(1.0)
        halves = (rng.integers(-3000, 3000, 60) + 0.5) * form.lsb
        values = np.concatenate([rng.uniform(-1.2, 1.2, 300) * top, halves, [np.inf, -np.inf, 3e38, 1e-45]])
        values = values.astype(np.float32)
        values = np.concatenate([values, np.nextafter(values, np.float32(0.0))])
        assert [call(float(x)) for x in values] == nearest_raw(values, form).tolist()
        nan = call(float("nan"))
        assert np.isnan(nan) if form.floating else nan == -(1 << (form.bits - 1))
    for u in (plan.output.low, plan.output.high):
        assert library.as_float(u) == np.float32(u) * np.float32(plan.output.lsb)


@pytest.mark.parametrize(
    "name, arithmetic, pattern, by",
    (
        ("spba", "q31", r"rest >= 0\.5f", "rest > 0.5f"),
        pytest.param("spba", "q15", r"scaled >= 32767", "scaled >= 42767", marks=pytest.mark.long),
        pytest.param(
            "spba", "q31", r"(sched_from_f32.*\n\{\n.*value \* )", r"\g<1>2.0f * ", marks=pytest.mark.long
        ),
        ("filter", "f32", r"(meas_from_f32.*\n\{\n +return )", r"\g<1>2.0f * "),
        ("spba", "q31", r"(SPBA_PERIOD_US +)10000u", r"\g<1>10001u"),
    ),
)
def test_verify_sees_a_wrong_conversion(sound, tmp_path, name, arithmetic, pattern, by):
    folder = copied(sound, tmp_path, name, arithmetic)
    sow(folder, name, Fault("conversion", "@.h", pattern, by))
    assert verify(folder, 200, edited=True).targets["host"].header


def test_without_floats(tmp_path, capsys):
    """Nothing of them in the header; the folder remembers, and verifies."""
    generate(paper_controller(20), tmp_path / "with", "q15", no_float=False)
    controller = str(tmp_path / "with" / "controller.toml")
    argv = ["generate", controller, "--out", str(tmp_path / "out"), "--arithmetic", "q15", "--no-float"]
    assert main(argv) == 0
    header = (tmp_path / "out" / "spba.h").read_text()
    assert "float" not in re.sub(r"/\*.*?\*/", "", header, flags=re.DOTALL) and "f32" not in header
    assert json.loads((tmp_path / "out" / "manifest.json").read_text())["no_float"] is True
    assert verify(tmp_path / "out", 200).holds and verify(tmp_path / "with", 200).holds
    example = tmp_path / "out" / "example" / "main.c"
    run(*compiler("gcc"), *STRICT, "-I", tmp_path / "out", example, tmp_path / "out" / "spba.c",
        "-o", tmp_path / "example.exe")  # fmt: skip
    assert len(run(tmp_path / "example.exe").splitlines()) == 10


# ------------------------------------------------------------------------------------------ saved states


def state_of(c, seed: int):
    """A state in the middle of a run."""
    ffi, library, _plan = c
    state, rng = ffi.new("double[]", library.state_bytes() // 8 + 1), np.random.default_rng(seed)
    library.spba_init(state)
    calls = library.of_ref, library.of_meas, library.of_sched
    for inputs in rng.uniform(0.0, (0.02, 0.02, 0.2), (50, 3)):
        library.spba_step(state, *(call(x) for call, x in zip(calls, inputs)))
    return state


def bytes_of(c, state) -> bytes:
    ffi, library, _ = c
    return bytes(ffi.buffer(state)[: library.state_bytes()])


def test_a_state_comes_back_and_goes_on(c):
    ffi, library, _ = c
    state, saved = state_of(c, 1), ffi.new("uint8_t[]", library.saved_bytes())
    library.spba_save(state, saved)
    other, content = state_of(c, 2), bytes(ffi.buffer(saved))
    assert int.from_bytes(content[-4:], "little") == zlib.crc32(content[:-4]), "as elsewhere"
    assert library.spba_restore(other, saved) == 0
    inputs = library.of_ref(0.01), library.of_meas(0.002), library.of_sched(0.1)
    for _ in range(30):
        assert library.spba_step(state, *inputs) == library.spba_step(other, *inputs)
    again = ffi.new("uint8_t[]", library.saved_bytes())
    library.spba_restore(other, saved)
    library.spba_save(other, again)
    assert bytes(ffi.buffer(again)) == bytes(ffi.buffer(saved))


def test_whatever_is_damaged_is_refused_and_changes_nothing(c):
    """Every single byte, in one bit; all 0, all 1."""
    ffi, library, _ = c
    count = library.saved_bytes()
    saved, state = ffi.new("uint8_t[]", count), state_of(c, 2)
    library.spba_save(state_of(c, 1), saved)
    before, good = bytes_of(c, state), bytes(ffi.buffer(saved))
    for at in range(count):
        saved[at] ^= 1 << (at % 8)
        assert library.spba_restore(state, saved) == 2
        saved[at] ^= 1 << (at % 8)
    for fill in (b"\0", b"\xff"):
        assert library.spba_restore(state, ffi.from_buffer(fill * count)) != 0
    assert bytes_of(c, state) == before and library.spba_restore(state, ffi.from_buffer(good)) == 0


def test_a_state_of_another_configuration_is_refused(tmp_path):
    """Of the same layout, with another gain."""
    text = []
    for i, gain in enumerate((2.0, 2.5)):
        ranges = replace(paper_controller().ranges, schedule=None)
        generate(paper_controller(20, gain=gain, ranges=ranges), tmp_path / str(i), "q31")
        text.append((tmp_path / str(i) / "spba.c").read_text())
    number = [re.search(r"#define SPBA_CONFIGURATION (\w+)", t)[1] for t in text]
    assert number[0] != number[1]
    ffi = FFI()
    ffi.cdef("void spba_save(const void *, uint8_t *); uint8_t spba_restore(void *, const uint8_t *);"
             "void spba_init(void *);")  # fmt: skip
    built = []
    for i in range(2):
        compile_shared([tmp_path / str(i) / "spba.c"], tmp_path / f"{i}.so", ["-std=c99"])
        built.append(ffi.dlopen(str(tmp_path / f"{i}.so")))
    state, saved = ffi.new("double[200]"), ffi.new("uint8_t[1000]")
    built[0].spba_init(state)
    built[0].spba_save(state, saved)
    before = bytes(ffi.buffer(state))
    assert built[1].spba_restore(state, saved) == 1 and bytes(ffi.buffer(state)) == before
    assert built[0].spba_restore(state, saved) == 0


NOT_SAVED = (
    ("@.c", r"    at = foc_put\(to, at, .*s->error\[i\].*\n", "    at = foc_put(to, at, 0, 4);\n"),
    ("@.c", r"    s->error_now = \(uint16_t\)foc_get", "    (void)foc_get"),
    ("@.c", r"!= sum\)", "!= sum && at == 0u)"),
    ("foc_save.h", r"bits >>= 8;", "bits >>= 7;"),
)


@pytest.mark.parametrize(
    "name, arithmetic, file, pattern, by",
    [
        pytest.param(*one, *fault, marks=() if turn % 2 == i else pytest.mark.long)
        for turn, fault in enumerate(NOT_SAVED)
        for i, one in enumerate((("spba", "q31"), ("filter", "f32")))
    ],
)
def test_verify_sees_what_is_not_saved(sound, tmp_path, name, arithmetic, file, pattern, by):
    folder = copied(sound, tmp_path, name, arithmetic)
    sow(folder, name, Fault("saving", file, pattern, by))
    assert verify(folder, 1600, edited=True).targets["host"].mismatches


# ------------------------------------------------------------------------------------------------ flags


def test_resets_and_tracks_out_of_range_say_so(c):
    ffi, library, plan = c
    if plan.floating:
        pytest.skip("floating inputs have no ends")
    state, ref, high = ffi.new("double[]", library.state_bytes() // 8 + 1), plan.reference, plan.output.high
    library.spba_init(state)
    resets = ((ref.high, 0, high), 0), ((ref.high + 1, 0, high), 8), ((0, -1, 0), 8), ((0, 0, -1), 8)
    for given, flag in resets:
        library.spba_reset(state, *given)
        assert library.spba_flags(state) == flag
    for u, flag in ((high, 8), (high + 1, 8), (0, 8)):
        library.spba_track(state, u)
        assert library.spba_flags(state) == flag, "and stays until the next step"
    library.spba_step(state, 0, 0, 0)
    assert not library.spba_flags(state) & 8
    library.spba_track(state, -1)
    assert library.spba_flags(state) & 8


@pytest.mark.parametrize("pattern", (r"(r != ref \|\| m != meas\)) \{", r"u != u_applied"))
@pytest.mark.parametrize("arithmetic", ("q31", pytest.param("q15", marks=pytest.mark.long)))
def test_verify_sees_a_flag_of_a_call_that_is_lost(sound, tmp_path, arithmetic, pattern):
    folder = copied(sound, tmp_path, "spba", arithmetic)
    sow(folder, "spba", Fault("flag", "@.c", pattern, r"0) {" if "r != ref" in pattern else "0"))
    assert verify(folder, 1600, edited=True).targets["host"].mismatches


# ------------------------------------------------------------------------------------------------ builds


def refusal(source: Path, *flags: str) -> str:
    """What the compiler says of a build that it stops, or warns of."""
    import subprocess

    command = [*compiler("gcc"), *flags, "-c", str(source), "-o", str(source.with_suffix(".o"))]
    return subprocess.run(command, capture_output=True, text=True).stderr


@pytest.mark.parametrize("arithmetic, fma", (("f32", "-D__FP_FAST_FMAF=1"), ("f64", "-D__FP_FAST_FMA=1")))
def test_flags_that_change_the_bits_are_named(sound, tmp_path, arithmetic, fma):
    generate(paper_controller(20), tmp_path, arithmetic)
    source = tmp_path / "spba.c"
    assert "build without -ffast-math" in refusal(source, "-std=c99", "-ffast-math")
    assert "build with -ffp-contract=off" in refusal(source, "-std=gnu99", fma)
    for flags in (("-std=c99", fma), ("-std=gnu99",), ("-std=gnu99", fma, "-DFOC_FLAGS_CHECKED"),
                  ("-std=c99", "-ffast-math", "-DFOC_FLAGS_CHECKED")):  # fmt: skip
        assert not refusal(source, *flags), flags
    assert not refusal(sound / "spba_q31" / "spba.c", "-std=gnu99", "-ffast-math", fma), "integers need none"


@pytest.mark.parametrize(
    "options",
    [
        {},
        pytest.param({"memory": "exponential"}, marks=pytest.mark.long),
        *({"target": target} for target in ("cortex-m4", "cortex-m0plus")),
    ],
    ids=str,
)
def test_a_header_of_another_version_stops_the_build(tmp_path, options):
    length = {} if "memory" in options else {"length": 100}
    made = generate(paper_controller(), tmp_path, "q31", **options, **length)
    headers = [name for name in made.files if name.startswith("foc_")]
    assert len(headers) >= 2
    for name in headers:
        text = (tmp_path / name).read_text()
        (tmp_path / name).write_text(re.sub(r"(#define FOC_\w+_VERSION) \d+", r"\1 99", text))
        assert f"{name} is not the one that came with spba.c" in refusal(tmp_path / "spba.c", "-std=c99")
        (tmp_path / name).write_text(text)
