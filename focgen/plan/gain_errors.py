"""How far the gain of a floating plan is from the controller's, piece of the schedule by piece.

Between two breakpoints p and q the step computes G + S (s − p), with G, S and p as the type holds them. What
these are off by is known. The scheduling signal is rounded to the type, and every operation once more. As
rounding does not change an order, a signal between two breakpoints stays there as machine numbers. At the
upper one the next segment begins, with a gain of its own.

A gain that is far off need not be a large one. So each piece has both, its error and its largest gain, and
the bound takes the piece for which error × signal + gain × the signal's error is worst.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from focgen.control.controller import GainSchedule
from focgen.plan.plan import Plan
from focgen.plan.rounding import half_place
from focgen.present import present

_DOUBLE = 2.0**-53


@dataclass(frozen=True)
class Piece:
    """A part of the scheduling signal's range: the gain's ``error`` there and its ``largest`` magnitude, both
    physical."""

    error: float
    largest: float


@dataclass(frozen=True)
class _Held:
    """Gains at the breakpoints in machine units: ``factor`` times the controller's, ``off`` by what at most,
    with any of their factors up to ``most``."""

    factor: float
    off: tuple[float, ...]
    most: float


def floating_pieces(plan: Plan, factor: float, unit: float) -> list[Piece]:
    """The pieces that the signal can be in, one where nothing is scheduled. ``factor``: of the gains in the
    plan, h/2 ahead of an integrator; ``unit``: u of the type.

    The reference's own rounding, in double, is included.
    """
    held = _held(plan, factor, unit)
    gains = [abs(g) * held.most for g in plan.controller.gains]
    if plan.schedule is None:
        return [Piece(held.off[0] / factor + 6.0 * _DOUBLE * gains[0], gains[0])]
    return [*_outside(plan, held, gains), *_segments(plan, held, unit)]


def _held(plan: Plan, factor: float, unit: float) -> _Held:
    """With factors: the factor's rounding, the nominal gain's, and that of their product."""
    box, most = plan.tuning, plan.controller.factors[1]
    raw = box.nominal if box else plan.schedule.gains if plan.schedule else (plan.constant_gain,)
    wanted = [g * factor for g in plan.controller.gains]
    off = [abs(held - g) for held, g in zip(raw, wanted)]
    if box:
        moved, up = half_place(most, unit), 1.0 + 4.0 * unit
        off = [
            moved * abs(held) + most * known + half_place(most * up * abs(held), unit)
            for held, known in zip(raw, off)
        ]
    return _Held(factor, tuple(off), most)


def _outside(plan: Plan, held: _Held, gains: list[float]) -> list[Piece]:
    """Below the first breakpoint and from the last one on, where the signal comes there."""
    low, high = present(plan.controller.ranges.schedule)
    points = plan.controller.schedule.breakpoints
    ends = [0] * (low < points[0]) + [-1] * (high >= points[-1])
    return [Piece(held.off[i] / held.factor + 6.0 * _DOUBLE * gains[i], gains[i]) for i in ends]


def _segments(plan: Plan, held: _Held, unit: float) -> list[Piece]:
    low, high = present(plan.controller.ranges.schedule)
    points = plan.controller.schedule.breakpoints
    reached = [(i, max(a, low), min(b, high)) for i, (a, b) in enumerate(pairwise(points))]
    return [_Segment(plan, held, i, unit).piece(a, b) for i, a, b in reached if a <= b]


class _Segment:
    """One segment, in machine units but for the signal: ``ends`` and ``gains`` are the controller's,
    ``points`` and ``first`` the machine's."""

    def __init__(self, plan: Plan, held: _Held, index: int, unit: float) -> None:
        controller, schedule = plan.controller, present(plan.schedule)
        self.held, self.unit = held, unit
        self.ends = controller.schedule.breakpoints[index : index + 2]
        self.points = schedule.breakpoints[index : index + 2]
        self.gains = [g * held.factor for g in controller.gains[index : index + 2]]
        self.off, self.first = held.off[index : index + 2], schedule.gains[index]
        self.run = self.ends[1] - self.ends[0]
        least_most = controller.factors
        rises = [f * self.gains[1] - g * self.gains[0] for f in least_most for g in least_most]
        self.rise = max(map(abs, rises)) + sum(self.off)
        self.per = plan.tuning.reciprocals[index] if plan.tuning else None
        self.slope = schedule.slopes[index]
        steep = self.rise * self.per * (1.0 + 4.0 * unit) if self.per else abs(self.slope)
        self.steep = max(steep, self.rise / self.run)

    def piece(self, low: float, high: float) -> Piece:
        """For a signal between ``low`` and ``high``, both within the segment."""
        sizes = tuple(abs(g) * self.held.most for g in self.gains)
        largest = max(map(float, GainSchedule(self.ends, sizes)([low, high])))
        reach = max(abs(low), abs(high))
        moved = half_place(reach, self.unit) + max(abs(a - b) for a, b in zip(self.ends, self.points))
        known = max(self._known(low), self._known(high), self.off[1] * (self.ends[1] - high <= moved))
        along = high - self.ends[0] + moved
        error = known + self.steep * moved + self._slope_error(along)
        error += self._step_error(along, largest + error)
        error += _DOUBLE * (6.0 * largest + 6.0 * self.rise + 2.0 * self.steep * reach)
        return Piece(error / self.held.factor, largest / self.held.factor)

    def _known(self, at: float) -> float:
        """What the table is off by at a signal, as if a step rounded nothing."""
        along = at - self.ends[0]
        if self.per is not None:  # a mean of what its ends are off by
            return self.off[0] + (self.off[1] - self.off[0]) * along / self.run
        exact = (self.gains[1] - self.gains[0]) / self.run
        return abs(self.first - self.gains[0] + (self.slope - exact) * along)

    def _slope_error(self, along: float) -> float:
        """Of a slope that ``tune`` makes: the rise, its product with a reciprocal, and that are rounded."""
        if self.per is None:
            return 0.0
        wrong = abs(self.per * (self.points[1] - self.points[0]) - 1.0) + 4.0 * _DOUBLE
        made = half_place(self.rise, self.unit) * self.per * (1.0 + self.unit)
        made += half_place(self.rise * self.per * (1.0 + self.unit), self.unit)
        return along * (made + wrong * self.rise * self.per)

    def _step_error(self, along: float, largest: float) -> float:
        """Of the signal's distance from the breakpoint, its product with the slope, and the sum."""
        up, unit = 1.0 + 4.0 * self.unit, self.unit
        product = half_place(self.steep * along * up, unit)
        return self.steep * half_place(along, unit) + product + half_place((largest + product) * up, unit)
