"""The gain and its schedule in machine terms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from focgen.arrays import Array
from focgen.control.controller import Controller, GainSchedule
from focgen.errors import PlanError
from focgen.plan.formats import Interval, Word, exponent_for, integer, nearest
from focgen.plan.plan import Count, Format, Plan, Schedule, Tuning
from focgen.plan.tuning import fixed_tuning, floating_reach, gain_intervals, overshoot, segment
from focgen.present import present

_MARGIN = 3  # counts a rounded slope may overshoot the gains it connects
_FEWEST = 16  # counts that a range must cover to be worth the name

_SIDES: tuple[Literal["left"], Literal["right"]] = ("left", "right")


@dataclass(frozen=True)
class Gain:
    """The part of a plan that makes g: ``schedule`` or ``constant`` (counts of ``format``); ``tuning`` where
    its factors may be changed.
    """

    format: Format
    constant: Count
    schedule: Schedule | None
    tuning: Tuning | None = None


def span_of(low: float, high: float, exponent: int, where: str, what: str) -> Interval:
    """A physical range in counts of 2^``exponent``. Raises PlanError where hardly a count is left of it."""
    counts = Interval(nearest(low * 2.0**-exponent), nearest(high * 2.0**-exponent))
    if counts.high - counts.low < _FEWEST:
        remedy = "subtract the offset from the signals, or choose a wider arithmetic"
        raise PlanError(
            where,
            f"the {what} range [{low:.10g}, {high:.10g}] spans only {counts.high - counts.low} counts",
            remedy,
        )
    return counts


def fixed_gain(controller: Controller, factor: float, word: Word) -> Gain:
    """The gain times ``factor`` (h/2 ahead of an integrator) in integers. Raises PlanError where it cannot be
    held."""
    where = f"{controller.name} [gain]"
    points, bare = _clipped(controller) if controller.scheduled else ((), controller.gains)
    gains = tuple(g * factor for g in bare)
    largest = max(abs(g) for g in gains)
    if largest == 0.0:
        raise PlanError(where, "is zero: the output would never move", "give a gain")
    if controller.tunable:
        return _tunable_gain(controller, points, gains, word, where)
    exponent = exponent_for(largest, word.limit - _MARGIN, where, "the gain")
    counts = tuple(nearest(g * 2.0**-exponent) for g in gains)
    form = Format(integer(word.bits), 2.0**exponent, min(counts) - bool(points), max(counts) + bool(points))
    if not points:
        return Gain(form, counts[0], None)
    return Gain(form, 0, _schedule(controller, points, counts, word, where))


def within_range(controller: Controller) -> Controller:
    """A scheduled controller whose breakpoints lie in the schedule's range, as integers hold them: where its
    gains have factors, there is one factor to each of these.
    """
    return replace(controller, gain=GainSchedule(*_clipped(controller)))


def _clipped(controller: Controller) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Breakpoints and gains within the schedule's range: beyond it no value can come."""
    low, high = present(controller.ranges.schedule)
    given = controller.schedule.breakpoints
    points = [b for b in given if low < b < high]
    if given[0] <= low or not points:
        points.insert(0, low)
    if given[-1] >= high or len(points) == 1:
        points.append(high)
    return tuple(points), tuple(float(controller.schedule(p)) for p in points)


def _schedule(
    controller: Controller, points: Sequence[float], gains: tuple[int, ...], word: Word, where: str
) -> Schedule:
    signal, counts = _points(controller, points, word)
    segments = []
    for i, run in enumerate(np.diff(counts).tolist()):
        slope = _slope(gains[i + 1] - gains[i], run, word)
        if slope is None:
            raise _too_steep(where, points[i], points[i + 1], word)
        segments.append(slope)
    return Schedule(signal, counts, gains, tuple(s for s, _ in segments), tuple(n for _, n in segments))


def _points(controller: Controller, points: Sequence[float], word: Word) -> tuple[Format, tuple[int, ...]]:
    """The scheduling signal's format, and the breakpoints in its counts."""
    low, high = present(controller.ranges.schedule)
    place = f"{controller.name} [ranges]"
    exponent = exponent_for(max(abs(low), abs(high), high - low), word.limit - 1, place, "the schedule")
    reach = span_of(low, high, exponent, place, "schedule")
    signal = Format(integer(word.bits), 2.0**exponent, reach.low, reach.high, controller.units.schedule)
    return signal, tuple(nearest(p * 2.0**-exponent) for p in points)


