"""The generator's simulator against exact responses, and its memory against the plain sum.

Red when the generator departs from the exact response.
"""

import mpmath
import numpy as np
import pytest

from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import Actuator, LinearActuator, Rig, Signals
from focgen.trials.history import BLOCK, Memory, l1_weights
from focgen.trials.machine import Machine, Session, simulate

SIGNALS = Signals("t", "y", command="u")


def mittag_leffler_step(t: float, T: float, alpha: float) -> float:
    """1 − E_alpha(−t^alpha / T) by its series in 60 digits."""
    with mpmath.workdps(60):
        z = -(mpmath.mpf(t) ** alpha) / T
        return float(1 - mpmath.nsum(lambda k: z**k / mpmath.gamma(alpha * k + 1), [0, mpmath.inf]))


@pytest.mark.parametrize("T, alpha", [(1.32, 0.6), (0.7, 0.8), (2.0, 0.5)])
def test_fractional_step_follows_mittag_leffler(T, alpha):
    rig = Rig("x", 0.02, SIGNALS, Actuator(T, alpha, (2.0,)))
    trace = simulate(Machine(rig), [np.full(9000, 0.5)], [0.0], 0.0025)[0]
    for t in (0.5, 2.0, 10.0):  # 10 s lie 16 blocks back
        assert trace.curvature[round(t / 0.0025)] == pytest.approx(mittag_leffler_step(t, T, alpha), abs=1e-3)


def test_integer_stages_follow_exponentials():
    den = [(1.0, 2.0), (3.0, 1.0), (2.0, 0.0)]  # (s + 1)(s + 2)
    plant = LinearActuator(TransferFunction([(1.0, 1.0), (2.0, 0.0)], den), offset=0.3)
    rig = Rig("x", 0.02, SIGNALS, plant, sensor=TransferFunction([(5.0, 0.0)], [(1.0, 1.0), (5.0, 0.0)]))
    trace = simulate(Machine(rig), [np.ones(2000)], [0.0], 0.005)[0]
    t = trace.time
    assert np.allclose(trace.curvature, 0.3 + 1 - np.exp(-t), atol=6e-3)  # the command acts one step late
    exact = 0.3 + 1 - (5 * np.exp(-t) - np.exp(-5 * t)) / 4
    assert np.allclose(trace.output, exact, atol=6e-3)


@pytest.mark.parametrize("count", [100, BLOCK, 3 * BLOCK + 17, 8 * BLOCK + 1])
def test_online_memory_equals_the_plain_sum(count):
    rng = np.random.default_rng(count)
    memory = Memory(l1_weights(0.6, count))
    memory.d[:] = 0.0
    increments, sums = rng.normal(size=count), np.zeros(count)
    for block, first in enumerate(range(0, count, BLOCK)):
        for n in range(first, min(first + BLOCK, count)):
            sums[n] = memory.far[n] + memory.w[1 : n - first + 1] @ memory.d[first:n][::-1]
            memory.d[n] = increments[n]
        memory.spread(block + 1)
    plain = np.convolve(memory.w, increments)[:count] - memory.w[0] * increments
    assert np.allclose(sums, plain, atol=1e-11)


def test_converges_with_the_step():
    rig = Rig("x", 0.02, SIGNALS, Actuator(1.3, 0.6, (1.0, 0.5)))

    def curvature(h):
        wave = 0.5 - 0.5 * np.cos(2 * np.pi * 0.3 * np.arange(round(10 / h)) * h)
        return simulate(Machine(rig), [wave], [0.0], h)[0].curvature[:: round(0.01 / h)]

    coarse, fine, finest = (curvature(h) for h in (0.01, 0.00125, 0.000625))
    assert np.abs(fine - finest).max() < 0.2 * np.abs(coarse - finest).max()


def test_rest_forgets_the_linear_state_only():
    rig = Rig("x", 0.02, SIGNALS, Actuator(1.3, 0.6, (1.0,)))
    session = Session(Machine(rig), 0.01)
    first, second = session.run(np.ones(500), 0.0), session.run(np.ones(500), 100.0)
    assert np.array_equal(first.output, second.output)
