"""Stages that are slower one way, and stages whose pace depends on level, time or speed, made step by step.

Red when a sensor that recovers late is taken for the actuator, or when a pace that no effect of the library
has is named as one.
"""

from itertools import product

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import LinearActuator, Rig, Signals

H, SAMPLES, PARTS = 0.02, 3000, 20
TIMES = {"regulator": 0.25, "actuator": 0.8, "sensor": 0.3}
ROLES = {"C": ("pressure", "curvature"), "B": ("pressure",), "A": ()}

# how many times as slow a stage is, by its gap, its level and how much of the session is over
PACES = {
    "falls late": lambda gap, level, over: 2.0 if gap < 0.0 else 1.0,
    "rises late": lambda gap, level, over: 2.0 if gap > 0.0 else 1.0,
    "level": lambda gap, level, over: 1.0 + 0.5 * level,
    "level's square": lambda gap, level, over: (
        1.0 + 2.0 * level**2
    ),  # nine times as slow where it is bent most
    "time": lambda gap, level, over: 1.0 + 0.5 * over,
    "speed": lambda gap, level, over: 1.0 / (1.0 + 2.0 * abs(gap)),
}


def lag(gain, time):
    return TransferFunction([(gain, 0.0)], [(time, 1.0), (1.0, 0.0)])


def logged(seed, stage, pace):
    """Random holds, or a sine and then holds, of the command, and what three lags make of it."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(0.0, 1.0, SAMPLES // 100), 100)
    if seed % 2 == 0:
        t = np.arange(SAMPLES // 2) * H
        u[: SAMPLES // 2] = 0.5 + 0.25 * np.sin(2.0 * np.pi * t / 7.0) * (1.0 + 0.5 * np.sin(t / 31.0))
    u[:50] = 0.0
    levels, gains, found = dict.fromkeys(TIMES, 0.0), {"regulator": 1.0, "actuator": 2.0, "sensor": 1.0}, []
    for i, command in enumerate(u):
        found.append(tuple(levels.values()))
        for _ in range(PARTS):
            entering = command
            for name, time in TIMES.items():
                gap = gains[name] * entering - levels[name]
                slow = PACES[pace](gap, levels[name], i / SAMPLES) if name == stage else 1.0
                levels[name] += H / PARTS * gap / (time * slow)
                entering = levels[name]
    noise = np.array([[0.004], [0.008], [0.008]]) * rng.standard_normal((3, SAMPLES))
    return dict(zip(("command", "pressure", "curvature", "output"), (u, *np.array(found).T + noise)))


def diagnosed(seed, stage, pace, signals):
    log, roles = logged(seed, stage, pace), ROLES[signals]
    given = Signals("t", "y", "u", **{role: role for role in roles})
    rig = Rig("rig", H, given, LinearActuator(lag(2.0, 0.8)), lag(1.0, 0.25), lag(1.0, 0.3))
    kept = {k: v for k, v in log.items() if k in ("command", "output", *roles)}
    return diagnose(rig, [Experiment("holds", H, kept)], pictures=False)


def every(cases, seeds, quick):
    """Each of ``cases`` with each of ``seeds`` and set of signals; those not in ``quick`` are long."""
    for case in cases:
        for seed in seeds:
            for signals in ROLES:
                marks = () if (case, seed, signals) in quick else pytest.mark.long
                yield pytest.param(case, seed, signals, marks=marks)


ONE_WAY = {
    ("sensor", "falls late"): "sensor_lag",
    ("sensor", "rises late"): "sensor_lag",
    ("regulator", "rises late"): "valve_asymmetry",
    ("actuator", "rises late"): "unloading_asymmetry",
}
QUICK_ONE_WAY = {
    (("sensor", "falls late"), 1, "B"),
    (("regulator", "rises late"), 2, "B"),
}


@pytest.mark.parametrize("case, seed, signals", list(every(ONE_WAY, (1, 2), QUICK_ONE_WAY)))
def test_a_stage_that_is_slower_one_way_keeps_its_name(case, seed, signals):
    found = diagnosed(seed, *case, signals)
    (cause,) = found.causes
    first = cause.candidates[0]
    assert (cause.stage, first.effect) == (case[0], ONE_WAY[case])
    assert first.confidence > 0.9 and found.shrink > 0.9


UNEVEN = [(stage, by) for stage in ("actuator", "sensor") for by in ("level", "time", "speed")]
UNEVEN += [("actuator", "level's square")]
SAID = (("actuator", "time"), 1, "B")  # by a note, too


@pytest.mark.long
@pytest.mark.parametrize("case, seed, signals", list(product(UNEVEN, (1, 2), ROLES)))
def test_an_uneven_pace_is_no_effect(case, seed, signals):
    """It was `hysteresis`, `gain_drift`, `softening` or `sensor_hysteresis` at 95 %."""
    found = diagnosed(seed, *case, signals)
    sure = [c.effect for cause in found.causes for c in cause.candidates if c.confidence > 0.9]
    assert not sure
    if (case, seed, signals) == SAID:
        assert found.verdict == "unknown"
        assert any("times as slow" in note and case[0] in note for note in found.notes)


def test_a_sensor_that_the_rig_takes_for_1_may_lag_one_way():
    """With the curvature logged; without it, nothing tells it from the actuator."""
    log = logged(1, "sensor", "falls late")
    y, made = 0.0, []
    for k in log["curvature"]:
        y += (k - y) * (1.0 if k > y else 1.0 - np.exp(-H / 0.5))
        made.append(y)
    log["output"] = np.array(made) + 0.008 * np.random.default_rng(9).standard_normal(SAMPLES)
    given = Signals("t", "y", "u", pressure="pressure", curvature="curvature")
    rig = Rig("rig", H, given, LinearActuator(lag(2.0, 0.8)), lag(1.0, 0.25))
    found = diagnose(rig, [Experiment("holds", H, log)], pictures=False)
    (cause,) = found.causes
    assert (cause.stage, cause.candidates[0].effect) == ("sensor", "sensor_lag")
