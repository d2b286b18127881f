"""The gain as a polynomial of the pressure, K(p) = gain[0] + gain[1] p + …, through the gains of single
steps.

A step from p to q moves the drive K(p) p by its own K times q − p. So this K is the drive's mean slope there:
K(q) where it starts at 0, K(p) where it ends at 0, and everywhere linear in the polynomial's coefficients.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from focgen.errors import FitError

_APART = 0.02  # of the largest level: nearer than this, two levels are one


@dataclass(frozen=True)
class GainLine:
    """``gain``: coefficients by rising power of p; ``half``: half their 95 % intervals; ``r2`` as for any
    regression.

    ``r2`` is 1 where as many levels as coefficients leave no choice.
    """

    gain: tuple[float, ...]
    half: tuple[float, ...]
    r2: float


def distinct_levels(steps: np.ndarray) -> int:
    """How many steps (n, 2), from one pressure to another, lie apart; a release tells what its load did."""
    rising = np.sort(steps.sum(axis=1))
    return int(1 + np.count_nonzero(np.diff(rising) > _APART * np.abs(rising).max()))


def _secants(steps: np.ndarray, count: int) -> np.ndarray:
    """(q^m − p^m)/(q − p) of each step from p to q, m = 1 … ``count``; shape (n, count)."""
    p, q = steps[:, :1], steps[:, 1:]
    powers = np.arange(count)
    return np.hstack([(q ** powers[:m] * p ** powers[:m][::-1]).sum(1, keepdims=True) for m in powers + 1])


def fit_line(steps: np.ndarray, K: np.ndarray, covariance: np.ndarray, degree: int) -> GainLine:
    """Ordinary least squares of K (n,) over ``steps`` (n, 2), each from one pressure to another.

    Its intervals follow from the ``covariance`` (n, n) of K, widened where K scatters about the line by more
    than that. Raises FitError where there are fewer distinct levels than coefficients.
    """
    if distinct_levels(steps) <= degree:
        what = f"{distinct_levels(steps)} distinct levels do not determine K(p) of degree {degree}"
        raise FitError("--gain-degree", what, "log more levels or ask for a lower degree")
    secants = _secants(steps, degree + 1)
    solve = np.linalg.pinv(secants)
    gain = solve @ K
    left, free = K - secants @ gain, len(K) - degree - 1
    spread = solve @ covariance @ solve.T * _excess(left, covariance, free)
    width = student.ppf(0.975, free) if _excess(left, covariance, free) > 1.0 else 1.959964
    return GainLine(tuple(gain.tolist()), tuple((width * np.sqrt(np.diag(spread))).tolist()), _r2(K, left))


def _excess(left: np.ndarray, covariance: np.ndarray, free: int) -> float:
    """χ² per degree of freedom of what is left, at least 1."""
    return max(1.0, float(left**2 @ (1.0 / np.diag(covariance))) / free) if free > 0 else 1.0


def _r2(K: np.ndarray, left: np.ndarray) -> float:
    total = float(np.sum((K - K.mean()) ** 2))
    return 1.0 - float(left @ left) / total if total > 0.0 else 1.0
