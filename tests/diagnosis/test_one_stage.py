"""A rig given as one stage: what belongs to a regulator acts ahead of its dynamics, what belongs to a sensor
behind them, and either way of zero.

Red when a drive that clips, or a reading that stops, is taken for a bent curve, or for each other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.effects import form_of
from focgen.rig.placed import slot_in
from focgen.rig.rig import Actuator, LinearActuator, Rig, Signals

H, T, GAIN, NOISE = 0.05, 0.6, 2.0, 0.1
LAG = TransferFunction([(0.95 * GAIN, 0.0)], [(1.06 * T, 1.0), (1.0, 0.0)])
MOTOR = Rig("motor", H, Signals("t", "w", "u"), LinearActuator(LAG))
LEVELS = (4.0, 0.0, -4.0, 8.0, -8.0, 2.0, 12.0, -2.0, -12.0, 6.0, 0.0)


def answered(drive: np.ndarray) -> np.ndarray:
    """What GAIN/(T s + 1) makes of a drive (n,) held from sample to sample."""
    num, den, _ = cont2discrete(([GAIN], [T, 1.0]), H, "zoh")
    return lfilter(num.ravel(), den, drive)


def session(ahead: float = np.inf, behind: float = np.inf) -> list[Experiment]:
    """Steps and a slow sine both ways of zero, with the drive and the reading clipped at these."""
    rng, t = np.random.default_rng(3), np.arange(800) * H
    steps = np.repeat((0.0, *LEVELS), [30, *[70] * 11])
    logs = []
    for name, command in (("steps", steps), ("sine", 12.0 * np.sin(0.5 * t))):
        made = np.clip(answered(np.clip(command, -ahead, ahead)), -behind, behind)
        roles = {"command": command, "output": made + NOISE * rng.normal(size=800)}
        logs.append(Experiment(name, H, roles))
    return [replace(log, start=50.0 * i) for i, log in enumerate(logs)]


@pytest.mark.parametrize(
    "where, effect",
    [
        pytest.param({"ahead": 9.0}, "supply_saturation", marks=pytest.mark.long),
        ({"behind": 18.0}, "sensor_saturation"),
    ],
    ids=["clipped drive", "stopped reading"],
)
def test_a_limit_is_found_on_its_side_of_the_dynamics(where, effect):
    found = diagnose(MOTOR, session(**where))
    assert [c.candidates[0].effect for c in found.causes] == [effect]
    assert found.causes[0].candidates[0].confidence > 0.8


def test_a_gauge_behind_the_only_stage_given_has_effects_of_its_own():
    """A second gauge logs the speed, and the calibration of the first is bent; the rig gives no sensor."""
    seen = replace(MOTOR, signals=Signals("t", "w", "u", curvature="c"))
    rng, logs = np.random.default_rng(5), []
    for log in session():
        true = answered(log["command"])
        roles = {"curvature": true + 0.05 * rng.normal(size=800), "output": log["output"] + 0.004 * true**2}
        logs.append(replace(log, signals={"command": log["command"], **roles}))
    (cause,) = diagnose(seen, logs).causes
    assert cause.stage == "sensor" and cause.candidates[0].effect == "sensor_nonlinearity"


@pytest.mark.parametrize(
    "where, effect",
    [("ahead", "slow_regulator"), pytest.param("behind", "sensor_lag", marks=pytest.mark.long)],
)
def test_a_lag_is_found_on_its_side_of_a_bent_gain(where, effect):
    """T y' + y = 2 u², and a lag of a fifth of T ahead of the square or behind everything."""
    film = Rig("film", H, Signals("t", "y", "u"), Actuator(1.05 * T, 1.0, (0.0, 1.9)))
    rng, t, kept = np.random.default_rng(8), np.arange(800) * H, np.exp(-H / (0.2 * T))

    def late(x: np.ndarray) -> np.ndarray:
        return lfilter([0.0, 1.0 - kept], [1.0, -kept], x)

    logs = []
    for i, command in enumerate(
        (np.abs(np.repeat((0.0, *LEVELS), [30, *[70] * 11])), 6 - 6 * np.cos(1.5 * t))
    ):
        drive = (late(command) if where == "ahead" else command) / 6.0
        made = answered(6.0 * drive**2)
        made = (late(made) if where == "behind" else made) + 0.05 * rng.normal(size=800)
        logs.append(
            replace(Experiment(str(i), H, {"command": command / 6.0, "output": made}), start=50.0 * i)
        )
    film = replace(film, actuator=Actuator(1.05 * T, 1.0, (0.0, 6.0 * 1.9)))
    found = diagnose(film, logs, only=("slow_regulator", "sensor_lag"))
    assert [c.candidates[0].effect for c in found.causes] == [effect]


@pytest.mark.parametrize(
    "effect, form, slots",
    [
        ("supply_saturation", "hard", ("supply", "load", "strain")),
        ("sensor_nonlinearity", "quadratic", ("command", "place", "strain")),
        ("gain_nonlinearity", "cubic", ("command", "drive", "strain")),
        ("transport_delay", "delay", ("supply", "response", "reading")),
        ("slow_regulator", "one_lag", ("supply", "load", "strain")),
        ("sensor_lag", "one_lag", ("supply", "response", "strain")),
        ("contact", "knee", ("supply", "response", "reading")),
    ],
)
def test_a_form_away_from_home_keeps_its_place_in_the_chain(effect, form, slots):
    """In a regulator, an actuator and a sensor."""
    made = tuple(slot_in(form_of(effect, form), stage) for stage in ("regulator", "actuator", "sensor"))
    assert made == slots
