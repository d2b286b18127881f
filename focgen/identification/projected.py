"""Least squares over records of one stage, everything that enters linearly projected out.

A model is a sum of columns. Some belong to one record (offset, free responses), the others share their
weights among all records (gain, zero). Both follow from the nonlinear parameters by linear least squares, so
that Levenberg–Marquardt runs over those alone (Golub and Pereyra, SIAM J. Numer. Anal. 10, 1973).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from focgen.identification.noise import covariance, residual_model
from focgen.identification.rational import Record, Shape, inside, responses

_RANK = 1e-12  # of the largest eigenvalue of unit columns' products: below it they are one column
_NUDGE = 1e-4  # of a parameter (logarithm or samples), for its derivative
_NONE = 1e-5  # of the measured spread: a residual below it is rounding


class Problem:
    """The residual of a shape over records, as a function of its nonlinear parameters."""

    def __init__(self, shape: Shape, records: Sequence[Record]):
        self.shape, self.records = shape, records
        self.longest = max(map(len, records))
        around = [r.measured - r.measured.mean() for r in records]
        self.spread = float(np.sqrt(np.mean(np.concatenate(around) ** 2)))

    def inside(self, x: np.ndarray) -> np.ndarray:
        """``x`` within what makes sense."""
        return inside(self.shape, x, self.longest)

    def columns(self, x: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Each record's own columns and its shared ones."""
        return [responses(self.shape, self.inside(x), r) for r in self.records]

    def residual(self, x: np.ndarray) -> np.ndarray:
        """Measured − model of all records in a row, in units of the measured spread."""
        return self.solved(x).left / self.spread

    def solved(self, x: np.ndarray) -> Solved:
        """The best weights at ``x`` and what they leave."""
        columns = self.columns(x)
        rest = [_without(own, np.column_stack([both, r.measured])) for (own, both), r in zip(columns, self.records)]
        rows = np.concatenate(rest)
        shared = _weights(rows[:, :-1], rows[:, -1:])[:, 0]
        left = rows[:, -1] - rows[:, :-1] @ shared
        return Solved(self.inside(x), shared, left, rows[:, :-1], columns)

    def fit(self, start: np.ndarray, rounds: int = 30) -> np.ndarray | None:
        """Levenberg–Marquardt from ``start``; None where it breaks down."""
        if not len(start):
            return start
        try:
            run = least_squares(
                self.residual,
                start,
                method="lm",
                xtol=1e-7,
                ftol=1e-9,
                diff_step=1e-6,
                max_nfev=rounds * (len(start) + 1),
            )
        except (ValueError, np.linalg.LinAlgError):
            return None
        return self.inside(run.x)


@dataclass(frozen=True, eq=False)
class Solved:
    """Weights at ``x``: ``shared`` by all records, what is ``left`` of the measured signals (samples,),
    ``rows`` the shared columns without the records' own ones, ``columns`` those of every record."""

    x: np.ndarray
    shared: np.ndarray
    left: np.ndarray
    rows: np.ndarray
    columns: list[tuple[np.ndarray, np.ndarray]]

    def own(self, records: Sequence[Record]) -> list[np.ndarray]:
        """The weights of each record's own columns."""
        rest = (r.measured - both @ self.shared for (_, both), r in zip(self.columns, records))
        return [_weights(own, y[:, None])[:, 0] for (own, _), y in zip(self.columns, rest)]


def mean_square(problem: Problem, solved: Solved) -> float:
    """Of the residual; rounding counts as the smallest there is."""
    return float(max(np.mean(solved.left**2), (_NONE * problem.spread) ** 2))


def uncertainty(problem: Problem, solved: Solved, linear_only: bool = False) -> tuple[np.ndarray, float]:
    """Covariance of (nonlinear parameters, shared weights), and the effective number of samples.

    ``linear_only`` takes the nonlinear parameters as known: their rows and columns are 0. Raises numpy.linalg.LinAlgError where the records do not tell the parameters apart.
    """
    records = problem.records
    ends = np.cumsum([len(r) for r in records])[:-1]
    models = [residual_model(part) for part in np.split(solved.left, ends)]
    slopes = [] if linear_only else _slopes(problem, solved)
    jacobian = np.column_stack([*slopes, solved.rows])
    sizes = np.linalg.norm(jacobian, axis=0)
    if not np.all(sizes > 0.0):
        raise np.linalg.LinAlgError("a parameter without effect")
    spread = covariance(jacobian / sizes, models) / np.outer(sizes, sizes)
    count, shared = len(solved.left), jacobian.shape[1]
    every = shared + sum(own.shape[1] for own, _ in solved.columns)
    freedom = (count - shared) / max(count - every, 1)
    known = len(solved.x) - len(slopes)
    return np.pad(spread * freedom, (known, 0)), sum(max(m.effective, 3.0) for m in models)


def _slopes(problem: Problem, solved: Solved) -> list[np.ndarray]:
    """Derivatives of the model in every nonlinear parameter, without the records' own columns."""
    own = solved.own(problem.records)

    def model(x):
        made = problem.columns(x)
        return [mine @ weights + both @ solved.shared for (mine, both), weights in zip(made, own)]

    slopes = []
    for step in _NUDGE * np.eye(len(solved.x)):
        ahead, behind = problem.inside(solved.x + step), problem.inside(solved.x - step)
        width = float(np.sum(ahead - behind))
        parts = [(a - b) / width for a, b in zip(model(ahead), model(behind))]
        slopes.append(
            np.concatenate([_without(mine, part[:, None])[:, 0] for (mine, _), part in zip(solved.columns, parts)])
        )
    return slopes


def _weights(columns: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Least squares by the normal equations of unit columns; what is one column twice shares its weight."""
    sizes = np.linalg.norm(columns, axis=0)
    sizes[sizes == 0.0] = 1.0
    unit = columns / sizes
    values, vectors = np.linalg.eigh(unit.T @ unit)
    kept = values > _RANK * max(values[-1], 1e-300)
    vectors = vectors[:, kept]
    return (vectors / values[kept]) @ (vectors.T @ (unit.T @ wanted)) / sizes[:, None]


def _without(columns: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """``wanted`` (n, k) less what ``columns`` (n, ·) can explain of it."""
    return wanted - columns @ _weights(columns, wanted)
