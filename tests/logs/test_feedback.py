"""A loop whose reference nobody logged shows in the command, and a command made in the open shows none.

Red when the gain that a controller has is not found to some per cent, when the output's noise is still in
what was asked for, or when a command of any usual kind passes for a controller's.
"""

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.logs.experiment import Experiment
from focgen.logs.feedback import unlogged_reference

N, NOISE = 1500, 0.02


def loop(seed, gain, later=0, limit=np.inf, colour=0.0):
    """A first-order rig that a PI controller of this ``gain`` leads, which reads so many samples ``later``,
    and the noise of the reading (n,)."""
    rng = np.random.default_rng(seed)
    e = lfilter([NOISE * np.sqrt(1.0 - colour**2)], [1.0, -colour], rng.normal(size=N))
    r = np.repeat(rng.uniform(0.0, 2.0, N // 150), 150)
    u, y, x, total = np.zeros(N), np.zeros(N), 0.0, 0.0
    for k in range(N):
        y[k] = x + e[k]
        error = r[k] - y[max(k - later, 0)]
        u[k] = np.clip(gain * error + total, -limit, limit)
        total += 0.03 * gain * error if abs(u[k]) < limit else 0.0
        x += 0.05 * (1.5 * u[k] - x)
    return Experiment("e", 0.1, {"command": u, "output": y}), e


@pytest.mark.parametrize("gain", [0.2, 1.0, 3.0])
@pytest.mark.parametrize("later", [0, 1, 2, 3])
@pytest.mark.parametrize("limit, colour", [(np.inf, 0.0), (1.2, 0.0), (np.inf, 0.8)])
def test_the_output_s_noise_is_taken_out_of_the_command(gain, later, limit, colour):
    log, e = loop(7, gain, later, limit, colour)
    asked = unlogged_reference(log)
    free = np.abs(log["command"]) < limit
    read = np.r_[np.full(later, log["output"][0]), log["output"]][:N]
    taken = np.polyfit(read[free], (asked - log["command"])[free], 1)[0]
    assert taken == pytest.approx(gain, rel=0.05)
    bends, shaken = (np.diff(v, 2) for v in (asked, np.r_[np.zeros(later), e][:N]))
    usual = np.abs(bends) < 5.0 * np.median(np.abs(bends))  # but for steps of the reference
    assert np.std(bends[usual]) < 0.15 * gain * np.std(shaken)


KINDS = {
    "steps": lambda t, rng: np.repeat(rng.normal(size=len(t) // 40 + 1), 40)[: len(t)],
    "random steps": lambda t, rng: rng.choice([-1.0, 1.0], len(t)),
    "slow random steps": lambda t, rng: np.repeat(rng.choice([-1.0, 1.0], len(t) // 3 + 1), 3)[: len(t)],
    "sines": lambda t, rng: sum(
        rng.uniform(0.2, 1.0) * np.sin(2.0 * np.pi * t / rng.uniform(4.0, 400.0)) for _ in range(5)
    ),
    "chirp": lambda t, rng: np.sin(2.0 * np.pi * (t / 800.0 + 0.1 * t**2 / len(t) / 2.0)),
    "noise": lambda t, rng: lfilter([1.0], [1.0, -rng.uniform(0.5, 0.99)], rng.normal(size=len(t))),
    "saw": lambda t, rng: t % 37.0 / 37.0,
    "rest": lambda t, rng: np.zeros(len(t)),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("rings", [False, True])
def test_a_command_made_in_the_open_is_no_controller_s(kind, rings):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        u = KINDS[kind](np.arange(N, dtype=float), rng)
        u = np.round(u, 2) if seed % 3 == 0 else u
        pole = np.exp(-1.0 / rng.choice([0.5, 3.0, 20.0]))
        y = lfilter([0.0, 1.0 - pole], [1.0, -pole], u)
        if rings:
            w, q = 2.0 * np.pi / rng.uniform(4.0, 60.0), 0.97
            y = lfilter([0.0, 0.1], [1.0, -2.0 * q * np.cos(w), q * q], y)
        y = y + rng.normal(0.0, rng.choice([1e-4, 0.01, 0.1]) * max(np.std(y), 1.0), N)
        assert unlogged_reference(Experiment("e", 0.1, {"command": u, "output": y})) is None


def test_a_rig_of_negative_gain_that_answers_within_the_sample_is_no_loop():
    pole = np.exp(-0.25)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        u = lfilter([1.0], [1.0, -0.9], rng.normal(size=N))
        y = -1.5 * lfilter([1.0 - pole], [1.0, -pole], u)
        y = y + rng.normal(0.0, 0.01 * np.std(y), N)
        assert unlogged_reference(Experiment("e", 0.1, {"command": u, "output": y})) is None


@pytest.mark.parametrize("colour", [0.0, 0.9])
@pytest.mark.parametrize("noise", [0.0, 1e-4, 1e-3, 0.01, 0.1])
def test_a_rig_that_answers_within_the_sample_alone_is_no_loop(colour, noise):
    """Of those whose last samples have no part in the next reading, half were taken for loops."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        pole = np.exp(-1.0 / rng.choice([0.5, 3.0, 20.0]))
        u = lfilter([1.0], [1.0, -colour], rng.normal(size=N))
        y = lfilter([1.0 - pole], [1.0, -pole], u)
        y = y + rng.normal(0.0, 1.0, N) * noise * np.std(y)
        assert unlogged_reference(Experiment("e", 0.1, {"command": u, "output": y})) is None


def test_a_controller_of_a_rig_of_negative_gain_is_found():
    log, _ = loop(7, 1.0)
    turned = Experiment("e", 0.1, dict(log.signals, command=-log["command"]))
    np.testing.assert_allclose(unlogged_reference(turned), -unlogged_reference(log), atol=1e-9)


@pytest.mark.parametrize("lacking", ["command", "output"])
def test_what_lacks_a_signal_shows_no_loop(lacking):
    log, _ = loop(1, 1.0)
    kept = {role: v for role, v in log.signals.items() if role != lacking}
    assert unlogged_reference(Experiment("e", 0.1, kept | {"pressure": log["command"]})) is None


def test_short_logs_and_holes_show_no_loop():
    log, _ = loop(1, 1.0)
    short = {role: v[:80] for role, v in log.signals.items()}
    assert unlogged_reference(Experiment("e", 0.1, short)) is None
    holed = dict(log.signals, output=np.where(np.arange(N) == 5, np.nan, log["output"]))
    assert unlogged_reference(Experiment("e", 0.1, holed)) is None
