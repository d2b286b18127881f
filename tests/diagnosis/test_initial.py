"""Diagnoses of sessions of which logs begin in a transient; the rig is simulated apart from the library.

Red when a log's begin is taken for an effect, or hides one.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.hypotheses.initial import begun_session, loosened
from focgen.diagnosis.problem.segments import make
from focgen.logs.begin import Begin
from focgen.logs.experiment import Experiment
from focgen.logs.read import in_session_order
from focgen.rig.effects import Run, form_of
from focgen.rig.engine import Chain
from focgen.rig.initial import NOTE
from focgen.rig.placed import Placed
from focgen.rig.rig import Actuator, Rig, Signals
from tests.diagnosis_rig import RIG, H, session

CUTS = {"steps": 8.0 + 2.5, "stairs": 6.0 + 4.2, "hold": 2.0 + 1.3}  # s into the logs: after steps from rest


def cut(logs):
    return tuple(log.between(CUTS.get(log.name), None) for log in logs)


def named(diagnosis):
    return [[c.effect for c in f.candidates] for f in diagnosis.causes]


FEW = ("steps", "stairs")  # of a session, those that tell most in the least time


def logs_of(session, names=None):
    return cut(log for log in session if names is None or log.name in names)


@pytest.mark.parametrize(
    "seed, names", [(0, FEW), *(pytest.param(seed, None, marks=pytest.mark.long) for seed in (0, 1))]
)
def test_a_healthy_rig_stays_healthy(seed, names):
    found = diagnose(RIG, logs_of(session(seed), names))
    assert found.verdict in ("none", "parameters") and not found.causes
    assert any(NOTE in note for note in found.notes)


@pytest.mark.parametrize("names", [FEW, pytest.param(None, marks=pytest.mark.long)])
def test_parameters_a_little_off_are_refitted_all_the_same(names):
    found = diagnose(RIG, logs_of(session(1, T=1.6, alpha=0.55, gain=(0.0025, 0.3)), names))
    assert found.verdict == "parameters"
    assert found.gap.refitted < 0.5 * found.gap.as_given
    assert found.gap.gof["refitted"] > found.gap.gof["possible"] - 0.02


@pytest.mark.parametrize(
    "effect, case, names",
    [
        ("transport_delay", {"delay": 4}, FEW),
        pytest.param("transport_delay", {"delay": 4}, None, marks=pytest.mark.long),
        pytest.param("dead_zone", {"zone": 0.045}, None, marks=pytest.mark.long),
        pytest.param("hysteresis", {"slip": 0.35}, None, marks=pytest.mark.long),
    ],
)
def test_one_effect_is_named_as_without_cuts(effect, case, names):
    found = diagnose(RIG, logs_of(session(11, **case), names))
    assert found.verdict == "named" and named(found) == [[effect]]
    assert found.shrink > 0.7


def test_a_session_at_rest_is_left_as_it_is():
    logs = session(4)
    assert all(a is b or not a.begins for a, b in zip(begun_session(RIG, logs), logs))
    segment = make(logs, "command", "pressure")
    assert loosened(RIG, segment, logs) is segment


def test_a_begin_may_be_off_in_the_ways_that_show():
    log = session(2)[0].between(10.5, None)
    told = begun_session(RIG, [log])
    segment = loosened(RIG, make(told, "pressure", "curvature"), told)
    rows = segment.loose.T
    assert 1 <= len(rows) <= 6 and segment.thinned(4).loose.shape == (len(log) // 4, len(rows))
    gram = rows @ rows.T
    assert np.allclose(gram, np.diag(np.diag(gram)), atol=1e-9 * gram.max())
    # what is left of a past fades
    assert np.abs(rows[:, -200:]).max() < 0.1 * np.abs(rows[:, :200]).max()


def test_thinning_keeps_the_begins():
    log = session(2)[0].between(10.5, None)
    segment = make(begun_session(RIG, [log]), "command", "pressure")
    assert segment.run.begins and segment.thinned(3).run.begins == segment.run.begins
    assert isinstance(segment.run.begins[0], Begin) and segment.run.h == H


FINGER = Rig("finger", 0.02, Signals("t", "y", pressure="p"), Actuator(0.84, 0.6, (0.5, 0.0025)))


def rested(seed, noise):
    """Stairs, levels and a sine of a finger that remembers, each log with a clock of its own: it rested 10 s
    before the second, and was held at its first level for 16 s, and rested 10 s before the third."""
    rng, n = np.random.default_rng(seed), 3000
    stairs = np.repeat([0.0, 20.0, 40.0, 60.0, 80.0, 95.0, 75.0, 55.0, 35.0, 15.0], 300)
    levels = np.repeat(np.r_[47.5, rng.uniform(15.0, 70.0, 9)], 300)
    sine = 47.5 - 47.5 * np.cos(2.0 * np.pi * np.arange(n) * 0.02 / 20.0)
    rest, held = np.zeros(500), np.full(800, 47.5)
    whole = np.concatenate([np.zeros(200), stairs, rest, held, levels, rest, sine])
    run = Run.of([len(whole)], [0.0], 0.02)
    y = Chain(FINGER).run(whole, "actuator", "actuator", run, False)
    y += noise * rng.standard_normal(len(y))
    parts = (slice(a, a + n) for a in (200, 200 + n + 1300, 200 + 2 * n + 1800))
    logs = [Experiment(f"{k}", 0.02, {"pressure": whole[p], "output": y[p]}) for k, p in enumerate(parts)]
    return in_session_order(logs)


@pytest.mark.parametrize("noise", [pytest.param(0.1, marks=pytest.mark.long), 0.05])
def test_what_a_rest_of_unknown_length_left_is_no_drift(noise):
    """Of 50: it was `sensor_drift`, and `unknown`."""
    found = diagnose(FINGER, rested(1, noise), pictures=False)
    assert found.verdict in ("none", "parameters") and not found.causes


def relaxing(logs, share, time, seed):
    """The ``logs`` with a reading that relaxes by a ``share`` within a ``time`` in s."""
    rng, slow = np.random.default_rng(seed), form_of("sensor_relaxation", "one_time")
    chain = Chain(RIG, (Placed("sensor_relaxation", slow, "sensor", (share, time)),))
    for log in logs:
        noisy = {name: 0.006 * rng.normal(size=len(log)) for name in ("pressure", "curvature", "output")}
        read = chain.run(log["curvature"], "sensor", "sensor", Run.of([len(log)], [0.0], H))
        clean = {**log.signals, "output": read}
        signals = {name: v + np.abs(v).max() * noisy.get(name, 0.0) for name, v in clean.items()}
        yield replace(log, signals=signals)


@pytest.mark.long
@pytest.mark.parametrize("kept", [("steps", "hold"), ("steps", "stairs", "sines")])
def test_a_past_is_told_by_what_remembers_it(kept):
    """Told without the effect it suited a bent reading, or a loop, at 0.95, which left two to three times the
    noise."""
    logs = [log for log in session(1, noise=0.0) if log.name in kept]
    found = diagnose(RIG, cut(tuple(relaxing(logs, 0.4, 100.0, 1))), pictures=False)
    assert named(found) == [["sensor_relaxation"]]
    assert found.gap.explained < 1.5 * found.gap.floor
