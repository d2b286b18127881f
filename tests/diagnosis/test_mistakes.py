"""Mistakes that every lab makes, on a rig that is healthy: none of them is an effect of the rig.

Red when a gauge that saturates, an amplifier that is switched, a column that was exported twice or a log at
another rate is named as one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.errors import LogError
from focgen.fractional.transfer import TransferFunction
from focgen.identification.identify import identify
from focgen.logs.experiment import Experiment
from focgen.logs.rates import at_one_rate
from focgen.rig.replay import replay
from tests import diagnosis_rig
from tests.diagnosis_rig import RIG, H, session


def altered(logs, change):
    """The logs with ``change`` of each one's number and signals."""
    return [replace(log, signals=change(k, dict(log.signals))) for k, log in enumerate(logs)]


def saturated(_, signals):
    """The gauge of pressure ends in the middle of what it is to show."""
    return signals | {"pressure": np.minimum(signals["pressure"], 0.6 * signals["pressure"].max())}


def twice(_, signals):
    """The camera's column holds the output's."""
    return signals | {"curvature": signals["output"].copy()}


@pytest.mark.parametrize(
    "change, seed",
    [(twice, 1), *(pytest.param(saturated, seed, marks=pytest.mark.long) for seed in (1, 2))],
)
def test_a_gauge_at_fault_is_no_effect_before_it_and_behind_it(change, seed):
    logs = [log.between(0.0, 25.0) for log in session(seed)]
    found = diagnose(RIG, altered(logs, change), pictures=False)
    named = [c.candidates[0].effect for c in found.causes]
    assert found.verdict in ("unknown", "none", "parameters") and not named, named
    if found.verdict == "unknown" and change is saturated:
        assert any("pressure" in line for line in (*found.notes, *found.unexplained))
    told = [line for line in found.warnings if "same samples" in line]
    assert len(told) == (change is twice)


def exchanged(_, signals):
    """Camera and sensor, each in the other's column."""
    return signals | {"curvature": signals["output"], "output": signals["curvature"]}


@pytest.mark.long
@pytest.mark.parametrize("time", (0.6, 1.0 / 6.0))
def test_a_reading_ahead_of_what_it_reads_is_no_effect(time):
    """A relaxation that overshoots comes closest, and was sure at 0.95 beside a warning of the columns."""
    rig = replace(RIG, sensor=TransferFunction([(1.0, 0.0)], [(time, 1.0), (1.0, 0.0)]))
    found = diagnose(rig, altered(session(1, sensor=(1.0, time)), exchanged), pictures=False)
    assert found.verdict == "unknown" and not found.causes
    assert {"pressure to curvature", "curvature to output"} == set(found.unexplained)
    assert any("exchanged" in line for line in found.warnings)


@pytest.mark.long
def test_an_amplifier_that_is_switched_between_experiments_is_no_curve():
    logs = session(3)
    late = len(logs) // 2

    def switched(k, signals):
        return signals | {"output": signals["output"] * (2.0 if k >= late else 1.0)}

    found = diagnose(RIG, altered(logs, switched), pictures=False)
    assert found.verdict == "unknown"
    moments = found.unexplained["curvature to output"]["moments"]
    first = logs[late].start
    assert any(abs(moment["at"] - first) < 0.1 * (logs[-1].start + len(logs[-1]) * H) for moment in moments)


def test_a_command_in_another_range_in_one_experiment_is_no_curve():
    """It was a bent gain of the regulator at 95 %: the hold alone is at that level."""

    def louder(k, signals):
        return signals | {"command": signals["command"] * (1.5 if k == 3 else 1.0)}

    logs, curves = altered(session(41), louder), ("gain_nonlinearity", "valve_asymmetry")
    found = diagnose(RIG, logs, pictures=False, only=curves)
    assert found.verdict == "unknown"
    assert any("0 s into hold" in note and "0 s into triangle" in note for note in found.notes)


def faster(log, times, rng):
    """The same experiment recorded so many times as often, the command held."""
    count = (len(log) - 1) * times + 1
    clock = np.arange(count) / times
    noise = {"pressure": 2e-4, "curvature": 1e-5, "output": 1e-5}
    signals = {
        role: y[clock.astype(int)]
        if role == "command"
        else np.interp(clock, np.arange(len(y)), y) + rng.normal(0.0, 0.1 * noise[role], count)
        for role, y in log.signals.items()
    }
    return Experiment(log.name, log.sample_time / times, signals, log.start)


def test_logs_of_several_rates_are_brought_to_the_slowest():
    logs, rng = session(4), np.random.default_rng(4)
    mixed = [faster(log, 4, rng) if k == 1 else log for k, log in enumerate(logs)]
    alike = at_one_rate(mixed)
    assert {log.sample_time for log in alike} == {H} and alike[0] is mixed[0]
    assert len(alike[1]) == len(logs[1]) and "as the slowest log" in alike[1].notes[-1]
    assert np.allclose(alike[1]["command"], logs[1]["command"])
    given, other = replay(RIG, logs), replay(RIG, mixed)
    for name, result in given.logs.items():
        assert other.logs[name].gof == pytest.approx(result.gof, abs=0.01)
    assert diagnose(RIG, mixed, pictures=False).verdict in ("none", "parameters")


