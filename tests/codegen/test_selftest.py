"""``NAME_selftest()``: 0 on a sound board; a wrong compiler, flag or byte has a step at which it shows.

Red when the self-test passes on a board with other bits, or fails on a sound one.
"""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from focgen.cli.main import main
from focgen.codegen.generate import folder_files, generate
from focgen.codegen.selftest import RESET, TRACK, scenario_of, selftest_rows
from focgen.control.files import controller_text
from focgen.errors import InputError, PlanError
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.verification.verify import verify
from tests.c_code import EXACT, FUSED, STRICT, compiler, fusing, run, tool
from tests.conftest import paper_controller
from tests.controllers import random_controller
from tests.verification.test_mutations import filter_controller, named

ARITHMETICS = ("f64", "f32", "q31", "q15")
CONTROLLERS = {"spba": paper_controller(40), "filter": filter_controller()}
RANDOM = range(700, 710)  # one of each kind


def main_of(*names: str) -> str:
    """A program that prints what the self-tests return."""
    return "\n".join(
        [
            "#include <stdio.h>",
            *(f'#include "{name}_selftest.h"' for name in names),
            "int main(void)\n{",
            *(f'    printf("%u ", (unsigned){name}_selftest());' for name in names),
            "    return 0;\n}\n",
        ]
    )


def results(folder: Path, names: list[str], command: list[str], *flags: str) -> list[int]:
    """Compile the controllers of a folder and run their self-tests."""
    (folder / "board.c").write_text(main_of(*names))
    sources = [folder / f"{name}{end}.c" for name in names for end in ("", "_selftest")]
    run(*command, *flags, folder / "board.c", *sources, "-o", folder / "board.exe", "-lm")
    return [int(word) for word in run(folder / "board.exe").split()]


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> Path:
    """Folders CONTROLLER_ARITHMETIC, each with its self-test."""
    folder = tmp_path_factory.mktemp("selftests")
    for name, controller in CONTROLLERS.items():
        for arithmetic in ARITHMETICS:
            generate(controller, folder / f"{name}_{arithmetic}", arithmetic, selftest=True)
    return folder


def boards(folder: Path, each: int) -> list[str]:
    """The self-tests of random controllers in one folder: each of them in so many arithmetics, by turns, of
    those that carry it."""
    names = []
    for turn, seed in enumerate(RANDOM):
        for arithmetic in [ARITHMETICS[(turn + i) % 4] for i in range(each)]:
            try:
                plan = build_plan(random_controller(seed, 90), arithmetic, name=f"c{seed}_{arithmetic}")
            except PlanError:
                continue
            write_files(folder, folder_files(plan, controller_text(plan.controller).encode(), selftest=True))
            names.append(plan.name)
    return names


@pytest.mark.parametrize(
    "level, each", [("-O2", 1), *(pytest.param(level, 4, marks=pytest.mark.long) for level in ("-O0", "-O2"))]
)
def test_sound_boards_agree(level, each, tmp_path):
    """Every kind of controller, all in one program; not a warning."""
    names = boards(tmp_path, each)
    assert len(names) > 7 * each and {name.split("_")[1] for name in names} == set(ARITHMETICS)
    strict = [flag for flag in STRICT if not flag.startswith("-Wmissing")]
    assert set(results(tmp_path, names, compiler("gcc"), *strict, "-ffp-contract=off", level)) == {0}


def by_turns(*arithmetics: str) -> list:
    """Each of the arithmetics with one of the controllers; with the other in the long suite."""
    return [
        pytest.param(arithmetic, name, marks=() if (i + j) % 2 == 0 else pytest.mark.long)
        for i, arithmetic in enumerate(arithmetics)
        for j, name in enumerate(CONTROLLERS)
    ]


@pytest.mark.parametrize("arithmetic, name", by_turns(*ARITHMETICS))
def test_clang_agrees(sound, name, arithmetic):
    folder = sound / f"{name}_{arithmetic}"
    assert results(folder, [name], compiler("clang"), *STRICT, "-O2", "-ffp-contract=off") == [0]


@pytest.fixture(scope="module")
def fma() -> list[str]:
    """What makes the compiler of this machine fuse products and sums."""
    return fusing()


@pytest.mark.parametrize("arithmetic, name", by_turns("f32", "f64"))
@pytest.mark.parametrize("cc", ["gcc", pytest.param("clang", marks=pytest.mark.long)])
def test_contraction_is_noticed(sound, name, arithmetic, cc, fma):
    fast = ["-O2", "-ffp-contract=fast", *fma]
    folder, command = sound / f"{name}_{arithmetic}", compiler(cc, *fast, source=FUSED)
    assert results(folder, [name], command, *fast) != [0]
    assert results(folder, [name], command, *EXACT, *fma) == [0]


@pytest.mark.parametrize("arithmetic, name", by_turns("f32", "f64"))
@pytest.mark.parametrize("cc", [pytest.param("gcc", marks=pytest.mark.long), "clang"])
def test_fast_math_is_noticed(sound, name, arithmetic, cc):
    """Where somebody has silenced the compiler's own complaint."""
    flags = ("-O3", "-ffast-math", "-DFOC_FLAGS_CHECKED")
    assert results(sound / f"{name}_{arithmetic}", [name], compiler(cc), *flags) != [0]


