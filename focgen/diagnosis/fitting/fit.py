"""Levenberg–Marquardt on simulated output, prewhitened, with numeric Jacobian and bounds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dposv

from focgen.diagnosis.fitting.predictability import predictable_share
from focgen.diagnosis.problem.problem import Problem
from focgen.rig.kernels import innovations as innovated
from focgen.rig.kernels import products

STEP = 1e-4
_SURE, _NOTHING = 1e-10, 1e-12  # of the largest of a matrix: what is sure to be known, and what is not
FIXED = 1e-6  # a parameter whose bounds are as close is none
_STALE = 2  # iterations that rows of the Jacobian are kept for
_HOPELESS = 600.0  # exponent: so unlikely, no fit is better than another, and exp would pass a float's end
_LAGGING = 0.01  # of what a fit is behind another: one that gains less by an iteration will not reach it


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted hypothesis: ``vector``, ``innovations`` (all experiments, one after the other), their
    ``sse``, and the normal matrix ``information`` (J^T J of the innovations, and what is known beforehand in
    the same unit)."""

    problem: Problem
    vector: np.ndarray
    innovations: np.ndarray
    sse: float
    information: np.ndarray

    @cached_property
    def size(self) -> int:
        """How many parameters the candidate effects have that are free."""
        low, high = self.problem.bounds()
        return int(np.sum(high[self.problem.head :] - low[self.problem.head :] > FIXED))

    @cached_property
    def prior_penalty(self) -> float:
        """Nats against its nominal parameters, for being far from those given."""
        return self.problem.nominals.prior_penalty(self.vector)

    @cached_property
    def cost(self) -> float:
        """What the fit was to make least: the sum of squares, and what is known beforehand."""
        return _cost(self.problem, self.vector, self.sse, len(self.innovations))

    @cached_property
    def weighed(self) -> np.ndarray:
        """The residual (n,) by trust, as a share of the output's level."""
        return self.problem.weighed(self.vector)

    @cached_property
    def predictable_share(self) -> float:
        """The share of the residual's mean square that inputs predict."""
        problem = self.problem
        return predictable_share(problem.segment, self.weighed, problem.references.clocks["response"])

    def residual(self) -> list[np.ndarray]:
        """Measured less simulated, by experiment, as a share of the output's level, each sample by its
        trust."""
        return self.problem.segment.parts(self.weighed)


@dataclass(frozen=True, eq=False)
class Weighing:
    """How residuals are weighed: means of ``coarse`` samples at a time, whitened by ``ar``."""

    ar: np.ndarray
    coarse: int = 1


@dataclass(frozen=True, eq=False)
class Known:
    """The first ``rows`` (k, n) of a Jacobian, as they are taken, and their ``products`` (k, k) with one
    another: sums over the samples."""

    rows: np.ndarray
    products: np.ndarray

    @classmethod
    def of(cls, rows: np.ndarray) -> Known:
        """Rows with their products."""
        return cls(rows, products(rows))


WHITE = Weighing(np.ones(1))
"""Every sample by itself: noise without colour."""


def means(part: np.ndarray, coarse: int) -> np.ndarray:
    """Means of ``coarse`` neighbours; what does not fill the last one is left out."""
    count = len(part) // coarse
    return part if coarse == 1 else part[: count * coarse].reshape(count, coarse).mean(axis=1)


@dataclass(frozen=True, eq=False)
class Since:
    """Innovations ``now`` (n,) at a vector, and ``per`` which step from it derivatives are taken."""

    now: np.ndarray
    per: float


def innovations(
    problem: Problem,
    vector: np.ndarray,
    weighing: Weighing,
    probe: bool = False,
    since: Since | None = None,
    into: np.ndarray | None = None,
) -> np.ndarray:
    """The weighed residual, as a share of the output's level; ``probe``: of a step from a vector that was
    simulated just before, and will be again. ``since``: by how much more it is than there, per step. Left
    ``into`` an array, where one is given."""
    segment = problem.segment
    y, made = segment.y, problem.simulate(vector, probe)
    if segment.pace:
        y = segment.recent(y - made)
        made = np.zeros_like(y)
    less, per = (since.now, 1.0 / since.per) if since else (None, 1.0)
    return innovated(y, made, segment.weight, segment.run.rest, weighing.coarse, weighing.ar, less, per, into)


