"""Levenberg–Marquardt fit of K(p) p through e^(−Ls)/(T s^α + 1), eq. (3), to one experiment or several at
once.

Only log τ, α and the dead time L are searched (T = τ^α): for each trial the coefficients of K(p), an offset
an experiment and the amounts of an unknown past follow by linear least squares and are projected out (Golub
and Pereyra, 1973). The search begins at the best points of a coarse grid.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from focgen.arrays import Array
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
    older_times,
    suggestion,
    times,
    worth_it,
)
from focgen.identification.problem import Point, Problem, shortened, starts
from focgen.present import present

_ROUNDS = 60  # of Levenberg–Marquardt
_DAMPED, _STIFF, _FREE = 1e-3, 1e9, 1e-9  # damping: at first, at most, at least
_STILL = 1e-10  # largest step, in units of log τ, α and samples, at which a fit has converged
_FLAT = 1e-13  # relative fall of the cost, likewise
_TRIALS = 4  # steps of a past that are tried, an experiment
_ROUGHLY = 1e-4  # largest step at which a trial has converged
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

    gain: Array
    T: float
    alpha: float
    delay: float
    offset: Array
    half: dict[str, float | Array]
    gain_covariance: Array
    residuals: list[ResidualModel]
    simulated: list[Array]
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

    ``delay``: whether a dead time is fitted, or its fixed value in s. ``pasts``: which experiments have an
    unknown past; None: those whose data ask for it. Raises FitError where the data do not determine the
    parameters.
    """
    free, fixed = (delay, 0.0) if isinstance(delay, bool) else (False, float(delay))
    problem = Problem(experiments, (None,) * len(experiments), free, fixed)
    best = _searched(problem)
    if pasts is not None and any(pasts):
        problem, best = _with_pasts(problem, best, pasts, _STILL)
    if pasts is None:
        problem, best = _with_pasts_asked_for(problem, best)
    if any(x.reference is not None for x in experiments):
        problem, best = _whitened(problem, best)
    _check(problem, best)
    return _finished(problem, best)


def _with_pasts(
    problem: Problem, point: Point, pasts: Sequence[Past | None], still: float
) -> tuple[Problem, Point]:
    """The fit with these pasts, new steps begun at the times that explain most, and older ones allowed
    for."""
    begun: list[float] = [*point.x[: problem.core]]
    for i, (x, past) in enumerate(zip(problem.experiments, pasts)):
        known = point.x[problem.of_past[i]]
        begun += [*known][: past.steps if past else 0]
        if past and past.steps > len(known):
            made = _pasts_of(problem, point, x)
            left = (x.measured - problem.simulated(point)[i])[: made.shape[1]]
            time = times(x.beginning(SHOWS))[best_time(left, made)]
            begun += [np.log(time + 1.0)] * (past.steps - len(known))
    for _ in range(2):
        penalties = _long_run(problem, point)
        problem = Problem(problem.experiments, pasts, problem.delay_free, problem.delay, penalties)
        point = _descended(problem, problem.inside(np.array(begun)), still)
        pasts, begun = _with_older(problem, point), [*point.x]
    return problem, point


def _with_older(problem: Problem, point: Point) -> tuple[Past | None, ...]:
    """The pasts with what may have been before their first step."""
    found = []
    for i, (x, past) in enumerate(zip(problem.experiments, problem.pasts)):
        when = np.exp(point.x[problem.of_past[i]]) - 1.0
        found.append(past and replace(past, older=older_times(x, when)))
    return tuple(found)


def _searched(problem: Problem) -> Point:
    """The best of the fits from the better starts of the coarse grid; found on the beginning of long logs."""
    few = shortened(problem)
    best = min((_descended(few, start) for start in starts(few)), key=lambda point: point.cost)
    return best if few is problem else _descended(problem, best.x)


def _descended(problem: Problem, start: Array, still: float = _STILL, rounds: int = _ROUNDS) -> Point:
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
        if moved <= still or fallen <= _FLAT * point.cost:
            return point
    return point


