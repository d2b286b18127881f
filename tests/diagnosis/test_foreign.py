"""The foreign simulator is what it says, and the diagnosis of its rigs is seldom sure when it is wrong.

Red when the simulator shares a form with the library, or a wrong name is given with confidence.
"""

import numpy as np
import pytest

from tests.foreign.cases import SEVERITIES, _Play, case
from tests.foreign.chain import Fault, Physics, Session
from tests.foreign.forms import MAKE, STAGE
from tests.foreign.judge import Judged, judged, table

H = 0.01


def test_its_chain_is_exact_where_a_closed_form_is_known():
    """Order 1: two lags in series, of a step; the L1 scheme is implicit Euler there, wrong by order h."""
    physics = Physics(0.5, 0.3, 1.0, 1.0 - 1e-12, (0.2, 0.0), 1.0, 0.001)
    t = np.arange(1000) * H
    made = Session(physics).run(np.r_[0.0, np.ones(999)], t)
    tau = np.maximum(t - H, 0.0)
    assert made["pressure"] == pytest.approx(0.5 * -np.expm1(-tau / 0.3), abs=1e-3)
    exact = 0.1 * (1.0 - (np.exp(-tau) - 0.3 * np.exp(-tau / 0.3)) / 0.7)
    assert made["curvature"] == pytest.approx(exact, abs=1e-3)


def test_its_actuator_creeps_as_a_power_of_time():
    """T D^0.5 y + y = v of a step: y = 1 - exp(t/T²) erfc(√t/T)."""
    from scipy.special import erfcx

    physics = Physics(1.0, 1e-2, 0.8, 0.5, (1.0, 0.0), 1.0, 0.001)
    t = np.arange(2000) * H
    made = Session(physics).run(np.r_[0.0, np.ones(1999)], t)["curvature"]
    exact = 1.0 - erfcx(np.sqrt(np.maximum(t - H, 0.0)) / 0.8)
    assert made[100:] == pytest.approx(exact[100:], abs=4e-3)


def test_a_seed_is_a_case():
    made, again = case(5, "B", "sensor_drift", 0.08), case(5, "B", "sensor_drift", 0.08)
    assert made.amount == again.amount == pytest.approx(0.15, abs=0.05)
    assert all(np.array_equal(a["output"], b["output"]) for a, b in zip(made.logs, again.logs, strict=True))
    assert "curvature" not in made.logs[0] and "pressure" in made.logs[0]


def test_what_was_loaded_before_is_remembered_through_a_session():
    def softer(x, clock, memory):
        memory["runs"] = memory.get("runs", 0.0) + 1.0
        return x * memory["runs"]

    play = _Play(Physics(1.0, 0.2, 0.8, 0.7, (0.1, 0.0), 1.0, 0.1), [np.ones(40), np.ones(40)], H)
    first, second = play.traces([Fault("drive", softer)])
    assert len(first["curvature"]) == 40 and second["curvature"] == pytest.approx(2.0 * first["curvature"])


def test_the_table_counts_what_is_wrong_and_sure():
    said = [[("creep", 0.95)], [("leak", 0.5)]]
    found = [
        Judged("C", 0, "creep", 0.1, "named", said[:1], "actuator", 0.9, 0.85, []),
        Judged("C", 1, "leak", 0.1, "named", said[:1], "actuator", 0.9, 0.1, []),
        Judged("C", 2, None, 0.0, "parameters", [], None, None, None, []),
    ]
    lines = dict(line.strip("| ").split(" | ") for line in table(found).splitlines()[2:])
    assert lines["top-1 effect"] == "0.50 (1/2)" and lines["wrong above 0.9"] == "0.33 (1/3)"
    assert lines["promise within 0.10"] == "0.50 (1/2)" and lines["false alarms"] == "0.00 (0/1)"


@pytest.mark.long
@pytest.mark.parametrize("signals, least", [("C", 0.85), ("B", 0.75), ("A", 0.6)])
def test_foreign_rigs_are_named_rightly_or_not_for_sure(signals, least):
    """Every family once, its severity by turns, and three sound rigs; ``make foreign`` prints more."""
    asked = [(name, SEVERITIES[i % 3]) for i, name in enumerate(MAKE)] + [(None, 0.0)] * 3
    found = [judged(i, signals, truth, severity) for i, (truth, severity) in enumerate(asked)]
    singles = [j for j in found if j.truth]
    assert sum(j.right for j in singles) >= least * len(singles), table(found)
    assert sum(j.wrong_and_sure for j in found) <= 1, table(found)
    assert not any(j.causes or j.verdict == "unknown" for j in found if not j.truth), table(found)
    assert set(STAGE) == {j.truth for j in singles}
