"""Diagnoses of sessions of which logs begin in a transient; the rig is simulated apart from the library.

Red when a log's begin is taken for an effect, or hides one.
"""

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.hypotheses.initial import begun_session, loosened
from focgen.diagnosis.problem.segments import make
from focgen.logs.begin import Begin
from focgen.rig.initial import NOTE
from tests.diagnosis_rig import RIG, H, session

CUTS = {"steps": 8.0 + 2.5, "stairs": 6.0 + 4.2, "hold": 2.0 + 1.3}  # s into the logs: after steps from rest


def cut(logs):
    return tuple(log.between(CUTS.get(log.name), None) for log in logs)


def named(diagnosis):
    return [[c.effect for c in f.candidates] for f in diagnosis.causes]


@pytest.mark.parametrize("seed", range(2))
def test_a_healthy_rig_stays_healthy(seed):
    found = diagnose(RIG, cut(session(seed)))
    assert found.verdict in ("none", "parameters") and not found.causes
    assert any(NOTE in note for note in found.notes)


def test_parameters_a_little_off_are_refitted_all_the_same():
    found = diagnose(RIG, cut(session(1, T=1.6, alpha=0.55, gain=(0.0025, 0.3))))
    assert found.verdict == "parameters"
    assert found.gap.refitted < 0.5 * found.gap.as_given
    assert found.gap.gof["refitted"] > found.gap.gof["possible"] - 0.02


@pytest.mark.parametrize(
    "effect, case",
    [
        ("transport_delay", {"delay": 4}),
        ("dead_zone", {"zone": 0.045}),
        ("hysteresis", {"slip": 0.35}),
    ],
)
def test_one_effect_is_named_as_without_cuts(effect, case):
    found = diagnose(RIG, cut(session(11, **case)))
    assert found.verdict == "named" and named(found) == [[effect]]
    assert found.shrink > 0.7


def test_a_session_at_rest_is_left_as_it_is():
    logs = session(4)
    assert all(a is b or not a.begins for a, b in zip(begun_session(RIG, logs), logs))
    segment = make(logs, "command", "pressure")
    assert loosened(RIG, segment) is segment


def test_a_begin_may_be_off_in_the_ways_that_show():
    log = session(2)[0].between(10.5, None)
    told = begun_session(RIG, [log])
    segment = loosened(RIG, make(told, "pressure", "curvature"))
    rows = segment.loose.T
    assert 1 <= len(rows) <= 3 and segment.thinned(4).loose.shape == (len(log) // 4, len(rows))
    gram = rows @ rows.T
    assert np.allclose(gram, np.diag(np.diag(gram)), atol=1e-9 * gram.max())
    # what is left of a past fades
    assert np.abs(rows[:, -200:]).max() < 0.1 * np.abs(rows[:, :200]).max()


def test_thinning_keeps_the_begins():
    log = session(2)[0].between(10.5, None)
    segment = make(begun_session(RIG, [log]), "command", "pressure")
    assert segment.run.begins and segment.thinned(3).run.begins == segment.run.begins
    assert isinstance(segment.run.begins[0], Begin) and segment.run.h == H
