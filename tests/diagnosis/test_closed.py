"""Diagnoses from closed-loop logs: the output's noise is in the command, and predicts nothing.

Red when noise in the command is taken for what the rig does, with a reference in the logs or without.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.problem.segments import make
from tests.closed_rig import closed_session, references
from tests.diagnosis_rig import RIG, session


def named(diagnosis):
    return [[c.effect for c in f.candidates] for f in diagnosis.causes]


@pytest.mark.parametrize("roles", [(), ("pressure",)])
@pytest.mark.parametrize("seed", [0, *(pytest.param(s, marks=pytest.mark.long) for s in range(1, 3))])
def test_noise_that_goes_round_the_loop_is_no_gap(seed, roles):
    found = diagnose(RIG, closed_session(seed, noise=0.015, roles=roles))
    assert found.verdict in ("none", "parameters") and not found.causes


def unled(logs):
    """The logs without what the loop was asked for."""
    kept = [{r: v for r, v in log.signals.items() if r != "reference"} for log in logs]
    return [replace(log, signals=signals) for log, signals in zip(logs, kept)]


@pytest.mark.parametrize("seed", range(2))
def test_nor_is_it_where_no_reference_was_logged(seed):
    """It was unknown: the command foretold more than half of what was left, for it holds the noise."""
    found = diagnose(RIG, unled(closed_session(seed, noise=0.015)), pictures=False)
    assert found.verdict in ("none", "parameters") and not found.causes


def test_an_effect_is_named_through_a_loop_of_no_logged_reference():
    logs = unled(closed_session(1, lock=2.5))
    assert make(logs, "command", "output").closed
    assert named(diagnose(RIG, logs, pictures=False)) == [["gain_nonlinearity"]]


@pytest.mark.long
def test_a_hum_that_goes_round_the_loop_is_no_resonance():
    """The command carries it, and a mode of that frequency would make the one from the other."""
    found = diagnose(RIG, closed_session(1, hum=0.03))
    assert found.verdict == "unknown" and any(part["tonal"] for part in found.unexplained.values())


@pytest.mark.parametrize(
    "effect, case",
    [
        ("gain_nonlinearity", {"lock": 2.5}),
        pytest.param("hysteresis", {"slip": 0.4}, marks=pytest.mark.long),
    ],
)
def test_an_effect_is_named_through_the_loop(effect, case):
    found = diagnose(RIG, closed_session(1, **case))
    assert named(found) == [[effect]] and found.shrink > 0.9 and found.where.inferred


def test_what_is_asked_of_the_rig_is_the_reference_where_the_output_follows_one():
    logs = closed_session(0)
    assert make(logs, "command", "output").led
    assert np.allclose(make(logs, "command", "output").asked[:2400], references()["setpoints"], atol=1e-12)
    open_loop = session(0)
    segment = make(open_loop, "command", "pressure")
    assert not segment.led and np.allclose(segment.asked, segment.x / segment.level_in)
