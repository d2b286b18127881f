"""Integrals of f32 in whole counts: what a float cannot add up, an integer of 64 bits can.

A float that holds 12 V takes in no increment below half a microvolt: at high rates a small error is never
acted on. So in f32 an integral is an integer N, in counts of 2^−up. Each increment is rounded once, to half a
count; whole numbers add up without any error, however many there are.

``up`` is the largest for which both ends of the integral, and every increment that inputs within their ranges
can cause, are at most ``MOST`` counts: an integral and two increments cannot overflow then. Over ``STEPS``
samples, of two increments each, all that rounding adds is at most ``STEPS`` counts. That is less than half a
unit in the last place of the largest output as long as no increment is 256 times as large as the output
(:func:`added_up`).

In every arithmetic an error can be so small that its increment is rounded to nothing:
:mod:`focgen.plan.least_error`.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from focgen.plan.counts import MOST, counts_of
from focgen.plan.plan import Format, Plan
from focgen.plan.truncation import largest_error
from focgen.plan.usable import filtered_reach, l1_of

STEPS = 10**8
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
