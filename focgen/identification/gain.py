"""The gain as a polynomial of the pressure, K(p) = gain[0] + gain[1] p + …: what degree the logs can show.

A step from p to q moves the drive K(p) p by its own K times q − p. So the K of a single fit is the drive's
mean slope there: K(q) where it starts at 0, K(p) where it ends at 0, and everywhere linear in the
polynomial's coefficients.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.arrays import Array
from focgen.errors import FitError
from focgen.identification.excitation import Excitation
from focgen.identification.identification import ExperimentFit
from focgen.identification.single import is_step

_STEEPEST = 5  # degree of K(p); beyond it a polynomial through a few levels means nothing
_APART = 0.02  # of the largest level: nearer than this, two levels are one
_OWN = 0.05  # of a power's size: what the lower ones must leave of it


def check_degree(degree: int) -> None:
    """Raise FitError for a degree that makes no sense."""
    if not 0 <= degree <= _STEEPEST:
        raise FitError("--gain-degree", f"is {degree}", f"give 0 to {_STEEPEST}; 1 is the line of eq. (5)")


def feasible_degree(excitations: Sequence[Excitation], degree: int) -> tuple[int, tuple[str, ...]]:
    """The degree that these excitations can show, at most ``degree``, and a note where it is less."""
    if all(is_step(x) for x in excitations):
        levels = distinct_levels(np.array([x.ends for x in excitations]))
        if levels > degree:
            return degree, ()
        what = f"{levels} distinct level{'s' * (levels > 1)}"
        return levels - 1, (f"{what}: K(p) of degree {levels - 1}, not {degree}",)
    possible = next((m for m in range(1, degree + 1) if _follows_from_lower(excitations, m)), degree + 1) - 1
    if possible == degree:
        return degree, ()
    return possible, (f"the levels lie too close together: K(p) of degree {possible}, not {degree}",)


def distinct_levels(steps: Array) -> int:
    """How many steps (n, 2), from one pressure to another, lie apart; a release tells what its load did."""
    rising = np.sort(steps.sum(axis=1))
    return int(1 + np.count_nonzero(np.diff(rising) > _APART * np.abs(rising).max()))


def r2_of_line(excitations: Sequence[Excitation], fits: Sequence[ExperimentFit], degree: int) -> float | None:
    """R² of the polynomial of ``degree`` through the K of single fits of steps; None where there are fewer
    than two, 1 where as many levels as coefficients leave no choice."""
    ends = {x.name: x.ends for x in excitations}
    steps = np.array([ends[f.name] for f in fits if f.step])
    if len(steps) < 2:
        return None
    K = np.array([f.K for f in fits if f.step])
    secants = secants_of(steps, min(degree + 1, distinct_levels(steps)))
    left = K - secants @ np.linalg.lstsq(secants, K, rcond=None)[0]
    total = float(np.sum((K - K.mean()) ** 2))
    return 1.0 - float(left @ left) / total if total > 0.0 else 1.0


def secants_of(steps: Array, count: int) -> Array:
    """(q^m − p^m)/(q − p) of each step from p to q, m = 1 … ``count``; shape (n, count)."""
    p, q = steps[:, :1], steps[:, 1:]
    powers = np.arange(count)
    return np.hstack([(q ** powers[:m] * p ** powers[:m][::-1]).sum(1, keepdims=True) for m in powers + 1])


def _follows_from_lower(excitations: Sequence[Excitation], power: int) -> bool:
    """Whether p^(power + 1) is all but a sum of the lower powers, each experiment about its mean."""
    rows = [x.course.values - x.course.values.mean(axis=1, keepdims=True) for x in excitations]
    values = np.hstack(rows)
    lower, top = values[:power].T, values[power]
    sizes = np.linalg.norm(lower, axis=0)
    left = top - lower @ (np.linalg.lstsq(lower / sizes, top, rcond=None)[0] / sizes)
    return bool(np.linalg.norm(left) <= _OWN * np.linalg.norm(top))
