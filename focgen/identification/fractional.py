"""Levenberg–Marquardt fit of K(p) p through e^(−Ls)/(T s^α + 1), eq. (3), to one experiment or several at once.

Only log τ, α and the dead time L are searched (T = τ^α): for each trial the coefficients of K(p), an offset an
experiment and the amounts of an unknown past follow by linear least squares and are projected out (Golub and
Pereyra, 1973). The search begins at the best points of a coarse grid.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from focgen.errors import FitError
from focgen.identification.excitation import Excitation
from focgen.identification.noise import ResidualModel, half_width, residual_model, sandwich
from focgen.identification.past import (
    EXACT,
    MOST_STEPS,
    SHOWS,
    Past,
    asks_for_past,
    best_time,
    columns,
    suggests_past,
    times,
    worth_it,
)
from focgen.identification.problem import Point, Problem, delay_reach, shortened, starts

_ROUNDS = 60  # of Levenberg–Marquardt
_DAMPED, _STIFF, _FREE = 1e-3, 1e9, 1e-9  # damping: at first, at most, at least
_STILL = 1e-10  # largest step, in units of log τ, α and samples, at which a fit has converged
_FLAT = 1e-13  # relative fall of the cost, likewise
_RECONSIDERED = 3  # times that the pasts are chosen anew
_EDGE = 1e-6  # distance of α from its bounds
_WHITENED = 15  # times that model and noise model are fitted in turn
_SEARCHED_ANEW = 3  # of these times the fit begins at the coarse grid, too: the biased one may be far off
_AGREED = 1e-5  # of log τ and α: they agree


@dataclass(frozen=True, eq=False)
class FractionalFit:
    """A fit of one experiment or several, which share T, α, the gain's coefficients and the dead time.

    ``gain`` (powers,): K(p) = gain[0] + gain[1] p + …; ``T`` in s^alpha, ``delay`` in s. ``half`` maps "T",
    "alpha", "delay", "gain" (powers,) to half a 95 % interval, and "offset" to that of a single experiment.
    ``gain_covariance`` (powers, powers). ``offset`` (experiments,), ``simulated``: the model's outputs;
    ``pasts``: for each experiment the unknown past that was estimated, None where it began at rest.
    ``closed_loop``: whether a loop was closed, so that a noise model was fitted along.
    """

    gain: np.ndarray
    T: float
    alpha: float
    delay: float
    offset: np.ndarray
    half: dict[str, float | np.ndarray]
    gain_covariance: np.ndarray
    residuals: list[ResidualModel]
    simulated: list[np.ndarray]
    pasts: tuple[Past | None, ...]
    closed_loop: bool = False

    @property
    def K(self) -> float:
        """The gain of a fit with one power."""
        return float(self.gain[0])


def fit_fractional(
    experiments: Sequence[Excitation],
    delay: bool | float = False,
    pasts: Sequence[Past | None] | None = None,
) -> FractionalFit:
    """Fit one K(p), T and α to all experiments, with an offset each.

    ``delay``: whether a dead time is fitted, or its fixed value in s. ``pasts``: which experiments have an unknown
    past; None: those whose data ask for it. Raises FitError where the data do not determine the parameters.
    """
    free, fixed = (delay, 0.0) if isinstance(delay, bool) else (False, float(delay))
    problem = Problem(experiments, (None,) * len(experiments), free, fixed)
    best = _searched(problem)
    if pasts is not None and any(pasts):
        problem, best = _with_pasts(problem, best, pasts)
    if pasts is None:
        problem, best = _with_pasts_asked_for(problem, best)
    if any(x.reference is not None for x in experiments):
        problem, best = _whitened(problem, best)
    _check(problem, best)
    return _finished(problem, best)


def _with_pasts(problem: Problem, point: Point, pasts: Sequence[Past | None]) -> tuple[Problem, Point]:
    """The fit with these pasts, begun at the times that explain most; their prior weighed by what is left."""
    begun = [*point.x[: problem.core]]
    for i, (x, past) in enumerate(zip(problem.experiments, pasts)):
        known = point.x[problem.of_past[i]]
        begun += [*known][: past.steps if past else 0]
        if past and past.steps > len(known):
            made = _pasts_of(problem, point, x)
            left = (x.measured - problem.simulated(point)[i])[: made.shape[1]]
            time = times(x.beginning(SHOWS))[best_time(left, made)]
            begun += [np.log(time + 1.0)] * (past.steps - len(known))
    penalties = _long_run(problem, point)
    for _ in range(2):
        problem = Problem(problem.experiments, pasts, problem.delay_free, problem.delay, penalties)
        point = _descended(problem, problem.inside(np.array(begun)))
        penalties, begun = _long_run(problem, point), point.x
    return problem, point


def _searched(problem: Problem) -> Point:
    """The best of the fits from the better starts of the coarse grid; found on the beginning of long logs."""
    few = shortened(problem)
    best = min((_descended(few, start) for start in starts(few)), key=lambda point: point.cost)
    return best if few is problem else _descended(problem, best.x)


def _descended(problem: Problem, start: np.ndarray, rounds: int = _ROUNDS) -> Point:
    """Levenberg–Marquardt on the searched parameters, the linear ones projected out."""
    point, damping = problem.at(start), _DAMPED
    for _ in range(rounds):
        slope, left = problem.projected_slope(point)
        sizes = np.maximum(np.linalg.norm(slope, axis=0), 1e-300)
        while True:
            rows = np.vstack([slope / sizes, np.sqrt(damping) * np.eye(len(sizes))])
            step = -np.linalg.lstsq(rows, np.concatenate([left, np.zeros(len(sizes))]), rcond=None)[0] / sizes
            trial = problem.at(problem.inside(point.x + problem.short(step)))
            if trial.cost <= point.cost or damping > _STIFF:
                break
            damping *= 8.0
        moved = float(np.max(np.abs(trial.x - point.x)))
        if trial.cost > point.cost:
            return point
        fallen = point.cost - trial.cost
        point, damping = trial, max(damping / 10.0, _FREE)
        if moved <= _STILL or fallen <= _FLAT * point.cost:
            return point
    return point


def _with_pasts_asked_for(problem: Problem, point: Point) -> tuple[Problem, Point]:
    """The fit with the pasts that its data ask for.

    A past is tried wherever one is suggested, and stays where the fit that has it cannot do without: parameters
    that are off for want of a past hide how much it explains.
    """
    for _ in range(_RECONSIDERED):
        tried = _changed(problem, point, _grown)
        if tried[0] is problem:
            break
        without = problem.residuals(point)
        kept = _changed(*tried, lambda *at: _kept(*at, without[at[2]]))
        if kept[0].pasts == problem.pasts:
            break
        problem, point = kept
    return problem, point


def _changed(problem: Problem, point: Point, rule) -> tuple[Problem, Point]:
    """The fit with each experiment's past by ``rule``."""
    reach = max(float(np.ptp(x.measured)) for x in problem.experiments)
    pasts = tuple(rule(problem, point, i, reach) for i in range(len(problem.experiments)))
    return (problem, point) if pasts == problem.pasts else _with_pasts(problem, point, pasts)


