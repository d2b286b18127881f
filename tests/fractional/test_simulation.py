"""The simulators against Mittag-Leffler functions, matrix exponentials and the plain recursion.

Red when a simulator departs from the exact response by more than its order allows.
"""

import mpmath as mp
import numpy as np
import pytest
from scipy import linalg, optimize, signal

from focgen.fractional.responses import ramp_response, step_response
from focgen.fractional.simulation import Convolution, GrunwaldLetnikov
from focgen.fractional.transfer import TransferFunction

STEP = 0.01
REGULATOR = TransferFunction([(152.48, 0)], [(1, 2), (53.39, 1), (1528, 0)])
OSCILLATING = TransferFunction([(1, 0.4), (2, 0)], [(0.2, 1.83), (0.3, 0.41), (1, 0)])
ADDING_UP = TransferFunction([(1, 0)], [(1, 1.5), (0.1, 0.5)])


def model(gain, constant, order):
    return TransferFunction([(gain, 0)], [(constant, order), (1, 0)])


def seconds(count):
    return STEP * np.arange(count)


def mittag_leffler_step(t, constant, order):
    """1 − E_α(−t^α/T) by its series in many digits: nothing here is shared with the package."""
    with mp.workdps(60):
        x = -(mp.mpf(float(t)) ** mp.mpf(order)) / mp.mpf(constant)
        terms = (x ** int(k) * mp.rgamma(mp.mpf(order) * k + 1) for k in range(int(200 / order)))
        return float(1 - mp.fsum(terms))


# Convolution -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [0.35, 0.6, 0.97, 1.3, 1.85])
def test_step_is_mittag_leffler_at_every_scale(order):
    y = Convolution(model(1.0, 1.32, order), STEP).run(np.ones(700))
    samples = [1, 2, 5, 15, 16, 17, 18, 63, 64, 65, 200, 256, 699]
    truth = [mittag_leffler_step(k * STEP, 1.32, order) for k in samples]
    assert np.max(np.abs(y[samples] - truth)) < 1e-12


@pytest.mark.parametrize(
    "order, delay, hold",
    [
        pytest.param(order, delay, hold, marks=() if (turn + i + j) % 2 == 0 else pytest.mark.long)
        for turn, order in enumerate([0.35, 0.6, 1.3])
        for i, delay in enumerate([0.3 * STEP, 2 * STEP, 17.81 * STEP])
        for j, hold in enumerate(["zero", "linear"])
    ],
)
def test_a_delayed_step_is_mittag_leffler_earlier(order, delay, hold):
    y = Convolution(model(1.0, 1.32, order), STEP, hold, delay).run(np.ones(700))
    samples = [1, 2, 5, 18, 19, 20, 63, 200, 256, 699]
    truth = [mittag_leffler_step(max(k * STEP - delay, 0.0), 1.32, order) for k in samples]
    assert np.max(np.abs(y[samples] - truth)) < 1e-12


@pytest.mark.parametrize("delay", [0.3 * STEP, 2 * STEP, 17.81 * STEP])
@pytest.mark.parametrize("transfer", [model(2.0, 1.32, 0.6), REGULATOR, OSCILLATING])
def test_a_delayed_ramp_is_the_exact_one_earlier(transfer, delay):
    t = np.maximum(seconds(700) - delay, 0.0)
    truth = ramp_response(transfer, np.maximum(t, 1e-9)) * (t > 0.0)
    y = Convolution(transfer, STEP, "linear", delay).run(seconds(700))
    assert np.max(np.abs(y - truth)) < 1e-10 * np.max(np.abs(truth))


@pytest.mark.parametrize("hold", ["zero", "linear"])
@pytest.mark.parametrize("transfer", [model(2.0, 1.32, 0.6), REGULATOR * model(1.0, 1.32, 0.6), OSCILLATING])
def test_arbitrary_inputs_superpose_exactly(hold, transfer):
    """Steps (held) or ramps (linear) laid over one another, each from the exact response."""
    count = 400
    u = 1.0 + 0.05 * np.random.default_rng(4).standard_normal(count).cumsum()
    t = seconds(count)
    if hold == "zero":
        response, changes = step_response(transfer, t), np.diff(u, prepend=0.0)
        truth = np.convolve(changes, response)[:count]
    else:
        ramp = ramp_response(transfer, t)
        slopes = np.diff(np.diff(u) / STEP, prepend=0.0)
        truth = u[0] * step_response(transfer, t) + np.convolve(np.append(slopes, 0.0), ramp)[:count]
    y = Convolution(transfer, STEP, hold).run(u)
    assert np.max(np.abs(y - truth)) < 1e-10 * np.max(np.abs(truth))


