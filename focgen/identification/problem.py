"""The least-squares problem of K(p) p through e^(−Ls)/(T s^α + 1), linear parameters projected out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.signal import lfilter

from focgen.arrays import Array
from focgen.identification.excitation import Excitation
from focgen.identification.kernel import Kernels, kernels
from focgen.identification.past import Past, columns, latest
from focgen.present import present

_LONGEST = 60.0  # |log τ|, τ in s
_DELAYS = 0.25  # of the shortest experiment: dead times are looked for up to here
_NUDGE = 0.02  # of a sample: for the derivative by the dead time
_GRID_ALPHAS, _GRID_TAUS = (0.5, 0.9, 1.4), 8
_SEARCHED, _FEWEST = 60_000, 4000  # samples that the search looks at: of all experiments, of each at least
_RESPONDS = 0.3  # of an experiment's spread: its beginning shows a response
_BLOCK = 50_000  # rows that are decomposed at once
_SECOND = 4.0  # times the best cost: a start of another order is tried up to here


@dataclass(frozen=True, eq=False)
class Point:
    """A trial ``x``, see :class:`Problem`, and what follows from it linearly.

    ``gain`` (powers,); ``offsets``, and ``amounts`` of the past's steps, of each experiment; ``cost``: the
    sum of squares, scaled.
    """

    x: Array
    gain: Array
    offsets: list[float]
    amounts: list[Array]
    cost: float


@dataclass(frozen=True, eq=False)
class _Local:
    """What an experiment has for itself, an offset and a past: an orthonormal basis of it, prior rows
    below."""

    basis: Array
    triangle: Array
    rows: int

    def without(self, columns: Array) -> Array:
        """Columns (k, n) with the local ones projected out, prior rows appended: (k, n + rows)."""
        padded = np.hstack([columns, np.zeros((len(columns), self.rows))])
        return padded - (padded @ self.basis) @ self.basis.T

    def amounts(self, left: Array) -> Array:
        """The local coefficients that explain ``left`` (n,) best."""
        padded = np.concatenate([left, np.zeros(self.rows)])
        return np.linalg.solve(self.triangle, self.basis.T @ padded)


class Problem:
    """Experiments that share T, α, K(p) and the dead time, each scaled by its own spread so that all weigh
    alike.

    ``x`` is (log τ, α), then the dead time in samples of the first experiment where it is ``delay_free``,
    then log(θ + 1), θ in samples, of every step of a past. ``pasts``: an unknown past for each experiment, or
    None for a begin at rest;
    ``penalties``: the variance (scaled) that weighs a past's prior against the data. ``whitening``: for each
    experiment the autoregressive filter [1, a₁, …] that makes its residual white, None where it is taken as
    it is.
    """

    ALPHAS = (0.05, 1.95)

    def __init__(
        self,
        experiments: Sequence[Excitation],
        pasts: Sequence[Past | None],
        delay_free: bool,
        delay: float = 0.0,
        penalties: Sequence[float] | None = None,
        whitening: Sequence[Array | None] | None = None,
    ) -> None:
        self.experiments, self.pasts = tuple(experiments), tuple(pasts)
        self.delay_free, self.delay = delay_free, delay
        self.step = experiments[0].step
        self.weights = [1.0 / x.spread for x in experiments]
        self.penalties = list(penalties) if penalties is not None else [1e-4] * len(experiments)
        self.whitening = tuple(whitening) if whitening is not None else (None,) * len(experiments)
        self.core = 2 + delay_free
        ends = self.core + np.cumsum([0, *(p.steps if p else 0 for p in self.pasts)])
        self.of_past = [slice(int(a), int(b)) for a, b in pairwise(ends)]
        self._low, self._high, self._most = self._edges()
        self._store: dict[tuple[str, int], tuple[bytes, Any]] = {}

    def with_whitening(self, filters: Sequence[Array | None], penalties: Sequence[float]) -> Problem:
        """The same seen through these filters, for residuals of these variances behind them."""
        return Problem(self.experiments, self.pasts, self.delay_free, self.delay, penalties, filters)

    def _edges(self) -> tuple[Array, Array, Array]:
        """The least and the largest ``x`` that make sense, and the longest step in one round."""
        late = delay_reach(self.experiments) / self.step
        rows = [(-_LONGEST, _LONGEST, 2.0), (*self.ALPHAS, 0.3)]
        rows += [(0.0, late, 0.1 * late + 2.0)] * self.delay_free
        for x, past in zip(self.experiments, self.pasts):
            rows += [(0.0, float(np.log(latest(x))), 1.0)] * (past.steps if past else 0)
        low, high, most = np.array(rows).T
        return low, high, most

    @property
    def latest(self) -> float:
        """The longest dead time that is looked for, samples."""
        return delay_reach(self.experiments) / self.step

    def inside(self, x: Array) -> Array:
        """``x`` within what makes sense."""
        return np.clip(x, self._low, self._high)

    def short(self, step: Array) -> Array:
        """A step no longer than the linear model can be trusted."""
        return step / max(1.0, float(np.max(np.abs(step) / self._most)))

    def delay_at(self, x: Array) -> float:
        """The dead time in s."""
        return float(x[2]) * self.step if self.delay_free else self.delay

    def kernels(self, x: Array, i: int, nudge: float = 0.0) -> Kernels:
        """The kernels of experiment ``i``; ``nudge``: samples added to the dead time."""
        run = self.experiments[i]
        count = run.stepped.count if self.pasts[i] is not None else len(run)
        return self.kernels_for(run, x, count, nudge)

    def kernels_for(self, run: Excitation, x: Array, count: int, nudge: float = 0.0) -> Kernels:
        """The kernels of so many samples."""
        delay = max(self.delay_at(x) + nudge * self.step, 0.0) + run.late
        return kernels(float(x[0]), float(x[1]), run.step, count, delay)

    # -- the value at a trial -------------------------------------------------------------------------------

    def at(self, x: Array) -> Point:
        """The trial ``x`` with the best gain."""
        parts = [self._value(x, i) for i in range(len(self.experiments))]
        stacked = np.vstack([_triangle(np.vstack([drives, [target]])) for drives, target, _ in parts])
        gain = np.linalg.lstsq(stacked[:, :-1], stacked[:, -1], rcond=None)[0]
        cost, offsets, amounts = 0.0, [], []
        for i, (drives, target, local) in enumerate(parts):
            left = target - gain @ drives
            cost += float(left @ left)
            raw = self.weights[i] * (self.experiments[i].measured - gain @ self._responses(x, i)[0])
            found = local.amounts(self.white(i, raw[None])[0])
            offsets.append(float(found[0]))
            amounts.append(found[1:])
        return Point(np.array(x, float), gain, offsets, amounts, cost)

    def _value(self, x: Array, i: int) -> tuple[Array, Array, _Local]:
        """Drives and target of an experiment, scaled, its local columns projected out."""
        local, w = self._local(x, i), self.weights[i]
        columns = w * np.vstack([self._responses(x, i)[0], self.experiments[i].measured])
        rows = local.without(self.white(i, columns))
        return rows[:-1], rows[-1], local

    def white(self, i: int, columns: Array) -> Array:
        """Columns (k, n) through the experiment's whitening filter; nothing counts until that is filled."""
        whitening = self.whitening[i]
        if whitening is None or not len(columns):
            return columns
        white: Array = lfilter(whitening, [1.0], columns, axis=1)
        white[:, : len(whitening) - 1] = 0.0
        return white

    def _responses(self, x: Array, i: int) -> Array:
        """Rows × powers × n."""
        make = lambda: self.experiments[i].respond(self.kernels(x, i))
        made: Array = self._kept("responses", i, x[: self.core], make)
        return made

    def _columns(self, x: Array, i: int) -> Array:
        """Rows × steps × n of the past, older ones last, the last row by log(θ + 1)."""
        when = self.when(x, i)
        make = lambda: columns(self.experiments[i], self.kernels(x, i), when)
        made: Array = self._kept("past", i, np.append(x[: self.core], when), make)
        return made

    def local(self, i: int) -> _Local:
        """The offset of an experiment that begins at rest."""
        made: _Local = self._kept("at rest", i, np.empty(0), lambda: self._made_local(np.empty(0), i, True))
        return made

    def when(self, x: Array, i: int) -> Array:
        """The times of all steps of an experiment's past, samples before its first one."""
        return np.concatenate([np.exp(x[self.of_past[i]]) - 1.0, present(self.pasts[i]).older])

    def _local(self, x: Array, i: int, offset: bool = True) -> _Local:
        make = lambda: self._made_local(x, i, offset)
        made: _Local = self._kept(f"local {offset}", i, np.append(x[: self.core], x[self.of_past[i]]), make)
        return made

    def _made_local(self, x: Array, i: int, offset: bool) -> _Local:
        n, w, past = len(self.experiments[i]), self.weights[i], self.pasts[i]
        level = np.full((int(offset), n), w)
        if past is None:
            basis = self.white(i, level).T
            sizes = np.linalg.norm(basis, axis=0)
            return _Local(basis / sizes, np.diag(sizes), 0)
        made = np.vstack([level, w * self._columns(x, i)[0]])
        prior = np.zeros((len(past.reaches), len(made)))
        prior[:, int(offset) :] = np.diag(np.sqrt(self.penalties[i]) / past.reaches)
        return _Local(*np.linalg.qr(np.vstack([self.white(i, made).T, prior])), len(prior))

    def _kept(self, what: str, i: int, x: Array, make: Callable[[], Any]) -> Any:
        """What was made for the last trial."""
        key = x.tobytes()
        found = self._store.get((what, i))
        if found is None or found[0] != key:
            del found
            self._store.pop((what, i), None)  # before the new one takes its memory
            found = self._store[what, i] = key, make()
        return found[1]  # whatever its making has left in the store

    # -- derivatives ----------------------------------------------------------------------------------------

    def _slopes(self, point: Point, i: int) -> Array:
        """Derivatives of an experiment's scaled output by those of ``x`` that it depends on; see
        :meth:`_own`."""
        x, w = point.x, self.weights[i]
        slopes = np.einsum("rmn,m->rn", self._responses(x, i)[1:], point.gain)
        if self.pasts[i] is not None:
            slopes = slopes + np.einsum("rjn,j->rn", self._columns(x, i)[1:3], point.amounts[i])
        if self.delay_free:
            slopes = np.vstack([slopes, self._by_delay(point, i)])
        if self.pasts[i] is not None:
            late, count = self._columns(x, i)[3], present(self.pasts[i]).steps
            slopes = np.vstack([slopes, late[:count] * point.amounts[i][:count, None]])
        return self.white(i, w * slopes)

    def _own(self, i: int) -> Array:
        """Which of ``x`` an experiment depends on."""
        here = self.of_past[i]
        return np.concatenate([np.arange(self.core), np.arange(here.start, here.stop)])

    def _by_delay(self, point: Point, i: int) -> Array:
        """The derivative by the dead time, a sample."""
        run = self.experiments[i]
        low = min(_NUDGE, float(point.x[2]))
        ends = []
        for nudge in (_NUDGE, -low):
            made = self.kernels(point.x, i, nudge)
            value = point.gain @ run.respond(made, 1)[0]
            if self.pasts[i] is not None:
                value = value + point.amounts[i] @ columns(run, made, self.when(point.x, i), 1)[0]
            ends.append(value)
        found: Array = (ends[0] - ends[1]) / (_NUDGE + low)
        return found

    def jacobians(self, point: Point, offset: bool = False) -> list[Array]:
        """Derivatives of each experiment's scaled output by x and gain, (n + prior rows, parameters), its
        local columns and those of its noise model projected out; ``offset``: the offset is the last column
        instead.
        """
        found = []
        for i, x in enumerate(self.experiments):
            w, slopes = self.weights[i], np.zeros((len(point.x), len(x)))
            slopes[self._own(i)] = self._slopes(point, i)
            rows = [slopes, self.white(i, w * self._responses(point.x, i)[0])]
            if offset:
                rows.append(self.white(i, np.full((1, len(x)), w)))
            alone = self._local(point.x, i, not offset).without(np.vstack(rows)).T
            found.append(self._without_noise_model(point, i, alone))
        return found

    def _without_noise_model(self, point: Point, i: int, rows: Array) -> Array:
        """Rows without what the whitening filter's own coefficients can make up for: in a closed loop they
        answer the same disturbance as the model."""
        whitening = self.whitening[i]
        if whitening is None:
            return rows
        residual, n = self.residuals(point)[i], len(self.experiments[i])
        order = len(whitening) - 1
        past = np.zeros((len(rows), order))
        for k in range(1, order + 1):
            past[order:n, k - 1] = residual[order - k : n - k]
        return rows - past @ np.linalg.lstsq(past, rows, rcond=1e-10)[0] if order else rows

    def projected_slope(self, point: Point) -> tuple[Array, Array]:
        """The derivative of the projected residual by ``x``, and that residual, compressed to a few rows."""
        parts, powers = [], len(point.gain)
        for i in range(len(self.experiments)):
            drives, target, local = self._value(point.x, i)
            slopes = local.without(self._slopes(point, i))
            triangle = _triangle(np.vstack([drives, slopes, [target - point.gain @ drives]]))
            whole = np.zeros((len(triangle), powers + len(point.x) + 1))
            places = [*range(powers), *(powers + self._own(i)), whole.shape[1] - 1]
            whole[:, places] = triangle
            parts.append(whole)
        triangle = _triangle(np.vstack(parts).T)
        below = triangle[powers:, powers:]  # what the gain cannot make up for
        return below[:, :-1], -below[:, -1]

    # -- results --------------------------------------------------------------------------------------------

    def from_rest(self, point: Point, i: int) -> Array:
        """The output of experiment ``i`` without offset and past."""
        made: Array = point.gain @ self._responses(point.x, i)[0]
        return made

    def simulated(self, point: Point) -> list[Array]:
        """The model's output in each experiment, offset and past included."""
        found = []
        for i in range(len(self.experiments)):
            y = self.from_rest(point, i) + point.offsets[i]
            if self.pasts[i] is not None:
                y = y + point.amounts[i] @ self._columns(point.x, i)[0]
            found.append(y)
        return found

    def residuals(self, point: Point, white: bool = False) -> list[Array]:
        """Model − measured of each experiment, scaled, and ``white`` through its filter."""
        made = self.simulated(point)
        rows: list[Array] = [w * (y - x.measured) for w, y, x in zip(self.weights, made, self.experiments)]
        return [self.white(i, row[None])[0] for i, row in enumerate(rows)] if white else rows