def _grown(problem: Problem, point: Point, i: int, reach: float) -> Past | None:
    """The past of experiment ``i`` with a step more where one is suggested."""
    x, known = problem.experiments[i], problem.pasts[i]
    left = x.measured - problem.simulated(point)[i]
    steps = known.steps if known else 0
    if steps == MOST_STEPS or np.std(left) <= EXACT * x.spread:
        return known
    made = _pasts_of(problem, point, x)
    wanted = asks_for_past if known else suggests_past
    return Past(steps + 1, reach) if wanted(left[: made.shape[1]], made, reach) else known


def _pasts_of(problem: Problem, point: Point, x: Excitation) -> np.ndarray:
    """What steps at a grid of times before an experiment leave of its first samples, (times, n)."""
    start = x.beginning(SHOWS)
    return columns(start, problem.kernels_for(start, point.x, start.stepped.count), times(start), 1)[0]


def _kept(problem: Problem, point: Point, i: int, reach: float, without: np.ndarray) -> Past | None:
    """The past of experiment ``i``, None where what it explains does not ask for it, or the fit that was
    ``without`` it leaves little more."""
    x, known = problem.experiments[i], problem.pasts[i]
    if known is None:
        return None
    made = _pasts_of(problem, point, x)
    alone = (x.measured - problem.from_rest(point, i))[: made.shape[1]]
    worth = worth_it(without, problem.residuals(point)[i])
    return known if worth and asks_for_past(alone, made, reach) else None


