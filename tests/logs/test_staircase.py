"""A pressure that only jumps and rests is held between its samples, and has no noise of its gauge.

Red when levels near one another pass for one, or a ramp, a sine, a lag or a walk for a staircase.
"""

import numpy as np
import pytest

from focgen.logs.staircase import staircase_of

N, HOLD = 1000, 25


def levels(rng):
    return np.repeat(rng.uniform(0.0, 3.0, N // HOLD), HOLD)


def lagging(rng):
    """A valve's answer to steps, from most of a step within a sample to a twentieth."""
    asked, kept, made = levels(rng), np.exp(-1.0 / rng.uniform(0.7, 20.0)), np.zeros(N)
    for i in range(1, N):
        made[i] = kept * made[i - 1] + (1.0 - kept) * asked[i - 1]
    return made


OTHERS = {
    "sine": lambda rng: 1.5 + 1.5 * np.sin(2.0 * np.pi * np.arange(N) / rng.uniform(20.0, 2000.0)),
    "ramps": lambda rng: np.interp(np.arange(N) / 100.0, np.arange(12), rng.uniform(0.0, 3.0, 12)),
    "lag": lagging,
    "walk": lambda rng: np.cumsum(rng.normal(0.0, 0.05, N)),
}


@pytest.mark.parametrize("noise", [0.006, 0.03])
def test_levels_are_the_means_of_their_readings(noise):
    found = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        true = levels(rng)
        steps = staircase_of(true + rng.normal(0.0, noise, N))
        found += steps is not None
        if steps is not None:  # a level within its neighbour's noise may be taken for that
            assert np.sqrt(np.mean((steps - true) ** 2)) < 0.5 * noise
    assert found >= 34


@pytest.mark.parametrize("kind", OTHERS)
def test_what_moves_otherwise_is_no_staircase(kind):
    for seed in range(40):
        rng = np.random.default_rng(seed)
        noise = rng.choice([0.006, 0.03, 0.06])
        assert staircase_of(OTHERS[kind](rng) + rng.normal(0.0, noise, N)) is None


def test_a_staircase_without_noise_is_itself():
    true = levels(np.random.default_rng(1))
    np.testing.assert_array_equal(staircase_of(true), true)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_levels_are_levels_as_well(count):
    """The bound on their slopes knows how many there are: by chance one of two has a large one."""
    for seed in range(100):
        rng = np.random.default_rng(seed)
        true = np.repeat(np.arange(float(count)), 200)
        steps = staircase_of(true + rng.normal(0.0, 0.003, len(true)))
        assert steps is not None and np.max(np.abs(steps - true)) < 0.002
