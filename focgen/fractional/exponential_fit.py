"""Best sums of exponentials for the weights of (1 − z⁻¹)^(−β), 0 < β < 1, in relative error.

The weights are g_j = Γ(j+β) / (Γ(β) j!) = (sin πβ / π) ∫₀¹ λ^j λ^(β−1) (1−λ)^(−β) dλ, moments of a positive
measure. Two sums of n real exponentials differ at most 2n − 1 times in sign (Descartes' rule), so
one whose relative error alternates at 2n + 1 lags between ±E is the best possible: no n exponentials have a
smaller largest error (de la Vallée-Poussin; Braess, Nonlinear Approximation Theory, 1986).

The alternation is found by Remez's exchange, on logarithms of rates and weights. It needs a good start, which
the ladder gives: the best fit with n modes, pulled apart in the middle where it is periodic in log lag,
starts n + 1 modes at a longer horizon, and is then drawn back to the horizon that was asked for.

Where an error is all but level, the last bit of a sum decides which lag is its largest, and with it every bit
of the fit. So all of it is computed by :mod:`focgen.fractional.elementary`, the same on every machine.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from focgen.arrays import Array, Ints
from focgen.fractional import elementary
from focgen.fractional.weights import gl_weights_at

_ALL_LAGS = 200  # up to here every lag is looked at, then _COARSE or _FINE places a factor of e
_SPARSE, _COARSE, _FINE = 40, 100, 300
_EASES = tuple(0.5 * i for i in range(1, 11))
_ROUGH, _LEVEL = 2.0, 1.005  # largest over smallest extremum: on the way, and at the end
_EXCHANGES, _NEWTONS, _LAWSONS = 30, 30, 60
_LOG_2 = 0.6931471805599453
_LONGEST = 34.0  # log of the longest horizon on the way


@dataclass(frozen=True)
class Alternation:
    """Modes e^(log_weights) · exp(−e^(log_rates) (j − 1)), lags j ≥ 1, whose error alternates.

    ``log_rates`` rises, both of shape (n,). ``error`` is the largest |h_j/g_j − 1| / profile_j, met with
    alternating signs at the lags ``places``, shape (2n + 1,).
    """

    log_rates: Array
    log_weights: Array
    error: float
    places: Ints

    @property
    def modes(self) -> int:
        """How many exponentials there are."""
        return len(self.log_rates)


class Problem:
    """The weights of (1 − z⁻¹)^(−``beta``) on the lags 1 … e^``log_horizon``.

    The error allowed at lag j is the profile (1 + ``ease`` j / horizon)(1 − 0.175 ``ease`` / j), times what
    is to be found: lags near the horizon weigh least in the output, the first ones most. ``ease`` in 0 … 5.
    """

    def __init__(self, beta: float, log_horizon: float, ease: float = 0.0) -> None:
        self.beta, self.log_horizon, self.ease = beta, log_horizon, ease
        self.horizon = round(float(elementary.exp(log_horizon)))

    def lags(self, density: int) -> Ints:
        """Return the lags to look at, ``density`` of them where the lag grows by a factor of e."""
        count = int(self.log_horizon * density) + 2
        spread = np.rint(elementary.exp(np.arange(count) * (self.log_horizon / (count - 1)))).astype(np.int64)
        head = np.arange(1, min(_ALL_LAGS, self.horizon) + 1)
        return np.unique(np.concatenate([head, np.minimum(spread, self.horizon), [self.horizon]]))

    def scaled(self, lags: Array | Ints) -> tuple[Array, Array]:
        """Return g_j · profile_j and 1 / profile_j."""
        profile = (1.0 + self.ease * lags / self.horizon) * (1.0 - 0.175 * self.ease / lags)
        return gl_weights_at(-self.beta, lags) * profile, 1.0 / profile

    def solve(self, start: Alternation, density: int, level: float) -> Alternation | None:
        """Exchange places until the extrema are equal within ``level``; None where that fails."""
        lags = self.lags(density)
        scale, target = self.scaled(lags)
        fit = start
        for _ in range(_EXCHANGES):
            levelled = self._levelled(fit)
            if levelled is None:
                return None
            fit = levelled
            error = elementary.total(_modes(fit, lags)) / scale - target
            extrema = _extrema(error)
            if len(extrema) != len(fit.places):
                return None
            sizes = np.abs(error[extrema])
            fit = replace(fit, places=lags[extrema])
            if sizes.max() < level * sizes.min():
                return replace(fit, error=float(sizes.max()))
        return None

    def _levelled(self, fit: Alternation) -> Alternation | None:
        """Newton's method for errors of one size and alternating signs at the places of ``fit``."""
        n, signs = fit.modes, np.where(np.arange(2 * fit.modes + 1) % 2, 1.0, -1.0)
        scale, target = self.scaled(fit.places)
        for _ in range(_NEWTONS):
            by_weight = _modes(fit, fit.places) / scale
            by_rate = by_weight * -elementary.exp(fit.log_rates)[:, None] * (fit.places - 1.0)
            jacobian = np.vstack([by_rate, by_weight, -fit.error * signs]).T
            step = _newton_step(jacobian, target + signs * fit.error - elementary.total(by_weight))
            if step is None:
                return None
            largest = np.abs(step).max()
            step *= 0.5 / max(largest, 0.5)
            fit = Alternation(
                fit.log_rates + step[:n],
                fit.log_weights + step[n:-1],
                fit.error * float(elementary.exp(step[-1])),
                fit.places,
            )
            if largest < 0.01 * math.sqrt(fit.error):  # what is left is the square of this step
                return fit if np.all(np.diff(fit.log_rates) > 0) else None
        return None