def _too_steep(where: str, before: float, after: float, word: Word) -> PlanError:
    what = f"between the breakpoints {before:g} and {after:g} the gain is too steep for {word.bits} bits"
    return PlanError(where, what, "move the breakpoints apart")


def _tunable_gain(
    controller: Controller, points: Sequence[float], gains: tuple[float, ...], word: Word, where: str
) -> Gain:
    """Gains with factors on them; as the default parameters have them."""
    box, exponent = fixed_tuning(controller, gains, word)
    reach = gain_intervals(box)
    one = Interval(round(1.0 / box.factor.lsb), round(1.0 / box.factor.lsb))
    default = tuple((one * Interval(int(n), int(n))).shifted(box.to_gain).low for n in box.nominal)
    low, high = min(i.low for i in reach), max(i.high for i in reach)
    if not points:
        return Gain(Format(integer(word.bits), 2.0**exponent, low, high), default[0], None, box)
    signal, counts = _points(controller, points, word)
    made, spare = [], 0
    for i, run in enumerate(np.diff(counts).tolist()):
        rise = reach[i + 1] - reach[i]
        one_segment = segment(rise, run, word) if run > 0 else None
        if one_segment is None:
            raise _too_steep(where, points[i], points[i + 1], word)
        spare = max(spare, overshoot(rise, run, *one_segment))
        made.append(one_segment)
    per, to_slope, by = zip(*made)
    rises = (after - before for before, after in pairwise(default))
    slopes = tuple(Interval(r * p, r * p).shifted(n).low for r, p, n in zip(rises, per, to_slope))
    form = Format(integer(word.bits), 2.0**exponent, low - spare, high + spare)
    box = replace(box, reciprocals=per, to_slopes=to_slope)
    return Gain(form, 0, Schedule(signal, counts, default, slopes, by), box)


def _slope(rise: int, run: int, word: Word) -> tuple[int, int] | None:
    """(count, right shift) of ``rise`` / ``run``, as fine as the word allows; None where there is none."""
    if run <= 0 or abs(rise) > run * word.limit:
        return None
    if rise == 0:
        return 0, 0
    by = word.sum_bits - 2
    while abs(nearest_fraction(Fraction(rise << by, run))) > word.limit:
        by -= 1
    return nearest_fraction(Fraction(rise << by, run)), by


def nearest_fraction(value: Fraction) -> int:
    """The nearest integer, halves upwards, exactly."""
    return (2 * value.numerator + value.denominator) // (2 * value.denominator)


def floating_gain(controller: Controller, factor: float, kind: type[np.floating[Any]], ctype: str) -> Gain:
    """The gain times ``factor`` in float or double. Raises PlanError where its breakpoints coincide there."""
    if not controller.scheduled:
        constant = float(kind(controller.gains[0] * factor))
        made = Gain(Format(ctype, 1.0, constant, constant), constant, None)
        return _with_factors(made, (constant,), controller, kind) if controller.tunable else made
    points = tuple(float(kind(b)) for b in controller.schedule.breakpoints)
    gains = tuple(float(kind(g * factor)) for g in controller.gains)
    if any(b <= a for a, b in pairwise(points)):
        remedy = "move the breakpoints apart"
        raise PlanError(f"{controller.name} [gain]", f"breakpoints coincide as {ctype}", remedy)
    slopes = tuple(
        float(kind((g1 - g0) / (b1 - b0))) for g0, g1, b0, b1 in zip(gains, gains[1:], points, points[1:])
    )
    low, high = (float(kind(x)) for x in present(controller.ranges.schedule))
    signal = Format(ctype, 1.0, low, high, controller.units.schedule)
    schedule = Schedule(signal, points, gains, slopes, (0,) * len(slopes))
    made = Gain(Format(ctype, 1.0, min(gains), max(gains)), 0.0, schedule)
    return _with_factors(made, gains, controller, kind) if controller.tunable else made


