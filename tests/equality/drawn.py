"""Random controllers of every kind: transfer function, arithmetic, memory, schedule, and what is optional."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from focgen.control.controller import Controller, Tunable
from focgen.errors import PlanError
from focgen.plan.build import build_plan
from focgen.plan.plan import Plan
from tests.controllers import random_controller

ARITHMETICS = ("q31", "q15", "f32", "f64")
LONGEST = 32
"""Past samples of a short memory: what takes part in a sum changes nothing but the time that it takes."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """A plan, and what is special of it, in words that a table can count."""

    seed: int
    plan: Plan
    kinds: tuple[str, ...]


def drawn(seed: int) -> Drawn | None:
    """The controller of a seed; None where its arithmetic or its memory cannot carry it."""
    rng = np.random.default_rng([seed, 20])
    controller = _dressed(rng, random_controller(seed, LONGEST))
    arithmetic = ARITHMETICS[seed // 10 % 4]  # the kinds of transfer functions change with every seed
    memory = _memory(rng)
    tunable = controller.tunable is not None
    try:
        plan = build_plan(controller, arithmetic, name=f"c{seed}", tunable=tunable, **memory)
    except PlanError:
        return None
    return Drawn(seed, plan, _kinds(plan, controller))


def _dressed(rng: np.random.Generator, controller: Controller) -> Controller:
    """With a set-point filter, a slew limit and a box of parameters, each now and then."""
    h, (low, high) = controller.sample_time, controller.ranges.output
    if rng.random() < 0.25:
        controller = replace(controller, setpoint_filter=float(h * 10.0 ** rng.uniform(-0.5, 3.0)))
    if controller.integrator and rng.random() < 0.25:
        controller = replace(controller, slew_limit=float((high - low) / h * 10.0 ** rng.uniform(-2.5, -0.5)))
    if rng.random() < 0.25:
        third = (high - low) / 3.0
        box = Tunable(
            (float(rng.uniform(0.3, 1.0)), float(rng.uniform(1.0, 2.0))),
            (low, low + third),
            (high - third, high),
        )
        controller = replace(controller, tunable=box)
    return controller


def _memory(rng: np.random.Generator) -> dict:
    """Short in half of all; else exponential, a third of them with the continuous operator."""
    chance = rng.random()
    if chance < 0.5:
        return {"memory": "short"}
    tolerance = float(10.0 ** rng.uniform(-3.5, -1.5))
    if chance < 0.83:
        return {
            "memory": "exponential",
            "tolerance": tolerance,
            "horizon": int(10.0 ** rng.uniform(3.0, 5.5)),
        }
    return {"memory": "exponential", "operator": "continuous", "tolerance": max(tolerance, 1e-3)}


def _kinds(plan: Plan, controller: Controller) -> tuple[str, ...]:
    found = {
        "exponential memory": plan.memory == "exponential",
        "continuous operator": plan.operator == "continuous",
        "recursion": plan.feedback is not None,
        "inner integral": plan.inner is not None,
        "integrator": plan.integrator is not None,
        "schedule": plan.schedule is not None,
        "tunable": plan.tuning is not None,
        "slew limit": controller.slew_limit is not None,
        "set-point filter": plan.set_point is not None,
    }
    return tuple(name for name, has in found.items() if has)
