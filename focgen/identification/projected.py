"""Least squares over records of one stage, everything that enters linearly projected out.

A model is a sum of columns. Some belong to one record (offset, free responses), the others share their
weights among all records (gain, zero). Both follow from the nonlinear parameters by linear least squares, so
that Levenberg–Marquardt runs over those alone (Golub and Pereyra, SIAM J. Numer. Anal. 10, 1973).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from focgen.arrays import Array
from focgen.identification.noise import covariance, residual_model
from focgen.identification.rational import LATEST, Record, Shape, inside, responses

_RANK = 1e-12  # of the largest eigenvalue of unit columns' products: below it they are one column
_ALIKE = 1e-9  # likewise, below which no covariance can be trusted
_NUDGE = 1e-4  # of a parameter (logarithm or samples), for its derivative
_NONE = 1e-5  # of the measured spread: a residual below it is rounding


class Problem:
    """The residual of a shape over records, as a function of its nonlinear parameters."""

    def __init__(self, shape: Shape, records: Sequence[Record]) -> None:
        self.shape, self.records = shape, records
        self.longest = max(map(len, records))
        self.earliest, self.latest = -min(r.early for r in records), LATEST * min(map(len, records))
        around = [r.measured - r.measured.mean() for r in records]
        self.spread = float(np.sqrt(np.mean(np.concatenate(around) ** 2)))

    def inside(self, x: Array) -> Array:
        """``x`` within what makes sense."""
        return inside(self.shape, x, self.longest, self.earliest, self.latest)

    def rows(self, x: Array) -> list[tuple[Array, Array]]:
        """Each record's own rows and its shared ones."""
        return responses(self.shape, self.inside(x), self.records)

    def residual(self, x: Array) -> Array:
        """Measured − model of all records in a row, in units of the measured spread."""
        return self.solved(x).left / self.spread

    def cost(self, x: Array) -> float:
        """Sum of squares of :meth:`residual`."""
        return float(np.sum(self.residual(x) ** 2))

    def solved(self, x: Array) -> Solved:
        """The best weights at ``x`` and what they leave."""
        rows = self.rows(x)
        stacks = [np.vstack([*pair, r.measured]) for pair, r in zip(rows, self.records)]
        sums = [stack @ stack.T for stack in stacks]
        cuts = [len(own) for own, _ in rows]
        made = [_eliminated(m, cut) for m, cut in zip(sums, cuts)]
        normal: Any = sum(m[cut:, cut:] for m, cut in zip(made, cuts))
        shared = _weights(normal[:-1, :-1], normal[:-1, -1:])[:, 0]
        from_shared = np.append(-shared, 1.0)
        own = [-m[:cut, cut:] @ from_shared for m, cut in zip(made, cuts)]
        left = [np.concatenate([o, from_shared]) @ stack for o, stack in zip(own, stacks)]
        return Solved(self.inside(x), shared, [-o for o in own], np.concatenate(left), rows)

    def fit(self, start: Array, rounds: int, close: float) -> Array | None:
        """Levenberg–Marquardt from ``start`` until the cost falls by less than the share ``close``.

        None where it breaks down.
        """
        if not len(start):
            return start
        try:
            run = least_squares(
                self.residual,
                start,
                method="lm",
                xtol=1e-8,
                ftol=close,
                diff_step=1e-6,
                max_nfev=rounds * (len(start) + 1),
            )
        except (ValueError, np.linalg.LinAlgError):
            return None
        return self.inside(run.x)


@dataclass(frozen=True, eq=False)
class Solved:
    """Weights at ``x``: ``shared`` by all records and each record's ``own``, what is ``left`` of the measured
    signals (samples,), and the ``rows`` that the weights belong to."""

    x: Array
    shared: Array
    own: list[Array]
    left: Array
    rows: list[tuple[Array, Array]]

    def models(self, rows: list[tuple[Array, Array]]) -> list[Array]:
        """These weights times ``rows``: the model of every record.

        A record may have a row more on one side of a dead time of 0 than on the other; what is lacking is 0.
        """
        made: list[Array] = []
        for weights, (own, shared) in zip(self.own, rows):
            count = min(len(weights), len(own))
            made.append(weights[:count] @ own[:count] + self.shared @ shared)
        return made


