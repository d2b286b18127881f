"""The gain as a polynomial of the pressure, K(p) = gain[0] + gain[1] p + …, through the gains of single
steps.
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


def distinct_levels(levels: np.ndarray) -> int:
    """How many levels lie apart."""
    rising = np.sort(levels)
    return int(1 + np.count_nonzero(np.diff(rising) > _APART * np.abs(levels).max()))


def fit_line(levels: np.ndarray, K: np.ndarray, covariance: np.ndarray, degree: int) -> GainLine:
    """Ordinary least squares of K (n,) over ``levels`` (n,).

    Its intervals follow from the ``covariance`` (n, n) of K, widened where K scatters about the line by more
    than that. Raises FitError where there are fewer distinct levels than coefficients.
    """
    if distinct_levels(levels) <= degree:
        what = f"{distinct_levels(levels)} distinct levels do not determine K(p) of degree {degree}"
        raise FitError("--gain-degree", what, "log more levels or ask for a lower degree")
    powers = np.vander(levels, degree + 1, increasing=True)
    solve = np.linalg.pinv(powers)
    gain = solve @ K
    left, free = K - powers @ gain, len(K) - degree - 1
    spread = solve @ covariance @ solve.T * _excess(left, covariance, free)
    width = student.ppf(0.975, free) if _excess(left, covariance, free) > 1.0 else 1.959964
    return GainLine(tuple(gain.tolist()), tuple((width * np.sqrt(np.diag(spread))).tolist()), _r2(K, left))


def _excess(left: np.ndarray, covariance: np.ndarray, free: int) -> float:
    """χ² per degree of freedom of what is left, at least 1."""
    return max(1.0, float(left**2 @ (1.0 / np.diag(covariance))) / free) if free > 0 else 1.0


def _r2(K: np.ndarray, left: np.ndarray) -> float:
    total = float(np.sum((K - K.mean()) ** 2))
    return 1.0 - float(left @ left) / total if total > 0.0 else 1.0
