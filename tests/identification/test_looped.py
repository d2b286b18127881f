"""A rig that goes round in loops is identified, where T and α alone have no numbers.

The truth is simulated here: a play sample by sample, and a lag on a grid ten times finer than the log's.

Red when a rig with a wide loop is refused ("these logs do not determine T"), or is written with the T of 10⁵
that lags at every pace alike.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from focgen.cli.main import main
from focgen.diagnosis.diagnose import diagnose
from focgen.errors import FitError
from focgen.identification import joint_fit, ready
from focgen.identification.between_samples import Way
from focgen.identification.identify import identify
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
from focgen.rig.replay import replay
from focgen.rig.rig import Actuator, Relative, Rig, Signals

FINER, STEP, T, GAIN = 10, 0.2, 1.5, 1.2
RIG = Rig("r", STEP, Signals("t", "y", "u"), Actuator(1.0, 0.9, (1.0,)))


def play(x, width):
    """Lost motion of half width ``width``, at rest in its middle."""
    made, now = np.empty_like(x), x[0]
    for k, value in enumerate(x):
        now = min(max(now, value - width), value + width)
        made[k] = now
    return made


def answer(command, width: float):
    """What a play and a lag make of a command in straight lines."""
    drive = GAIN * play(np.repeat(command, FINER), width)
    num, den, _ = cont2discrete(([1.0], [T, 1.0]), STEP / FINER, "zoh")
    return lfilter(np.ravel(num), den, drive)[::FINER]


def levels(rng, count: int):
    """Slow ramps between random levels of 0 to 3."""
    corners = np.r_[0.0, rng.uniform(0.0, 3.0, count // 90)]
    return np.interp(np.arange(count) / 90, np.arange(len(corners)), corners)


def ramps(seed: int, width: float, noise: float = 0.005, count: int = 900) -> Experiment:
    """Slow ramps through a play and a lag."""
    rng = np.random.default_rng(seed)
    command = levels(rng, count)
    made = answer(command, width) + rng.normal(0.0, noise, count)
    return Experiment(f"s{seed}", STEP, {"command": command, "output": made})


def raised(seed: int) -> Experiment:
    """The same on top of 2, where the rig has come to rest before the log begins."""
    rng = np.random.default_rng(seed)
    ahead = np.r_[np.linspace(0.0, 2.0, 60), np.full(140, 2.0)]
    command = np.r_[ahead, 2.0 + levels(rng, 900)]
    signals = {"command": command, "output": answer(command, 0.3) + rng.normal(0.0, 0.005, len(command))}
    return Experiment(f"r{seed}", STEP, {name: values[200:] for name, values in signals.items()})


def looped(found):
    """What is said of a loop."""
    return [said for said in found.warnings if "beside a play of the command" in said]


@pytest.mark.parametrize("seed", range(0, 12, 2))
def test_a_wide_loop_leaves_the_numbers_what_they_are(seed):
    """By themselves T was 3.3 times too long, and K up to a tenth off."""
    found = identify(RIG, [ramps(seed, 0.3), ramps(seed + 1, 0.3)], gain_degree=0, integer=False)
    actuator = found.rig.actuator
    assert len(looped(found)) == 1 and "0.3 to either side" in looped(found)[0]
    assert actuator.T == pytest.approx(T, rel=0.03) and actuator.alpha == pytest.approx(1.0, abs=0.03)
    assert actuator.gain[0] == pytest.approx(GAIN, rel=0.01)
    assert not found.rig.effects and found.rig.uncertainty.actuator == Relative(0.2, 0.2, 0.1)
    assert found.joint.play == pytest.approx(0.3, rel=0.01)
    name = f"s{seed}"
    assert found.gof["rig"][name] < 0.9 < found.gof["fom"][name]
    written = replay(found.rig, [ramps(seed, 0.3)]).logs[name]
    assert found.gof["rig"][name] == pytest.approx(written.gof, abs=0.1)  # but for an offset of its own


@pytest.mark.parametrize(
    "seed, width, count", [(4, 1.1, 450), (2, 1.1, 450), (0, 0.8, 270)], ids=["no T", "no K", "short"]
)
def test_a_loop_without_which_there_are_no_numbers(seed, width, count):
    logs = [ramps(s, width, count=count) for s in (seed, seed + 1)]
    found = identify(RIG, logs, gain_degree=0, integer=False)
    assert "without it they have no numbers" in looped(found)[0]
    assert found.rig.actuator.T == pytest.approx(T, rel=0.03)
    assert found.rig.actuator.alpha == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("zone", [0.4, 0.8])
def test_a_few_readings_of_a_dead_zone_are_no_loop(seed, zone):
    """They were: 40 of them, with T = 0.33 of 1.5 said to be known to a fifth."""
    rng = np.random.default_rng(seed)
    command = np.interp(np.arange(40) / 10, np.arange(5), np.r_[0.0, rng.uniform(0.0, 3.0, 4)])
    drive = np.maximum(np.repeat(command, FINER) - zone, 0.0)
    num, den, _ = cont2discrete(([1.0], [T, 1.0]), STEP / FINER, "zoh")
    output = lfilter(np.ravel(num), den, drive)[::FINER] + 0.005 * rng.normal(size=40)
    try:
        found = identify(RIG, [Experiment("a", STEP, {"command": command, "output": output})], gain_degree=0)
    except FitError:
        return
    assert not looped(found)


@pytest.mark.parametrize("seed, degree", [(4, 0), (2, 1), pytest.param(5, 0, marks=pytest.mark.long)])
def test_what_was_before_is_found_beside_the_loop(seed, degree):
    """Without it the logs were taken to begin with a step from 0: T = 0.3 to 1.3, alpha = 0.66 to 0.9."""
    found = identify(RIG, [raised(seed), raised(seed + 1)], gain_degree=degree, integer=False)
    assert found.joint.play == pytest.approx(0.3, rel=0.01) and found.joint.T == pytest.approx(T, rel=0.03)
    assert found.joint.gain[0] == pytest.approx(GAIN, rel=0.02)
    assert not any("begin with their step" in note for note in found.notes)


def test_a_loop_is_where_the_way_to_the_first_sample_left_it():
    """Ramps about 5 of which the first 26 s are missing; from the middle of its slack T was 0.6 to 2.4."""
    whole = ramps(3, 0.3)
    raised = {"command": whole["command"] + 2.0, "output": whole["output"] + 2.0 * GAIN}
    logs = [Experiment("cut", STEP, {name: values[130:] for name, values in raised.items()})]
    found = identify(RIG, logs, gain_degree=0, integer=False)
    assert looped(found) and found.rig.actuator.T == pytest.approx(T, rel=0.1)


@pytest.mark.parametrize("width", [0.0, 0.1])
def test_a_loop_that_is_not_most_of_it_is_left_to_the_diagnosis(width):
    """A rig that comes back five times as slowly as it goes: beside it a small loop takes off 62 %."""
    logs = []
    for seed in (3, 4):
        rng = np.random.default_rng(seed)
        command = levels(rng, 900)
        output, now = np.empty(900), 0.0
        for k, level in enumerate(GAIN * play(command, width)):
            output[k] = now
            now += (level - now) * (1.0 - np.exp(-STEP / (0.5 if level > now else 2.5)))
        signals = {"command": command, "output": output + rng.normal(0.0, 0.005, 900)}
        logs.append(Experiment(f"a{seed}", STEP, signals))
    found = identify(RIG, logs, gain_degree=0, integer=False)
    assert not looped(found) and any("another speed of unloading" in said for said in found.warnings)


def test_a_way_without_numbers_widens_no_interval(monkeypatch):
    """It made T known to 6700 %."""
    experiments = [ramps(1, 0.3), ramps(2, 0.3)]
    fit = joint_fit.joint_fit(experiments, RIG, 0, False).found.fit
    far = replace(fit, T=40.0, half=fit.half | {"T": np.inf})
    for rival, apart in ((far, set()), (replace(fit, T=2.0), {"T", "alpha", "delay", "gain"})):
        way = Way(Between.HELD, fit, shown=False, rival=rival)
        monkeypatch.setattr(ready, "likeliest_way", lambda *_, way=way: way)
        assert set(ready.as_it_runs(experiments, [None, None], RIG, 0, False).apart) == apart


def test_what_only_rises_may_be_behind_a_dead_zone_as_well():
    logs = [ramps(s, 0.5, count=270) for s in (2, 3)]
    with pytest.raises(FitError, match="the best order is at the edge"):
        identify(RIG, logs, gain_degree=0, integer=False)


def test_what_is_identified_beside_a_loop_is_diagnosed_as_one():
    logs = [ramps(20, 0.3), ramps(21, 0.3)]
    found = diagnose(identify(RIG, logs, gain_degree=0, integer=False).rig, logs, pictures=False)
    assert len(found.causes) == 1 and "hysteresis" in {c.effect for c in found.causes[0].candidates}
    assert found.augmented.actuator.T == pytest.approx(T, rel=0.05)


def test_the_terminal_leads_on_to_the_diagnosis(tmp_path, capsys):
    log = ramps(2, 0.3)
    rows = np.c_[STEP * np.arange(len(log)), log["command"], log["output"]]
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="t,u,y", comments="")
    (tmp_path / "rig.toml").write_text(
        f'name = "r"\nsample_time = {STEP}\n[signals]\ntime = "t"\ncommand = "u"\noutput = "y"\n'
    )
    new = tmp_path / "new.toml"
    argv = ["identify", str(tmp_path / "log.csv"), "--rig", str(tmp_path / "rig.toml"), "--out", str(new)]
    assert main([*argv, "--no-integer"]) == 0
    told = capsys.readouterr().out
    assert f"next: focgen diagnose {new} {tmp_path / 'log.csv'}" in told and "beside a play" in told


def test_without_a_loop_nothing_is_told():
    found = identify(RIG, [ramps(1, 0.0), ramps(2, 0.0)], gain_degree=0, integer=False)
    assert not looped(found) and found.joint.play == 0.0
    assert found.rig.actuator.T == pytest.approx(T, rel=0.1)


def test_readings_that_follow_nothing_are_refused_as_before():
    """A walk of its own: no loop follows it either."""
    walk = lambda seed: np.cumsum(np.random.default_rng(seed).normal(size=900))
    logs = [Experiment("a", STEP, {"command": ramps(3, 0.3)["command"], "output": walk(4)})]
    with pytest.raises(FitError, match="there is no model to write"):
        identify(RIG, logs, gain_degree=0, integer=False)