def mean_square(problem: Problem, solved: Solved) -> float:
    """Of the residual; rounding counts as the smallest there is."""
    return max(float(np.mean(solved.left**2)), float(_NONE * problem.spread) ** 2)


def uncertainty(problem: Problem, solved: Solved, linear_only: bool = False) -> tuple[Array, float]:
    """Covariance of (nonlinear parameters, shared weights), and the effective number of samples.

    ``linear_only`` takes the nonlinear parameters as known: their rows and columns are 0. Raises
    numpy.linalg.LinAlgError where the records do not tell the parameters apart.
    """
    records = problem.records
    ends = np.cumsum([len(r) for r in records])[:-1]
    models = [residual_model(part) for part in np.split(solved.left, ends)]
    slopes = [] if linear_only else _slopes(problem, solved)
    jacobian = _jacobian(problem, solved, slopes)
    sizes = np.linalg.norm(jacobian, axis=0)
    unit = jacobian / np.where(sizes > 0.0, sizes, 1.0)
    alike = np.linalg.eigvalsh(unit.T @ unit)
    if alike[0] <= _ALIKE * alike[-1]:
        raise np.linalg.LinAlgError("parameters with the same effect, or none")
    spread = covariance(unit, models) / np.outer(sizes, sizes)
    count, shared = len(solved.left), jacobian.shape[1]
    every = shared + sum(len(own) for own in solved.own)
    freedom = (count - shared) / max(count - every, 1)
    known = len(solved.x) - len(slopes)
    return np.pad(spread * freedom, (known, 0)), sum(max(m.effective, 3.0) for m in models)


def _slopes(problem: Problem, solved: Solved) -> list[Array]:
    """Derivatives of the records' models in every nonlinear parameter, all records in a row."""
    slopes: list[Array] = []
    for step in _NUDGE * np.eye(len(solved.x)):
        ahead, behind = problem.inside(solved.x + step), problem.inside(solved.x - step)
        pair = (solved.models(problem.rows(x)) for x in (ahead, behind))
        slopes.append(np.concatenate([a - b for a, b in zip(*pair)]) / float(np.sum(ahead - behind)))
    return slopes


def _jacobian(problem: Problem, solved: Solved, slopes: list[Array]) -> Array:
    """Slopes and shared rows as columns (samples, ·), without what each record's own rows explain."""
    ends = np.cumsum([len(r) for r in problem.records])[:-1]
    parts = zip(*(np.split(slope, ends) for slope in slopes)) if slopes else [()] * len(problem.records)
    blocks = []
    for mine, (own, shared) in zip(parts, solved.rows):
        wanted = np.vstack([*mine, shared])
        blocks.append(wanted - _weights(own @ own.T, own @ wanted.T).T @ own)
    return np.hstack(blocks).T


def _eliminated(sums: Array, cut: int) -> Array:
    """Products of rows (k, k) after the first ``cut`` are regressed out of the others.

    The upper right block holds the regression's weights, the lower right one the products that are left.
    """
    made = sums.copy()
    made[:cut, cut:] = _weights(sums[:cut, :cut], sums[:cut, cut:])
    made[cut:, cut:] -= sums[cut:, :cut] @ made[:cut, cut:]
    return made


def _weights(products: Array, wanted: Array) -> Array:
    """Solve the normal equations, scaled to unit rows; rows that are one share its weight."""
    sizes = np.sqrt(np.maximum(np.diag(products), 0.0))  # rounding below 0
    sizes = np.where(sizes > 0.0, sizes, 1.0)
    values, vectors = np.linalg.eigh(products / np.outer(sizes, sizes))
    kept = values > _RANK * max(values[-1], 1e-300)
    vectors = vectors[:, kept]
    made: Array = (vectors / values[kept]) @ (vectors.T @ (wanted / sizes[:, None])) / sizes[:, None]
    return made
