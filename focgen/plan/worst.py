"""The inputs that drive a plan's nodes to their proved worst case."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from focgen.arrays import Array
from focgen.errors import PlanError
from focgen.plan.mode_sums import Modes
from focgen.plan.plan import Plan, Sum
from focgen.plan.proofs import sum_response
from focgen.plan.scenario import Reset, Scenario, Tune
from focgen.plan.tuning import default_params
from focgen.plan.values import scheduled_gain
from focgen.present import present

_LONGEST = 400  # samples of an exponential memory's response
_SETTLED = 8  # memory lengths after which a recursion's response is taken to have died away


def worst_case_input(plan: Plan, node: str) -> Scenario:
    """Raw inputs whose last sample takes ``node`` (one of ``plan.proofs``; floating: v) to its worst case.

    Two lanes: towards the highest value and towards the lowest. A sum over the error is reached exactly;
    behind a recursion as far as a finite input can. Raises PlanError for a node the plan does not have.
    """
    nodes = ["v"] if plan.floating else [p.node for p in plan.proofs]
    if node not in nodes:
        known = ", ".join(nodes)
        raise PlanError(plan.name, f"has no node {node!r}", f"choose one of {known}")
    response = _response(plan, node)
    up = response[::-1] > 0.0
    signs = np.stack([up, ~up])
    ref = np.where(signs, plan.reference.high, plan.reference.low)
    meas = np.where(signs, plan.measurement.low, plan.measurement.high)
    return Scenario(ref, meas, _schedule(plan, node, ref.shape), _resets(plan, node), tunes=_largest(plan))


def _largest(plan: Plan) -> tuple[Tune, ...]:
    """The largest factors there are, in both lanes."""
    if plan.tuning is None:
        return ()
    most = (plan.tuning.factor.high,) * len(plan.tuning.nominal)
    return tuple(Tune(lane, 0, replace(default_params(plan), gain=most)) for lane in range(2))


def _response(plan: Plan, node: str) -> Array:
    """How the node answers a unit error, sample by sample; an exponential memory for ``_LONGEST`` samples."""
    if " bank " in node and not node.startswith("feedback"):
        return _bank(plan, node)
    if node.startswith("rest") or node == "inner sum":
        return _part(present(plan.inner).rest, node)
    if node.startswith("direct"):
        return _part(present(plan.direct), node)
    v = _filtered(plan, node)
    return np.convolve(v, [1.0, 1.0]) if node == "integrator sum" else v


def _bank(plan: Plan, node: str) -> Array:
    """Of a bank's sum, or of its slowest mode."""
    name, _, index, *what = node.split()
    table = plan.direct if name == "direct" else present(plan.inner).rest
    bank = present(table).banks[int(index)]
    weights = np.array(bank.values) if what == ["sum"] else np.eye(bank.modes)[-1]
    return Modes(bank.order, np.array(bank.real_rates), weights).response(_LONGEST)


def _part(table: Sum, node: str) -> Array:
    """The weights by lag, those of other blocks 0."""
    return _only(table, node, sum_response(table, _LONGEST).weights, 0)


def _part_of_past(table: Sum, node: str) -> Array:
    """The same of a sum that begins at lag 1."""
    return _only(table, node, np.array(table.values), 1)


def _only(table: Sum, node: str, weights: Array, start: int) -> Array:
    """``weights`` from lag ``start`` on, without those outside the block that ``node`` names, if it names
    one.
    """
    for block in table.blocks:
        if node == f"{table.name}[{block.first}..{block.last}]":
            weights[: block.first - start] = 0.0
            weights[block.last + 1 - start :] = 0.0
    return weights


def _filtered(plan: Plan, node: str) -> Array:
    """e to v, or to a sum of past v."""
    count = plan.error_lags + 1 + (_SETTLED * plan.filtered_lags if plan.feedback else 0)
    count = _LONGEST if plan.states else count
    unit = np.zeros(count)
    unit[0] = 1.0
    p = np.zeros(count)
    if plan.direct:
        p = p + _answer(plan.direct, unit)
    if plan.inner:
        p = p + lfilter([1.0, 1.0], [1.0, -1.0], _answer(plan.inner.rest, unit))
    if plan.feedback is None:
        return p
    table = plan.feedback.table
    den = sum_response(table, count).weights.copy()
    den[0] = 1.0
    v: Array = lfilter([1.0], den, p)
    if not node.startswith("feedback") or " bank " in node:
        return v
    made: Array = lfilter(np.concatenate([[0.0], _part_of_past(table, node)]), [1.0], v)
    return made


def _answer(table: Sum, unit: Array) -> Array:
    """To a unit sample, as long as ``unit``."""
    found = sum_response(table, len(unit)).weights[: len(unit)]
    return np.pad(found, (0, len(unit) - len(found)))


def _schedule(plan: Plan, node: str, shape: tuple[int, int]) -> Array | None:
    """The schedule at its largest gain, or where its slope's product is largest."""
    if plan.schedule is None:
        return None
    schedule = plan.schedule
    ends = np.array(schedule.breakpoints)
    ends = ends if plan.floating else np.concatenate([ends, ends - 1])
    places = np.clip(ends, schedule.signal.low, schedule.signal.high)
    size = np.abs(scheduled_gain(plan, places))
    if node == "slope product":
        points = np.array(schedule.breakpoints)
        places, size = points[1:] - 1, np.abs(np.array(schedule.slopes) * (np.diff(points) - 1))
    return np.full(shape, places[int(np.argmax(size))])


def _resets(plan: Plan, node: str) -> tuple[Reset, ...]:
    """The integrator starts at the limit it is driven against."""
    if node != "integrator sum":
        return ()
    ref, meas, u = plan.reference, plan.measurement, plan.output
    still = max(ref.low, meas.low), min(ref.high, meas.high)
    level = still[0] if still[0] <= still[1] else None
    same = (level, level) if level is not None else (ref.low, meas.low)
    return tuple(Reset(lane, 0, *same, u0) for lane, u0 in enumerate((u.high, u.low)))
