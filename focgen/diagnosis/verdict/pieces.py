"""What a fit leaves whose parameters may become others at moments of the session, or in one experiment.

The fit's derivatives are known at every sample, so pieces between given moments take a linear equation (G. C.
Chow, Tests of equality between sets of coefficients in two linear regressions, Econometrica 28, 1960). Where
all parameters become others, a piece is by itself, and the best moments are found among all by dynamic
programming (R. Bellman, Communications of the ACM 4, 1961). Where it is one alone, pieces share the others,
and the moments are found one after the other, each looked at anew beside a later one. What they share, and
where the one begins, stays within the bounds of the fit: beyond them the rig would be another from the start.
One experiment that was recorded under other settings is one thing, though it begins and ends at a moment.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from focgen.diagnosis.fitting.fit import FIXED, Fit, Weighing, fit, innovations, jacobian
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.problem import Problem

_CELLS = 200  # of a session, between which a moment may lie
_MOST = 3  # moments
_SHORTEST = 4  # cells between two of them
_PARTS = (1.0, 0.5, 0.25, 0.0)  # of the way that a linear equation goes
_ROUNDS = 8  # of a fit to one piece
_FACTOR = 1.0  # a gain's or a time's logarithm: as far as a piece's may be from that of the fit


@dataclass(frozen=True, eq=False)
class Pieces:
    """Parameters that become others at ``samples`` (m,): in each piece they are ``less`` (m + 1, parameters)
    than those of the fit. ``square``: the sum of squares that a linear equation leaves, or a simulation where
    that leaves more; ``free``: how many numbers the changes take, the moments among them; ``things``: how
    many happened."""

    of_fit: Fit
    samples: tuple[int, ...]
    less: np.ndarray
    square: float
    free: int
    things: int

    @property
    def together(self) -> bool:
        """Whether pieces share all parameters but one, or but the gain as a whole."""
        return self.free <= 2 * len(self.samples)

    def simulated(self, weighing: Weighing) -> Pieces:
        """The same, each piece simulated with parameters of its own: as far on the way to those of the linear
        equation as leaves least, for the rig need not be linear so far off. What pieces share, they share.
        Where that leaves far more than the linear equation, pieces that share nothing are fitted."""
        problem, vector = self.of_fit.problem, self.of_fit.vector
        low, high = _reach(problem, vector)
        ends = list(pairwise([0, *self.samples, len(self.of_fit.innovations)]))
        ways = [vector - np.clip(vector - part * self.less, low, high) for part in _PARTS]

        rows, places = np.unique(np.concatenate(ways), axis=0, return_inverse=True)
        made = [innovations(problem, vector - less, weighing, probe=True) for less in rows]

        def left(row: int, first: int, last: int) -> float:
            part = made[row][first:last]
            return float(part @ part) if np.all(np.isfinite(part)) else np.inf

        each = places.reshape(len(ways), len(ends))  # what pieces share is simulated once
        squares = np.array([[left(row, *end) for row, end in zip(way, ends)] for way in each])
        best = np.argmin(squares, axis=0)
        if self.together:
            best = np.full(len(ends), np.argmin(np.sum(squares, axis=1)))
        kept = np.stack([ways[k][i] for i, k in enumerate(best)])
        square = float(np.sum(squares[best, np.arange(len(ends))]))
        if not self.together and self.square < NUMBERS.unlikely * square:
            starts = [[kept[i], ways[0][i]] if k else [kept[i]] for i, k in enumerate(best)]
            kept, square = self._fitted(starts, ends, weighing)
        return replace(self, less=kept, square=max(self.square, square))

    def _fitted(
        self, starts: Sequence[Sequence[np.ndarray]], ends: Sequence[tuple[int, int]], weighing: Weighing
    ) -> tuple[np.ndarray, float]:
        """What the parameters of each piece are less where they are fitted to it, from the best of its
        ``starts``, and the sum of squares that all pieces leave."""
        problem, vector = self.of_fit.problem, self.of_fit.vector
        low, high = _reach(problem, vector)
        less, square = [], 0.0
        for each, (first, last) in zip(starts, ends, strict=True):
            fitted = (_to_piece(problem, vector - start, first, last, weighing) for start in each)
            found = [np.clip(to_piece, low, high) for to_piece in fitted]
            left = [float(np.sum(innovations(problem, v, weighing)[first:last] ** 2)) for v in found]
            least = int(np.argmin(left))
            less.append(vector - found[least])
            square += left[least]
        return np.stack(less), square

    def changes(self) -> Iterator[tuple[int, np.ndarray]]:
        """Each moment's sample, and by how much more leaves the segment from there on until the next (n,), in
        its unit, than would without the change."""
        problem, vector = self.of_fit.problem, self.of_fit.vector
        made = [problem.simulate(vector - less, probe=True) for less in self.less]
        for (before, after), (first, last) in zip(pairwise(made), pairwise([*self.samples, len(made[0])])):
            yield first, after[first:last] - before[first:last]


def pieces(of: Fit, weighing: Weighing) -> Iterator[Pieces]:
    """For one moment, two and three: the best with all parameters others; with each of the rig's own alone;
    with its gain as a whole. And for one experiment, with one alone."""
    cells, spans = _Cells.of(of, weighing), of.problem.segment.run.spans
    yield from cells.all_others()
    for way in _own_ways(of.problem, of.vector, cells.ways):
        yield from cells.one_other(way)
        yield from cells.one_experiment(way, spans[1:-1])  # the others have a moment at one end


def _to_piece(problem: Problem, start: np.ndarray, first: int, last: int, weighing: Weighing) -> np.ndarray:
    """The vector that fits the samples from ``first`` to ``last``, from ``start``, as far as a piece's may be
    from what was known."""
    seen = np.zeros(len(problem.segment.trust))
    seen[first:last] = 1.0
    piece = replace(_far(problem), segment=problem.segment.seen_at(seen))
    return fit(piece, start, weighing, _ROUNDS).vector


def _own_ways(problem: Problem, vector: np.ndarray, ways: np.ndarray) -> Iterator[np.ndarray]:
    """Along ``ways`` (k, parameters), each of the rig's own parameters (k,), and its gain as a whole."""
    own = len(problem.nominal_start)
    yield from (single for single in np.eye(len(ways)) if (single @ ways)[:own].any())
    gain = ways[:, :own] @ problem.nominals.gain_way(vector[:own])
    if np.count_nonzero(gain) > 1:
        yield gain