def fit(
    problem: Problem,
    start: np.ndarray,
    weighing: Weighing,
    iterations: int = 12,
    tolerance: float = 1e-3,
    known: Known | None = None,
    leader: Fit | None = None,
    now: np.ndarray | None = None,
) -> Fit:
    """The likeliest vector within the problem's bounds, from ``start``: least squares, weighed against what
    is known beforehand; stops when the gain is below ``tolerance`` nats, or below a hundredth of those that
    it is behind ``leader``, a fit of the same innovations.

    ``known``: the Jacobian of the first parameters, taken as it is: a quick fit that is a little off.
    Otherwise the rows ahead of the candidates' own are made anew only every third time, for they change
    little, and the fit does not end on old ones. ``now``: the innovations at ``start``, which lies within
    the bounds, where they are known.
    """
    low, high = problem.bounds()
    vector = np.clip(start, low, high)
    now = innovations(problem, vector, weighing) if now is None else now
    sse, damping = float(now @ now), 1e-3
    cost, (expected, precision) = _cost(problem, vector, sse, len(now)), problem.known
    normal, kept, age, head = np.eye(len(vector)), known, 0, problem.head
    for _ in range(iterations):
        rows = jacobian(problem, vector, now, weighing, low, high, kept)
        product = products(rows, None if kept is None else kept.products)
        unit = sse / max(len(now), 1)  # a nat's worth of squares, twice
        normal = product[:-1, :-1] + unit * np.diag(precision)
        slope = product[:-1, -1] + unit * precision * (vector - expected)
        gained, before = False, cost
        for _ in range(6):
            trial = np.clip(vector - _step(normal, slope, damping, vector, low, high), low, high)
            then = innovations(problem, trial, weighing)
            worth = _cost(problem, trial, float(then @ then), len(then))
            if worth < cost:
                vector, now, sse, cost, gained = trial, then, float(then @ then), worth, True
                damping = max(damping * 0.2, 1e-9)
                break
            damping *= 6.0
        enough = max(tolerance, _LAGGING * _nats(len(now), cost, leader.cost)) if leader else tolerance
        ended = not gained or _nats(len(now), before, cost) < enough
        if ended and (kept is None or known is not None):
            break
        age = 0 if ended or age >= _STALE else age + 1
        if known is None:
            kept = Known(rows[:head], product[:head, :head]) if age else None
    return Fit(problem, vector, now, sse, normal)


def _nats(count: int, cost: float, better: float) -> float:
    """By how much likelier a fit of ``count`` innovations is at the cost ``better``."""
    return 0.5 * count * float(np.log(cost / max(better, 1e-300)))


def _cost(problem: Problem, vector: np.ndarray, sse: float, count: int) -> float:
    """The sum of squares that would be as unlikely alone as this one with these nominal parameters."""
    return sse * float(np.exp(min(2.0 * problem.unlikely(vector) / max(count, 1), _HOPELESS)))


def jacobian(
    problem: Problem,
    vector: np.ndarray,
    now: np.ndarray,
    weighing: Weighing,
    low: np.ndarray,
    high: np.ndarray,
    known: Known | None = None,
) -> np.ndarray:
    """Rows (k + 1, n): the innovations' derivatives, by differences, 0 for what cannot move; and last the
    innovations themselves."""
    rows = np.empty((len(vector) + 1, len(now)))
    first = 0 if known is None else len(known.rows)
    rows[-1] = now
    if known is not None:
        rows[:first] = known.rows
    for i in range(first, len(vector)):
        if high[i] - low[i] < FIXED:
            rows[i] = 0.0
            continue
        step = STEP if vector[i] + STEP <= high[i] else -STEP
        moved = vector.copy()
        moved[i] += step
        innovations(problem, moved, weighing, True, Since(now, step), rows[i])
    return rows


def known_at(problem: Problem, vector: np.ndarray, weighing: Weighing) -> tuple[np.ndarray, Known]:
    """The innovations at a vector, and the Jacobian there, for quick fits that take it as it is."""
    now = innovations(problem, vector, weighing)
    return now, Known.of(jacobian(problem, vector, now, weighing, *problem.bounds())[:-1])


def _step(
    normal: np.ndarray,
    slope: np.ndarray,
    damping: float,
    vector: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
) -> np.ndarray:
    """The damped step, with parameters held that stand at a bound and push beyond it."""
    held = ((vector <= low) & (slope > 0)) | ((vector >= high) & (slope < 0))
    free = ~held
    step = np.zeros_like(vector)
    if free.any():
        scale = np.diag(normal)[free]
        matrix = normal[np.ix_(free, free)]
        matrix.flat[:: len(scale) + 1] += damping * (scale + 1e-9 * max(scale.max(), 1e-30) + 1e-12)
        step[free] = _solved(matrix, slope[free])
    made: np.ndarray = np.clip(step, -1.0, 1.0)
    return made


def _solved(matrix: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """matrix⁻¹ slope, by Cholesky's factor, which is quick; where that shows a direction about which next to
    nothing is known, by singular values, without it."""
    factor, step, fault = dposv(matrix, slope)
    made: np.ndarray = step
    if fault or np.min(factor.diagonal()) ** 2 < _SURE * np.max(matrix.diagonal()):
        made = np.linalg.lstsq(matrix, slope, rcond=_NOTHING)[0]
    return made


def problem_residual(of: Fit) -> np.ndarray:
    """Measured less simulated (n,)."""
    return of.problem.residual(of.vector)


def answer(of: Fit, stray: np.ndarray, weighing: Weighing) -> float:
    """The sum of squares, as of innovations, of what a fit's output is another by where its input is another
    by ``stray`` (n,)."""
    problem, segment = of.problem, of.problem.segment.anew(x=of.problem.segment.fed.x + stray)
    moved = replace(problem, segment=segment, memory={}).simulate(of.vector)
    off = segment.recent(moved - problem.simulate(of.vector))
    rest = segment.run.rest
    found = innovated(off, np.zeros_like(off), segment.weight, rest, weighing.coarse, weighing.ar)
    return float(found @ found)


def square_by(of: Fit, weighing: Weighing) -> float:
    """The sum of squares of a fit, which may have been made to another colour of the noise, in this one."""
    found = innovations(of.problem, of.vector, weighing)
    return float(found @ found)
