"""C written by hand, and a few lines of Python, against the controller that focgen would have generated.

    pytest examples/port
"""

from pathlib import Path

import numpy as np
import pytest

import focgen
from focgen.testing import from_c

HERE = Path(__file__).resolve().parent


@pytest.fixture(scope="module")
def firmware(tmp_path_factory):
    """The reference: a generated folder. Yours stands in your repository."""
    folder = tmp_path_factory.mktemp("firmware")
    focgen.generate(HERE / "controller.toml", folder)
    return folder


def test_a_mirrored_history_gives_the_same_bits(assert_equivalent, firmware):
    assert_equivalent(firmware, from_c(HERE / "mirrored.c", prefix="mirrored"))


def test_four_sums_at_once_stay_within_the_bound(assert_equivalent, firmware):
    flags = ("-std=c99", "-O2", "-DFOUR_SUMS")
    port = from_c(HERE / "mirrored.c", prefix="mirrored", flags=flags)
    assert assert_equivalent(firmware, port, within="bound").share < 1.0
    with pytest.raises(AssertionError, match="differ in a bit"):
        assert_equivalent(firmware, port)


class WithNumpy:
    """The same in Python: a dot product, in whatever order numpy takes it."""

    def __init__(self):
        order, step, count = 0.5, 0.005, 24
        later = np.cumprod(1.0 - (order + 1.0) / np.arange(1, count + 1))
        self.weights = 0.4 * step**-order * np.concatenate([[1.0], later])
        self.weights[0] += 1.0
        self.gain = 3.0 * step / 2.0

    def reset(self, ref, meas, u0):
        self.errors = np.full(25, ref - meas)
        self.before, self.output = self.gain * self.weights @ self.errors, min(max(u0, 0.0), 10.0)

    def step(self, ref, meas):
        self.errors = np.concatenate([[ref - meas], self.errors[:-1]])
        now = self.gain * self.weights @ self.errors
        self.output = min(max(self.output + now + self.before, 0.0), 10.0)
        self.before = now
        return self.output

    def track(self, u):
        self.output = min(max(u, 0.0), 10.0)


def test_a_dot_product_of_numpy_stays_within_the_bound(assert_equivalent, firmware):
    assert_equivalent(firmware, WithNumpy, within="bound")
