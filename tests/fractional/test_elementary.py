"""Elementary functions against many digits, linear systems against fractions, bits against those of before.

mpmath and fractions share nothing with them.

Red when an elementary function loses digits, or differs from one processor to the next.
"""

from __future__ import annotations

import hashlib
import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest

from focgen.fractional import elementary

RNG = np.random.default_rng(5)
WIDE = np.concatenate([RNG.uniform(-708.0, 709.0, 400), RNG.uniform(-1.0, 1.0, 300)])
SMALL = -(10.0 ** RNG.uniform(-14.0, 2.0, 300))
NEAR_ONE = 1.0 + np.concatenate([RNG.uniform(-0.5, 1.0, 300), SMALL[SMALL > -0.5]])
POSITIVE = np.concatenate([10.0 ** RNG.uniform(-300.0, 300.0, 300), NEAR_ONE])


def relative_errors(found, exact, places) -> np.ndarray:
    with mpmath.workprec(200):
        wanted = [exact(mpmath.mpf(x)) for x in places.tolist()]
        pairs = zip(found.tolist(), wanted, strict=True)
        return np.abs([float((mpmath.mpf(value) - truth) / truth) for value, truth in pairs])


@pytest.mark.parametrize(
    "function, exact, places, units",
    [
        (elementary.exp, mpmath.exp, np.concatenate([WIDE, SMALL]), 2.0),
        (elementary.log, mpmath.log, POSITIVE, 2.0),
        (elementary.expm1, mpmath.expm1, np.concatenate([WIDE, SMALL]), 130.0),
    ],
    ids=["exp", "log", "expm1"],
)
def test_functions_are_right_to_the_last_place(function, exact, places, units):
    """In units of half a last place, 2^−53 of the value."""
    assert relative_errors(function(places), exact, places).max() < units * 2.0**-53


def test_what_no_number_can_hold_is_zero_or_infinite():
    assert elementary.exp([-1e300, -math.inf, -746.0, 0.0, 710.0, math.inf]).tolist() == [
        0.0, 0.0, 0.0, 1.0, math.inf, math.inf
    ]  # fmt: skip
    powers = elementary.powers(np.array([0.0]), np.array([0.0, 1.0]))
    assert elementary.log(1.0) == 0.0 and powers[0, 0] == 1.0 and powers[0, 1] < 1e-300


@pytest.mark.parametrize("base, exponent", [(0.01, -0.6), (0.02, -1.0), (1e-6, 7.9), (3.0, 0.0), (0.1, -300)])
def test_a_power_is_the_nearest_number(base, exponent):
    with mpmath.workprec(300):
        assert elementary.power(base, exponent) == float(mpmath.mpf(base) ** mpmath.mpf(exponent))


def test_powers_are_those_of_long_multiplication():
    bases, exponents = np.array([0.3, 0.999, 1.0 - 1e-8]), np.array([0, 1, 7, 1000])
    for base, row in zip(bases.tolist(), elementary.powers(bases, exponents)):
        exact = [float(Fraction(base) ** int(n)) for n in exponents]
        assert row == pytest.approx(exact, rel=1e-12)


def test_sums_do_not_depend_on_their_order():
    values = 10.0 ** RNG.uniform(-8.0, 8.0, 1000) * RNG.choice([-1.0, 1.0], 1000)
    exact = float(sum(map(Fraction, values.tolist())))
    assert elementary.exact_sum(values) == elementary.exact_sum(values[::-1]) == exact
    assert elementary.l1(values) == float(sum(abs(Fraction(v)) for v in values.tolist()))
    assert elementary.exact_sum([1e308] * 10) == math.inf
    parts = RNG.normal(size=(3, 4))
    assert np.array_equal(elementary.total(parts), (parts[0] + parts[1]) + parts[2])


def test_a_bound_is_rounded_up_to_six_digits_and_no_further():
    for bound in [*(10.0 ** RNG.uniform(-12.0, 12.0, 500)).tolist(), 0.1, 0.25, 2857.15, 1e-05]:
        found = elementary.rounded_up(bound)
        assert bound <= found <= bound * (1.0 + 1e-5) and float(f"{found:.6g}") == found
        assert elementary.rounded_up(found) == found
    assert elementary.rounded_up(1.000001) == 1.00001 and elementary.rounded_up(0.0) == 0.0
    assert elementary.rounded_up(math.inf) == math.inf


def exactly_solved(matrix: np.ndarray, right: np.ndarray) -> list[float]:
    """By fractions."""
    rows = [[Fraction(x) for x in (*row, b)] for row, b in zip(matrix.tolist(), right.tolist())]
    for k in range(len(rows)):
        pivot = next(i for i in range(k, len(rows)) if rows[i][k])
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [x / rows[k][k] for x in rows[k]]
        for i in range(len(rows)):
            if i != k:
                rows[i] = [a - rows[i][k] * b for a, b in zip(rows[i], rows[k])]
    return [float(row[-1]) for row in rows]


def test_linear_systems_are_solved():
    matrix, right = RNG.normal(size=(9, 9)), RNG.normal(size=9)
    matrix[0, 0] = 0.0  # needs another pivot
    assert elementary.solve(matrix, right) == pytest.approx(exactly_solved(matrix, right), rel=1e-9)
    assert elementary.solve(np.ones((2, 2)), np.ones(2)) is None


def test_least_squares_meet_the_normal_equations():
    matrix, right = RNG.normal(size=(40, 5)), RNG.normal(size=40)
    exact = [[Fraction(x) for x in column] for column in [*matrix.T.tolist(), right.tolist()]]
    products = np.array([[float(sum(a * b for a, b in zip(u, v))) for v in exact] for u in exact[:-1]])
    found = elementary.least_squares(matrix, right)
    assert found == pytest.approx(exactly_solved(products[:, :-1], products[:, -1]), rel=1e-9)
    assert elementary.least_squares(np.array([[1.0, 0.0], [2.0, 0.0]]), np.ones(2)) is None


def test_the_bits_are_those_of_every_other_machine():
    """A digest that was the same on all processors and versions that it was tried on."""
    x = np.arange(1, 2001) / 7.0
    grid = np.arange(1.0, 13.0)
    matrix = 1.0 / (grid[:, None] + grid) + np.eye(12)
    found = [
        elementary.exp(-x), elementary.expm1(-x / 300.0), elementary.log(x), elementary.solve(matrix, grid),
        elementary.powers(1.0 / (1.0 + grid), grid), elementary.least_squares(matrix[:, :6], grid),
    ]  # fmt: skip
    content = b"".join(part.astype("<f8").tobytes() for part in found)
    assert hashlib.sha256(content).hexdigest()[:16] == "bb6ab9df5b544f78"