def test_the_default_of_gcc_is_noticed(sound, fma):
    """Its own dialect contracts; -std=c99 does not."""
    folder, flags = sound / "spba_f32", ["-std=gnu11", "-O2", *fma]
    assert results(folder, ["spba"], compiler("gcc", *flags, source=FUSED), *flags) != [0]


def test_integers_need_no_flag(sound):
    for arithmetic in ("q31", "q15"):
        folder, flags = sound / f"spba_{arithmetic}", ["-Ofast", "-march=native"]
        assert results(folder, ["spba"], compiler("gcc", *flags), *flags) == [0]


# ------------------------------------------------------------------------------------------ what it covers


@pytest.mark.parametrize("name", CONTROLLERS)
@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_it_covers_what_a_controller_meets(name, arithmetic):
    plan = build_plan(CONTROLLERS[name], arithmetic)
    rows = selftest_rows(plan)
    seen = execute(plan, scenario_of(plan, rows))
    assert sum(row.event == RESET for row in rows) > 3 and sum(row.event == TRACK for row in rows) > 3
    present = int(np.bitwise_or.reduce(seen.flags[0]))
    expected = 3 | (4 if plan.schedule else 0) | (16 if plan.floating else 8)
    assert present == expected
    free = np.mean(seen.flags[0] & 3 == 0)
    assert free > 0.5 and len(np.unique(seen.u)) > 0.4 * seen.u.size
    if plan.floating:
        arguments = {place for row in rows for place in range(6) if row.bad >> place & 1}
        assert arguments == set(range(6 if plan.schedule else 5))
    if plan.schedule:
        raw = scenario_of(plan, rows).sched[0]
        segments = np.searchsorted(plan.schedule.breakpoints, raw, side="right")
        assert set(segments) == set(range(len(plan.schedule.breakpoints) + 1))


@pytest.mark.parametrize("length", [1, 2, 399, 3000])
def test_its_length_is_bearable_and_it_fills_the_memory(length):
    rows = selftest_rows(build_plan(paper_controller(length), "q15"))
    steps = sum(row.steps for row in rows)
    assert max(min(length, 800), 240) < steps < 1000 and all(0 < row.steps < 256 for row in rows)


FAULTS = {
    "ring": ("foc_rt.h", r"now \+ 1u < size", "now + 2u < size"),
    "tap": (
        "foc_rt.h",
        r"for \(; (i|count) ([<>]) (taps|0u); (i\+\+|count--)\)",
        r"for (; \1 \2 \3 && \1 != 1u; \4)",
    ),
    "reset": ("@.c", r"s->error\[i\] = e;", "(void)e;"),
    "track": ("@.c", r"s->integral = (.*u_applied.*|\(int\d\d_t\)u\b.*);", "(void)u_applied;"),
    "schedule": ("foc_rt.h", r"slopes\[i\] \*", "0 *"),
    "upper flag": ("@.c", r"flags \|= @_FLAG_HIGH", "flags |= 0u"),
    "lower flag": ("@.c", r"flags \|= @_FLAG_LOW", "flags |= 0u"),
    "schedule flag": ("@.c", r"flags \|= @_FLAG_SCHEDULE", "flags |= 0u"),
    "bad inputs": ("@.c", r"!foc_usable_f32\(\w+\)", "0"),
    "range": ("@.c", r"flags \|= @_FLAG_INPUT", "flags |= 0u"),
    "limit": ("@.h", r"(@_U_MAX +)(\d[\d.]*)", r"\g<1>1 + \2"),
}


ONE_ONLY = {"bad inputs": "f32", "range": "q15"}


