"""Signals of which a logger has filled rows in, or which it reports on change.

Red when a logger's doing stands for an effect of the rig or shuts the diagnosis, or when it hides an effect
that its readings show.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.verdict import evidence
from focgen.rig.effects import Run
from tests.diagnosis_rig import RIG, session
from tests.logs.test_filled import drawn, held, reported

ALL = ("pressure", "curvature", "output")


def logged(logs, fill, roles=ALL):
    """The logs with every signal of ``roles`` as a logger fills it in."""
    spans = {role: np.ptp(np.concatenate([log[role] for log in logs])) for role in roles if role in logs[0]}
    return [
        replace(log, signals={**log.signals, **{r: fill(log[r], span) for r, span in spans.items()}})
        for log in logs
    ]


def every(k, fill):
    """Each signal read in every ``k``-th row."""
    return lambda y, span: fill(y, np.arange(0, len(y), k))


def on_change(share):
    """Each reported once it has changed by this share of its span."""
    return lambda y, span: reported(y, share * span)


@pytest.mark.parametrize(
    "fill, roles, left",
    [
        pytest.param(every(10, held), ("output",), 1.25, marks=pytest.mark.long),
        (every(6, drawn), ("curvature", "output"), 1.25),
        pytest.param(every(10, held), (), 1.25, marks=pytest.mark.long),
        pytest.param(every(10, drawn), ALL, 1.25, marks=pytest.mark.long),
        pytest.param(on_change(0.03), ("output",), 3.0, marks=pytest.mark.long),
        pytest.param(on_change(0.06), ("output",), 3.0, marks=pytest.mark.long),
    ],
)
def test_what_a_logger_fills_in_is_no_effect(fill, roles, left):
    """``left``: times the noise, at most; no ``roles``: command and output alone are logged."""
    kept = ("pressure", "curvature") if roles else ()
    found = diagnose(RIG, logged(session(3, roles=kept), fill, roles or ("output",)), pictures=False)
    assert found.verdict in ("none", "parameters")
    assert found.gap.refitted < left * found.gap.floor


@pytest.mark.long
@pytest.mark.parametrize(
    "fill, effect, named",
    [
        (every(8, held), {"slip": 0.6}, "hysteresis"),
        (every(8, drawn), {"vent": 0.8}, "valve_asymmetry"),
        (every(6, held), {"delay": 6}, "transport_delay"),
        (on_change(0.01), {"bend": 15.0}, "sensor_nonlinearity"),
    ],
)
def test_an_effect_is_found_by_the_readings(fill, effect, named):
    found = diagnose(RIG, logged(session(4, **effect), fill), pictures=False)
    (cause,) = found.causes
    assert cause.candidates[0].effect == named


def test_a_log_at_rest_beside_slow_ones_is_read(tmp_path):
    """It has next to no readings. The proposal and the pictures are made all the same."""
    slow = [log for log in session(4, slip=0.6) if log.name in ("steps", "triangle")]
    logs = logged(slow, every(8, held))
    still = {role: np.zeros(60) for role in logs[0].signals}
    rest = replace(logs[-1], name="rest", signals=still, start=logs[-1].start + 60.0)
    found = diagnose(RIG, [*logs, rest], out=tmp_path / "gap", pictures=False)
    assert [c.candidates[0].effect for c in found.causes] == ["hysteresis"]


def test_an_experiment_of_one_reading_has_no_rate():
    run = Run.of([3, 1, 2], [0.0, 10.0, 20.0], 0.5)
    rates = evidence._rate_of(np.array([0.0, 1.0, 2.0, 7.0, 4.0, 5.0]), run)
    np.testing.assert_allclose(rates, [2.0, 2.0, 2.0, 0.0, 2.0, 2.0])
