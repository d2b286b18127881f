"""The test bench of a design: the rig, its steps, and the pressures over which the gain is scheduled."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from focgen.arrays import Array
from focgen.control.controller import ControllerRanges
from focgen.control.equilibrium import Equilibrium, derived_ranges, holding, rest
from focgen.control.inversion import Inversion, invert
from focgen.control.setpoints import check_setpoints, default_setpoints
from focgen.errors import DesignError
from focgen.loop.linear_effects import linear_part
from focgen.present import present
from focgen.rig.response import check_bounded
from focgen.rig.rig import Ranges, Rig

WATCHED = 1e4  # s that no stage may grow in by itself: no loop of an inverse holds what grows
_EXTRAPOLATED = 0.5  # of the span of the operating points: how far beyond it the line K_o(p) is used


@dataclass(frozen=True)
class Bench:
    """Steps from rest to the operating points, and how the loop runs.

    ``start``: where the rig rests; ``points``: nearest first; ``ranges``: the controller's; ``span``: the
    pressures between which the gain is scheduled, held beyond; ``delay``: of the computation, samples;
    ``pressure_known``: whether the rig measures the pressure.
    """

    rig: Rig
    start: Equilibrium
    points: tuple[Equilibrium, ...]
    ranges: ControllerRanges
    span: tuple[float, float]
    delay: int
    pressure_known: bool

    @property
    def references(self) -> Array:
        """The set points, shape (points,)."""
        return np.array([point.output for point in self.points])

    @property
    def pressures(self) -> Array:
        """Their pressures, shape (points,)."""
        return np.array([point.pressure for point in self.points])


def prepare(
    rig: Rig, setpoints: Sequence[float] | None, lowest: float | None, delay: int
) -> tuple[Bench, list[str]]:
    """Return the bench for operating points at the outputs ``setpoints``, and what has to be said about it.

    Raises DesignError where the rig cannot be inverted, held at a set point, or scheduled, RigError where a
    stage of it grows by itself.
    """
    inversion = invert(rig, 1.0)  # for K(p) only, and to refuse early what cannot be inverted
    check_bounded(rig, WATCHED)
    ranges, derived = derived_ranges(rig)
    notes = [*derived, *_said(rig)]
    start = rest(rig, present(ranges.command))
    references = (
        default_setpoints(start.output, present(ranges.output)) if setpoints is None else tuple(setpoints)
    )
    points = _points(rig, references, start, ranges)
    span = _span(rig, inversion, points, ranges, lowest)
    own = ControllerRanges(
        present(ranges.output),
        present(ranges.output),
        present(ranges.command),
        ranges.pressure if inversion.scheduled else None,
    )
    known = rig.signals.pressure is not None
    if inversion.scheduled and not known:
        notes.append(
            "the rig logs no pressure: the schedule's signal is the command times the regulator's static gain"
        )
    return Bench(rig, start, points, own, span, delay, known), notes


def _said(rig: Rig) -> list[str]:
    if not rig.effects:
        return []
    _, inside, others = linear_part(rig)
    notes = ["the gains are designed for the chain without its effects; beside stands each step with them"]
    if inside:
        notes.append(f"in the margins: {', '.join(inside)}")
    if others:
        notes.append(f"not linear, so not in the margins: {', '.join(others)}")
    return notes


def _points(
    rig: Rig, references: Sequence[float], start: Equilibrium, ranges: Ranges
) -> tuple[Equilibrium, ...]:
    check_setpoints(references)
    if any(reference == start.output for reference in references):
        raise DesignError(
            "--setpoints", f"hold the rest itself ({start.output:g})", "give outputs away from rest"
        )
    ordered = sorted(set(references), key=lambda reference: abs(reference - start.output))
    return tuple(holding(rig, reference, ranges) for reference in ordered)


def _span(
    rig: Rig, inversion: Inversion, points: Sequence[Equilibrium], ranges: Ranges, lowest: float | None
) -> tuple[float, float]:
    """Return the pressures between which K_o/K is scheduled, after checking K(p) and K(p)p there."""
    near, far = points[0].pressure, points[-1].pressure
    if not inversion.scheduled:
        return min(near, far), max(near, far)
    beyond = far + _EXTRAPOLATED * (far - near)
    inside = (present(ranges.pressure)[1] - beyond) * (beyond - present(ranges.pressure)[0]) >= 0.0
    end = beyond if inside else (present(ranges.pressure)[1] if far >= near else present(ranges.pressure)[0])
    begin = near if lowest is None else lowest
    if (far - begin) * (far - near) < 0.0:
        raise DesignError(
            "lowest", f"is {begin:g}, beyond the operating points", f"give a pressure up to {near:.4g}"
        )
    end = end if abs(end - near) > abs(far - near) or near == far else far
    if begin == end:  # one operating point, at the pressure's limit
        begin, end = begin - 0.05 * abs(begin), end + 0.05 * abs(end)
    _check_gain(rig, inversion, begin, end, near, far)
    return min(begin, end), max(begin, end)


def _check_gain(rig: Rig, inversion: Inversion, begin: float, end: float, near: float, far: float) -> None:
    zero = _turning(np.linspace(begin, end, 2001), inversion.K)
    if zero is not None:
        raise DesignError(
            f"{rig.name} [actuator]",
            f"has a gain K(p) that changes sign at p = {zero:.3g}, so K_o/K is not defined there",
            "give set points, or [ranges] pressure, on one side of it",
        )
    slope = np.polynomial.Polynomial((0.0, *inversion.gain)).deriv()
    turn = _turning(np.linspace(near, far, 2001), slope)
    if turn is not None:
        raise DesignError(
            f"{rig.name} [actuator]",
            f"has an output K(p)p that turns back at p = {turn:.3g}",
            "give set points below it",
        )


def _turning(place: Array, function: Callable[[Array], Array]) -> float | None:
    """Return where ``function`` first loses the sign it begins with, None where it keeps it."""
    sign = np.sign(function(place))
    lost = (sign != sign[0]) | (sign == 0.0)
    return float(place[lost.argmax()]) if lost.any() else None
