"""The algebra of transfer functions with real orders: laws, exact equality, frequency response.

Red when a law of the algebra fails, or two equal functions compare as different.
"""

import cmath
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from focgen.fractional.transfer import Term, TransferFunction, polynomial

# Coefficients and orders that sums and products keep exact, so that the laws hold number for number.
coefficients = st.integers(-64, 64).map(lambda n: n / 8)
orders = st.integers(-8, 24).map(lambda n: n / 8)
terms = st.lists(st.tuples(coefficients, orders), max_size=4)
nonzero = terms.filter(lambda t: polynomial(t))
transfers = st.builds(TransferFunction, terms, nonzero)
quick = settings(max_examples=60, deadline=None)


@quick
@given(transfers, transfers, transfers)
def test_laws_hold_number_for_number(a, b, c):
    assert a * b == b * a and hash(a * b) == hash(b * a)
    assert (a * b) * c == a * (b * c)
    assert a + b == b + a
    assert a * 1.0 == a == 1.0 * a
    assert a + 0.0 == a == 0.0 + a
    assert --a == a


@quick
@given(transfers, transfers, st.floats(-2, 2), st.floats(-3.1, 3.1))
def test_series_and_parallel_at_any_frequency(a, b, decade, angle):
    s = cmath.rect(10.0**decade, angle)
    for g in (a, b):  # not next to a pole, where rounding decides
        assume(abs(value(g.den, s)) > 1e-3 * sum(abs(t.coefficient) * abs(s) ** t.order for t in g.den))
    left, right = (value(g.num, s) / value(g.den, s) for g in (a, b))
    parts = [sum(abs(t.coefficient * s**t.order) for t in g.num) / abs(value(g.den, s)) for g in (a, b)]
    size = max(1.0, *parts)
    assert cmath.isclose(complex((a * b)(s)), left * right, rel_tol=1e-9, abs_tol=1e-9 * size**2)
    assert cmath.isclose(complex((a + b)(s)), left + right, rel_tol=1e-9, abs_tol=1e-9 * size)
    assert cmath.isclose(complex((a - b)(s)), left - right, rel_tol=1e-9, abs_tol=1e-9 * size)


def value(terms, s):
    return sum((t.coefficient * s**t.order for t in terms), 0j)


@quick
@given(terms, nonzero, st.randoms())
def test_equality_ignores_how_it_was_written(num, den, random):
    split = [part for c, o in num for part in ((c / 2, o), (c / 2, o))] + [(0.0, 7.0)]
    random.shuffle(split)
    assert TransferFunction(split, den) == TransferFunction(num, den)


@quick
@given(st.builds(TransferFunction, nonzero, nonzero))
def test_inverse_undoes_itself(a):
    assert a.inverse().inverse() == a
    assert (a * a.inverse()).num == (a * a.inverse()).den


@pytest.mark.parametrize("change", [((1.32 + 2**-51, 0.6), (1.0, 0.0)), ((1.32, 0.6 + 2**-52), (1.0, 0.0))])
def test_one_bit_makes_a_difference(change):
    assert TransferFunction([(1, 0)], [(1.32, 0.6), (1.0, 0.0)]) != TransferFunction([(1, 0)], change)


def test_frequency_response_in_polar_form():
    """(jω)^α has modulus ω^α and phase απ/2."""
    omega = np.geomspace(1e-3, 1e3, 13)
    gain = TransferFunction([(2.0, 0.6)]).frequency_response(omega)
    assert np.abs(gain) == pytest.approx(2 * omega**0.6, rel=1e-14)
    assert np.angle(gain) == pytest.approx(np.full(13, 0.3 * math.pi), rel=1e-14)
    model = TransferFunction([(1, 0)], [(1.32, 0.6), (1, 0)]).frequency_response(omega)
    real, imag = 1 + 1.32 * omega**0.6 * math.cos(0.3 * math.pi), 1.32 * omega**0.6 * math.sin(0.3 * math.pi)
    assert 1 / model == pytest.approx(real + 1j * imag, rel=1e-13)
    assert model.shape == omega.shape


@pytest.mark.parametrize(
    "num, den, gain",
    [
        ([(3, 0)], [(1.32, 0.6), (2, 0)], 1.5),
        ([(3, 0.2)], [(1.32, 0.6), (2, 0)], 0.0),
        ([(-3, 0)], [(1.32, 0.6)], -math.inf),
        ([], [(1, 0)], 0.0),
    ],
)
def test_dc_gain(num, den, gain):
    assert TransferFunction(num, den).dc_gain == gain


def test_properties():
    fractional = TransferFunction([(1, 1.2)], [(1, 0.6), (1, 0)])
    assert (fractional.is_integer, fractional.is_proper, fractional.orders) == (False, False, (1.2, 0.6, 0.0))
    whole = TransferFunction([(1, 1)], [(1, 2), (1, 0)])
    assert (whole.is_integer, whole.is_proper) == (True, True)
    assert TransferFunction([(2, 0)]).den == (Term(1.0, 0.0),)


REFUSED = [([(math.nan, 0)], [(1, 0)]), ([(1, math.inf)], [(1, 0)]), ([(1, 0)], [(0, 3)])]


@pytest.mark.parametrize("num, den", REFUSED)
def test_what_is_no_transfer_function_is_refused(num, den):
    with pytest.raises(ValueError):
        TransferFunction(num, den)
    with pytest.raises(ValueError):
        TransferFunction([]).inverse()
