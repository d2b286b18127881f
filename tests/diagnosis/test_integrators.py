"""A rig of one stage that adds up, and has no time constant: a motor's angle from its speed, a tank's level.

Red when a healthy one is ``unknown`` for noise that has a colour, or when a fault that the whole path shows
is no surer than the nominal chain being off.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import LinearActuator, Rig, Signals

H, GAIN, NOISE = 0.05, 0.2, 0.006


def rig(gain=GAIN):
    return Rig(
        "tank",
        H,
        Signals("t", "y", "u", "p"),
        actuator=LinearActuator(TransferFunction([(gain, 0.0)], [(1.0, 1.0)])),
    )


def moves(kind, count, rng):
    t = np.arange(count) / count
    if kind == "steps":
        return np.repeat(rng.uniform(-1.0, 1.0, 20), count // 20)
    if kind == "sine":
        return np.sin(12.0 * np.pi * t)
    return sum(np.sin(2 * np.pi * f * t + rng.uniform(0.0, 6.0)) for f in (3, 7, 11, 23)) / 3


def log(kind, rng, coloured, role="command", fault=lambda u: u, count=1400, start=0.0):
    """A log of one kind of moves: a command is held between samples, a pressure moves in lines."""
    u = moves(kind, count, rng)
    v = fault(u)
    y = GAIN * H * np.r_[0.0, np.cumsum(v[:-1] if role == "command" else 0.5 * (v[1:] + v[:-1]))]
    white = rng.normal(size=count)
    y += NOISE * np.ptp(y) * (lfilter([0.6], [1.0, -0.8], white) if coloured else white)
    return Experiment(kind, H, {role: u, "output": y}, start)


@pytest.mark.parametrize("role", ["command", pytest.param("pressure", marks=pytest.mark.long)])
@pytest.mark.parametrize("kind", ["steps", pytest.param("sine", marks=pytest.mark.long), "multisine"])
@pytest.mark.parametrize("coloured", [False, True])
def test_a_healthy_one_is_healthy(kind, coloured, role):
    """Of 16 such logs three with a colour were ``unknown``: the rig was judged by what it does within less
    than a sample, where such noise is no louder than half of itself."""
    rng = np.random.default_rng(7)
    found = diagnose(rig(GAIN * 1.03), [log(kind, rng, coloured, role, count=700)], pictures=False)
    assert found.verdict in ("none", "parameters")
    assert found.gap.floor > 0.6 * found.gap.refitted


@pytest.mark.parametrize(
    "fault, names",
    [
        pytest.param(
            lambda u: np.sign(u) * np.maximum(np.abs(u) - 0.1, 0.0),
            {"dead_zone", "friction"},
            marks=pytest.mark.long,
        ),
        pytest.param(lambda u: np.r_[np.zeros(8), u[:-8]], {"transport_delay"}, marks=pytest.mark.long),
        (lambda u: np.clip(u, -0.75, 0.75), {"supply_saturation"}),
        pytest.param(lambda u: u * (1.0 + 0.15 * u * u), {"gain_nonlinearity"}, marks=pytest.mark.long),
    ],
)
def test_what_its_whole_path_shows_is_named(fault, names):
    """A dead zone that moved the path by five times its noise had a confidence of 0.00, and a limit was
    ``unknown``. Ahead of an integral a dead zone is a dry friction."""
    rng = np.random.default_rng(0)
    logs = [log(k, rng, False, fault=fault, start=i * 70.0) for i, k in enumerate(("multisine", "steps"))]
    found = diagnose(rig(GAIN * 1.03), logs, pictures=False)
    (cause,) = found.causes
    first = {c.effect: c.confidence for c in cause.candidates[: len(names)]}
    assert set(first) == names and sum(first.values()) > 0.7
    assert found.gap.explained < 1.1 * found.gap.floor
