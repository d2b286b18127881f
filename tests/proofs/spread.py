"""The controllers that are proved, fuzzed and searched for faults: together they have every part there is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from focgen.codegen.generate import folder_files
from focgen.codegen.kernels import PORTABLE, Kernels
from focgen.control.controller import Controller, ControllerRanges, GainSchedule, Tunable
from focgen.control.files import controller_text
from focgen.fractional.transfer import TransferFunction
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.plan.plan import Plan

ARITHMETICS = ("q15", "q31", "f32", "f64")
KERNELS = (("rv32imac", "q15"), ("rv32imac", "q31"), ("cortex-m4", "f32"), ("cortex-m0plus", "q31"))
"""A target and an arithmetic for each form of the cores' sums in C: looking ahead, and by halves."""
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


def tuned(length: int) -> dict[str, Controller]:
    """With parameters: "inverse_tuned", a schedule ahead of an integrator that has a slew limit, and
    "filter_tuned", neither of them, but a set-point filter.
    """
    found = controllers(length)
    limits = {"inverse": Tunable((0.5, 2.0), (0.0, 1.0), (5.0, 10.0))}
    limits["filter"] = Tunable((0.25, 1.5), (-3.0, -1.0), (1.0, 3.0))
    found["inverse"] = replace(found["inverse"], slew_limit=20.0)
    found["filter"] = replace(found["filter"], setpoint_filter=0.1)
    return {f"{n}_tuned": replace(found[n], name=f"{n}_tuned", tunable=box) for n, box in limits.items()}


def remembering() -> dict[str, Controller]:
    """The same with an exponential memory: in the numerator alone, and in everything; and "slow_modes", which
    remembers changes (an order above 1) for so long that every arithmetic needs its bank for slow modes.
    """
    found = controllers(24)
    form = dict(memory="exponential", tolerance=1e-2, horizon=2000)
    names = {name: f"{name}_modes" for name in ("inverse", "all")}
    changes = TransferFunction([(0.02, 1.3), (1.0, 0.0)])
    slow = replace(found["filter"], name="slow_modes", transfer=changes, **{**form, "horizon": 1_000_000})
    return {
        **{called: replace(found[name], name=called, **form) for name, called in names.items()},
        "slow_modes": slow,
    }


def generated(folder: Path, name: str, arithmetic: str, length: int, kernels: Kernels = PORTABLE) -> Plan:
    """Write one of them into a folder, under its own name, and return its plan."""
    controller = {**controllers(length), **tuned(length), **remembering()}[name]
    plan = build_plan(controller, arithmetic, name=name, tunable=controller.tunable is not None)
    write_files(folder, folder_files(plan, controller_text(controller).encode(), kernels=kernels))
    return plan