def test_a_command_between_slower_samples_is_its_mean():
    fast = Experiment("a", 0.01, {"command": np.arange(10.0), "output": np.arange(10.0)})
    slow = Experiment("b", 0.025, {"command": np.zeros(4), "output": np.ones(4)})
    made, _ = at_one_rate([fast, slow])
    assert np.allclose(made["output"], [0.0, 2.5, 5.0, 7.5]) and made.sample_time == 0.025
    area = [0 + 1 + 0.5 * 2, 0.5 * 2 + 3 + 4, 5 + 6 + 0.5 * 7, 0.5 * 7 + 8 + 9]
    assert np.allclose(made["command"], np.array(area) / 2.5)


def written(folder, name, log):
    """A log as a file of the rig's columns."""
    rows = np.column_stack(
        [log.start + log.time, *(log[r] for r in ("command", "pressure", "curvature", "output"))]
    )
    np.savetxt(folder / name, rows, delimiter=",", header="t_s,u,p,k,y", comments="", fmt="%.9g")
    return folder / name


def test_one_experiment_under_two_names_is_said_to_be(tmp_path):
    logs = session(5)
    files = [written(tmp_path, "a.csv", logs[0]), written(tmp_path, "b.csv", logs[0])]
    assert any("holds the same samples as a" in note for note in replay(RIG, files).notes)
    other = [files[0], written(tmp_path, "c.csv", logs[1])]
    assert not any("same samples" in note for note in replay(RIG, other).notes)


def test_a_log_that_is_fitted_is_not_shown_as_unseen(tmp_path):
    logs = session(6)
    files = [written(tmp_path, f"{k}.csv", log) for k, log in enumerate(logs)]
    copy = written(tmp_path, "copy.csv", logs[0])
    with pytest.raises(LogError, match="holds the samples of 0, which is fitted"):
        identify(RIG, files, unseen=[copy])


LEVELS = (1.0, 1.6, 0.6, 1.8, 0.8, 1.3)  # V
CURVES = ("softening", "gain_nonlinearity", "gain_drift")


def few_runs(monkeypatch, late, factor=1.0, soften=0.0):
    """A run for each level, pressure and output logged. From run ``late`` on the output is ``factor`` times
    what it was; or the drive loses ``soften`` of itself with the largest there has been."""
    runs = {f"to {a} V": np.repeat([0.0, a, 0.0], [20, 400, 380]) for a in LEVELS}
    largest, rubs = [0.0], diagnosis_rig._friction

    def softened(drive, share):
        most = np.maximum(np.maximum.accumulate(drive), largest[0])
        largest[0] = most[-1]
        return rubs(drive * (1.0 - soften * most / 0.012), share)

    monkeypatch.setattr(diagnosis_rig, "commands", lambda: runs)
    monkeypatch.setattr(diagnosis_rig, "_friction", softened)
    return altered(
        session(4, roles=("pressure",)),
        lambda k, s: s | {"output": s["output"] * (factor if k >= late else 1.0)},
    )


@pytest.mark.long
@pytest.mark.parametrize("late, factor", [(3, 1.3), (2, 1.3), (2, 2.0), (3, 2.0)])
def test_a_gain_that_is_switched_between_few_runs_is_no_curve_of_many_values(monkeypatch, late, factor):
    """A gain for each of six levels follows it as well: ``gain_nonlinearity`` or ``softening`` at 95 %."""
    found = diagnose(RIG, few_runs(monkeypatch, late, factor), pictures=False, only=CURVES)
    assert found.verdict == "unknown" and any("at once" in note for note in found.notes)


@pytest.mark.parametrize("soften, sure", [(-0.5, 0.8), pytest.param(0.5, 0.7, marks=pytest.mark.long)])
def test_a_softening_of_few_runs_is_one(monkeypatch, soften, sure):
    """Of the one that gives way a drift that settles stands beside it, at 0.17."""
    found = diagnose(RIG, few_runs(monkeypatch, 0, soften=soften), pictures=False, only=CURVES)
    assert found.causes[0].candidates[0].effect == "softening"
    assert found.causes[0].candidates[0].confidence > sure


def later(logs, samples):
    """The command so many samples late in its column."""
    for log in logs:
        u = np.asarray(log["command"], float)
        moved = np.r_[np.full(samples, u[0]), u][: len(u)]
        yield replace(log, signals=dict(log.signals) | {"command": moved})


@pytest.mark.parametrize(
    "count",
    [1, pytest.param(5, marks=pytest.mark.long)],
)
def test_a_command_that_is_logged_late_is_no_resonance(count):
    """The answer comes three samples early, which no effect of a rig does; a mode would follow it. In
    ``count`` logs."""
    found = diagnose(RIG, list(later(session(1, roles=())[:count], 3)))
    assert found.verdict == "unknown"
    assert any("the command may be" in note and "0.15 s late (3 samples)" in note for note in found.notes)


@pytest.mark.long
@pytest.mark.parametrize("case", [{"regulator": (1.0, 0.4)}, {"zone": 0.03}])
def test_what_answers_late_or_less_is_not_taken_for_it(case):
    found = diagnose(RIG, session(1, roles=(), **case))
    assert found.verdict in ("named", "set") and not any("late (" in note for note in found.notes)


def test_logs_of_a_command_and_logs_of_a_pressure_are_no_one_session():
    """They ended in a traceback."""
    only = [session(1, roles=("pressure",))[0], session(1, roles=())[1]]
    driven = replace(only[0], signals={r: v for r, v in only[0].signals.items() if r != "command"})
    with pytest.raises(LogError, match=f"{driven.name}: has no command, which other logs have"):
        diagnose(RIG, [driven, only[1]], pictures=False)