class Ladder:
    """The best fits with 1, 2, … modes on the lags 1 … ``horizon`` until rounding ends them; found once."""

    def __init__(self, beta: float, horizon: int) -> None:
        self._found: list[Alternation] = []
        self._further = _climb(beta, horizon)

    def __iter__(self) -> Iterator[Alternation]:
        for i in itertools.count():
            if i == len(self._found):
                self._found.extend(itertools.islice(self._further, 1))
            if i == len(self._found):
                return
            yield self._found[i]


@functools.lru_cache(maxsize=16)
def ladder(beta: float, horizon: int) -> Ladder:
    """Return the :class:`Ladder` of (1 − z⁻¹)^(−``beta``) and ``horizon``."""
    return Ladder(beta, horizon)


def _climb(beta: float, horizon: int) -> Iterator[Alternation]:
    goal = float(elementary.log(horizon))
    short = min(goal, 3.0)
    fit = _drawn(beta, _single(Problem(beta, short)), short, goal)
    while fit is not None:
        yield fit
        fit = _one_more(beta, goal, fit)


def eased(beta: float, horizon: int, fit: Alternation, tolerance: float) -> Alternation:
    """Return ``fit``, re-levelled with as much ``ease`` as keeps every lag within ``tolerance``."""
    for ease in _EASES:
        problem = Problem(beta, float(elementary.log(horizon)), ease)
        easier = problem.solve(fit, _FINE, _LEVEL)
        if easier is None or easier.error * (1.0 + ease) > 0.99 * tolerance:
            break
        fit = easier
    return fit


def _modes(fit: Alternation, lags: Array | Ints) -> Array:
    """Every mode at every lag, shape (n, lags)."""
    rates = elementary.exp(fit.log_rates)
    return elementary.exp(fit.log_weights[:, None] - rates[:, None] * (lags - 1.0))


def _newton_step(jacobian: Array, residual: Array) -> Array | None:
    scale = np.abs(jacobian).max(axis=0)
    if not (np.all(scale > 0) and np.all(np.isfinite(jacobian))):
        return None
    with np.errstate(over="ignore", invalid="ignore"):  # a step that no number can hold is none
        step = elementary.solve(jacobian / scale, residual)
        step = None if step is None else step / scale
    return step if step is not None and np.all(np.isfinite(step)) else None


def _extrema(error: Array) -> Array:
    """Return where |error| is largest in each run of one sign."""
    edges = np.flatnonzero(np.diff(np.sign(error))) + 1
    bounds = np.concatenate([[0], edges, [len(error)]])
    return np.array([a + np.argmax(np.abs(error[a:b])) for a, b in itertools.pairwise(bounds)])


def _single(problem: Problem) -> Alternation | None:
    """One mode: start from the one that meets the first and the last weight."""
    last = problem.horizon
    first_weight, last_weight = gl_weights_at(-problem.beta, np.array([1, last]))
    rate = float(elementary.log(first_weight / last_weight)) / (last - 1)
    start = Alternation(elementary.log([rate]), elementary.log([first_weight]), 0.0, np.array([1]))
    lags = problem.lags(_COARSE)
    excess = elementary.total(_modes(start, lags)) / gl_weights_at(-problem.beta, lags) - 1.0
    half = 0.5 * float(excess.max())
    places = np.array([1, lags[np.argmax(excess)], last])
    start = Alternation(start.log_rates, start.log_weights - half, half, places)
    return problem.solve(start, _COARSE, _ROUGH)


def _pair(problem: Problem, single: Alternation) -> Alternation | None:
    """Two modes: the single one carries the last weight, a fast one what the first weight has more."""
    first_weight, last_weight = gl_weights_at(-problem.beta, np.array([1, problem.horizon]))
    goal = problem.log_horizon
    start = Alternation(
        np.array([single.log_rates[0], -0.5 * goal]),
        elementary.log([last_weight, first_weight - last_weight]),
        0.1 * single.error,
        _distinct(goal * np.array([0.0, 0.2, 0.5, 0.8, 1.0]), problem.horizon),
    )
    return problem.solve(start, _FINE, _LEVEL)