def _with_factors(
    made: Gain, gains: tuple[float, ...], controller: Controller, kind: type[np.floating[Any]]
) -> Gain:
    """A floating gain with factors on it; its default slopes are products with reciprocals, too."""
    least, most = (float(kind(end)) for end in controller.factors)
    ctype, schedule = made.format.ctype, made.schedule
    points = schedule.breakpoints if schedule else ()
    per = tuple(float(kind(1.0 / (b - a))) for a, b in pairwise(points))
    box = Tuning(Format(ctype, 1.0, least, most), gains, 1.0, 0, per, (0,) * len(per))
    if schedule:
        rises = [kind(b) - kind(a) for a, b in pairwise(gains)]
        schedule = replace(schedule, slopes=tuple(float(r * kind(p)) for r, p in zip(rises, per)))
    reach = floating_reach([end * gain for end in (least, most) for gain in gains], ctype)
    return Gain(Format(ctype, 1.0, *reach), made.constant, schedule, box)


# ------------------------------------------------------------------------------------------- how exact it is


def largest_gain(controller: Controller) -> float:
    """Largest |gain|, with the largest factor on it."""
    return max(map(abs, controller.gains)) * controller.factors[1]


def steepest(controller: Controller) -> float:
    """Largest slope of the gain over the scheduling signal, whatever the factors."""
    gains, runs = np.array(controller.gains), np.diff(controller.schedule.breakpoints)
    ends = np.outer(controller.factors, gains)
    rises = [np.abs(after[1:] - before[:-1]) for before in ends for after in ends]
    return float(np.max(np.max(rises, axis=0) / runs))


def table_error(plan: Plan, lsb: float) -> float:
    """Largest difference of a plan's schedule, not rounded further, from the controller's.

    Both are straight between the breakpoints of either, so it is there, or at an end of the signal's range; a
    breakpoint beyond that counts nothing. ``lsb`` is the physical size of a gain count.
    """
    schedule, (low, high) = present(plan.schedule), present(plan.controller.ranges.schedule)
    points = np.array(schedule.breakpoints) * schedule.signal.lsb
    least, most = (float(end) * schedule.signal.lsb for end in (schedule.signal.low, schedule.signal.high))
    places = np.concatenate([points, plan.controller.schedule.breakpoints, [low, high, least, most]])
    ideal = plan.controller.schedule(np.clip(places, low, high))
    inside = (places >= min(low, least)) & (places <= max(high, most))
    sides = [_machine_gain(schedule, points, places, side) * lsb - ideal for side in _SIDES]
    return float(np.max(np.abs(sides)[:, inside]))


def tuned_error(plan: Plan, lsb: float) -> float:
    """Largest difference of a tunable plan's gain, in integers, from the controller's with the same physical
    factors, whatever they are, but for the step's own rounding. ``lsb``: the physical size of a gain count.

    Half a count each of the factor, the nominal gain and their product, what interpolation may leave the
    gains by, and breakpoints that are half a count off.
    """
    box, controller = present(plan.tuning), plan.controller
    largest, slope = largest_gain(controller), steepest(controller) if controller.scheduled else 0.0
    factor = 0.5 * box.factor.lsb * largest / controller.factors[1]
    nominal = 0.5 * controller.factors[1] * box.nominal_lsb * lsb / plan.gain.lsb
    spare = max(int(plan.gain.high) - max(i.high for i in gain_intervals(box)), 0)
    moved = 0.5 * plan.schedule.signal.lsb * slope if plan.schedule else 0.0
    return factor + nominal + (0.5 + spare) * lsb + moved


def _machine_gain(schedule: Schedule, points: Array, places: Array, side: Literal["left", "right"]) -> Array:
    """The table's gain in counts at physical ``places``; at a breakpoint that of the segment on one side."""
    segment = np.searchsorted(points, places, side=side) - 1
    inside = np.clip(segment, 0, len(points) - 2)
    gains = np.array(schedule.gains, dtype=float)
    slopes = np.ldexp(np.array(schedule.slopes, dtype=float), -np.array(schedule.slope_shifts, dtype=np.intc))
    linear = gains[inside] + slopes[inside] * (places - points[inside]) / schedule.signal.lsb
    made: Array = np.where(segment < 0, gains[0], np.where(segment >= len(points) - 1, gains[-1], linear))
    return made
