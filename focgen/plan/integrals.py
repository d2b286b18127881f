"""Integrals of f32 in whole counts: what a float cannot add up, an integer of 64 bits can.

A float that holds 12 V takes in no increment below half a microvolt: at high rates a small error is never
acted on. So in f32 an integral is an integer N, in counts of 2^−up. Each increment is rounded once, to half a
count; whole numbers add up without any error, however many there are.

``up`` is the largest for which both ends of the integral, and every increment that inputs within their ranges
can cause, are at most ``MOST`` counts: an integral and two increments cannot overflow then. Over ``STEPS``
samples, of two increments each, all that rounding adds is at most ``STEPS`` counts. That is less than half a
unit in the last place of the largest output as long as no increment is 256 times as large as the output
(:func:`added_up`).

In every arithmetic an error can be so small that its increment is rounded to nothing.
:func:`smallest_error` finds the least that is acted on.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from focgen.plan.counts import MOST, counts_of
from focgen.plan.formats import shift
from focgen.plan.plan import Format, Plan, Sum
from focgen.plan.truncation import largest_error
from focgen.plan.tuning import gain_intervals
from focgen.plan.usable import filtered_reach, l1_of
from focgen.present import present

STEPS = 10**8
_DIGITS = 2.0**-24  # of the largest input: what a measurement has at most
_FINEST = 126  # one count is a normal float
_SLACK = 1.0 + 1e-6  # over the rounding of the reaches themselves


def counted(plan: Plan) -> Plan:
    """The plan with its integrals in counts, where it is f32 and has any."""
    if plan.arithmetic != "f32":
        return plan
    error = largest_error(plan.controller)
    if plan.inner:
        state = _state(plan.inner.state, l1_of(plan.inner.rest) * error)
        plan = replace(plan, inner=replace(plan.inner, state=state))
    if plan.integrator:
        gain = max(abs(plan.gain.low), abs(plan.gain.high))
        state = _state(plan.integrator.state, gain * filtered_reach(plan, error))
        increment = Format(state.ctype, state.lsb, -MOST, MOST, state.unit)
        plan = replace(plan, integrator=replace(plan.integrator, state=state), increment=increment)
    return plan


def _state(floating: Format, increment: float) -> Format:
    """The format in counts of an integral between the ends of ``floating``, given its largest increment."""
    ends = max(abs(floating.low), abs(floating.high))
    up = min(61 - math.frexp(max(ends, increment * _SLACK))[1], _FINEST)
    low, high = (int(counts_of(np.float32(end), up)) for end in (floating.low, floating.high))
    return Format("int64_t", 2.0**-up, low, high, floating.unit)


def added_up(plan: Plan) -> float | None:
    """What the rounding of increments can add to the output over ``STEPS`` samples, in units in the last
    place of its largest value; None where no integrator is in counts."""
    if plan.integrator is None or plan.integrator.state.floating or not plan.floating:
        return None
    largest = np.float32(max(abs(plan.output.low), abs(plan.output.high)))
    return STEPS * plan.integrator.state.lsb / float(np.spacing(largest))


# ------------------------------------------------------------------------------------- what is acted on


def smallest_error(plan: Plan) -> float | None:
    """The least steady error, physical, that an integral acts on: since a reset to it the integral moves, at
    the smallest gain that is not 0 and, in f64, wherever it stands. None where there is no integral, or where
    exact arithmetic does not act on a steady error either.
    """
    if plan.integrator is None and plan.inner is None:
        return None
    return _floating_least(plan) if plan.floating else _fixed_least(plan)


def coarse(plan: Plan) -> bool:
    """Whether an error is ignored that a measurement has digits for: a count, or 24 bits of the largest."""
    least = smallest_error(plan)
    inputs = max(map(abs, (*plan.controller.ranges.reference, *plan.controller.ranges.measurement)))
    return least is not None and least > max(_DIGITS * inputs, 0.0 if plan.floating else plan.error.lsb)


def _gains(plan: Plan) -> list[float]:
    """Every gain, in counts, that is not 0; of a tunable one at both ends of its factor."""
    if plan.tuning is None:
        found = list(plan.schedule.gains) if plan.schedule else [plan.constant_gain]
    elif plan.floating:
        found = [g * plan.tuning.factor.low for g in plan.tuning.nominal]
    else:
        found = [end for each in gain_intervals(plan.tuning) for end in (each.low, each.high)]
    return [g for g in found if g]


def _at_rest(table: Sum | None) -> float:
    return math.fsum(table.values) if table else 0.0


def _floating_least(plan: Plan) -> float | None:
    """2 d, or 2 r, has to be a count, or half a digit of the integral where it is largest."""
    needed = []
    if plan.integrator:
        steady = plan.feedback.steady if plan.feedback else _at_rest(plan.direct)
        needed.append((min(map(abs, _gains(plan)), default=0.0) * abs(steady), plan.integrator.state))
    if plan.inner:
        needed.append((abs(_at_rest(plan.inner.rest)), plan.inner.state))
    moved = [_least_addend(state) / gain for gain, state in needed if gain]
    return min(moved, default=None)


def _least_addend(state: Format) -> float:
    if not state.floating:
        return 0.5 * state.lsb
    return 0.25 * float(np.spacing(max(abs(state.low), abs(state.high))))


def _fixed_least(plan: Plan) -> float | None:
    """By bisection: what a step makes of a constant grows with it."""
    moving: list[Callable[[int], bool]] = []
    if plan.integrator:
        moving.append(lambda e: all(_increment(plan, int(g), s * e) for g in _gains(plan) for s in (1, -1)))
    if plan.inner:
        moving.append(lambda e: all(_still(present(plan.inner).rest, s * e) for s in (1, -1)))
    largest = max(abs(int(plan.error.low)), abs(int(plan.error.high)))
    found = [_first(moves, largest) for moves in moving]
    return min((n * plan.error.lsb for n in found if n is not None), default=None)


def _first(moves: Callable[[int], bool], largest: int) -> int | None:
    low, high = 0, largest
    if not moves(high):
        return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if moves(middle) else (middle, high)
    return high


def _still(table: Sum | None, e: int) -> int:
    """A sum of a constant history, in counts of its total; modes add nothing."""
    return sum(shift(sum(map(int, b.weights)) * e, b.align) for b in table.blocks) if table else 0


def _increment(plan: Plan, gain: int, e: int) -> int:
    """d of a constant error."""
    if plan.feedback:
        v = shift(int(plan.feedback.steady) * e, plan.feedback.steady_shift)
    else:
        v = shift(_still(plan.direct, e), plan.narrow)
    made: int = shift(int(gain) * v, plan.gain_shift)
    return made
