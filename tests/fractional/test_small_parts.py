"""Elementary functions at their ends, weights at their limits, transfer functions as text and as pictures.

Red when a digit is lost at an end of a range, or a text does not say what it stands for.
"""

import importlib.util
import math
import subprocess
import sys
from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest

import focgen.fractional
from focgen.fractional import convert, elementary, simulation, weights
from focgen.fractional.discrete import gl_frequency_response
from focgen.fractional.recursion import ExponentialRecursion
from focgen.fractional.responses import mittag_leffler, ramp_response, step_response
from focgen.fractional.simulation import Convolution, GrunwaldLetnikov, divided, gl_operator
from focgen.fractional.transfer import Term, TransferFunction, polynomial
from focgen.fractional.weights import gl_weights, gl_weights_at, short_memory_bias
from tests.fractional.test_elementary import relative_errors

LAG = TransferFunction([(1, 0)], [(1.32, 0.6), (1, 0)])


# Elementary functions ----------------------------------------------------------------------------------


def test_exponentials_are_right_on_either_side_of_every_part_of_an_octave():
    edges = (np.arange(-64, 65) + 0.5) * math.log(2.0) / 32.0
    x = np.concatenate([edges, np.nextafter(edges, 9.0), edges * 15.0, [-708.0, 709.7, 1e-300, 0.0]])
    assert relative_errors(elementary.exp(x), mp.exp, x).max() < 2.0 * 2.0**-53
    tiny = np.array([-720.0, -740.0])
    assert elementary.exp(tiny) == pytest.approx(np.exp(tiny), abs=5e-324, rel=1e-2)


def test_exponentials_less_one_keep_their_digits_where_they_are_small():
    edge = math.log(2.0) / 64.0
    x = np.array(
        [1e-300, -1e-17, 1e-9, 0.3 * edge, 0.999 * edge, -0.999 * edge, 1.01 * edge, -1.01 * edge, 0.5]
    )
    assert relative_errors(elementary.expm1(x), mp.expm1, x).max() < 1e-14
    assert relative_errors(elementary.expm1(x[:6]), mp.expm1, x[:6]).max() < 4.0 * 2.0**-53


def test_logarithms_are_right_next_to_where_their_octave_changes():
    places = math.sqrt(0.5) * 2.0 ** np.arange(-3, 4)
    x = np.concatenate(
        [places, np.nextafter(places, 9.0), np.nextafter(places, 0.0), [1.0 - 2.0**-53, 5e-300]]
    )
    assert relative_errors(elementary.log(x), mp.log, x).max() < 2.0 * 2.0**-53


def test_sines_are_right_where_they_are_small_and_cosines_too():
    x = np.array([1e-300, 1e-8, 0.1, 0.7, 1.2, 1.5, math.pi / 2])
    sine, cosine = elementary.sine_cosine(x)
    assert relative_errors(sine, mp.sin, x).max() < 2e-16
    assert relative_errors(cosine[:5], mp.cos, x[:5]).max() < 3e-16
    assert np.abs(cosine - [float(mp.cos(v)) for v in x]).max() < 2e-16


def test_powers_beyond_all_numbers_are_infinite_or_nothing():
    assert elementary.power(1e-300, -2.0) == math.inf and elementary.power(1e300, -2.0) == 0.0
    found = elementary.powers(np.array([0.0, 1e-200, 0.5]), np.array([0.0, 1.0, 2.0]))
    assert found[:, 0].tolist() == [1.0, 1.0, 1.0] and found[0, 1] < 1e-300 and found[1, 2] == 0.0
    assert found[1:, 1] == pytest.approx([1e-200, 0.5], rel=1e-13)


@pytest.mark.parametrize("rows", [3, 8, 9, 33])
@pytest.mark.parametrize("tilt", [1e-9, -1e-9, 1.0, 0.0])
def test_reflections_lose_no_digits_on_columns_that_are_nearly_reflected(rows, tilt):
    """A first column along the first axis, one way and the other: the least squares in rational numbers."""
    rng = np.random.default_rng(rows)
    matrix, right = rng.normal(size=(rows, 2)), rng.normal(size=rows)
    matrix[1:, 0] *= tilt
    for sign in (1.0, -1.0):
        matrix[0, 0] = sign * abs(matrix[0, 0])
        a, b = ([Fraction(v) for v in column] for column in matrix.T.tolist())
        y = [Fraction(v) for v in right.tolist()]
        aa, ab, bb, ay, by = (
            sum(u * v for u, v in zip(*p)) for p in ((a, a), (a, b), (b, b), (a, y), (b, y))
        )
        exact = [
            float((ay * bb - by * ab) / (aa * bb - ab**2)),
            float((by * aa - ay * ab) / (aa * bb - ab**2)),
        ]
        assert elementary.least_squares(matrix, right) == pytest.approx(exact, rel=1e-13, abs=1e-14)