def _long_run(problem: Problem, point: Point) -> list[float]:
    """The spectral density of each experiment's residual at rest: what a slow column is weighed against."""
    models = [residual_model(part) for part in problem.residuals(point)]
    return [m.variance / float(np.sum(m.a)) ** 2 for m in models]


def _check(problem: Problem, best: Point) -> None:
    names = ", ".join(e.name for e in problem.experiments)
    if not (np.all(np.isfinite(best.x)) and np.isfinite(best.cost)):
        raise FitError(names, "the fit does not converge", "look at the log")
    if not Problem.ALPHAS[0] + _EDGE < best.x[1] < Problem.ALPHAS[1] - _EDGE:
        what = f"the best order is at the edge of (0, 2): {best.x[1]:.3g}"
        raise FitError(names, what, "the log does not show such dynamics; look at its columns and its time")
    if problem.delay_free and best.x[2] >= problem.latest:
        what = f"the best dead time is the longest that is looked for, {problem.delay_at(best.x):.3g} s"
        raise FitError(names, what, "record for four times the dead time; look at the logs' clocks")


def _whitened(problem: Problem, point: Point) -> tuple[Problem, Point]:
    """The fit with a noise model for each closed loop, both estimated in turn until they agree.

    In a closed loop the input answers the disturbance in the output. The prediction error of a model with the right
    noise model is not correlated with inputs of the past, so the fit is not biased (Ljung, 1999, §13.4).
    """
    for turn in range(_WHITENED):
        before, models = point.x, [residual_model(part) for part in problem.residuals(point)]
        filters = [m.a if x.reference is not None else None for m, x in zip(models, problem.experiments)]
        penalties = [m.variance for m in models]
        problem = problem.with_whitening(filters, penalties)
        found = [_descended(problem, point.x)]
        if turn < _SEARCHED_ANEW and not any(problem.pasts):
            found.append(_searched(problem))
        point = min(found, key=lambda each: each.cost)
        if float(np.max(np.abs(point.x - before))) < _AGREED:
            break
    return problem, point


def _finished(problem: Problem, point: Point) -> FractionalFit:
    models = [residual_model(part) for part in problem.residuals(point, white=True)]
    try:
        spread = sandwich(problem.jacobians(point), models, problem.penalties)
    except np.linalg.LinAlgError:
        names = ", ".join(e.name for e in problem.experiments)
        raise FitError(
            names, "the logs do not determine K, T and alpha", "record longer holds at more levels"
        ) from None
    return _with_intervals(problem, point, spread, models)


def _with_intervals(problem: Problem, point: Point, spread, models) -> FractionalFit:
    log_tau, alpha = point.x[:2]
    T = float(np.exp(alpha * log_tau))
    searched = len(point.x)
    slope = np.zeros(len(spread))
    slope[:2] = T * alpha, T * log_tau  # of T = exp(α log τ)
    effective = sum(m.effective for m in models)
    count = len(spread) + len(models)
    wide = lambda variance: half_width(variance, effective, count)  # noqa: E731
    gains = slice(searched, searched + len(point.gain))
    half = {
        "T": float(wide(slope @ spread @ slope)),
        "alpha": float(wide(spread[1, 1])),
        "delay": problem.step * float(wide(spread[2, 2])) if problem.delay_free else 0.0,
        "gain": wide(np.diag(spread)[gains]),
    }
    if len(problem.experiments) == 1:
        half["offset"] = float(wide(_offset_variance(problem, point, models)))
    return FractionalFit(
        point.gain.copy(),
        T,
        float(alpha),
        problem.delay_at(point.x),
        np.array(point.offsets),
        half,
        spread[gains, gains],
        models,
        problem.simulated(point),
        problem.pasts,
        any(a is not None for a in problem.whitening),
    )


def _offset_variance(problem: Problem, point: Point, models) -> float:
    """Of the offset of a single experiment."""
    rows = problem.jacobians(point, offset=True)
    try:
        return float(sandwich(rows, models, problem.penalties)[-1, -1])
    except np.linalg.LinAlgError:
        return float("inf")


__all__ = ["FractionalFit", "delay_reach", "fit_fractional"]