STATE_SPACES = {
    "three poles two zeros, slow and real": ([2.0, 3.0, 0.5], [1.0, 1.011, 0.01101, 1e-5]),
    "complex": ([152.48], [1.0, 53.39, 1528.0]),
    "nearly coinciding": ([1.0], np.poly([-2.0, -2.0, -2.0001])),
    "unstable": ([1.0, 1.0], [1.0, -0.2, 4.0]),
    "integrators": ([1.0, 0.3], [1.0, 0.5, 0.0, 0.0]),
    "integrator and a pole that is almost one": ([1.0], [1.0, 1e-7, 0.0]),
    "stiff": ([1.0, 1.0], [1.0, 1000.01, 10.0]),
    "feedthrough": ([2.0, 1.0], [4.0, 3.0]),
}


def state_space_simulation(num, den, u, hold):
    """Sample by sample with the matrix exponential of the input-augmented system."""
    a, b, c, d = (np.asarray(m) for m in signal.tf2ss(num, den))
    n = len(a)
    augmented = np.zeros((n + 2, n + 2))
    augmented[:n, :n], augmented[:n, n : n + 1], augmented[n, n + 1] = a * STEP, b * STEP, 1.0
    jump = linalg.expm(augmented)
    x, out = np.zeros(n), []
    for k, now in enumerate(u):
        out.append(float((c @ x + d[0] * now)[0]))
        change = u[k + 1] - now if hold == "linear" and k + 1 < len(u) else 0.0
        x = jump[:n, :n] @ x + jump[:n, n] * now + jump[:n, n + 1] * change
    return np.array(out)


@pytest.mark.parametrize("hold", ["zero", "linear"])
@pytest.mark.parametrize("name", STATE_SPACES)
def test_whole_orders_equal_the_matrix_exponential(name, hold):
    num, den = STATE_SPACES[name]
    transfer = TransferFunction(zip(num[::-1], range(9)), zip(den[::-1], range(9)))
    u = np.random.default_rng(11).standard_normal(2000) + 1.0
    truth = state_space_simulation(num, den, u, hold)
    y = Convolution(transfer, STEP, hold).run(u)
    assert np.max(np.abs(y - truth)) < 1e-10 * np.max(np.abs(truth))


@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_order_one_is_where_its_neighbours_meet(hold):
    """α = 1 goes by poles, α = 1 ± 1e-9 by the contour: two ways to the same response."""
    u = np.random.default_rng(5).standard_normal(1500).cumsum()
    at, below, above = (Convolution(model(1, 1.32, a), STEP, hold).run(u) for a in (1.0, 1 - 1e-9, 1 + 1e-9))
    assert np.max(np.abs(at - (below + above) / 2)) < 1e-11 * np.max(np.abs(at))


def test_kernel_is_kept_and_prefixes_agree():
    simulator = Convolution(OSCILLATING, STEP, "linear")
    u = np.random.default_rng(1).standard_normal(3000)
    long = simulator.run(u)
    kernel = simulator._kernel
    assert np.max(np.abs(simulator.run(u[:700]) - long[:700])) < 1e-13
    assert simulator._kernel is kernel
    assert np.max(np.abs(Convolution(OSCILLATING, STEP, "linear").run(u[:700]) - long[:700])) < 1e-12


def test_a_hundred_thousand_samples():
    y = Convolution(model(1.0, 1.32, 0.6), STEP).run(np.ones(100_000))
    samples = np.array([1, 1000, 40_000, 99_999])
    assert y[samples] == pytest.approx(step_response(model(1.0, 1.32, 0.6), samples * STEP), abs=1e-12)


@pytest.mark.parametrize("hold", [pytest.param("zero", marks=pytest.mark.long), "linear"])
@pytest.mark.parametrize("order", [0.6, 1.4])
def test_identification_has_no_bias(hold, order):
    """Noise-free Mittag-Leffler data, N = 2000, h = 10 ms: α comes back to 1e-8 (1e-5 is asked for)."""
    fitted = np.unique(np.round(np.geomspace(1, 999, 60))).astype(int)
    data = np.array([2.0 * mittag_leffler_step(k * STEP, 1.32, order) for k in fitted])
    u = np.ones(2000)

    def misfit(p):
        return Convolution(model(*p), STEP, hold).run(u)[fitted] - data

    tight = dict(xtol=1e-15, ftol=1e-15, gtol=1e-15)
    fit = optimize.least_squares(misfit, (1.0, 1.0, order - 0.1), x_scale="jac", **tight)
    assert np.max(np.abs(fit.x - (2.0, 1.32, order))) < 1e-8