def test_systems_are_solved_with_the_largest_pivot_and_left_as_they_were():
    matrix, right = np.array([[1e-20, 1.0], [1.0, 1.0]]), np.array([1.0, 2.0])
    before = matrix.copy(), right.copy()
    assert elementary.solve(matrix, right) == pytest.approx([1.0, 1.0], rel=1e-14)
    assert np.array_equal(matrix, before[0]) and np.array_equal(right, before[1])
    assert elementary.solve(np.array([[4.0]]), np.array([2.0])).tolist() == [0.5]
    assert elementary.solve(np.zeros((1, 1)), np.ones(1)) is None
    assert elementary.least_squares(np.array([[-4.0]]), np.array([2.0])).tolist() == [-0.5]


def test_bounds_are_rounded_up_to_as_many_digits_as_asked():
    assert [elementary.rounded_up(x, 2) for x in (1.51e-5, 0.0999, 120.0, 121.0)] == [
        1.6e-5,
        0.1,
        120.0,
        130.0,
    ]
    assert (
        elementary.rounded_up(0.123456, 3) == 0.124
        and elementary.rounded_up(math.nextafter(2.0, 3), 1) == 3.0
    )


# Weights -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [-101.0, -100.3, -37.2, 24.5, 60.5, 100.5])
def test_weights_of_large_orders_are_exact_where_the_recursion_ends(order):
    last = max(128, math.ceil(40.0 * abs(order)))
    places = np.array(
        [0, 1, last - 1, last, last + 1, last + 2, 2 * last]
    )  # far beyond, no number holds them
    with mp.workdps(60):
        exact = [mp.gammaprod([int(j) - mp.mpf(order)], [-mp.mpf(order), int(j) + 1]) for j in places]
        found = gl_weights_at(order, places)
        assert max(abs(float(w / e - 1)) for w, e in zip(map(mp.mpf, found.tolist()), exact)) < 1e-12


def test_orders_are_taken_to_their_limits():
    assert gl_weights(101.0, 3).tolist() == [1.0, -101.0, 5050.0, -166650.0]
    assert gl_weights(-101.0, 2).tolist() == [1.0, 101.0, 5151.0]
    assert short_memory_bias(-100.0, 2) == 5151.0
    for order in (101.0000001, -101.0000001, 102.0, math.nan, -math.inf):
        with pytest.raises(ValueError, match=f"the order {order} is not a number between -100 and 100"):
            gl_weights_at(order, [1])
    assert gl_weights(0.0, 4).tolist() == [1.0, 0.0, 0.0, 0.0, 0.0]
    assert gl_weights(-1.0, 300) == pytest.approx(np.ones(301), rel=1e-13)
    assert gl_weights_at(0.6, np.empty(0, int)).shape == (0,)
    assert gl_weights_at(2.0, np.array([[0, 2], [1, 50]])).tolist() == [[1.0, 1.0], [-2.0, 0.0]]
    with pytest.raises(ValueError, match="the number of weights is -1, it must be at least 0"):
        gl_weights(0.6, -1)


@pytest.mark.parametrize("order", [0.6, -0.4, 2.7])
def test_the_series_is_exact_to_rounding_from_where_it_is_used(order):
    """ln Γ(j − α)/Γ(j + 1) by the series alone, against many digits."""
    with mp.workdps(40):
        for place in (128, 1000):
            x = mp.mpf(place) - mp.mpf(order) / 2
            exact = (
                mp.loggamma(place - mp.mpf(order)) - mp.loggamma(place + 1) + (mp.mpf(order) + 1) * mp.log(x)
            )
            assert float(weights._series(order, float(x))) == pytest.approx(float(exact), rel=1e-7, abs=1e-17)


# Transfer functions ------------------------------------------------------------------------------------


@pytest.mark.parametrize("num, den, text", [
    ([(1, 0)], [(1, 0)], "1"), ([], [(1, 0)], "0"), ([(1, 1)], [(1, 0)], "s"), ([(2, 1)], [(1, 0)], "2 s"),
    ([(1, 0.6), (-2.5, 0)], [(1, 0)], "s^0.6 - 2.5"), ([(1, 0)], [(4, 0.6), (1, 0)], "(1) / (4 s^0.6 + 1)"),
    ([(-3, 2), (1, -0.5)], [(2, 0)], "(-3 s^2 + s^-0.5) / (2)"), ([(1, 0)], [(1, 1)], "(1) / (s)"),
])  # fmt: skip
def test_a_text_says_what_it_stands_for(num, den, text):
    assert str(TransferFunction(num, den)) == text


