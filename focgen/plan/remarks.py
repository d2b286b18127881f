"""What has to be said of a plan: what its integrals cannot hold, and what to do about it; a sentence each."""

from __future__ import annotations

import math

from focgen.fractional.weights import short_memory_bias
from focgen.plan.canonical import realise
from focgen.plan.integrals import STEPS, added_up
from focgen.plan.least_error import coarse, out_of_reach, since_reset, smallest_error
from focgen.plan.plan import Plan

_SHARE = 0.01  # of what an integral can be off by in the end
_SAID = 1e-3  # of the trapezoid's error from here on
_BESIDE = 1e-9  # of a whole order, which it may well be meant to be


def remarks(plan: Plan) -> list[str]:
    """What has to be said, most important first; nothing of most plans."""
    found = [*_held(plan), *_beside_whole(plan)]
    if plan.inner is None:
        return found
    return [*found, _beside_output(plan), *_adding_up(plan), *_ramp(plan), *_trapezoid(plan)]


def _beside_whole(plan: Plan) -> list[str]:
    """Orders that need all of a memory for next to nothing."""
    form = realise(plan.controller)
    orders = dict.fromkeys(t.order for t in form.direct + form.rest + form.den)
    near = [order for order in orders if 0.0 < abs(order - round(order)) < _BESIDE]
    what = "is no whole number, so it takes all the memory that any power does; write it so that"
    return [
        f"{plan.name} [transfer]: the order {order!r} {what} {round(order)} is left, if that is meant"
        for order in near
    ]


def _held(plan: Plan) -> list[str]:
    """What the arithmetic cannot hold of what the gain asks."""
    found, added = [], added_up(plan)
    wider = {"q15": "choose q31 or f32", "q31": "choose f64"}.get(plan.arithmetic, "lengthen the sample time")
    if coarse(plan):
        what = f"a steady error below {smallest_error(plan):.3g} may be left: the integral need not move"
        if out_of_reach(plan):
            what = "no steady error within the ranges is sure to move the integral"
        what += ", even after a reset to it" if since_reset(plan) else ""
        found.append(f"{plan.name} [gain]: {what}; raise the gain, or {wider}")
    if added is not None and added > 0.5:
        what = f"one increment can be so large that rounding adds up to {added:.2g} digits of the output"
        remedy = "narrow the input ranges, or choose q31 or f64"
        found.append(f"{plan.name} [ranges]: {what} in {STEPS:.0e} samples; {remedy}")
    return found


def _beside_output(plan: Plan) -> str:
    """What the integral of the terms of negative order does that the output does not show."""
    what = "the integral of the terms of negative order"
    if plan.integrator:
        what += (
            " winds up while the output is at a limit: an error of the other sign takes up to as long to undo"
        )
        remedy = "reset to the output that stands when the error turns"
        return f"{plan.name} [transfer]: {what} it as the one before has lasted; {remedy}"
    what += " starts at 0 and follows nothing: reset and track ignore the output that they are given"
    remedy = "for a start without a bump set integrator = true and multiply the transfer function by s"
    return f"{plan.name} [transfer]: {what}; {remedy}"


def _adding_up(plan: Plan) -> list[str]:
    """Nothing ends the error of an integral but its clamp."""
    bound = plan.error_bound
    if not bound.operator_per_sample:
        return []
    samples = int(_SHARE * bound.operator / bound.operator_per_sample)
    what = "the integral of a term of negative order adds up what rounding leaves, so for ever it is known no"
    what += f" better than its clamp; within {samples} samples of a reset the error is at most"
    what += f" {100 * _SHARE:g} % of that bound"
    return [f"{plan.name} [transfer]: {what}; close a loop around it, or reset it in time"]


def _ramp(plan: Plan) -> list[str]:
    """What short memory makes of a constant: s^β without its tail reads a constant, and 1/s integrates it."""
    if plan.exponential:
        return []
    h, found = plan.sample_time, []
    for term in realise(plan.controller).rest:
        if term.order == 0.0:
            continue
        slope = term.coefficient * h**-term.order * short_memory_bias(term.order, plan.length)
        what = f"of a constant error {term.coefficient:.6g} s^{term.order - 1.0:.6g} becomes, after"
        what += (
            f" {plan.length} samples, a ramp of {slope:.3g} times the error a second, while the exact power"
        )
        what += " slows down"
        found.append(
            f"{plan.name} [transfer]: {what}; take exponential memory, or a longer one, in open loop"
        )
    return found


def _trapezoid(plan: Plan) -> list[str]:
    """What 1/s itself is off by at the upper end of a band, beside the fitted power."""
    if plan.band is None:
        return []
    half = 0.5 * plan.band[1] * plan.sample_time
    low = 1.0 - half / math.tan(half)
    if low < _SAID:
        return []
    what = "a term of negative order is 1/s by the trapezoid times a fitted power: beside the tolerance it is"
    what += f" {100 * low:.2g} % low at the band's upper end, however many modes"
    return [f"{plan.name} [transfer]: {what}; lower the band's end, or shorten the sample time"]
