"""A speed that depends on the level is no pair of curves, though two that cancel at rest follow it.

Red when such a pair is believed, or when a pair that bends the levels is not.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.fitting.fit import WHITE, fit
from focgen.diagnosis.hypotheses.nuisances import problem_of
from focgen.diagnosis.problem.problem import CandidateEffect
from focgen.diagnosis.problem.segments import make
from focgen.diagnosis.verdict.cancelling import cancelling
from focgen.logs.experiment import Experiment
from focgen.rig.effects import form_of
from focgen.rig.rig import Actuator, Rig, Signals

H = 0.1
RIG = Rig("wire", H, Signals("t", "y", "u"), Actuator(1.2, 1.0, (1.0,)))
CURVES = (("gain_nonlinearity", "bent_spring"), ("sensor_nonlinearity", "quartic"))


def session(latent: float, bend: float) -> list[Experiment]:
    """A wire that takes up heat around a level of 0.5; ``bend``: of its levels."""
    steps = np.r_[np.zeros(20), np.repeat([0.5, 0.0, 1.0, 0.25, 0.8, 0.4, 0.65, 0.0], 70)]
    swings = 0.5 - 0.5 * np.cos(0.5 * H * np.arange(600))
    logs = []
    for i, u in enumerate((steps, swings)):
        x, seen = 0.0, []
        for drive in u:
            seen.append(x)
            for _ in range(10):
                x += H / 10 * (drive - x) / (1.2 * (1.0 + latent * np.exp(-(((x - 0.5) / 0.15) ** 2))))
        y = np.array(seen) + bend * np.array(seen) ** 2
        y = y + 0.006 * np.random.default_rng(i).normal(size=len(y))
        logs.append(replace(Experiment(str(i), H, {"command": u, "output": y}), start=100.0 * i))
    return logs


@pytest.mark.parametrize("latent, bend, cancel", [(3.0, 0.0, True), (0.0, 0.3, False)])
def test_two_curves_that_cancel_at_rest(latent, bend, cancel):
    logs = session(latent, bend)
    problem = problem_of(RIG, make(logs, "command", "output"), logs)
    curves = tuple(CandidateEffect(name, form_of(name, form), "actuator") for name, form in CURVES)
    both = problem.with_candidates(curves)
    start = np.r_[problem.nominal(), *(both.starts(c)[0] for c in curves)]
    assert cancelling(fit(both, start, WHITE, 12)) == cancel


@pytest.mark.long
def test_latent_heat_is_unknown_and_said_to_be_a_speed():
    found = diagnose(RIG, session(3.0, 0.0))
    assert found.verdict == "unknown"
    assert any("speed may depend on the level" in note for note in found.notes)
