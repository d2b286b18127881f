"""The controllers that are proved, fuzzed and searched for faults: together they have every part there is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from focgen.codegen.generate import folder_files
from focgen.control.controller import Controller, ControllerRanges, GainSchedule
from focgen.control.files import controller_text
from focgen.fractional.transfer import TransferFunction
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.plan.model import Plan

ARITHMETICS = ("q15", "q31", "f32", "f64")
_POINTS = (0.05, 0.1, 0.2, 0.25)
_GAINS = tuple((85.66 * p + 6.692) / (0.0015 + 0.345 * p) for p in _POINTS)


def controllers(length: int) -> dict[str, Controller]:
    """By name: "inverse" (schedule, integrator), "filter" (recursion, term of negative order, neither of the
    two), "all" (all four).
    """
    inverse = Controller(
        name="inverse",
        sample_time=0.01,
        transfer=TransferFunction([(1.32, 0.6), (1.0, 0.0)]),
        gain=GainSchedule(_POINTS, _GAINS),
        integrator=True,
        ranges=ControllerRanges((0.0, 0.02), (0.0, 0.02), (0.0, 10.0), (0.0, 0.25)),
        length=length,
    )
    both = TransferFunction([(0.4, 0.6), (1.0, 0.0), (0.5, -0.4)], [(0.05, 0.9), (1.0, 0.0)])
    plain = TransferFunction([(0.3, 0.5), (1.0, 0.0), (0.8, -0.7)], [(0.2, 0.9), (1.0, 0.0)])
    wide = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-3.0, 3.0))
    return {
        "inverse": inverse,
        "filter": replace(inverse, name="filter", transfer=plain, gain=2.5, integrator=False, ranges=wide),
        "all": replace(inverse, name="all", transfer=both),
    }


def remembering() -> dict[str, Controller]:
    """The same with an exponential memory: in the numerator alone, and in everything."""
    found = controllers(24)
    return {
        f"{name}_modes": replace(
            found[name], name=f"{name}_modes", memory="exponential", tolerance=1e-2, horizon=2000
        )
        for name in ("inverse", "all")
    }


def generated(folder: Path, name: str, arithmetic: str, length: int) -> Plan:
    """Write one of them into a folder, under its own name, and return its plan."""
    controller = {**controllers(length), **remembering()}[name]
    plan = build_plan(controller, arithmetic, name=name)
    write_files(folder, folder_files(plan, controller_text(controller).encode()))
    return plan
