"""Of several effects each has to foretell parts of the session that its fit did not see.

Red when a form stays that only follows what another one lacks, run by run, or one of two true effects goes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.fitting.fit import WHITE, Fit, Weighing, fit
from focgen.diagnosis.fitting.folds import fitted_to, folds, foreseen, foretold
from focgen.diagnosis.hypotheses import rivals
from focgen.diagnosis.hypotheses.foretelling import foretelling
from focgen.diagnosis.hypotheses.initial import begun_session
from focgen.diagnosis.hypotheses.nuisances import problem_of, uncertain
from focgen.diagnosis.hypotheses.search import evidence
from focgen.diagnosis.problem.candidates import CandidateEffect
from focgen.diagnosis.problem.problem import Problem
from focgen.diagnosis.problem.segments import make
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.effects import library
from focgen.rig.rig import LinearActuator, Rig, Signals
from tests.diagnosis.test_held import RIG as PUMP
from tests.diagnosis.test_pumps import session as pump_session

H, NOISE, TOPS = 0.05, 0.05, (2.0, 3.0, 4.0, 6.0, 6.0)
LAG = TransferFunction([(6.0, 0.0)], [(2.0, 1.0), (1.0, 0.0)])
TANK = Rig("tank", H, Signals("t", "p", "u"), LinearActuator(LAG))


def steps(seed: int, *gains: float) -> list[Experiment]:
    """Steps from rest of a tank with these gains, behind a pump that does nothing below 1.5 V."""
    rng, t, logs = np.random.default_rng(seed), np.arange(600) * H, []
    for top, gain in zip(TOPS, gains):
        made = gain * (top - 1.5) * (1.0 - np.exp(-np.maximum(t - 5.0, 0.0) / 2.0))
        roles = {"command": np.where(t >= 5.0, top, 0.0), "output": made + NOISE * rng.normal(size=600)}
        logs.append(Experiment(f"{top} V", H, roles))
    return logs


def problem_for(logs: Sequence[Experiment], *forms: tuple[str, str]) -> Problem:
    """The tank's, with these forms of effects."""
    plain = problem_of(TANK, make(logs, "command", "output"), logs)
    return plain.with_candidates(
        [CandidateEffect(n, f, "actuator") for n, name in forms for f in library()[n].forms if f.name == name]
    )


def fitted(problem: Problem) -> Fit:
    """From the first start values of each."""
    starts = [problem.starts(candidate)[0] for candidate in problem.candidates]
    bare = problem.with_candidates([])
    return fit(problem, np.concatenate([bare.nominal(), *starts]), WHITE, 25)


def families(of: Fit) -> list[str]:
    return [c.effect for c in of.problem.candidates]


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(s, marks=pytest.mark.long) for s in range(2, 4))])
def test_what_two_runs_tell_differently_is_left_out(seed):
    """The first step to 6 V ends lower, as at an obstacle, and the second one does not."""
    logs = steps(seed, 6.0, 6.0, 6.0, 4.8, 6.0)
    both = fitted(problem_for(logs, ("dead_zone", "soft"), ("contact", "hertz")))
    without = fitted(problem_for(logs, ("dead_zone", "soft")))
    assert evidence(both, without) > 50.0
    assert families(foretelling(both, WHITE)) == ["dead_zone"]


def dead_and_creeping(seed: int) -> Fit:
    """Both effects fitted to what they make."""
    logs = steps(seed, 6.0, 6.0, 6.0, 6.0, 6.0)
    problem = problem_for(logs, ("dead_zone", "soft"), ("creep", "power"))
    true = fitted(problem).vector
    true[-len(problem.candidates[1].form.parameters) :] = problem.starts(problem.candidates[1])[0]
    noise = np.random.default_rng(seed).normal(size=len(problem.segment.y))
    seen = replace(problem.segment, y=problem.simulate(true) + NOISE * noise)
    return fitted(replace(problem, segment=seen, memory={}))


@pytest.mark.parametrize("seed", [0, *(pytest.param(s, marks=pytest.mark.long) for s in range(1, 4))])
def test_two_effects_that_are_there_stay(seed):
    assert families(foretelling(dead_and_creeping(seed), WHITE)) == ["dead_zone", "creep"]


def test_a_fit_that_is_stuck_makes_no_effect_vain(monkeypatch):
    """Without the effect it leaves more than its parts foretell, and the search knows of a better one: a dead
    zone beside a rail was lost so."""
    both = dead_and_creeping(1)
    alone = [fitted(both.problem.with_candidates([c])) for c in both.problem.candidates]

    def stuck(problem: Problem, start: np.ndarray, weighing: Weighing, iterations: int) -> Fit:
        known = any(start is of.vector for of in alone)
        return fit(problem, start, weighing, iterations if known else 0)

    monkeypatch.setattr(rivals, "fit", stuck)
    assert len(families(foretelling(both, WHITE))) == 1
    assert families(foretelling(both, WHITE, alone)) == ["dead_zone", "creep"]


def test_parts_are_neighbouring_experiments_or_quarters():
    assert folds([5, 5, 5, 5]).tolist() == [0] * 5 + [1] * 5 + [2] * 5 + [3] * 5
    assert folds([8]).tolist() == [0, 0, 1, 1, 2, 2, 3, 3]


@pytest.mark.parametrize("seed", [0, *(pytest.param(s, marks=pytest.mark.long) for s in range(1, 3))])
def test_a_fit_foretells_what_it_made_least(seed):
    """Noise that wanders leaves a level of each run that no other run tells. Its innovations do not."""
    logs = steps(seed, 6.0, 6.0, 6.0, 6.0, 6.0)
    walk = np.cumsum(np.random.default_rng(seed).normal(size=(5, 600)), axis=1)
    noisy = [
        replace(log, signals=log.signals | {"output": log["output"] + 0.02 * w}) for log, w in zip(logs, walk)
    ]
    plain = fitted(problem_for(noisy, ("dead_zone", "soft")))
    assert foretold(plain, WHITE) == foreseen(plain, WHITE)
    colour = Weighing(np.array([1.0, -0.999]))
    best = fit(plain.problem, plain.vector, colour, 12)
    assert foretold(best, colour) < 1.05 * np.mean(best.innovations**2)
    assert foreseen(best, colour) > 1.2 * np.mean(best.weighed**2)


def test_a_fold_keeps_what_only_the_unseen_tells():
    """Where a pump stood as a log began is told by that log alone. Its prior moved that to where the begin
    had told it, and a fit that did not see the log foretold nothing of it."""
    logs = [log.between(1.2 + 1.1 * n, 45.0) for n, log in enumerate(pump_session(1))]
    bare = [replace(log, signals={n: log[n] for n in ("command", "output")}) for log in logs]
    bare = begun_session(PUMP, bare)
    problem = uncertain(PUMP, make(bare, "command", "output"), bare)
    assert problem.stood == 2
    vector = problem.nominal()
    vector[problem.head - 2 : problem.head] = 0.7
    first = np.arange(len(problem.segment.y)) < problem.segment.run.spans[0][1]
    found = fitted_to(fit(problem, vector, WHITE, 0), WHITE, first)
    assert found.vector[problem.head - 1] == 0.7 != found.vector[problem.head - 2]
