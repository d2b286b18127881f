"""The same rig with other signs: a vacuum, a bend the other way, a drive mounted the other way round.

Red when the sign of a signal changes what is found, its confidence or its size, when a rig that is written
does not replay the logs as they are, or when an experiment is proposed on the other side of 0.
"""

import json
from dataclasses import replace

import numpy as np
import pytest

import focgen
from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.proposals.identifiability import plan
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import ROLES, Experiment
from focgen.rig.rig import LinearActuator, Origins, Ranges, Rig, Signals
from focgen.rig.turned import Turn

H, FINER, COUNT = 0.02, 10, 900


def lag(gain, time):
    return TransferFunction([(gain, 0.0)], [(time, 1.0), (1.0, 0.0)])


def finger(ceiling=np.inf, stop=np.inf):
    """A line of 0.1 s that ends at a ``ceiling``, and a finger of 0.3 s that ends at a ``stop``, as their
    owner knows them: 5 and 7 % off."""
    signals = Signals("t", "y", command="u", pressure="p")
    rig = Rig("finger", H, signals, LinearActuator(lag(1.9, 0.32)), regulator=lag(1.0, 0.095))
    rng, logs = np.random.default_rng(3), []
    for number, held in enumerate((150, 100, 60)):
        u = np.repeat(rng.uniform(0.0, 1.0, COUNT // held), held)
        u[:5] = 0.0
        p = y = 0.0
        rows = np.zeros((COUNT, 2))
        for k, asked in enumerate(u):
            rows[k] = min(p, ceiling), min(y, stop)
            for _ in range(FINER):
                y += H / FINER * (2.0 * min(p, ceiling) - y) / 0.3
                p += H / FINER * (asked - p) / 0.1
        read = rows + rng.normal(0.0, 0.003, rows.shape) * (1.0, 2.0)
        kept = {"command": u, "pressure": read[:, 0], "output": read[:, 1]}
        logs.append(Experiment(f"e{number}", H, kept, start=30.0 * number))
    return rig, logs


def axis(force=0.25):
    """A carriage on a motor of 0.2 s with dry friction of this ``force``, known 8 % off."""
    dynamics = TransferFunction([(1.0, 0.0)], [(0.2, 2.0), (1.08, 1.0)])
    rig = Rig("axis", H, Signals("t", "y", "u"), LinearActuator(dynamics))
    rng, logs, y = np.random.default_rng(5), [], 0.0
    for number in range(3):
        t = np.arange(COUNT) * H
        u = sum(rng.uniform(0.3, 0.8) * np.sin(2.0 * np.pi * t / period) for period in (6.0, 2.3, 1.1))
        v, made = 0.0, np.zeros(COUNT)
        for k, asked in enumerate(u):
            made[k] = y
            for _ in range(FINER):
                if v == 0.0 and abs(asked) <= force:
                    continue
                slowed = force * np.sign(v or asked)
                now = v + H / FINER * (asked - slowed - v) / 0.2
                v = 0.0 if now * v < 0.0 else now
                y += H / FINER * v
        kept = {"command": u, "output": made + rng.normal(0.0, 0.003, COUNT)}
        logs.append(Experiment(f"e{number}", H, kept, start=30.0 * number))
    return rig, logs


SIGNS = {
    "vacuum": {"command": -1, "pressure": -1},
    "other way": {"curvature": -1, "output": -1, "reference": -1},
    "both": dict.fromkeys(ROLES, -1),
    "valve the other way": {"command": -1},
}
RIGS = {
    "supply_saturation": (lambda: finger(ceiling=0.6), ("vacuum", "valve the other way")),
    "sensor_saturation": (lambda: finger(stop=1.3), ("other way", "both")),
    "friction": (axis, ("other way",)),
}


def turned(rig, logs, signs):
    turn = Turn(dict.fromkeys(ROLES, 1) | SIGNS[signs])
    return replace(turn.rig(rig), turned=frozenset()), [turn.log(log, rig) for log in logs]


def told(found):
    return [
        [(c.effect, c.stage, c.form, c.confidence, c.parameters) for c in cause.candidates]
        for cause in found.causes
    ]


@pytest.mark.parametrize("effect", RIGS)
def test_what_is_found_has_no_sign(effect, tmp_path):
    """A ceiling of a vacuum was a bent gain (0.95), friction of an axis the other way round a dead zone."""
    made, each = RIGS[effect]
    rig, logs = made()
    as_it_was = diagnose(rig, logs, pictures=False)
    assert as_it_was.causes[0].candidates[0].effect == effect
    for signs in each:
        found = diagnose(*turned(rig, logs, signs), out=tmp_path / signs, pictures=False)
        assert told(found) == told(as_it_was)
        assert found.gap == as_it_was.gap
        assert any("count magnitudes" in note for note in found.notes)
        _check_rigs(found, *turned(rig, logs, signs), tmp_path / signs)


def _check_rigs(found, rig, logs, folder):
    """The rigs as written replay the logs as they are, and the figures draw these."""
    replayed = focgen.replay(folder / "augmented.toml", logs)
    left = np.concatenate([log["output"] - replayed.simulated[log.name]["output"] for log in logs])
    assert np.sqrt(np.mean(left**2)) < 1.1 * found.gap.explained
    for trace, log in zip(found.drawn.traces, logs, strict=True):
        step = round(len(log) / len(trace.measured))
        np.testing.assert_allclose(trace.measured, log["output"][::step], atol=1e-12)
        np.testing.assert_array_equal(replayed.experiments[logs.index(log)]["output"], log["output"])
        np.testing.assert_array_equal(trace.input, log["command"][::step])


def lifted(rig, logs, curvature, output):
    """The same rig with other zeros."""
    actuator = replace(rig.actuator, offset=rig.actuator.offset + curvature)
    far = [replace(log, signals=log.signals | {"output": log["output"] + curvature + output}) for log in logs]
    return replace(rig, actuator=actuator, zero=rig.zero + output), far


@pytest.mark.parametrize(
    "effect, curvature, output",
    [("sensor_saturation", 0.0, 32.0), ("sensor_saturation", -32.0, 0.0), ("friction", 0.0, 64.0)],
)
def test_what_is_found_has_no_origin(effect, curvature, output, tmp_path):
    """A thermometer in kelvin that ends 30 K above its room was a bent one (0.57), or a bent gain."""
    rig, logs = RIGS[effect][0]()
    as_it_was = diagnose(rig, logs, pictures=False)
    given = lifted(rig, logs, curvature, output)
    found = diagnose(*given, out=tmp_path, pictures=False)
    first, again = (d.causes[0].candidates[0] for d in (as_it_was, found))
    assert again.effect == effect and again.confidence == pytest.approx(first.confidence, abs=1e-4)
    assert again.parameters.keys() == first.parameters.keys()
    for name, number in first.parameters.items():
        assert again.parameters[name].value == pytest.approx(number.value, rel=1e-4)
    assert found.gap.explained == pytest.approx(as_it_was.gap.explained, rel=1e-4)
    assert found.augmented.origins == Origins(curvature, curvature + output)
    assert not found.refitted.origins
    assert any(f"zero of the output is {curvature + output:g}" in note for note in found.notes)
    _check_rigs(found, *given, tmp_path)


@pytest.mark.parametrize("zero, logged", [(32.0, 0.0), (-5.0, 0.0), (0.0, 293.15)])
def test_a_zero_that_no_log_bears_out_is_the_logs_own(zero, logged):
    """An offset left in from logs in kelvin, or one that is lacking: a ceiling was an obstacle
    (0.95), or soft (0.95)."""
    rig, logs = finger(stop=1.3)
    as_it_was = diagnose(rig, logs, pictures=False)
    _, far = lifted(rig, logs, 0.0, logged)
    found = diagnose(replace(rig, zero=zero), far, pictures=False)
    assert [[c.effect for c in cause.candidates] for cause in found.causes] == [
        [c.effect for c in cause.candidates] for cause in as_it_was.causes
    ]
    assert found.gap.explained == pytest.approx(as_it_was.gap.explained, rel=1e-3)
    assert found.gap.as_given == pytest.approx(abs(logged - zero), rel=0.03)
    assert f"zero of the output is {zero:.4g}, and the logs lie by" in found.warnings[0]
    assert found.refitted.zero == pytest.approx(logged, abs=0.05)


def test_a_healthy_rig_with_a_zero_that_no_log_bears_out_has_parameters():
    rig, logs = finger()
    found = diagnose(replace(rig, zero=32.0), logs, pictures=False)
    assert found.verdict == "parameters" and found.gap.as_given == pytest.approx(32.0, rel=0.01)
    left = focgen.replay(found.refitted, logs)
    assert np.sqrt(np.mean([log.rmse**2 for log in left.logs.values()])) < 1.2 * found.gap.floor


def test_a_plan_has_no_origin():
    rig, logs = finger()
    far, lifted_logs = lifted(rig, logs, 32.0, 0.0)
    bare = [log.without("output", "") for log in logs]
    for given, other in (((), ()), (logs, lifted_logs), (bare, bare)):
        here, there = plan(rig, given), plan(far, other)
        assert [s.effect for s in here.effects] == [s.effect for s in there.effects]
        assert [s.survives for s in there.effects] == pytest.approx(
            [s.survives for s in here.effects], abs=1e-3
        )


def test_an_experiment_is_proposed_on_the_side_where_the_logs_are(tmp_path):
    rig, logs = finger(stop=1.3)
    short = [logs[2]]
    up, down = (
        diagnose(*turned(rig, short, signs), out=tmp_path / signs, pictures=False)
        for signs in ("other way", "vacuum")
    )
    asked, other = up.next_experiment, down.next_experiment
    assert asked is not None and other is not None
    assert (other.inputs["low"], other.inputs["high"]) == (-asked.inputs["high"], -asked.inputs["low"])
    assert other.inputs["low"] < -0.5 and other.inputs["high"] <= 0.0
    assert f"{other.inputs['low']:.4g} to" in other.what or f"to {other.inputs['low']:.4g}" in other.what
    rows = np.loadtxt(tmp_path / "vacuum" / other.inputs["file"], delimiter=",", skiprows=1)
    assert rows[:, 1].min() == pytest.approx(other.inputs["low"], rel=1e-5) and rows[:, 1].max() <= 0.0
    assert json.loads((tmp_path / "vacuum" / "diagnosis.json").read_text())["next_experiment"]


def test_a_rig_refitted_in_a_vacuum_says_nothing_of_the_next_session():
    rig, logs = finger(ceiling=0.6)
    stale = replace(rig, downwards=frozenset(ROLES))
    assert told(diagnose(stale, logs, pictures=False)) == told(diagnose(rig, logs, pictures=False))
    down = diagnose(*turned(rig, logs, "vacuum"), pictures=False)
    assert not down.refitted.downwards and down.augmented.downwards


def test_a_drift_has_the_sign_that_the_log_shows():
    rig, logs = finger()
    sinking = [
        replace(log, signals=log.signals | {"output": log["output"] + 0.005 * (log.start + log.time)})
        for log in logs
    ]
    up, down = (
        diagnose(*turned(rig, sinking, signs), pictures=False).causes[0].candidates[0]
        for signs in ("vacuum", "other way")
    )
    rates = [c.parameters["rate"] for c in (up, down)]
    assert up.effect == down.effect == "sensor_drift"
    assert rates[0].value == pytest.approx(0.005, rel=0.2) and rates[1].value == -rates[0].value
    assert rates[1].ci95 == (-rates[0].ci95[1], -rates[0].ci95[0])


@pytest.mark.parametrize("signs", ["vacuum", "other way"])
@pytest.mark.parametrize("logged", [False, True])
def test_a_plan_has_no_sign(signs, logged):
    rig, logs = finger()
    rig = replace(rig, ranges=Ranges((0.0, 1.0), (0.0, 1.0), (0.0, 2.0)))
    other, others = turned(rig, logs, signs)
    asked, answered = plan(rig, logs if logged else ()), plan(other, others if logged else ())
    assert asked == answered
