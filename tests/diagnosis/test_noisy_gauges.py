"""A gauge in between that is far noisier than the output: it may hide nothing that the output shows.

Red when a session with such a gauge tells less than the same session without it.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest

from focgen.diagnosis import findings
from focgen.diagnosis.diagnose import diagnose
from tests.diagnosis_rig import RIG, session

CAMERA = 4.0  # times the output's noise
RIG_ROLES = ("pressure", "curvature")


def firsts(found):
    return [cause.candidates[0].effect for cause in found.causes]


@pytest.mark.parametrize(
    "seed, drift, count",
    [(1, 4e-4, 3), *(pytest.param(seed, 2e-4, 5, marks=pytest.mark.long) for seed in (1, 2))],
)
def test_a_drift_that_the_output_shows_is_named_whatever_the_camera_shows(seed, drift, count):
    """It was ``unknown``, and beside the output alone a ``gain_drift``, 0.95. Of ``count`` logs."""
    found = diagnose(RIG, session(seed, camera=CAMERA, drift=drift)[:count], pictures=False)
    alone = diagnose(RIG, session(seed, drift=drift, roles=("pressure",))[:count], pictures=False)
    assert firsts(found) == firsts(alone) == ["gain_drift"]
    assert found.causes[0].candidates[0].confidence > 0.9
    assert found.gap.explained < 1.05 * alone.gap.explained
    assert any("the curvature is so noisy" in note for note in found.notes)


@pytest.mark.parametrize(
    "faults, said",
    [({}, ("none", "parameters")), pytest.param({"vent": 0.1}, ("named",), marks=pytest.mark.long)],
)
def test_a_noisy_camera_is_kept_where_it_hides_nothing(faults, said):
    found = diagnose(RIG, session(2, camera=CAMERA, **faults), pictures=False)
    assert found.verdict in said
    assert not any("so noisy" in note for note in found.notes)


@pytest.mark.long
def test_what_the_chain_may_be_off_by_is_told_where_it_is_seen_best():
    """Of the camera's noise the dead zone changes half: a nominal chain that is off by as much, 76 %. Of the
    output's it changes all of it."""
    logs, bare = (session(1, camera=2.0, zone=0.012, roles=r) for r in (RIG_ROLES, ("pressure",)))
    found, alone = (diagnose(RIG, of, pictures=False) for of in (logs, bare))
    assert firsts(found) == firsts(alone) == ["dead_zone"]
    sure, as_sure = (f.causes[0].candidates[0].confidence for f in (found, alone))
    assert sure > 0.6 and sure > as_sure - 0.1


@pytest.mark.long
def test_what_left_its_segment_is_back_where_the_output_shows_it():
    """Of the camera's noise it changes a third, and had left: no name, and no experiment to tell."""
    found = diagnose(RIG, session(1, camera=2.0, zone=0.008), pictures=False)
    assert firsts(found) == ["dead_zone"]
    assert any("the nominal rig may be off by itself" in note for note in found.notes)
    assert found.next_experiment is not None


@pytest.mark.long
def test_a_gauge_that_is_dropped_is_still_looked_at():
    """Its unit is off by a hundred; only that it is noisy was said."""
    logs = session(1, camera=CAMERA, drift=2e-4)
    off = [replace(log, signals=dict(log.signals) | {"curvature": 100.0 * log["curvature"]}) for log in logs]
    found = diagnose(RIG, off, pictures=False)
    assert any("curvature in a unit 100 times smaller?" in warning for warning in found.warnings)


def _told(exit, *sets):
    """An explanation of the segment up to a signal, with these sets of families."""
    rivals = [
        [SimpleNamespace(effect=name, stage="", odds=9.0, off=-9.0) for name in names] for names in sets
    ]
    return SimpleNamespace(
        segment=SimpleNamespace(exit=exit), causes=[SimpleNamespace(rivals=r) for r in rivals]
    )


@pytest.mark.parametrize(
    "exit, shown, alone, kept",
    [
        ("pressure", ["valve_stiction"], ["hysteresis"], True),
        ("pressure", ["valve_stiction"], ["hysteresis", "valve_stiction"], False),
        ("pressure", ["slow_regulator", "valve_asymmetry"], ["valve_asymmetry"], False),
        ("output", ["valve_stiction"], ["hysteresis"], False),  # of the noise that the gauge passes on
    ],
)
def test_what_a_signal_shows_is_not_given_up_for_what_the_output_tells_without_it(
    monkeypatch, exit, shown, alone, kept
):
    """A valve that sticks before a gauge that is bent was ``hysteresis``, 0.95: the gauge was left out."""
    seen = SimpleNamespace(explanations=(_told(exit, shown),), rigs=None, session=(), nominal=None)
    bare = SimpleNamespace(explanations=(_told("output", alone),), rigs=None, session=())
    for name, answer in {
        "hiding": ["pressure"],
        "without": (),
        "found_in": bare,
        "leaves_far_less": True,
        "tell_the_same": False,
        "is_unknown": False,
    }.items():
        monkeypatch.setattr(findings, name, lambda *a, answer=answer: answer)
    assert findings.unhidden(seen, (), 0) is (seen if kept else bare)