@dataclass(frozen=True, eq=False)
class _Cells:
    """What a fit's innovations and their derivatives along its ``ways`` (k, parameters) make, summed up to
    the ``ends`` (cells + 1,) of cells, in samples: ``normal`` (cells + 1, k, k), ``slope`` (cells + 1, k) and
    ``square`` (cells + 1,). ``ridge`` (k, k): what is known of the nuisances beforehand; ``least`` and
    ``most`` (k,): by what the bounds let parameters be less."""

    of_fit: Fit
    ways: np.ndarray
    ends: np.ndarray
    normal: np.ndarray
    slope: np.ndarray
    square: np.ndarray
    ridge: np.ndarray
    least: np.ndarray
    most: np.ndarray

    @classmethod
    def of(cls, of_fit: Fit, weighing: Weighing) -> _Cells:
        problem = of_fit.problem
        low, high = problem.bounds()
        now, ways = innovations(problem, of_fit.vector, weighing), np.eye(len(low))[high - low > FIXED]
        rows = ways @ jacobian(problem, of_fit.vector, now, weighing, low, high)[:-1]
        ends = _ends(problem, len(now))
        cells = [(rows[:, a:b], now[a:b]) for a, b in pairwise(ends)]
        normal = _summed([r @ r.T for r, _ in cells])
        ridge = ways @ _known(problem) * float(now @ now) / len(now)
        ridge = np.diag(ridge + 1e-9 * np.trace(normal[-1]))
        slope, square = _summed([r @ x for r, x in cells]), _summed([np.array(x @ x) for _, x in cells])
        least, most = ways @ (of_fit.vector - high), ways @ (of_fit.vector - low)
        return cls(of_fit, ways, ends, normal, slope, square, ridge, least, most)

    def all_others(self) -> Iterator[Pieces]:
        """All parameters become others."""
        count = len(self.ends) - 1
        a, b = np.triu_indices(count + 1, _SHORTEST)
        cost = np.full((count + 1, count + 1), np.inf)
        cost[a, b] = self._piece(a, b)[1]
        least, places = cost[0], [()] * (count + 1)
        for _ in range(_MOST):
            ways = least[:, None] + cost
            last = np.argmin(ways, axis=0)
            least, places = np.min(ways, axis=0), [(*places[i], int(i)) for i in last]
            if np.isfinite(least[-1]):
                edges = np.array([0, *places[-1], count])
                moved = self._piece(edges[:-1], edges[1:])[0]
                yield self._made(places[-1], moved @ self.ways, least[-1], len(self.ways))

    def _piece(self, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of pieces from cells ``a`` to cells ``b`` (m,): what their parameters are less (m, k), and the sums
        of squares that they leave (m,)."""
        normal = self.normal[b] - self.normal[a] + self.ridge
        slope = self.slope[b] - self.slope[a]
        moved = np.linalg.solve(normal, slope[..., None])[..., 0]
        return moved, self.square[b] - self.square[a] - np.sum(moved * slope, axis=1)

    def one_other(self, way: np.ndarray) -> Iterator[Pieces]:
        """Only along ``way`` (k,) they become others; the rest of them is one for all pieces."""
        cuts: tuple[int, ...] = ()
        for _ in range(_MOST):
            added = self._one_more(way, cuts)
            if added is None:
                return
            cuts = (*cuts, added)
            for cut in cuts[:-1]:
                held = tuple(c for c in cuts if c != cut)
                cuts = (*held, self._one_more(way, held) or cut)
            cuts = tuple(sorted(cuts))
            shared, by, square = self._shared(way, np.array([cuts]))
            steps = np.cumsum([0.0, *by[0]])
            less = (shared[0] + steps[:, None] * way) @ self.ways
            yield self._made(cuts, less, float(square[0]), 1)

    def _one_more(self, way: np.ndarray, held: tuple[int, ...]) -> int | None:
        """The cell at whose beginning one more moment leaves least beside those ``held``; None where there is
        no room."""
        free = np.arange(_SHORTEST, len(self.ends) - _SHORTEST)
        for cut in held:
            free = free[np.abs(free - cut) >= _SHORTEST]
        if not len(free):
            return None
        cuts = np.column_stack([np.broadcast_to(held, (len(free), len(held))), free]).astype(int)
        return int(free[np.argmin(self._shared(way, cuts)[2])])

    def one_experiment(self, way: np.ndarray, spans: Sequence[tuple[int, int]]) -> Iterator[Pieces]:
        """Only along ``way`` (k,) another, and only within one of ``spans``, in samples."""
        first, last = np.searchsorted(self.ends, np.array(spans, int).reshape(-1, 2).T)
        wide = last > first
        if not wide.any():
            return
        first, last = first[wide], last[wide]
        shared, moved, square = self._apart(way, first[:, None], last[:, None])
        k = int(np.argmin(square))
        less = (shared[k] + np.array([[0.0], moved[k], [0.0]]) * way) @ self.ways
        yield replace(self._made((first[k], last[k]), less, square[k], 1), free=2, things=1)

    def _shared(self, way: np.ndarray, cuts: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """For rows of ``cuts`` (r, m): what all parameters are less (r, k), by what they become less along
        ``way`` at each (r, m), and the sums of squares that are left (r,)."""
        return self._apart(way, cuts, np.full_like(cuts, len(self.ends) - 1))

    def _apart(
        self, way: np.ndarray, first: np.ndarray, last: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """For rows of stretches from cells ``first`` to cells ``last`` (r, m): what all parameters are less
        (r, k), by what they are less along ``way`` in each (r, m), and the sums of squares that are left
        (r,)."""
        (r, m), k = first.shape, len(self.slope[-1])
        begin = np.maximum(first[:, :, None], first[:, None, :])
        end = np.maximum(np.minimum(last[:, :, None], last[:, None, :]), begin)
        normal, slope = np.zeros((r, k + m, k + m)), np.zeros((r, k + m))
        normal[:, :k, :k] = self.normal[-1] + self.ridge
        normal[:, k:, :k] = (self.normal[last] - self.normal[first]) @ way
        normal[:, :k, k:] = np.swapaxes(normal[:, k:, :k], 1, 2)
        normal[:, k:, k:] = (self.normal[end] - self.normal[begin]) @ way @ way + np.eye(m) * (
            way @ self.ridge @ way
        )
        slope[:, :k], slope[:, k:] = self.slope[-1], (self.slope[last] - self.slope[first]) @ way
        any_more = np.full(m, np.inf)
        moved = _bounded(normal, slope, np.r_[self.least, -any_more], np.r_[self.most, any_more])
        left = np.einsum("ri,rij,rj->r", moved, normal, moved) - 2.0 * np.sum(moved * slope, axis=1)
        return moved[:, :k], moved[:, k:], self.square[-1] + left

    def _made(self, cuts: tuple[int, ...], less: np.ndarray, square: float, each: int) -> Pieces:
        samples = tuple(int(self.ends[c]) for c in cuts)
        return Pieces(self.of_fit, samples, less, float(square), len(cuts) * (each + 1), len(cuts))


def _bounded(normal: np.ndarray, slope: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Solutions (r, k) of normal equations (r, k, k) within bounds (k,). What would pass its bound by most
    stays there, one after the other; that leaves the least unless one of them had better come back."""
    held, ends = np.zeros(slope.shape, bool), np.zeros(slope.shape)
    diagonal = np.arange(slope.shape[1])
    for _ in range(len(diagonal) + 1):
        free = np.where(held[:, :, None] | held[:, None, :], 0.0, normal)
        free[:, diagonal, diagonal] += held
        right = np.where(held, ends, slope - np.einsum("rij,rj->ri", normal, ends))
        moved = np.linalg.solve(free, right[..., None])[..., 0]
        beyond = np.where(held, 0.0, np.maximum(np.maximum(low - moved, moved - high), 0.0))
        if not beyond.any():
            break
        passing = (beyond > 0.0) & (beyond == np.max(beyond, axis=1, keepdims=True))  # the furthest first
        held, ends = held | passing, np.where(passing, np.clip(moved, low, high), ends)
    return moved


def _ends(problem: Problem, count: int) -> np.ndarray:
    """Where cells end: they are alike, and an experiment begins with one."""
    even = np.linspace(0, count, min(_CELLS, count // 10) + 1).astype(int)
    begun = [first for first, _ in problem.segment.run.spans if first < count]
    made: np.ndarray = np.union1d(even, begun) if len(begun) <= len(even) else even
    return made


def _far(problem: Problem) -> Problem:
    return replace(problem, nominals=replace(problem.nominals, far=True), memory={})


def _reach(problem: Problem, vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper bounds of what a piece is simulated with: what was known of the rig's own parameters
    holds no more behind a moment."""
    low, high = _far(problem).bounds()
    own = len(problem.nominal_start)
    factors = slice(own - len(problem.nominals.factors), own)
    low[factors], high[factors] = vector[factors] - _FACTOR, vector[factors] + _FACTOR
    return low, high


def _known(problem: Problem) -> np.ndarray:
    """The inverse variances (k,) of what is known of the parameters: nothing of those of the rig, for what
    was known holds no more behind a moment."""
    known = problem.known[1].copy()
    known[: len(problem.nominal_start)] = 0.0
    return known


def _summed(parts: list[np.ndarray]) -> np.ndarray:
    """Sums of the parts ahead of each end."""
    made: np.ndarray = np.concatenate([np.zeros((1, *parts[0].shape)), np.cumsum(parts, axis=0)])
    return made