def _with_pasts_asked_for(problem: Problem, point: Point) -> tuple[Problem, Point]:
    """The fit with the pasts that its data ask for, one step after the other, the most suggested first.

    A step is tried wherever one is suggested, and stays where the fit that has it cannot do without:
    parameters that are off for want of a past hide how much it explains.
    """
    reach = _reach(problem)
    held = [Past(0, reach, older_times(x, np.empty(0))) if x.begins_up else None for x in problem.experiments]
    if any(held):
        problem, point = _with_pasts(problem, point, held, _ROUGHLY)
    refused: set[int] = set()
    for _ in range(_TRIALS * len(problem.experiments)):
        i = _most_wanting(problem, point, refused)
        if i is None:
            break
        other, trial = _with_one_more(problem, point, i)
        if _worth(problem, point, other, trial, i):
            problem, point, refused = other, trial, set()
        else:
            refused.add(i)
    return (problem, _descended(problem, point.x)) if any(problem.pasts) else (problem, point)


def _most_wanting(problem: Problem, point: Point, refused: set[int]) -> int | None:
    """The experiment whose residual suggests another step of its past most; None where none does."""
    wants = {}
    for i, (x, made) in enumerate(zip(problem.experiments, problem.simulated(point))):
        known, left = problem.pasts[i], x.measured - made
        if i in refused or (known and known.steps == MOST_STEPS) or np.std(left) <= EXACT * x.spread:
            continue
        pasts = _pasts_of(problem, point, x)
        wants[i] = suggestion(left[: pasts.shape[1]], pasts, _reach(problem))
    best = max(wants, key=lambda i: wants[i], default=None)
    return best if best is not None and wants[best] > 0.0 else None


def _with_one_more(problem: Problem, point: Point, i: int) -> tuple[Problem, Point]:
    """The fit with a step more in the past of experiment ``i``."""
    pasts = list(problem.pasts)
    pasts[i] = Past((present(pasts[i]).steps if pasts[i] else 0) + 1, _reach(problem))
    return _with_pasts(problem, point, pasts, _ROUGHLY)


def _worth(problem: Problem, point: Point, other: Problem, trial: Point, i: int) -> bool:
    """Whether a step more in experiment ``i`` explains something that is no misfit."""
    x, made = problem.experiments[i], _pasts_of(other, trial, problem.experiments[i])
    answer = other.from_rest(trial, i)
    alone = (x.measured - answer)[: made.shape[1]]
    fell = worth_it(problem.residuals(point)[i], other.residuals(trial)[i])
    return fell and trial.cost < point.cost and asks_for_past(alone, made, _reach(problem), answer)


def _reach(problem: Problem) -> float:
    return max(float(np.ptp(x.measured)) for x in problem.experiments)


def _pasts_of(problem: Problem, point: Point, x: Excitation) -> Array:
    """What steps at a grid of times before an experiment leave of its first samples, (times, n)."""
    start = x.beginning(SHOWS)
    made: Array = columns(start, problem.kernels_for(start, point.x, start.stepped.count), times(start), 1)[0]
    return made


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

    In a closed loop the input answers the disturbance in the output. The prediction error of a model with the
    right noise model is not correlated with inputs of the past, so the fit is not biased (Ljung, 1999,
    §13.4).
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


def _with_intervals(
    problem: Problem, point: Point, spread: Array, models: list[ResidualModel]
) -> FractionalFit:
    log_tau, alpha = point.x[:2]
    T = float(np.exp(alpha * log_tau))
    searched = len(point.x)
    slope = np.zeros(len(spread))
    slope[:2] = T * alpha, T * log_tau  # of T = exp(α log τ)
    effective = sum(m.effective for m in models)
    count = len(spread) + len(models)

    def wide(variance: Any) -> Any:
        return half_width(variance, effective, count)

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


def _offset_variance(problem: Problem, point: Point, models: list[ResidualModel]) -> float:
    """Of the offset of a single experiment."""
    rows = problem.jacobians(point, offset=True)
    try:
        return float(sandwich(rows, models, problem.penalties)[-1, -1])
    except np.linalg.LinAlgError:
        return float("inf")
