"""Fits do no work twice, and none that could change nothing.

Red when work is done twice, or what is left out to save it changes an answer.
"""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.fitting.fit import WHITE, _cost, _solved, fit, innovations, jacobian
from focgen.diagnosis.hypotheses.nuisances import problem_of
from focgen.diagnosis.hypotheses.search import best_start, footings
from focgen.diagnosis.problem.candidates import CandidateEffect
from focgen.diagnosis.problem.problem import Problem
from focgen.diagnosis.problem.segments import make
from focgen.rig.effects import Form, Parameter, library
from tests.diagnosis_rig import RIG, session


@pytest.fixture(scope="module")
def problem():
    """The actuator's, of a rig whose actuator has dry friction."""
    logs = session(4, slip=0.3)
    return problem_of(RIG, make(logs, "pressure", "curvature"), logs)


def beside(problem, effect, form):
    """``problem`` with one form, and its first start values."""
    candidate = next(
        CandidateEffect(effect, f, "actuator") for f in library()[effect].forms if f.name == form
    )
    found = problem.with_candidates([candidate])
    return found, np.r_[found.nominal(), found.starts(candidate)[0]]


def counted(monkeypatch):
    """A list that grows by every simulation's vector."""
    found, plain = [], Problem.simulate
    monkeypatch.setattr(
        Problem, "simulate", lambda self, v, *more: (found.append(v), plain(self, v, *more))[1]
    )
    return found


def test_a_derivatives_steps_leave_in_memory_what_they_set_out_from(problem):
    whole, vector = beside(problem, "hysteresis", "play")
    now = innovations(whole, vector, WHITE)
    before = {place: [id(made) for *_, made in kept] for place, kept in whole.memory.items()}
    jacobian(whole, vector, now, WHITE, *whole.bounds())
    chain = [place for place in before if place != "rigs"]
    assert chain and all([id(m) for *_, m in whole.memory[place]] == before[place] for place in chain)


def test_a_unit_is_not_moved_for_its_derivative(problem, monkeypatch):
    whole, vector = beside(problem, "gain_nonlinearity", "cubic")  # its scale is a unit
    now = innovations(whole, vector, WHITE)
    simulated = counted(monkeypatch)
    rows = jacobian(whole, vector, now, WHITE, *whole.bounds())
    low, high = whole.bounds()
    assert len(simulated) == np.sum(high - low > 1e-6) < len(vector)
    assert not np.any(rows[-2]) and np.any(rows[-3])
    np.testing.assert_array_equal(rows[-1], now)


def test_a_rig_that_runs_away_fits_nothing_and_is_nothing_to_warn_of(problem):
    """Users saw numpy's warning of a trial that no fit took."""
    force = Parameter("force", lower=1.0, upper=1e3, starts=(500.0,), zero=0.0)
    away = Form("away", "load", (force,), lambda x, v, run: np.sinh(1e6 * v[0] * x) - np.exp(1e6 * v[0] * x))
    candidate = CandidateEffect("gain_nonlinearity", away, "actuator")
    whole = problem.with_candidates([candidate])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = whole.simulate(np.r_[whole.nominal(), 500.0])
        assert not np.all(np.isfinite(made))
        found = best_start(problem, footings(problem, problem.nominal()), candidate)
    assert found.sse > 1e3 * fit(problem, problem.nominal(), WHITE).sse


def test_a_fit_far_behind_is_left_early_within_a_hundredth_of_what_it_is_behind(problem, monkeypatch):
    leader = fit(*beside(problem, "hysteresis", "play"), WHITE)
    other, start = beside(problem, "gain_drift", "bending")
    simulated = counted(monkeypatch)
    ended = fit(other, start, WHITE)
    whole = len(simulated)
    left = fit(other, start, WHITE, leader=leader)
    nats = 0.5 * len(left.innovations) * np.log([left.cost / ended.cost, left.cost / leader.cost])
    assert len(simulated) - whole < 0.8 * whole
    assert nats[1] > 1000.0 and nats[0] < 0.02 * nats[1]


def test_an_input_beside_another_is_what_it_is_made_from_the_start(problem):
    rng = np.random.default_rng(5)
    ways = rng.standard_normal((len(problem.segment.x), 3))
    segment = replace(problem.segment, input_modes=ways)
    whole = replace(problem, segment=segment, memory={})
    off, last = np.array([0.3, -0.2, 0.0]), np.array([0.0, 0.0, 1e-4])
    base = whole._entered(-0.4, off, probe=False)
    others = [
        (-0.4001, off),
        (0.1, off),
        (0.0, off),
        (-0.4, off + last),
        (-0.4, -off),
        (0.0, 0 * off),
    ]
    for shift, moved in others:
        made, exact = whole._entered(shift, moved, probe=True), whole._moved(shift, moved)
        np.testing.assert_allclose(made, exact, atol=1e-13)
        assert np.any(made != base)
    assert whole._entered(-0.4, off, probe=True) is base


def test_a_quick_fit_simulates_no_start_that_an_earlier_one_ended_at(problem, monkeypatch):
    candidate = next(CandidateEffect("hysteresis", f, "actuator") for f in library()["hysteresis"].forms)
    thin = problem.thinned(2)
    from_ = footings(thin, thin.nominal())
    simulated = counted(monkeypatch)
    assert best_start(thin, from_, candidate).sse < np.sum(from_[0].now ** 2)
    assert len({v.tobytes() for v in simulated}) == len(simulated)


@pytest.mark.parametrize("known", [1.0, 1e-4, 0.0])
def test_a_step_goes_nowhere_of_which_nothing_is_known(known):
    rng = np.random.default_rng(3)
    rows, scales = rng.standard_normal((5, 40)), np.array([1.0, 1e-2, 3.0, 0.1, known])
    rows *= scales[:, None]
    matrix, wanted = rows @ rows.T, rng.standard_normal(5)
    step = _solved(matrix, matrix @ wanted)
    sure = slice(None) if known else slice(4)
    np.testing.assert_allclose(step[sure], wanted[sure], rtol=1e-6)
    assert known or abs(step[4]) < 1e-9


def test_a_vector_that_is_hopelessly_unlikely_costs_more_than_any_other_without_a_warning(problem):
    expected, precision = problem.known
    assert precision.any()
    far, near = expected + 1e4 * (precision > 0.0), expected
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        costs = [_cost(problem, vector, 1.0, 50) for vector in (near, far)]
    assert costs[0] == 1.0 and 1e100 < costs[1] < np.inf
