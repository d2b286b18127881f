"""What a command does between its samples: read off the logs where the rig does not say it.

The truth is simulated here, by scipy's exact holds on a grid 20 times finer than the log's.

Red when a command that is not held is taken for one: a regulator of 1.2 s was 0.87 s, and the next session's
healthy valve a slow one at 0.95.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from focgen.identification.identify import identify
from focgen.identification.stages import identify_stage
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
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


def answer(way: Between, seed: int):
    """A command, and what a lag of ``LAG`` s and gain 1.5 makes of it as it runs ``way``, with noise."""
    command, smooth = waves(seed)
    held, fine = np.repeat(command, FINER), np.arange(len(smooth)) / FINER
    straight = np.interp(fine, np.arange(len(command)), command)
    course = {Between.HELD: held, Between.STRAIGHT: straight, Between.SMOOTH: smooth}[way]
    system = [1.5], [LAG, 1.0]
    num, den, _ = cont2discrete(system, STEP / FINER, "zoh" if way == Between.HELD else "foh")
    made = 1.5 * course[0] + lfilter(np.ravel(num), den, course - course[0])[::FINER]
    return command, made + 0.01 * np.random.default_rng([seed, 7]).normal(size=len(command))


def logs_of(way: Between, seeds, role: str) -> list[Experiment]:
    logs = []
    for seed in seeds:
        command, made = answer(way, seed)
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
