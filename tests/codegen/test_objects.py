"""What the compiled C asks for, what it does to memory, and how it lives beside another controller.

Red when the C asks for a library, writes outside its state, or keeps a state of its own.
"""

from __future__ import annotations

import json
import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from focgen.codegen.generate import folder_files, generate
from focgen.control.files import controller_text, read_controller
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.resources import shipped
from tests.c_code import EXACT, SANITISERS, STRICT, compiler, cross_compiler, run, tool
from tests.controllers import seed_controller

FINGER = Path(__file__).parents[1] / "golden" / "finger.toml"
ARITHMETICS = ("f64", "f32", "q31", "q15")
MEMORY = {"memset", "memcpy", "memmove"}  # what a compiler may make of a loop, with or without a libc


def folder_of(arithmetic: str, out: Path, name: str = "finger") -> Path:
    generate(FINGER, out, arithmetic, name=name)
    return out


def wanted(thing: Path) -> set[str]:
    """The symbols an object file leaves open."""
    return set(run(tool("nm"), "-u", thing).replace("U ", " ").split())


@pytest.mark.parametrize(
    "arithmetic, level",
    [
        pytest.param(arithmetic, level, marks=() if turn % 3 == i else pytest.mark.long)
        for turn, arithmetic in enumerate(ARITHMETICS)
        for i, level in enumerate(("-O0", "-O2", "-Os"))
    ],
)
def test_nothing_is_left_to_link(arithmetic, level, tmp_path):
    """No libm, no heap, no soft float, no globals; all that is public carries the name."""
    folder = folder_of(arithmetic, tmp_path)
    run(*compiler("gcc"), "-std=c99", level, "-c", folder / "finger.c", "-o", folder / "x.o")
    assert wanted(folder / "x.o") <= MEMORY
    defined = [line.split()[1:] for line in run(tool("nm"), "--defined-only", folder / "x.o").splitlines()]
    public = {name for kind, name in defined if kind.isupper() and kind != "R"}
    verbs = ("init", "reset", "step", "track", "flags", "save", "restore")
    assert public == {f"finger_{verb}" for verb in verbs}
    assert all(kind in "TtRr" for kind, _ in defined), "nothing that can be written to"
    assert all(name.startswith(("finger_", "foc_", ".L", ".rodata", ".text")) for _, name in defined)


@pytest.mark.parametrize("arithmetic", ["q31", "q15"])
def test_no_floating_point_on_the_fixed_path(arithmetic, tmp_path):
    """On a core without a floating-point unit every float operation is a call: there is none."""
    folder = folder_of(arithmetic, tmp_path)
    zig = [*compiler_for_bare_metal(), "-std=c99", "-O2", "-c", folder / "finger.c", "-o", folder / "x.o"]
    run(*zig)
    calls = {name for name in wanted(folder / "x.o") if not name.startswith("__aeabi_unwind")}
    assert calls <= MEMORY | {
        "__aeabi_lmul",
        "__aeabi_llsl",
        "__aeabi_lasr",
        "__aeabi_memset",
        "__aeabi_memclr",
        "__aeabi_memclr4",
        "__aeabi_memclr8",
        "__aeabi_memset4",
        "__aeabi_memset8",
        "__aeabi_memcpy",
        "__aeabi_memcpy4",
    }
    folder = folder_of("f32", tmp_path / "float")
    run(*zig[:-3], folder / "finger.c", "-o", folder / "x.o")
    assert any(name.startswith("__aeabi_f") for name in wanted(folder / "x.o")), (
        "the check sees float operations"
    )


def compiler_for_bare_metal() -> list[str]:
    pytest.importorskip("ziglang", reason="ziglang (extra `targets`) is not installed")
    return [
        sys.executable,
        "-m",
        "ziglang",
        "cc",
        "-target",
        "thumb-freestanding-eabi",
        "-mcpu=cortex_m0plus",
        "-ffreestanding",
        "-fno-sanitize=undefined",
    ]


