"""Optimisation at link time: the same bits, on this computer and with the kernels of cores in an emulator.

Red when optimisation at link time changes a bit, or breaks the assembly of a core.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from focgen.codegen.generate import generate
from focgen.targets import toolchains
from focgen.targets.cores import core
from focgen.targets.library import TargetLibrary
from focgen.targets.toolchains import EXACT as EXACT_THERE
from focgen.verification.compare import answered, cases_of, judged
from focgen.verification.folder import read_folder
from tests.c_code import EXACT, FUSED, compiler, fusing, run, tool
from tests.codegen.test_selftest import main_of
from tests.conftest import paper_controller

FORMS = {"short": dict(memory="short", target="cortex-m4"), "exponential": dict(memory="exponential")}
ENTRIES = ("focgen_run", "focgen_scale", "focgen_bytes", "focgen_selftest", "focgen_halt")
KEPT = "-Wl," + ",".join(f"-u,{name}" for name in ENTRIES)  # what the emulator calls


def linked(folder: Path, command: list[str], *flags: str) -> Path:
    """A program that prints what the self-test returns."""
    (folder / "board.c").write_text(main_of("spba"))
    sources = [folder / name for name in ("board.c", "spba.c", "spba_selftest.c")]
    target = folder / "board.exe"
    run(*command, *flags, "-flto", *sources, "-o", target, "-lm")
    return target


def by_turns(*arithmetics: str) -> list:
    """Each of the arithmetics by one of the compilers; by the other one in the long suite."""
    return [
        pytest.param(cc, arithmetic, marks=() if turn % 2 == i else pytest.mark.long)
        for turn, arithmetic in enumerate(arithmetics)
        for i, cc in enumerate(("gcc", "clang"))
    ]


@pytest.mark.parametrize("cc, arithmetic", by_turns("q15", "q31", "f32", "f64"))
def test_the_bits_are_the_same(cc, arithmetic, tmp_path):
    for form, how in FORMS.items():
        generate(paper_controller(60), tmp_path / form, arithmetic, selftest=True, **how)
        assert run(linked(tmp_path / form, compiler(cc, "-flto"), *EXACT)).split() == ["0"], form


@pytest.mark.parametrize("cc, arithmetic", by_turns("f32", "f64"))
def test_contraction_at_link_time_is_noticed_where_it_happens(cc, arithmetic, tmp_path):
    """GCC fuses then, too; clang 14 leaves it out: the program's own instructions say which."""
    flags = ["-O2", "-ffp-contract=fast", *fusing()]
    command, objdump = compiler(cc, "-flto", *flags, source=FUSED), tool("objdump")
    generate(paper_controller(60), tmp_path, arithmetic, selftest=True)
    program = linked(tmp_path, command, *flags)
    fused = re.search(r"\bv?fn?m(add|sub)", run(objdump, "-d", program)) is not None
    assert (run(program).split() != ["0"]) == fused and (fused or cc == "clang")


@pytest.mark.parametrize(
    "name, arithmetic",
    [
        pytest.param("cortex-m4", "q15", marks=pytest.mark.long),
        pytest.param("cortex-m4", "q31", marks=pytest.mark.long),
        pytest.param("cortex-m4", "f32", marks=pytest.mark.long),
        ("cortex-m0plus", "q31"),
        ("rv32imac", "q15"),
    ],
)
def test_the_kernels_of_a_core(name, arithmetic, tmp_path):
    """No compiler looks through their assembly; the self-test there says so as well."""
    pytest.importorskip("unicorn")
    pytest.importorskip("ziglang")
    read = read_folder(
        generate(paper_controller(60), tmp_path, arithmetic, selftest=True, target=name).folder
    )
    for chain in toolchains.toolchains(core(name)):
        flags = (*EXACT_THERE, KEPT, "-flto")
        library = TargetLibrary(core(name), chain, [read.plan], [tmp_path], flags, selftest=True)
        cases = cases_of(read.plan, 200, 1, 200)
        result = judged(read.plan, cases, *answered(library, read.plan, cases), read)
        assert result.sound and library.selftest(read.plan) == 0 and not library.illegal(), result.first
