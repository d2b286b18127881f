"""The gain schedule that realises K_o(p)/K(p): where its breakpoints lie, and how far it is from the
formula.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Array
from focgen.control.controller import GainSchedule

TOLERANCE = 0.005
_PROBES = 65
_MOST = 256


@dataclass(frozen=True)
class Line:
    """K_o(p) = ``intercept`` + ``slope`` p, in 1/s per output unit of the regulator's gain, like eq. (7)."""

    intercept: float
    slope: float

    def __call__(self, pressure: ArrayLike) -> Array:
        """The specified gain K_o, 1/s per output unit, at pressures of any shape."""
        return self.intercept + self.slope * np.asarray(pressure)


@dataclass(frozen=True)
class Table:
    """A schedule and its largest relative ``error`` against the formula between its ends."""

    schedule: GainSchedule
    error: float


def gain_table(formula: Callable[..., Any], low: float, high: float, tolerance: float = TOLERANCE) -> Table:
    """Return breakpoints from ``low`` to ``high``, as few as keep straight lines within ``tolerance`` of
    ``formula``.

    ``formula`` takes an array and must not change sign. Breakpoints and gains carry 6 digits; the error is
    that of the table as written. Raises ValueError where 256 breakpoints do not do.
    """
    points = [low]
    while points[-1] < high:
        if len(points) >= _MOST:
            raise ValueError(f"more than {_MOST} breakpoints are needed for an error of {tolerance:g}")
        points.append(_furthest(formula, points[-1], high, 0.9 * tolerance))
    rounded = [float(f"{point:.6g}") for point in _evened(formula, np.array(points), tolerance)]
    schedule = GainSchedule(
        tuple(rounded), tuple(float(f"{gain:.6g}") for gain in formula(np.array(rounded)))
    )
    return Table(schedule, table_error(schedule, formula))


def _chord_error(formula: Callable[..., Any], start: float, stop: float) -> float:
    place = np.linspace(start, stop, _PROBES)
    exact = formula(place)
    straight = exact[0] + (exact[-1] - exact[0]) * np.linspace(0.0, 1.0, _PROBES)
    return float(np.max(np.abs(straight / exact - 1.0)))


def _furthest(formula: Callable[..., Any], start: float, stop: float, tolerance: float) -> float:
    """Return the furthest point to which one straight line from ``start`` stays within ``tolerance``."""
    if _chord_error(formula, start, stop) <= tolerance:
        return stop
    near, far = start, stop
    for _ in range(30):
        middle = 0.5 * (near + far)
        near, far = (middle, far) if _chord_error(formula, start, middle) <= tolerance else (near, middle)
    return near


def _evened(formula: Callable[..., Any], points: Array, tolerance: float) -> Array:
    """Spread the same number of breakpoints so that no piece is short because it came last."""
    low, high, count = points[0], points[-1], len(points) - 1
    small, large = 0.0, tolerance
    best = points
    for _ in range(10):
        middle = 0.5 * (small + large)
        trial = [low]
        while trial[-1] < high and len(trial) <= count:
            trial.append(_furthest(formula, trial[-1], high, middle))
        if trial[-1] >= high and len(trial) == count + 1:
            best, large = np.array(trial), middle
        else:
            small = middle
    return best


def table_error(schedule: GainSchedule, formula: Callable[..., Any]) -> float:
    """Return the schedule's largest relative error against ``formula`` between its first and last
    breakpoint.
    """
    points = np.array(schedule.breakpoints)
    place = np.concatenate([np.linspace(a, b, _PROBES) for a, b in pairwise(points)])
    return float(np.max(np.abs(schedule(place) / formula(place) - 1.0)))