@pytest.mark.parametrize("arithmetic", ["q31", "q15"])
def test_the_source_of_the_fixed_path_names_no_floating_type(arithmetic, tmp_path):
    folder = folder_of(arithmetic, tmp_path)
    code = re.sub(r"/\*.*?\*/", "", (folder / "finger.c").read_text(), flags=re.DOTALL)
    assert not re.search(r"\b(float|double)\b|[0-9]\.[0-9]|_f32|_f64", code)


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_the_state_is_as_large_as_the_manifest_says(arithmetic, tmp_path):
    folder = folder_of(arithmetic, tmp_path)
    size = json.loads((folder / "manifest.json").read_text())["sizes"]
    (folder / "size.c").write_text(
        '#include <stdio.h>\n#include "finger.h"\n'
        'int main(void) { printf("%d", (int)sizeof(finger_state)); return 0; }\n'
    )
    run(*compiler("gcc"), "-std=c99", folder / "size.c", "-o", folder / "size.exe")
    assert int(run(folder / "size.exe")) == size["state_bytes"]
    run(*compiler("gcc"), "-std=c99", "-O0", "-c", folder / "finger.c", "-o", folder / "x.o")
    tables = [line.split() for line in run(tool("nm"), "-S", folder / "x.o").splitlines() if " r " in line]
    assert sum(int(bytes_, 16) for _, bytes_, _, _ in tables) == size["table_bytes"]


_WILD = """#include <stdint.h>
#include <stdio.h>
#include "finger.h"

static uint32_t seed = 1;

static uint32_t chance(void)
{
    seed = seed * 1664525u + 1013904223u;
    return seed >> 8;
}

static finger_sig any(void)
{
    const uint32_t kind = chance() & 7u;
    return kind == 0u ? %(top)s : kind == 1u ? %(bottom)s : (finger_sig)%(some)s;
}

int main(void)
{
    static finger_state s;
    long k;

    finger_init(&s);
    for (k = 0; k < 200000; k++) {
        const uint32_t kind = chance() & 255u;
        if (kind == 0u) finger_reset(&s, any(), any(), any());
        if (kind == 1u) finger_track(&s, any());
        (void)finger_step(&s, any(), any(), any());
        if (finger_flags(&s) > 31u) return 2;
    }
    puts("clean");
    return 0;
}
"""
_SOME = {
    "int16_t": "(chance() & 0xffffu)",
    "int32_t": "(chance() << 8)",
    "float": "chance() * 1e-8f",
    "double": "chance() * 1e-8",
}
_ENDS = {
    "int16_t": ("INT16_MAX", "INT16_MIN"),
    "int32_t": ("INT32_MAX", "INT32_MIN"),
    "float": ("1e30f", "-1e30f"),
    "double": ("1e300", "-1e300"),
}


@pytest.mark.parametrize(
    "arithmetic", ["f32", "q31", *(pytest.param(a, marks=pytest.mark.long) for a in ("f64", "q15"))]
)
def test_no_input_leads_to_undefined_behaviour(arithmetic, tmp_path):
    """Any raw input whatever, in the address and undefined-behaviour sanitisers."""
    folder = folder_of(arithmetic, tmp_path)
    ctype = {"f64": "double", "f32": "float", "q31": "int32_t", "q15": "int16_t"}[arithmetic]
    top, bottom = _ENDS[ctype]
    (folder / "wild.c").write_text(_WILD % {"top": top, "bottom": bottom, "some": _SOME[ctype]})
    program = folder / "wild.exe"
    run(
        *compiler("gcc", *SANITISERS),
        "-std=c99",
        "-O1",
        "-g",
        *SANITISERS,
        folder / "wild.c",
        folder / "finger.c",
        "-o",
        program,
    )
    assert run(program) == "clean\n"


def test_two_controllers_live_in_one_program(tmp_path):
    """Another arithmetic and name, in one program or in one translation unit: each as it is alone."""
    folder_of("q15", tmp_path, "left"), folder_of("f32", tmp_path, "right")
    alone = [trace(tmp_path, [name]) for name in ("left", "right")]
    assert trace(tmp_path, ["left", "right"]) == "".join(alone)
    assert trace(tmp_path, ["left", "right"], one_unit=True) == "".join(alone)
    assert len(set(alone[0].split())) > 20


def trace(folder: Path, names: list[str], one_unit: bool = False) -> str:
    """The first outputs of controllers stepped in turn, grouped by controller."""
    calls = [
        f'{n}_init(&{n}); for (k = 0; k < 50; k++) printf("%.9g\\n", '
        f"(double){n}_step(&{n}, ({n}_sig)(0.01 / {n}_REF_LSB), 0, ({n}_sig)(0.1 / {n}_SCHED_LSB)));"
        for n in names
    ]
    ends = "c" if one_unit else "h"
    text = "\n".join(
        [
            "#include <stdio.h>",
            *(f'#include "{n}.{ends}"' for n in names),
            *(f"static {n}_state {n};" for n in names),
            "int main(void) { int k;",
            *calls,
            "return 0; }",
        ]
    )
    (folder / "main.c").write_text(text)
    sources = [] if one_unit else [folder / f"{n}.c" for n in names]
    run(*compiler("gcc"), *EXACT, folder / "main.c", *sources, "-o", folder / "main.exe")
    return run(folder / "main.exe")