def test_terms_are_collected():
    assert polynomial([(1, 0.5), (2, 1), (3, 0.5), (-2, 1)]) == (Term(4.0, 0.5),)
    assert polynomial([(1, 0), (1, 2), (1, 1)]) == (Term(1.0, 2.0), Term(1.0, 1.0), Term(1.0, 0.0))
    for bad in ((math.inf, 1.0), (1.0, math.nan)):
        with pytest.raises(ValueError, match="is not finite"):
            polynomial([bad])


@pytest.mark.parametrize("num, den, gain, proper", [
    ([(3, 0.6), (1, 0)], [(2, 0.6), (4, 0)], 0.25, True), ([(3, 0.6)], [(2, 0.6)], 1.5, True),
    ([(3, 0.6)], [(2, 0.8), (1, 0.7)], math.inf, True), ([(3, 0.7)], [(2, 0.6)], 0.0, False),
    ([(3, -0.5)], [(-2, 0)], -math.inf, True),
])  # fmt: skip
def test_gains_at_rest_and_properness(num, den, gain, proper):
    made = TransferFunction(num, den)
    assert (made.dc_gain, made.is_proper) == (gain, proper)


def test_numbers_take_part_in_the_algebra():
    assert 2.0 * LAG == LAG * 2.0 == TransferFunction([(2, 0)], LAG.den)
    assert 1.0 + LAG == LAG + 1.0 == TransferFunction([(1.32, 0.6), (2, 0)], LAG.den)
    assert LAG - 1.0 == TransferFunction([(-1.32, 0.6)], LAG.den) and -LAG == LAG * -1.0
    assert (LAG - LAG).num == ()


def test_corners_are_where_two_terms_balance():
    """Three terms below, two above: corners 10, 1/4 and (1/40)^(1/2) below, 300 above, two decades beyond."""
    transfer = TransferFunction([(1, 0.5), (300.0**0.5, 0)], [(4, 2), (40, 1), (1, 0)])
    found = convert.corners(transfer)
    assert found[[0, -1]] == pytest.approx([0.025 / 100.0, 300.0 * 100.0]) and len(found) == 400
    assert np.diff(np.log(found)) == pytest.approx(np.full(399, math.log(300.0 / 0.025 * 1e4) / 399))
    assert convert.corners(TransferFunction([(3, 1)]))[[0, -1]] == pytest.approx([0.01, 100.0])


def test_python_control_is_not_needed_before_it_is_used(monkeypatch):
    monkeypatch.setitem(sys.modules, "control", None)
    found = importlib.util.find_spec("focgen.fractional.convert")
    again = importlib.util.module_from_spec(found)
    found.loader.exec_module(again)
    assert again.corners(LAG)[0] > 0.0


def test_every_public_name_is_loaded_where_it_is_first_used():
    """Nothing before: scipy takes its time. In a process of its own, which has loaded nothing yet."""
    script = "import sys, focgen.fractional as f; assert 'scipy' not in sys.modules and 'bode' in dir(f)"
    subprocess.run([sys.executable, "-c", script], check=True)
    assert set(focgen.fractional.__all__) == set(focgen.fractional._NAMES)
    for name in focgen.fractional.__all__:
        assert getattr(focgen.fractional, name).__name__ == name or name == "Simulator"
    assert not hasattr(focgen.fractional, "nothing")


def test_limits_of_frequencies_and_delays():
    assert LAG.to_frd([1e-300]).omega.tolist() == [1e-300]
    assert np.ravel(LAG.to_frd(2.0, 0.0).complex) == pytest.approx(LAG.frequency_response([2.0]))
    for delay in (math.inf, math.nan, -1e-300):
        with pytest.raises(ValueError, match="it must be 0 s or more"):
            LAG.to_frd([1.0], delay)


# Responses and simulators ------------------------------------------------------------------------------


@pytest.mark.parametrize("alpha", [0.0, -1.0, 100.0, math.nan])
def test_orders_of_mittag_leffler_are_limited(alpha):
    with pytest.raises(ValueError, match=f"alpha is {alpha}, it must lie between 0 and 100"):
        mittag_leffler(alpha, 1.0, [0.5])


