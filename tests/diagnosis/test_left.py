"""Friction leaves a rig off its rest, and the next experiment begins there.

Red when a dead zone is named for the time that a block, which is simulated from 0, then seems to wait.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.hypotheses import explain
from focgen.diagnosis.problem.problem import CandidateEffect
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.effects import form_of
from focgen.rig.rig import LinearActuator, Rig, Signals

H, HELD = 0.1, 0.35  # s; Coulomb's force
PLANT = TransferFunction([(1.04, 0.0)], [(1.28, 1.0), (1.0, 0.0)])
BLOCK = Rig("block", H, Signals("t", "y", "u"), LinearActuator(PLANT))
FORMS = [(name, form_of(name, form)) for name, form in (("friction", "coulomb"), ("dead_zone", "preloaded"))]
STAIRS = (0.6, 1.2, 1.8, 2.4, 3.0, 2.4, 1.8, 1.2, 0.6, 0.0)
STEPS = (2.1, 0.6, 3.0, 0.0, 1.5, 0.0)


def pushed(force: np.ndarray, y: float) -> tuple[np.ndarray, float]:
    """The place (n,) of a block on a damper of 1.2 and a spring of 1, from ``y`` on, and where it ends."""
    seen = []
    for u in force:
        seen.append(y)
        for _ in range(10):
            y += H / 12.0 * np.sign(u - y) * max(abs(u - y) - HELD, 0.0)
    return np.array(seen), y


def test_a_block_that_lies_where_it_was_left_has_no_dead_zone(monkeypatch):
    two = [CandidateEffect(*pair, "actuator") for pair in FORMS]  # all families take ten times as long
    monkeypatch.setattr(explain, "candidates_for", lambda segment, rig: two)
    rng, logs, start, y = np.random.default_rng(6), [], 0.0, 0.0
    corners = np.cumsum([0, 90, 60, 40, 60, 90, 30])
    triangle = np.interp(np.arange(370), corners, [0.0, 2.7, 0.9, 2.1, 0.3, 3.0, 0.0])
    for force in (np.repeat(STAIRS, 36), triangle, np.repeat(STEPS, 48), np.repeat((*STAIRS[:3], 0.0), 36)):
        force = np.r_[np.zeros(12), force, np.zeros(40)]
        seen, y = pushed(force, y)
        roles = {"command": force, "output": seen + 0.01 * rng.normal(size=len(force))}
        logs.append(replace(Experiment(str(len(logs)), H, roles), start=start))
        start += H * len(force)
    found = diagnose(BLOCK, logs)
    assert [c.candidates[0].effect for c in found.causes] == ["friction"]
    assert found.causes[0].candidates[0].confidence > 0.9