def test_the_example_closes_its_loop(tmp_path):
    """It takes over from manual without a bump, and settles; its exit status says so."""
    examples = shipped("examples")
    generate(examples / "controller.toml", tmp_path)
    sources = [examples / "main.c", tmp_path / "spba.c"]
    run(*compiler("gcc"), *STRICT, *EXACT, "-I", tmp_path, *sources, "-o", tmp_path / "loop.exe")
    rows = [line.split() for line in run(tmp_path / "loop.exe").splitlines()[1:]]
    before, after = (float(row[1]) for row in rows[1:3])
    assert before == after == 1.0 and abs(float(rows[-1][2]) - 0.008) < 1e-4


def test_the_handshake_refuses_another_runtime(tmp_path):
    folder = folder_of("q15", tmp_path)
    runtime = folder / "foc_rt.h"
    runtime.write_text(runtime.read_text().replace("#define FOC_RT_VERSION 2", "#define FOC_RT_VERSION 99"))
    with pytest.raises(AssertionError, match="run focgen generate again"):
        run(*compiler("gcc"), "-std=c99", "-c", folder / "finger.c", "-o", folder / "x.o")


def test_every_table_and_every_pointer_to_one_is_marked_for_flash(tmp_path):
    folder = folder_of("q15", tmp_path)
    code, runtime = ((folder / name).read_text() for name in ("finger.c", "foc_rt.h"))
    assert code.count("static const FOC_ROM ") == code.count("static const ") > 8
    for table in ("weights", "blocks", "points", "gains", "slopes", "shifts"):
        pointers = re.findall(rf"(\S+ \S+) \*{table}\b", runtime)
        assert pointers and all(pointer.startswith("FOC_ROM ") for pointer in pointers), table


def test_on_avr_the_tables_stay_in_flash(tmp_path):
    folder = folder_of("q15", tmp_path)
    flags = ["-mmcu=atmega2560", "-std=gnu99", "-Os", "-Wall", "-Wextra", "-Werror"]
    avr = [*cross_compiler("avr-gcc", *flags), *flags]
    run(*avr, "-c", folder / "finger.c", "-o", folder / "x.o")
    tables = [line for line in run(tool("avr-nm"), folder / "x.o").splitlines() if "finger_numerator" in line]
    sections = run(tool("avr-objdump"), "-h", folder / "x.o")
    assert (
        tables
        and ".progmem" in sections
        and not re.search(r"^ +\d+ \.(rodata|data) +0*[1-9a-f]", sections, re.MULTILINE)
    )


@pytest.mark.parametrize(
    "changes, absent, present",
    [
        (dict(), ("inner", "feedback", "carry", "filtered["), ("schedule", "integral")),
        (
            dict(integrator=False),
            ("integral", "starting", "resting", "increment ="),
            ("(void)u0", "(void)u_applied"),
        ),
    ],
)
def test_what_a_controller_lacks_leaves_no_code(changes, absent, present, tmp_path):
    controller = replace(seed_controller(50), **changes)
    plan = build_plan(controller, "q31")
    files = folder_files(plan, controller_text(controller).encode())
    code = files["spba.c"] + files["spba.h"].split("typedef struct")[1].split("}")[0]
    assert not [word for word in absent if word in code.replace("no integral", "")]
    assert all(word in code for word in present)


def test_without_a_schedule_step_takes_two_signals(tmp_path):
    controller = replace(
        seed_controller(50), gain=300.0, ranges=replace(seed_controller().ranges, schedule=None)
    )
    files = folder_files(build_plan(controller, "q15"), controller_text(controller).encode())
    assert "spba_sig spba_step(spba_state *s, spba_sig ref, spba_sig meas);" in files["spba.h"]
    assert "sched" not in files["spba.h"].lower() and "sched" not in files["spba.c"].lower()
    write_files(tmp_path, files)
    run(
        *compiler("gcc"),
        *EXACT,
        "-I",
        tmp_path,
        tmp_path / "example" / "main.c",
        tmp_path / "spba.c",
        "-o",
        tmp_path / "main.exe",
    )


def test_the_controller_in_the_folder_is_the_one_that_was_given(tmp_path):
    made = generate(FINGER, tmp_path, "q15", length=17, name="short_finger")
    assert (tmp_path / "controller.toml").read_bytes() == FINGER.read_bytes()
    assert read_controller(tmp_path / "controller.toml") == read_controller(FINGER)
    assert made.manifest["length"] == 17 == made.plan.length and made.manifest["name"] == "short_finger"
    assert "short_finger_numerator[18]" in (tmp_path / "short_finger.c").read_text()
