"""What a command does between its samples: read off the logs where the rig does not say it.

The truth is simulated here, by scipy's exact holds on a grid 20 times finer than the log's.

Red when a command that is not held is taken for one: a regulator of 1.2 s was 0.87 s, and the next session's
healthy valve a slow one at 0.95.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.identification.identify import identify
from focgen.identification.stages import identify_stage
from focgen.logs.between import Between, course_of
from focgen.logs.experiment import Experiment
from focgen.rig.replay import replay
from focgen.rig.rig import Actuator, Rig, Signals

FINER, STEP, LAG = 20, 0.5, 1.2
RIG = Rig("r", STEP, Signals("t", "y", "u"), Actuator(2.0, 0.9, (1.5,)))


def waves(seed: int, count: int = 1200):
    """A command and its course on the fine grid: sines of 12 to 60 samples a period about 2."""
    rng = np.random.default_rng(seed)
    at = lambda k: (
        2.0
        + sum(
            a * (np.sin(2.0 * np.pi * k / p + s) - np.sin(s))
            for a, p, s in zip(rng.uniform(0.2, 0.6, 4), rng.uniform(12.0, 60.0, 4), rng.uniform(0.0, 6.0, 4))
        )
    )
    fine = np.arange(count * FINER) / FINER
    rng_state = rng.bit_generator.state
    course = at(fine)
    rng.bit_generator.state = rng_state
    return at(np.arange(count)), course


def answer(way: Between, seed: int, lag: float = LAG):
    """A command, and what a ``lag`` in s of gain 1.5 makes of it as it runs ``way``, with noise."""
    command, smooth = waves(seed)
    held, fine = np.repeat(command, FINER), np.arange(len(smooth)) / FINER
    straight = np.interp(fine, np.arange(len(command)), command)
    course = {Between.HELD: held, Between.STRAIGHT: straight, Between.SMOOTH: smooth}[way]
    system = [1.5], [lag, 1.0]
    num, den, _ = cont2discrete(system, STEP / FINER, "zoh" if way == Between.HELD else "foh")
    made = 1.5 * course[0] + lfilter(np.ravel(num), den, course - course[0])[::FINER]
    return command, made + 0.01 * np.random.default_rng([seed, 7]).normal(size=len(command))


def logs_of(way: Between, seeds, role: str, lag: float = LAG) -> list[Experiment]:
    logs = []
    for seed in seeds:
        command, made = answer(way, seed, lag)
        logs.append(Experiment(f"log {seed}", STEP, {"command": command, role: made}))
    return logs


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("way", [Between.HELD, Between.STRAIGHT])
def test_a_regulator_is_as_slow_as_it_is_whatever_its_command_does(way, seed):
    found = identify_stage(logs_of(way, [seed, seed + 50], "pressure"), "regulator")
    lag, half = found.parameters["T"]
    assert found.between in ((None, Between.HELD) if way == Between.HELD else (way,))
    assert lag == pytest.approx(LAG, abs=2.0 * half) and half < 0.02
    assert found.parameters["gain"][0] == pytest.approx(1.5, rel=2e-3)


@pytest.mark.parametrize("seed, lag", [(1, 0.5), (2, 0.3), (2, 0.5)])
def test_a_lag_of_a_sample_is_no_dead_time_of_one(seed, lag):
    """The command's bends passed for noise, as those of a measured input do, so a gain behind a dead time
    was likelier. A held one that rings five times as fast as the samples passes for one in straight lines."""
    found = identify_stage(logs_of(Between.STRAIGHT, [seed, seed + 50], "pressure", lag), "regulator")
    assert found.shape == "1p" and found.between == Between.STRAIGHT
    assert found.parameters["T"][0] == pytest.approx(lag, rel=0.03)
    assert found.parameters["gain"][0] == pytest.approx(1.5, rel=2e-3)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("way", list(Between))
def test_an_actuator_driven_by_its_command_is_as_slow_as_it_is(way, seed):
    found = identify(RIG, logs_of(way, [seed, seed + 50], "output"), gain_degree=0, integer=False)
    assert found.joint.T == pytest.approx(LAG, rel=0.02) and found.joint.alpha == pytest.approx(1.0, abs=0.01)
    # a smooth one and a polygon differ by a hundredth of the noise here
    assert (found.rig.between == Between.HELD) == (way == Between.HELD)
    told = [note for note in found.notes if note.startswith("the command")]
    assert len(told) == (found.rig.between is not None)


def test_what_the_rig_says_of_its_command_is_kept():
    logs = logs_of(Between.STRAIGHT, [1], "output")
    says = {way: identify(replace(RIG, between=way), logs, gain_degree=0, integer=False) for way in Between}
    assert [found.rig.between for found in says.values()] == list(Between)
    assert says[Between.HELD].joint.T < 0.9 * LAG < says[Between.STRAIGHT].joint.T
    assert not any(
        "the command" in note for found in says.values() for note in found.notes if "between" in note
    )


def test_a_step_or_a_rest_says_nothing_of_between_samples():
    """Where a command only jumps and rests it is held, but for a logger's corners."""
    command = np.where(np.arange(600) // 100 % 2 == 1, 2.0, 0.0)
    made = lfilter([0.0, 1.0 - np.exp(-STEP / LAG)], [1.0, -np.exp(-STEP / LAG)], command)
    made += 0.01 * np.random.default_rng(3).normal(size=600)
    found = identify_stage([Experiment("steps", STEP, {"command": command, "pressure": made})], "regulator")
    assert found.between in (None, Between.HELD) and found.parameters["T"][0] == pytest.approx(LAG, rel=0.01)


def behind_a_valve(seed: int, lag: float = 0.2, step: float = 0.1, both: bool = True) -> list[Experiment]:
    """Two logs of held steps through a valve of ``lag`` s and an actuator of 2 s, with 1 % of noise on the
    pressure; ``both``: whether the second one has its pressure, too."""
    rng, logs = np.random.default_rng([seed, 11]), []
    for i in range(2):
        command = np.repeat(rng.uniform(0.0, 3.0, 20), 60)
        command[:60] = 0.0
        course = np.repeat(command, FINER)
        lags = [1.0 - np.exp(-step / FINER / tau) for tau in (lag, 2.0)]
        pressure = lfilter([0.0, lags[0]], [1.0, lags[0] - 1.0], course)
        made = lfilter([lags[1]], [1.0, lags[1] - 1.0], pressure)[::FINER]
        noisy = pressure[::FINER] + 0.03 * rng.standard_normal(len(command))
        signals = {"command": command, "output": made + 0.01 * rng.standard_normal(len(command))}
        logs.append(Experiment(f"log {i}", step, signals | ({"pressure": noisy} if both or i == 0 else {})))
    return logs


VALVE = Rig(
    "r",
    0.1,
    Signals("t", "y", "u", "p"),
    Actuator(1.5, 0.95, (1.0,)),
    regulator=TransferFunction([(1.0, 0.0)], [(0.2, 1.0), (1.0, 0.0)]),
)


@pytest.mark.parametrize("between", [None, Between.HELD])
@pytest.mark.parametrize("both", [True, False], ids=["pressures", "one pressure"])
def test_a_command_is_held_beside_a_pressure_too(both, between):
    """What the regulator makes of it stands beside the pressure, and in its place where a log has none."""
    rig = replace(VALVE, between=between)
    found = identify(rig, behind_a_valve(1, both=both), gain_degree=0, integer=False)
    assert found.rig.between == between
    assert found.joint.T == pytest.approx(2.0, rel=0.01) and found.joint.alpha == pytest.approx(
        1.0, abs=0.006
    )


def test_what_the_shapes_lack_of_a_regulator_is_no_other_way_of_a_command():
    """Three lags, where two and a dead time are tried: a held square wave was taken for a straight one."""
    course = np.repeat(np.where(np.arange(2400) // 40 % 2 == 1, 2.0, 0.0), FINER)
    command, made = course[::FINER], course
    for lag in (0.3, 0.15, 0.1):
        share = 1.0 - np.exp(-0.1 / FINER / lag)
        made = lfilter([0.0, share], [1.0, share - 1.0], made)
    noisy = made[::FINER] + 0.02 * np.random.default_rng(0).standard_normal(len(command))
    found = identify_stage([Experiment("log", 0.1, {"command": command, "pressure": noisy})], "regulator")
    assert found.between in (None, Between.HELD) and found.parameters["delay"][0] < 0.08


def ramps(role: str) -> Experiment:
    """A command in ramps, and what a lag of ``LAG`` s makes of it: of a held one it comes to the same."""
    knots = np.random.default_rng(2).uniform(0.0, 3.0, 25)
    knots[0] = 0.0
    fine = np.interp(np.arange(1200 * FINER) / FINER / 50.0, np.arange(25), knots)
    num, den, _ = cont2discrete(([1.5], [LAG, 1.0]), STEP / FINER, "foh")
    made = lfilter(np.ravel(num), den, fine)[::FINER] + 0.05 * np.random.default_rng(5).normal(size=1200)
    return Experiment("ramps", STEP, {"command": fine[::FINER], role: made})


def test_a_lag_is_known_to_half_a_sample_where_ramps_hide_what_a_command_does():
    found = identify_stage([ramps("pressure")], "regulator")
    lag, half = found.parameters["T"]
    assert found.between is None and 0.4 * STEP < half < 0.7 * STEP and abs(lag - LAG) < half
    assert found.time_relative == pytest.approx(half / lag)


def test_logs_to_be_shown_run_as_those_that_were_fitted():
    fitted, (shown,) = logs_of(Between.STRAIGHT, [1, 51], "output"), logs_of(Between.STRAIGHT, [7], "output")
    found = identify(RIG, fitted, gain_degree=0, integer=False, unseen=[replace(shown, name="shown")])
    assert found.unseen[0].gof > 0.97
    assert all(log.gof > 0.97 for log in replay(found.rig, [shown]).logs.values())


def test_what_a_rig_says_of_its_command_is_kept_and_a_note_tells_of_another_way():
    """Other loggers have other ways: a rig of a smooth command was 9 times the noise off held steps, and
    nothing said why. What is late by half a sample looks alike, so logs alone do not overrule the file."""
    rig = identify(RIG, logs_of(Between.STRAIGHT, [1, 51], "output"), gain_degree=0, integer=False).rig
    held, smooth = logs_of(Between.HELD, [3], "output"), logs_of(Between.STRAIGHT, [4], "output")
    for made in (lambda logs: replay(rig, logs), lambda logs: diagnose(rig, logs, pictures=False)):
        assert any("'held' leaves" in said for said in made(held).notes)
        assert not any("between =" in said for said in made(smooth).notes)
    assert replay(rig, held).rig.between == Between.STRAIGHT


@pytest.mark.parametrize("way", [Between.HELD, Between.STRAIGHT])
def test_a_delay_of_a_sample_is_found_in_a_rig_that_says_how_its_command_runs(way):
    rig = identify(RIG, logs_of(way, [1, 51], "output"), gain_degree=0, integer=False).rig
    late = [
        replace(log, signals={**log.signals, "output": np.roll(log["output"], 1)}).between(5.0, None)
        for log in logs_of(way, [3, 4], "output")
    ]
    found = diagnose(replace(rig, between=way), late, pictures=False)
    assert [cause.candidates[0].effect for cause in found.causes] == ["transport_delay"]
    assert not any("between =" in said for said in found.notes)


def test_an_actuator_is_known_to_half_a_sample_where_ramps_hide_what_a_command_does():
    found = identify(RIG, [ramps("output")], gain_degree=0, integer=False)
    low, high = found.joint.ci95["T"]
    assert found.rig.between is None and low < LAG < high and high - low > 0.6 * STEP
    assert found.rig.uncertainty.actuator.time > 0.2 * STEP / LAG


def test_a_regulator_is_fitted_as_its_rig_says_that_its_command_runs():
    logs = logs_of(Between.STRAIGHT, [1, 51], "pressure")
    said = identify(replace(RIG, between=Between.HELD), logs, stages=["regulator"])
    assert said.stages["regulator"].parameters["T"][0] < 0.9 * LAG
    smooth = identify(replace(RIG, between=Between.SMOOTH), logs, stages=["regulator"])
    assert (said.rig.between, smooth.rig.between) == (Between.HELD, Between.SMOOTH)
    free = identify(RIG, logs, stages=["regulator"])
    assert free.rig.between == Between.STRAIGHT
    assert free.stages["regulator"].parameters["T"][0] == pytest.approx(LAG, rel=0.02)


def test_straight_lines_have_no_bends():
    values = np.sin(np.arange(60.0) / 5.0)[None]
    lines, curve = (course_of(values, np.zeros(60, bool), way) for way in (Between.STRAIGHT, Between.SMOOTH))
    assert lines.bends is None and curve.bends is not None
    assert np.array_equal(lines.straight[0, 1:], np.diff(values[0]))
