"""Parameters of a tunable plan: their box in machine terms, and what the state holds of them.

How they are taken over is part of :mod:`focgen.plan.plan`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from focgen.arrays import Kind
from focgen.control.controller import Controller
from focgen.errors import PlanError
from focgen.plan.formats import Interval, Word, exponent_for, integer, nearest, shift
from focgen.plan.plan import Count, Format, Plan, Schedule, Tuning
from focgen.plan.scenario import Params, Scenario
from focgen.present import present

REFUSED_GAIN, REFUSED_LOW, REFUSED_HIGH = 1, 2, 4
_RECIPROCAL = 1 << 30  # the largest, so that a difference of two gains times it fits 64 bits
_SPARE = {"float": 2.0**-12, "double": 2.0**-40}  # by which a good gain may leave the box, of the largest


@dataclass(frozen=True)
class Applied:
    """What a state holds of parameters, raw: the gains at the breakpoints, or the only one, the slopes
    between them, and the limits of the output.
    """

    gains: tuple[Count, ...]
    slopes: tuple[Count, ...]
    low: Count
    high: Count


def default_params(plan: Plan) -> Params:
    """Factors of 1, and the limits of ``ranges.output``; raw."""
    one = 1.0 if plan.floating else round(1.0 / present(plan.tuning).factor.lsb)
    return Params((one,) * len(present(plan.tuning).nominal), plan.output.low, plan.output.high)


def refused(plan: Plan, params: Params) -> int:
    """What NAME_check says of raw parameters: 0, or the bits of what is outside the box."""
    box, found = present(plan.tuning), 0
    if len(params.gain) != len(box.nominal) or not all(
        box.factor.low <= factor <= box.factor.high for factor in params.gain
    ):
        found |= REFUSED_GAIN
    if not box.low[0] <= params.u_min <= box.low[1]:
        found |= REFUSED_LOW
    if not box.high[0] <= params.u_max <= box.high[1]:
        found |= REFUSED_HIGH
    return found


def applied(plan: Plan, params: Params) -> Applied:
    """What a state takes over of raw parameters within the box."""
    box, ends = plan.box, (params.u_min, params.u_max)
    if not plan.floating:
        return Applied(*_whole(box, [int(factor) for factor in params.gain]), *map(int, ends))
    kind = np.float32 if plan.gain.ctype == "float" else np.float64
    low, high = (float(kind(end)) for end in ends)
    return Applied(*_floating(box, [kind(factor) for factor in params.gain], kind), low, high)


def _whole(box: Tuning, factors: list[int]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    gains = tuple(shift(factor * nominal, box.to_gain) for factor, nominal in zip(factors, box.nominal))
    rises = (after - before for before, after in pairwise(gains))
    return gains, tuple(shift(rise * per, by) for rise, per, by in zip(rises, box.reciprocals, box.to_slopes))


def _floating(box: Tuning, factors: list[Any], kind: Kind) -> tuple[tuple[float, ...], tuple[float, ...]]:
    gains = [factor * kind(nominal) for factor, nominal in zip(factors, box.nominal)]
    pairs = zip(gains, gains[1:], box.reciprocals)
    slopes = tuple(float((after - before) * kind(per)) for before, after, per in pairs)
    return tuple(map(float, gains)), slopes


def courses(plan: Plan, scenario: Scenario) -> dict[int, list[tuple[int, Applied]]]:
    """By lane, from which samples on which parameters hold, in the order in which they are taken; the default
    ones, from before the first sample, are in front. Those that are refused leave no trace.
    """
    start = (-1, applied(plan, default_params(plan)))
    found = {lane: [start] for lane in range(scenario.lanes)}
    for tune in sorted(scenario.tunes, key=lambda tune: tune.sample):
        if not refused(plan, tune.params):
            found[tune.lane].append((tune.sample, applied(plan, tune.params)))
    return found


def tuned(schedule: Schedule, parameters: Applied) -> Schedule:
    """The schedule with other gains."""
    return replace(schedule, gains=parameters.gains, slopes=parameters.slopes)


# ------------------------------------------------------------------------------------------------ the box


def fixed_tuning(controller: Controller, gains: tuple[float, ...], word: Word) -> tuple[Tuning, int]:
    """The box of the factors on physical ``gains`` (h/2 inside), and log2 of the lsb of what they give.

    Raises PlanError where the box is too wide for the word.
    """
    where, (low, high) = f"{controller.name} [tunable]", controller.factors
    largest = max(map(abs, gains))
    fine = exponent_for(largest, word.limit, where, "the gain")
    finer = exponent_for(high, word.limit - 1, where, "the factor")  # a count for what is out of the box
    coarse = exponent_for(largest * high, word.limit - margin(word), where, "the tuned gain")
    least, most = (nearest(end * 2.0**-finer) for end in (low, high))
    if least < 1:
        what = f"spans factors of {low:g} to {high:g}, more than {word.bits} bits can hold"
        raise PlanError(where, what, "narrow gain, or choose q31, f32 or f64")
    factor = Format(integer(word.bits), 2.0**finer, least, most)
    nominal = tuple(nearest(gain * 2.0**-fine) for gain in gains)
    return Tuning(factor, nominal, 2.0**fine, coarse - fine - finer), coarse


def margin(word: Word) -> int:
    """Counts by which interpolation may leave the gains that it connects; :func:`overshoot` says how many."""
    return 16 if word.bits == 16 else 64


def gain_intervals(box: Tuning) -> list[Interval]:
    """The gains at the breakpoints, over the whole box."""
    factors = Interval(int(box.factor.low), int(box.factor.high))
    each = (factors * Interval(int(n), int(n)) for n in box.nominal)
    return [one.shifted(box.to_gain) for one in each]


def reciprocal(run: int) -> tuple[int, int]:
    """1 / ``run`` as a count, and the right shift that goes with it."""
    by = 30 + run.bit_length() - 1
    while _nearest(Fraction(1 << by, run)) > _RECIPROCAL:
        by -= 1
    return _nearest(Fraction(1 << by, run)), by


def _nearest(value: Fraction) -> int:
    return (2 * value.numerator + value.denominator) // (2 * value.denominator)


def segment(rise: Interval, run: int, word: Word) -> tuple[int, int, int] | None:
    """Of a segment whose gain rises by anything within ``rise``: the reciprocal of its length, the shift to
    the slope, and the slope's own in the step; None where it is too steep.
    """
    per, whole = reciprocal(run)
    by = min(word.sum_bits - 2, whole)
    while by >= 0 and (rise.worst * per >> (whole - by)) + 1 > word.limit:
        by -= 1
    return None if by < 0 else (per, whole - by, by)


def overshoot(rise: Interval, run: int, per: int, to_slope: int, by: int) -> int:
    """By how many counts the gain of a segment can leave those at its ends: the reciprocal's error over all
    of the rise, half a count of the slope over the run, and the step's own rounding.
    """
    wrong = abs(Fraction(per, 1 << (to_slope + by)) - Fraction(1, run)) * rise.worst
    return math.ceil(run * (wrong + Fraction(1, 2 << by)) + Fraction(1, 2))


def floating_reach(gains: list[float], ctype: str) -> tuple[float, float]:
    """Between which numbers a gain within the box is, its rounding and that of its slope included."""
    spare = _SPARE[ctype] * max(map(abs, gains))
    kind = np.float32 if ctype == "float" else np.float64
    return float(kind(min(gains) - spare)), float(kind(max(gains) + spare))


def with_limits(plan: Plan) -> Plan:
    """A tunable plan with the boxes of its limits, in counts of the output, filled in.

    Raises PlanError where rounding would let the limits cross.
    """
    if plan.tuning is None:
        return plan
    box, out = present(plan.controller.tunable), plan.output
    inner = box.output_low[1], box.output_high[0]
    if out.floating:
        kind = np.float32 if out.ctype == "float" else np.float64
        top, bottom = (float(kind(end)) for end in inner)
    else:
        top, bottom = (nearest(end / out.lsb) for end in inner)
    low, high = (out.low, top), (bottom, out.high)
    if low[1] >= high[0]:
        what = f"lets the limits meet in {plan.arithmetic}"
        raise PlanError(f"{plan.name} [tunable]", what, "keep output_low and output_high further apart")
    return replace(plan, tuning=replace(plan.tuning, low=low, high=high))