def _one_more(beta: float, goal: float, fit: Alternation) -> Alternation | None:
    if fit.modes == 1:
        return _pair(Problem(beta, goal), fit)
    middle = fit.modes // 2
    period = (goal + 2.0) / 3.0
    if fit.modes > 2:
        period = max(0.3, fit.log_rates[middle] - fit.log_rates[middle - 1])
    for stretch in (1.0, 1.2, 0.8, 1.5, 0.65, 2.0):
        longer = Problem(beta, min(goal + period * stretch, _LONGEST))
        grown = longer.solve(_pulled_apart(fit, longer, longer.log_horizon - goal), _COARSE, _ROUGH)
        drawn = _drawn(beta, grown, longer.log_horizon, goal)
        if drawn is not None:
            return drawn
    return None


def _pulled_apart(fit: Alternation, longer: Problem, period: float) -> Alternation:
    """Insert one mode and two places in the middle; what is slower follows the power law of the weights."""
    n, middle = fit.modes, fit.modes // 2
    decay = (1.0 - longer.beta) * period
    rates = np.concatenate([fit.log_rates[: middle + 1] - period, fit.log_rates[middle:]])
    weights = np.concatenate([fit.log_weights[: middle + 1] - decay, fit.log_weights[middle:]])
    places, cut = elementary.log(fit.places), 2 * (n - middle)
    between = places[cut - 1] + period * np.array([0.5, 1.0])
    places = np.concatenate([places[:cut], between, places[cut:] + period])
    return Alternation(rates, weights, fit.error, _distinct(np.sort(places), longer.horizon))


def _drawn(beta: float, fit: Alternation | None, here: float, goal: float) -> Alternation | None:
    """Follow the best fit from the log horizon ``here`` to ``goal``, in as few steps as succeed."""
    step = goal - here
    if fit is not None and step == 0.0:
        return Problem(beta, goal).solve(fit, _FINE, _LEVEL)
    while fit is not None and here != goal:
        there = goal if abs(step) >= abs(goal - here) else here + step
        problem = Problem(beta, there)
        quality = (_FINE, _LEVEL) if there == goal else (_COARSE, _ROUGH)
        moved = problem.solve(_stretched(fit, here, problem), *quality)
        if moved is not None:
            fit, here, step = moved, there, 1.5 * step
        elif abs(step) < 1e-3:
            return None
        else:
            step *= 0.5
    return fit


def _stretched(fit: Alternation, here: float, problem: Problem) -> Alternation:
    """Stretch rates and places in log lag; the error follows exp(−π² n / ln 8R) (Braess, Hackbusch 2005)."""
    factor = problem.log_horizon / here
    rates = fit.log_rates[-1] - factor * (fit.log_rates[-1] - fit.log_rates)
    weights = fit.log_weights + float(elementary.log(factor)) + (1.0 - problem.beta) * (rates - fit.log_rates)
    slope = fit.modes * (math.pi / (here + 3.0 * _LOG_2)) ** 2
    error = min(0.99, fit.error * float(elementary.exp(slope * (problem.log_horizon - here))))
    places = _distinct(elementary.log(fit.places) * factor, problem.horizon)
    return Alternation(rates, weights, error, places)


def _distinct(log_places: Array, horizon: int) -> Ints:
    """Return rising lags nearest to e^``log_places``, the last at the horizon."""
    places = np.rint(elementary.exp(log_places)).astype(np.int64)
    for i in range(1, len(places)):
        places[i] = max(places[i], places[i - 1] + 1)
    places[-1] = max(horizon, places[-1])
    return places


def best_weights(beta: float, horizon: int, poles: Array) -> Array:
    """Return the weights at lag 1 that make the largest relative error small for given ``poles``, shape (n,).

    Least squares, reweighted by Lawson's rule until the largest error no longer falls; −∞ where two poles
    are too close to one another for that.
    """
    lags = Problem(beta, float(elementary.log(horizon))).lags(_SPARSE)
    basis = elementary.powers(poles, lags - 1.0) / gl_weights_at(-beta, lags)
    importance = np.full(len(lags), 1.0 / len(lags))
    best, smallest = np.full(len(poles), -math.inf), math.inf
    for _ in range(_LAWSONS):
        root = np.sqrt(importance)
        weights = elementary.least_squares((root * basis).T, root)
        if weights is None:
            break
        error = np.abs(elementary.total(weights[:, None] * basis) - 1.0)
        if error.max() < smallest:
            best, smallest = weights, float(error.max())
        importance *= error
        importance /= elementary.exact_sum(importance)
    return best