def fault_cases():
    """Every other fault in one of two arithmetics, by turns; all in both of them in the long suite."""
    for turn, fault in enumerate(FAULTS):
        here = ("q15", "f32")[turn // 2 % 2] if turn % 2 == 0 else None
        here = ONE_ONLY.get(fault, here)
        for arithmetic in ("q15", "f32"):
            yield pytest.param(fault, arithmetic, marks=() if arithmetic == here else pytest.mark.long)


@pytest.mark.parametrize("fault, arithmetic", list(fault_cases()))
def test_a_fault_has_a_step(sound, tmp_path, arithmetic, fault):
    file, pattern, by = (named(part, "spba") for part in FAULTS[fault])
    folder = Path(shutil.copytree(sound / f"spba_{arithmetic}", tmp_path / "broken"))
    text, places = re.subn(pattern, by, (folder / file).read_text())
    if not places:
        assert ONE_ONLY[fault] != arithmetic
        pytest.skip(f"{arithmetic} does not have it")
    (folder / file).write_text(text)
    assert 0 < results(folder, ["spba"], compiler("gcc"), *EXACT)[0] < 500


@pytest.mark.parametrize(
    "step, arithmetic",
    [
        (283, "q31"),
        *(
            pytest.param(*case, marks=pytest.mark.long)
            for case in ((1, "q31"), (1, "f64"), (40, "q31"), (40, "f64"), (283, "f64"))
        ),
    ],
)
def test_it_names_the_first_step_that_is_wrong(sound, tmp_path, arithmetic, step, capsys):
    """A vector is changed; the command says so, too, whatever the samples."""
    folder = Path(shutil.copytree(sound / f"spba_{arithmetic}", tmp_path / "broken"))
    path = folder / "spba_selftest.c"
    head, table, rest = re.split(r"(spba_outputs\[\d+\] = \{\n[^}]*\};)", path.read_text())
    begin, end = list(re.finditer(r"-?\d[\d.e-]*(?=,)", table))[step - 1].span()
    other = "3" + table[begin + 1 : end].replace("3", "4")
    assert other != table[begin:end]
    path.write_text(head + table[:begin] + other + table[end:] + rest)
    assert results(folder, ["spba"], compiler("gcc"), *EXACT) == [step]
    assert main(["verify", str(folder), "--samples", "200", "--edited"]) == 1
    out = capsys.readouterr().out
    assert f"wrong at its step {step}" in out and "NOT verified" in out and "samples equal" in out
    assert main(["verify", str(folder), "--samples", "200", "--edited", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["targets"]["host"]["selftest"] == step


def test_the_command_writes_it_on_request_only(tmp_path, capsys):
    toml = tmp_path / "spba.toml"
    toml.write_text(controller_text(CONTROLLERS["spba"]))
    for extra, wanted in (([], 0), (["--selftest"], 2)):
        folder = tmp_path / f"out{wanted}"
        assert main(["generate", str(toml), "--out", str(folder), "--arithmetic", "q15", *extra]) == 0
        assert len(list(folder.glob("*_selftest.*"))) == wanted
        assert ("spba_selftest()" in (folder / "README.md").read_text()) == bool(wanted)
        assert main(["verify", str(folder), "--samples", "200"]) == 0
        assert ("self-test: 0" in capsys.readouterr().out) == bool(wanted)
    (tmp_path / "out2" / "spba_selftest.h").unlink()
    assert main(["verify", str(tmp_path / "out2")]) == 2
    assert "lacks spba_selftest.h" in capsys.readouterr().err


def test_generated_again_without_one_it_is_gone_and_nothing_else(tmp_path):
    """Nor headers that only the form before needed; what somebody else wrote or changed stays."""
    again = lambda **how: generate(CONTROLLERS["spba"], tmp_path, "q15", **how)
    again(selftest=True, memory="exponential", tolerance=0.05, horizon=1000)
    for own in ("mine_selftest.c", "notes.txt", "foc_mine.h"):
        (tmp_path / own).write_text("mine")
    assert (tmp_path / "foc_memory.h").is_file() and (tmp_path / "spba_selftest.c").is_file()
    generate(CONTROLLERS["filter"], tmp_path, "q15")  # another controller takes no file
    assert (tmp_path / "spba_selftest.c").is_file() and (tmp_path / "foc_memory.h").is_file()
    again(selftest=True, target="cortex-m4")
    changed = tmp_path / "foc_ahead_q15.h"
    changed.write_text(changed.read_text() + "/* mine */")
    made = again()
    here = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    kept = {
        "mine_selftest.c",
        "notes.txt",
        "foc_mine.h",
        "foc_ahead_q15.h",
        "filter.c",
        "filter.h",
        "filter.manifest.json",
        "filter.controller.toml",
    }
    assert here == {*made.files, *kept}
    assert verify(tmp_path, 200).holds


@pytest.mark.parametrize(
    "content", ["", "[]", "{", '{"name": "spba", "selftest": {}, "inputs": {"../x": ""}}']
)
def test_a_manifest_that_is_none_removes_nothing_outside(tmp_path, content):
    (tmp_path / "x").write_text("mine")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "manifest.json").write_text(content)
    with pytest.raises(InputError, match="manifest.json would be replaced"):
        generate(CONTROLLERS["spba"], tmp_path / "out", "q15")
    generate(CONTROLLERS["spba"], tmp_path / "out", "q15", force=True)
    assert (tmp_path / "x").is_file() and (tmp_path / "out" / "spba.c").is_file()


def test_the_manifest_says_what_it_takes(sound):
    for arithmetic in ARITHMETICS:
        folder = sound / f"spba_{arithmetic}"
        entry = json.loads((folder / "manifest.json").read_text())["selftest"]
        assert f"SELFTEST_STEPS {entry['steps']}u" in (folder / "spba_selftest.h").read_text()
        run(*compiler("gcc"), "-std=c99", "-O0", "-c", folder / "spba_selftest.c", "-o", folder / "x.o")
        symbols = run(tool("nm"), "-S", folder / "x.o").splitlines()
        tables = [line.split() for line in symbols if " r " in line]
        assert sum(int(size, 16) for _, size, _, _ in tables) == entry["table_bytes"]


def test_a_folder_without_one_verifies_without_one(tmp_path):
    generate(CONTROLLERS["spba"], tmp_path, "q15")
    assert verify(tmp_path, 200).targets["host"].selftest is None