def test_mittag_leffler_of_large_orders_and_either_sign():
    """E_{4,1}(z⁴) = (cosh z + cos z)/2, E_{4,1}(−4 z⁴) = cosh z cos z, E_{3,1} by its series."""
    z = np.array([0.3, 1.0, 2.0, 4.0])
    assert mittag_leffler(4.0, 1.0, z**4) == pytest.approx((np.cosh(z) + np.cos(z)) / 2, rel=1e-12)
    assert mittag_leffler(4.0, 1.0, -4 * z**4) == pytest.approx(np.cosh(z) * np.cos(z), rel=1e-10, abs=1e-11)
    series = [math.fsum(x**k / math.factorial(3 * k + 1) for k in range(40)) for x in (-30.0, 30.0)]
    assert mittag_leffler(3.0, 2.0, [-30.0, 30.0]) == pytest.approx(series, rel=1e-11)
    assert mittag_leffler(0.6, 1.0, [[0.0], [1.0]]).shape == (2, 1)


def test_a_ramp_is_the_integral_of_a_step_and_begins_at_rest():
    t = np.array([-1.0, 0.0, 0.5, 2.0])
    assert ramp_response(TransferFunction([(1, 0)], [(1, 1), (1, 0)]), t) == pytest.approx(
        np.where(t > 0, t - 1.0 + np.exp(-np.maximum(t, 0)), 0.0), abs=1e-13
    )
    assert step_response(LAG, []).shape == (0,) and step_response(LAG, [[0.0, -1.0]]).tolist() == [[0.0, 0.0]]


@pytest.mark.parametrize("step", [0.0, -0.1, math.inf, math.nan])
def test_steps_that_are_none_are_refused(step):
    for simulator in (Convolution, GrunwaldLetnikov, lambda t, h: ExponentialRecursion(t, h, 1000, 1e-4)):
        with pytest.raises(ValueError, match=f"the step is {step} s, it must be positive"):
            simulator(LAG, step)


@pytest.mark.parametrize("count", [511, 512, 513, 1537, 4096, 5000])
def test_a_division_is_its_product_undone(count):
    """In rational numbers' place: integers, whose sums are exact."""
    rng = np.random.default_rng(count)
    den, y = np.zeros(count), rng.integers(-3, 4, count).astype(float)
    den[0], den[1], den[count // 2], den[-1] = 1.0, -1.0, 1.0, 2.0
    right = np.convolve(den, y)[:count]
    assert divided(right, den) == pytest.approx(y, abs=1e-9)
    assert simulation._product(den, y) == pytest.approx(right, abs=1e-9)


def test_operators_add_their_terms():
    terms = TransferFunction([(2, 0.6), (3, 1), (-1, 0)]).num
    found = gl_operator(terms, 0.1, 5)
    exact = 2 * 0.1**-0.6 * gl_weights(0.6, 5) + 3 / 0.1 * gl_weights(1.0, 5) - gl_weights(0.0, 5)
    assert found == pytest.approx(exact, rel=1e-14)
    assert gl_operator((), 0.1, 2).tolist() == [0.0, 0.0, 0.0]
    num, den = GrunwaldLetnikov(LAG, 0.1, 4).coefficients(2)
    assert len(num) == len(den) == 3 and len(GrunwaldLetnikov(LAG, 0.1, 4).coefficients(9)[1]) == 5
    omega = np.array([0.5, 3.0])
    infinite = gl_frequency_response(LAG, 0.1, None, omega)
    exact = 1.0 / (1.32 * ((1.0 - np.exp(-0.1j * omega)) / 0.1) ** 0.6 + 1.0)
    assert infinite == pytest.approx(exact, rel=1e-13)


def test_a_memory_of_one_sample_is_the_shortest():
    y = GrunwaldLetnikov(LAG, 0.1, 1).run([1.0, 0.0])
    lead = 1.32 * 0.1**-0.6
    assert y == pytest.approx([1.0 / (lead + 1.0), 0.6 * lead / (lead + 1.0) ** 2], rel=1e-14)


@pytest.mark.parametrize("transfer", [
    TransferFunction([(1, 0)], [(1, 2), (0.4, 1.3), (2, 0.7), (3, 0)]),
    TransferFunction([(2, 1), (1, 0)], [(1, 1)]),
    TransferFunction([(2, 1.5), (1, 0)], [(1, 1.5), (0.5, 1), (1, 0)]),
    TransferFunction([], [(1, 0.5), (1, 0)]), TransferFunction([(3, 0)]),
], ids=str)  # fmt: skip
def test_a_recursion_of_modes_is_the_whole_sum(transfer):
    u = np.random.default_rng(2).normal(size=600)
    made = ExponentialRecursion(transfer, 0.05, 1000, 1e-5)
    whole = GrunwaldLetnikov(transfer, 0.05).run(u)
    assert np.abs(made.run(u) - whole).max() <= 1e-5 * max(np.abs(whole).max(), 1.0)
    fractional = [t for t in transfer.num + transfer.den if not t.order.is_integer()]
    assert (made.states > 0) == bool(fractional)
