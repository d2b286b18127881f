"""The recursion of exponential memories: the whole Grünwald–Letnikov sum, in a few dozen modes.

Red when a recursion departs from the whole sum by more than its tolerance.
"""

import numpy as np
import pytest

from focgen.fractional.recursion import ExponentialRecursion
from focgen.fractional.responses import step_response
from focgen.fractional.simulation import GrunwaldLetnikov
from focgen.fractional.transfer import TransferFunction

LAG = TransferFunction([(1.0, 0.0)], [(1.32, 0.6), (1.0, 0.0)])
CASES = {
    "lag": LAG,
    "nearly whole": TransferFunction([(1.0, 0.0)], [(1.32, 0.97), (1.0, 0.0)]),
    "oscillating": TransferFunction([(1.0, 0.0)], [(0.1, 1.9), (1.0, 0.0)]),
    "two powers": TransferFunction([(1.0, 0.0)], [(0.5, 1.4), (1.0, 0.3), (2.0, 0.0)]),
    "numerator": TransferFunction([(0.2, 0.5), (1.0, 0.0)], [(0.1, 2.0), (1.0, 1.2), (1.0, 0.0)]),
    "whole": TransferFunction([(1.0, 0.0)], [(1.0, 1.0), (1.0, 0.0)]),
    "derivative": TransferFunction([(3.0, 0.4), (1.0, 0.0)], [(2.0, 0.4)]),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("tolerance", [1e-4, pytest.param(1e-8, marks=pytest.mark.long)])
def test_it_is_the_whole_sum(name, tolerance):
    u = np.random.default_rng(5).normal(size=4000).cumsum()
    whole = GrunwaldLetnikov(CASES[name], 0.01).run(u)
    found = ExponentialRecursion(CASES[name], 0.01, 10_000, tolerance).run(u)
    assert np.abs(found - whole).max() <= tolerance * np.abs(whole).max()


def test_it_arrives_after_hours():
    """A day at 0.1 s: where Mittag-Leffler has it, within the O(h) of the sum itself."""
    count = 864_001
    found = ExponentialRecursion(LAG, 0.1, 1_000_000, 1e-6).run(np.ones(count))
    places = np.array([10_000, 100_000, count - 1])
    assert found[places] == pytest.approx(step_response(LAG, 0.1 * places), abs=3e-6)


def test_it_starts_at_rest_and_is_linear():
    made = ExponentialRecursion(LAG, 0.01, 1000, 1e-6)
    a, b = np.random.default_rng(0).normal(size=(2, 500))
    assert made.run(2.0 * a - b) == pytest.approx(2.0 * made.run(a) - made.run(b), abs=1e-12)
    late = np.concatenate([np.zeros(7), a])
    assert made.run(late) == pytest.approx(np.concatenate([np.zeros(7), made.run(a)]), abs=1e-12)
    assert made.run([]).shape == (0,)


@pytest.mark.parametrize(
    "transfer, step, said",
    [
        (LAG.inverse(), 0.01, "improper"),
        (LAG, 0.0, "positive"),
        (TransferFunction([(1.0, 0.0)], [(1.0, 2.5), (1.0, 0.0)]), 0.01, "not between"),
        (TransferFunction([(1.0, -1.0)], [(1.0, 0.0)]), 0.01, "negative"),
    ],
)
def test_what_it_cannot_do_is_refused(transfer, step, said):
    with pytest.raises(ValueError, match=said):
        ExponentialRecursion(transfer, step, 1000, 1e-4)
