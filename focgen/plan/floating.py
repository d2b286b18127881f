"""A controller in float or double: the same tables, rounded to the type."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from focgen.control.controller import Controller
from focgen.errors import PlanError
from focgen.plan.banks import floating_banks
from focgen.plan.canonical import Table, Tables, inner_limits
from focgen.plan.fixed import Actuation, Filter
from focgen.plan.gains import floating_gain
from focgen.plan.plan import Block, Feedback, Format, InnerIntegrator, Integrator, Sum
from focgen.present import present

KINDS: dict[str, tuple[type[np.floating[Any]], str]] = {
    "f64": (np.float64, "double"),
    "f32": (np.float32, "float"),
}


def filter_of(controller: Controller, tables: Tables, kind: type[np.floating[Any]], ctype: str) -> Filter:
    """The parts from e to v. Raises PlanError where a weight is beyond the type."""
    real = Format(ctype, 1.0, -np.inf, np.inf)
    direct = _sum("direct", "error", tables.direct, 0, controller, kind, real) if tables.direct else None
    feedback, at_rest = None, 1.0
    if tables.feedback:
        table = _sum("feedback", "filtered", tables.feedback, 1, controller, kind, real)
        total = tables.direct.total if tables.direct else 0.0
        feedback = Feedback(table, _rounded(total / tables.feedback.total, controller, kind), 0)
        at_rest += math.fsum(table.values)
    inner = _inner(controller, present(tables.rest), at_rest, kind, real) if tables.rest else None
    return Filter(direct, inner, real, 0, feedback, real, 0)


def _rounded(value: float, controller: Controller, kind: type[np.floating[Any]]) -> float:
    if abs(value) > float(np.finfo(kind).max) / 1e6:
        remedy = "give [ranges] in units that are nearer to 1, or choose f64"
        raise PlanError(controller.name, f"the weight {value:.3g} is beyond {np.dtype(kind).name}", remedy)
    return float(kind(value))


def _sum(
    name: str,
    history: str,
    table: Table,
    first: int,
    controller: Controller,
    kind: type[np.floating[Any]],
    real: Format,
) -> Sum:
    weights = tuple(_rounded(w, controller, kind) for w in table.weights[first:].tolist())
    block = Block(first, first + len(weights) - 1, weights, 1.0, real, 0)
    for m in table.modes:
        _rounded(float(np.abs(m.weights).max()), controller, kind)
    return Sum(name, history, (block,), real, floating_banks(table.modes, kind, real))


def _inner(
    controller: Controller, table: Table, at_rest: float, kind: type[np.floating[Any]], real: Format
) -> InnerIntegrator:
    low, high = (_rounded(x, controller, kind) for x in inner_limits(controller, at_rest))
    rest = _sum("rest", "error", table, 0, controller, kind, real)
    return InnerIntegrator(rest, Format(real.ctype, 1.0, low, high), 0)


def actuation(controller: Controller, output: Format, kind: type[np.floating[Any]], ctype: str) -> Actuation:
    """Gain and integrator."""
    factor = 0.5 * controller.sample_time if controller.integrator else 1.0
    gain = floating_gain(controller, factor, kind, ctype)
    real = Format(ctype, 1.0, -np.inf, np.inf, controller.units.output)
    return Actuation(gain, real, 0, real, Integrator(output, 0) if controller.integrator else None)


def signal(ends: tuple[float, float], kind: type[np.floating[Any]], ctype: str, unit: str) -> Format:
    """The format of an input or the output with the given physical range."""
    return Format(ctype, 1.0, float(kind(ends[0])), float(kind(ends[1])), unit)