def delay_reach(experiments: Sequence[Excitation]) -> float:
    """The longest dead time that is looked for, s."""
    return _DELAYS * min(len(x) * x.step for x in experiments)


def _triangle(columns: Array) -> Array:
    """R of the QR decomposition of columns (k, n), a block of rows after the other."""
    n = columns.shape[1]
    parts = [np.linalg.qr(columns[:, i : i + _BLOCK].T, mode="r") for i in range(0, n, _BLOCK)]
    if len(parts) == 1:
        alone: Any = parts[0]
        return np.asarray(alone)
    whole: Any = np.linalg.qr(np.vstack(parts), mode="r")
    made: Array = whole
    return made


def starts(problem: Problem) -> list[Array]:
    """The best point of a coarse grid, and the best of another order where it comes near."""
    found = sorted((_best_of_order(problem, alpha) for alpha in _GRID_ALPHAS), key=lambda each: each[0])
    return [x for cost, x in found[:2] if cost <= _SECOND * found[0][0]]


def shortened(problem: Problem) -> Problem:
    """The problem with no more than the first samples of long experiments, each from rest; itself where it is
    short, or where those first samples show no response."""
    if sum(map(len, problem.experiments)) <= _SEARCHED:
        return problem
    count = max(_SEARCHED // len(problem.experiments), _FEWEST)
    chosen = [x.beginning(count) for x in problem.experiments]
    if any(x.spread < _RESPONDS * whole.spread for x, whole in zip(chosen, problem.experiments)):
        return problem
    none = (None,) * len(chosen)
    return Problem(chosen, none, problem.delay_free, problem.delay, whitening=problem.whitening)


def _best_of_order(problem: Problem, alpha: float) -> tuple[float, Array]:
    longest = max(len(x) * x.step for x in problem.experiments)
    taus = np.geomspace(2.0 * problem.step, longest, _GRID_TAUS)
    return min((_best_delay(problem, np.log(tau), alpha) for tau in taus), key=lambda each: each[0])


def _best_delay(problem: Problem, log_tau: float, alpha: float) -> tuple[float, Array]:
    """Cost and place of the best dead time on the grid, in whole samples."""
    lags = [0]
    if problem.delay_free:
        lags += sorted({round(k) for k in np.geomspace(1.0, max(problem.latest, 1.0), 12)})
    x = np.array([log_tau, alpha, 0.0])[: 2 + problem.delay_free]
    made = [run.respond(problem.kernels(x, i), 1)[0] for i, run in enumerate(problem.experiments)]
    costs = [_cost_of(problem, made, lag) for lag in lags]
    best = int(np.argmin(costs))
    if problem.delay_free:
        x[2] = lags[best]
    return costs[best], x


def _cost_of(problem: Problem, made: list[Array], lag: int) -> float:
    """The sum of squares where each response comes ``lag`` samples of the first experiment later."""
    parts = []
    for i, (run, response, w) in enumerate(zip(problem.experiments, made, problem.weights)):
        by = round(lag * problem.step / run.step)
        late = np.hstack([np.zeros((len(response), by)), response])[:, : len(run)]
        local = problem.local(i)
        parts.append(_triangle(local.without(problem.white(i, w * np.vstack([late, run.measured])))))
    triangle = _triangle(np.vstack(parts).T)
    return float(triangle[-1, -1] ** 2)