# Eq. (10) --------------------------------------------------------------------------------------------


def equation_10(transfer, step, length, u):
    """Eq. (10)–(14) written out, index by index."""

    def weights(order):
        w = [1.0]
        for j in range(1, length + 1):
            w.append(w[-1] * (1 - (order + 1) / j))
        return w

    a = [(t.coefficient * step**-t.order, weights(t.order)) for t in transfer.den]
    b = [(t.coefficient * step**-t.order, weights(t.order)) for t in transfer.num]
    y = []
    for k in range(len(u)):
        past = range(1, min(length, k) + 1)
        right = sum(coefficient * (u[k] + sum(w[j] * u[k - j] for j in past)) for coefficient, w in b)
        left = sum(coefficient * sum(w[j] * y[k - j] for j in past) for coefficient, w in a)
        y.append((right - left) / sum(coefficient for coefficient, _ in a))
    return np.array(y)


LEAD = TransferFunction([(1.32, 0.6), (1, 0)], [(0.2, 1.1), (1, 0)])


@pytest.mark.parametrize("transfer", [model(1, 1.32, 0.6), LEAD])
@pytest.mark.parametrize("length", [1, 7, 60, None])
def test_equation_10_to_the_letter(transfer, length):
    u = np.random.default_rng(3).standard_normal(150)
    truth = equation_10(transfer, STEP, length or 150, u)
    y = GrunwaldLetnikov(transfer, STEP, length).run(u)
    assert np.max(np.abs(y - truth)) < 1e-12 * np.max(np.abs(truth))


@pytest.mark.parametrize("count", [513, 1024, 1025, 2600, 6000])
@pytest.mark.parametrize("length", [None, 800])
def test_blocks_equal_the_plain_recursion(count, length):
    u = np.random.default_rng(count).standard_normal(count).cumsum()
    for transfer in (model(1, 1.32, 0.6), REGULATOR * model(1, 1.32, 0.6), OSCILLATING, ADDING_UP):
        simulator = GrunwaldLetnikov(transfer, STEP, length)
        num, den = simulator.coefficients(count - 1)
        plain = signal.lfilter(num, den, u)
        # what adds up rounding errors, as an integrator does, defines neither result better than this
        condition = np.abs(den).sum() * np.abs(signal.lfilter([1.0], den, np.eye(1, count)[0])).sum()
        allowed = max(1e-12, 1e-16 * condition) if transfer is ADDING_UP else 1e-12
        assert np.max(np.abs(simulator.run(u) - plain)) < allowed * np.max(np.abs(plain))


def test_equation_10_keeps_the_first_input_and_its_bias():
    y = GrunwaldLetnikov(model(1, 1.32, 0.6), STEP).run(np.ones(3))
    assert y[0] == pytest.approx(1 / (1.32 * STEP**-0.6 + 1), rel=1e-14)
    short = GrunwaldLetnikov(model(1, 1.32, 0.6), STEP, 1000).run(np.ones(30_000))
    assert short[-1] == pytest.approx(0.870, abs=5e-4)


# Both ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("simulator", [Convolution, GrunwaldLetnikov])
def test_one_interface(simulator):
    transfer = model(1, 1.32, 0.6)
    assert simulator(transfer, STEP).run([]).shape == (0,)
    assert simulator(transfer, STEP).run([1]).shape == (1,)
    assert simulator(transfer, STEP).run(range(40)).shape == (40,)
    with pytest.raises(ValueError, match="2 dimensions"):
        simulator(transfer, STEP).run(np.ones((3, 3)))
    with pytest.raises(ValueError, match="step is 0.0 s"):
        simulator(transfer, 0.0)
    with pytest.raises(ValueError, match="improper"):
        simulator(TransferFunction([(1, 1)]), STEP).run([1.0])


def test_options_are_checked():
    with pytest.raises(ValueError, match="'cubic'"):
        Convolution(model(1, 1, 0.5), STEP, "cubic")
    with pytest.raises(ValueError, match="memory length is 0"):
        GrunwaldLetnikov(model(1, 1, 0.5), STEP, 0)
    with pytest.raises(ValueError, match="leading coefficients"):
        GrunwaldLetnikov(TransferFunction([(1, 0)], [(1, 1), (-100, 0)]), STEP).run([1.0])
