"""What least squares leave where parameters become others at a moment, against every moment tried by itself.

Red when a better moment is missed, when a bound is passed, when what is shared differs between the pieces, or
when a step beyond what is linear counts as kept.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from focgen.diagnosis.verdict import pieces
from focgen.diagnosis.verdict.pieces import _bounded, _Cells, _summed

N, WIDE, K = 300, 10, 3


def cells(rng, jump, at, low=-np.inf, high=np.inf):
    """Innovations that ``jump`` (K,) changes from cell ``at`` on; and by sample the rows, the innovations."""
    rows, now = rng.normal(size=(K, N)), 0.2 * rng.normal(size=N)
    late = np.arange(N) >= at * WIDE
    now = now + np.array([0.5, -0.4, 0.3]) @ rows + (jump @ rows) * late
    parts = [(rows[:, a : a + WIDE], now[a : a + WIDE]) for a in range(0, N, WIDE)]
    made = _Cells(
        None,
        np.eye(K),
        np.arange(0, N + 1, WIDE),
        _summed([r @ r.T for r, _ in parts]),
        _summed([r @ x for r, x in parts]),
        _summed([np.array(x @ x) for _, x in parts]),
        np.zeros((K, K)),
        np.full(K, low),
        np.full(K, high),
    )
    return made, rows, now


def tried(rows, now, ways, low=-np.inf, high=np.inf):
    """For every sample a cell begins with, what is left with ``ways`` (m, K) of their own from there on."""
    left = {}
    for first in range(4 * WIDE, N - 4 * WIDE + 1, WIDE):
        late = (ways @ rows) * (np.arange(N) >= first)
        table = np.vstack([rows, late]).T
        any_more = np.full(len(ways), np.inf)
        ends = np.r_[np.full(K, low), -any_more], np.r_[np.full(K, high), any_more]
        left[first] = 2.0 * lsq_linear(table, now, ends).cost
    return left


@pytest.mark.parametrize("seed", range(5))
def test_the_best_moment_of_one_parameter_is_found(seed):
    rng, way = np.random.default_rng(seed), np.array([0.0, 1.0, 0.0])
    made, rows, now = cells(rng, 0.4 * way, at=12)
    one = next(iter(made.one_other(way)))
    left = tried(rows, now, way[None])
    assert one.samples == (min(left, key=left.get),) and one.free == 2
    assert one.square == pytest.approx(min(left.values()), rel=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_the_best_moment_of_all_parameters_is_found(seed):
    made, rows, now = cells(np.random.default_rng(seed), np.array([0.3, 0.3, -0.3]), at=17)
    one = next(iter(made.all_others()))
    left = tried(rows, now, np.eye(K))
    assert one.samples == (min(left, key=left.get),) and one.free == K + 1
    assert one.square == pytest.approx(min(left.values()), rel=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_two_moments_of_one_parameter_there_and_back(seed):
    rng, way = np.random.default_rng(seed), np.array([1.0, 0.0, 0.0])
    made, rows, now = cells(rng, 0.8 * way, at=8)
    back = np.arange(N) >= 20 * WIDE
    there = cells_of(rows, now - 0.8 * rows[0] * back, made)
    two = list(there.one_other(way))[1]
    assert two.samples == (8 * WIDE, 20 * WIDE)
    by = np.diff(two.less, axis=0)
    assert np.allclose(by[:, 0], [0.8, -0.8], atol=0.1) and np.all(by[:, 1:] == 0.0)


def cells_of(rows, now, like):
    """The cells of other innovations."""
    parts = [(rows[:, a : a + WIDE], now[a : a + WIDE]) for a in range(0, N, WIDE)]
    slope, square = _summed([r @ x for r, x in parts]), _summed([np.array(x @ x) for _, x in parts])
    return _Cells(None, like.ways, like.ends, like.normal, slope, square, like.ridge, like.least, like.most)


def test_what_pieces_share_stays_within_its_bounds():
    """Beyond them the rig would be another from the start, and a moment is credited with what is none."""
    rng, way = np.random.default_rng(1), np.array([0.0, 0.0, 1.0])
    free, rows, now = cells(rng, np.zeros(K), at=12)
    near, _, _ = cells(np.random.default_rng(1), np.zeros(K), 12, low=-0.1, high=0.1)
    left = tried(rows, now, way[None], -0.1, 0.1)
    one = next(iter(near.one_other(way)))
    assert one.square == pytest.approx(min(left.values()), rel=0.02)
    assert one.square > 2.0 * next(iter(free.one_other(way))).square


@pytest.mark.parametrize("seed", range(40))
def test_bounded_solutions_are_the_best_within_bounds(seed):
    rng = np.random.default_rng(seed)
    table, right = rng.normal(size=(12, 4)), rng.normal(size=12)
    low, high = -rng.uniform(0.05, 0.3, 4), rng.uniform(0.05, 0.3, 4)
    (moved,) = _bounded((table.T @ table)[None], (table.T @ right)[None], low, high)
    best = lsq_linear(table, right, (low, high), method="bvls").cost
    assert np.all(moved >= low) and np.all(moved <= high)
    assert 0.5 * np.sum((table @ moved - right) ** 2) == pytest.approx(best, rel=1e-3)


@pytest.mark.parametrize("seed", range(5))
def test_the_best_experiment_of_another_parameter_is_found(seed):
    rng, way = np.random.default_rng(seed), np.array([0.0, 1.0, 0.0])
    made, rows, now = cells(rng, np.zeros(K), at=0)
    spans = [(40, 100), (100, 180), (180, 260)]
    inside = [(a <= np.arange(N)) & (np.arange(N) < b) for a, b in spans]
    there = cells_of(rows, now + 0.5 * rows[1] * inside[1], made)
    (one,) = there.one_experiment(way, spans)
    left = [
        np.linalg.lstsq(np.vstack([rows, rows[1] * i]).T, now + 0.5 * rows[1] * inside[1], rcond=None)[1][0]
        for i in inside
    ]
    assert one.samples == spans[1] and (one.free, one.things) == (2, 1)
    assert one.square == pytest.approx(min(left), rel=1e-9)
    assert np.allclose(np.diff(one.less, axis=0)[:, 1], [0.5, -0.5], atol=0.1)


class _Bent:
    """Samples that a parameter moves by its sine, and another one by itself; and what they are fitted to."""

    nominal_start = np.zeros(2)

    def __init__(self, rows, y):
        self.rows, self.y = rows, y

    def made(self, vector):
        return np.sin(vector[0]) * self.rows[0] + vector[1] * self.rows[1]


@pytest.fixture
def bent(monkeypatch):
    """A fit at 0, its second parameter bounded by 0.4."""
    rng = np.random.default_rng(2)
    rows = rng.normal(size=(2, N))
    problem = _Bent(rows, np.zeros(N))
    monkeypatch.setattr(pieces, "innovations", lambda p, v, w, probe=False: p.y - p.made(v))
    monkeypatch.setattr(pieces, "_reach", lambda p, v: (np.array([-9.0, -0.4]), np.array([9.0, 0.4])))
    monkeypatch.setattr(pieces, "_to_piece", lambda p, start, first, last, w: start)  # what a fit begins with
    problem.simulate = lambda v, probe=False: problem.made(v)
    return problem


def _cut(problem, less, free):
    of = SimpleNamespace(problem=problem, vector=np.zeros(2), innovations=problem.y)
    return pieces.Pieces(of, (100, 200), np.array(less), 0.0, free, 2)


def test_what_a_linear_equation_promises_is_what_a_simulation_keeps_of_it(bent):
    """A step of 2 on a sine that is 1 at most: half of it comes closest, and none of one of 3."""
    bent.y = np.where(np.arange(N) // 100 == 1, 0.85, 0.0) * bent.rows[0]
    kept = _cut(bent, [[0.0, 0.0], [-2.0, 0.0], [3.0, 0.0]], free=9).simulated(None)
    assert np.allclose(kept.less, [[0.0, 0.0], [-1.0, 0.0], [0.0, 0.0]])
    part = bent.rows[0, 100:200]
    assert kept.square == pytest.approx((np.sin(1.0) - 0.85) ** 2 * float(part @ part))
    (first, there), (second, back) = kept.changes()
    assert (first, second) == (100, 200) and np.allclose(there, np.sin(1.0) * part)
    assert np.allclose(back, -np.sin(1.0) * bent.rows[0, 200:])


def test_pieces_that_share_the_others_go_one_way_together(bent):
    """Each by itself, the first and the third would be two rigs."""
    bent.y = np.where(np.arange(N) // 100 == 1, 0.85, 0.9) * bent.rows[0]
    less = [[-0.3, 0.0], [-2.0, 0.0], [-0.3, 0.0]]
    kept = _cut(bent, less, free=2).simulated(None)
    assert any(np.allclose(kept.less, part * np.array(less)) for part in (1.0, 0.5, 0.25, 0.0))
    assert kept.square > _cut(bent, less, free=9).simulated(None).square


def test_a_piece_is_within_reach(bent):
    bent.y = 2.0 * bent.rows[1]
    kept = _cut(bent, [[0.0, -2.0]] * 3, free=9).simulated(None)
    assert np.allclose(kept.less, [[0.0, -0.4]] * 3) and kept.square > 0.0
