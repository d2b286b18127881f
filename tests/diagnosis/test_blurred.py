"""Noise ahead of a converter blurs its steps, and is read off how its readings go and come back.

Red when a rig that moves passes for noise, when steps behind noise are taken for sharper or duller than they
are, or when the curve that steps are in the mean is not what readings of one place show.
"""

from __future__ import annotations

import numpy as np
import pytest

from focgen.diagnosis.hypotheses.blurred import noise_ahead, part_that_stays

SPANS = [(0, 3000), (3000, 6000)]


def moved(pace: float = 0.003) -> np.ndarray:
    return 6.0 * np.sin(pace * np.arange(6000)) + 0.3


def read(noise: float, made: np.ndarray, seed: int = 1) -> np.ndarray:
    """Readings, in steps, of what a rig has ``made`` with ``noise``."""
    return np.round(made + noise * np.random.default_rng(seed).normal(size=len(made)))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("noise", [0.1, 0.2, 0.35, 0.5, 0.8])
def test_noise_is_found_to_a_twentieth_of_a_step(noise, seed):
    assert noise_ahead(read(noise, moved(), seed), moved(), SPANS) == pytest.approx(noise, abs=0.05)


def test_a_model_that_is_off_tells_where_the_rig_stays():
    off = 1.2 * moved() + 0.7
    assert noise_ahead(read(0.35, moved()), off, SPANS) == pytest.approx(0.35, abs=0.05)


RANDOM = np.random.default_rng(7).uniform(-3.0, 3.0, 6000)
SIGNALS = {
    **{f"a sine of {pace} a sample": moved(pace) for pace in (0.0003, 0.003, 0.03, 0.3, 1.0, 3.0)},
    "another level at every sample": RANDOM,
    "a walk": np.cumsum(np.sign(RANDOM)),
    "steps": np.repeat(RANDOM[:300], 20),
    "to and fro": np.where(np.arange(6000) % 2, 0.5, -0.5) + 0.3,
}


@pytest.mark.parametrize("signal", SIGNALS)
def test_what_moves_is_no_noise(signal):
    """A rig that answers within a sample, driven from level to level, passed for noise of half a step."""
    made = SIGNALS[signal]
    assert noise_ahead(read(0.0, made), 0.9 * made, SPANS) < 0.05


def test_a_spike_is_no_noise():
    made = moved(0.0003)
    spiked = read(0.0, made) + 6.0 * (np.arange(6000) % 200 == 100)
    assert noise_ahead(spiked, made, SPANS) < 0.05


def test_readings_too_few_tell_no_noise():
    few = moved()[:40]
    assert noise_ahead(read(0.5, few), few, [(0, 20), (20, 40)]) == noise_ahead(few, few, []) == 0.0
    assert noise_ahead(read(5.0, moved()), moved(), [(0, 1), (1, 6000)]) == 1.0


@pytest.mark.parametrize("noise", [0.05, 0.1, 0.2, 0.3])
def test_the_curve_that_stays_is_what_many_readings_of_a_place_have_in_the_mean(noise):
    """Steps without noise miss by 1/√12 of a step."""
    rng, places = np.random.default_rng(5), (np.arange(100) + 0.5) / 100
    missed = [np.mean(np.round(p + noise * rng.normal(size=200_000))) - p for p in places]
    assert np.std(missed) * np.sqrt(12.0) == pytest.approx(part_that_stays(noise), abs=0.01)
