"""Elementary functions, sums and linear systems that come out the same in every bit on every machine.

A processor's own exponential, a library's matrix product and the order of its sums differ in the last digit
between processors and versions. What is printed into C must not. IEEE 754 fixes +, −, ×, ÷, the root and what
moves an exponent, one operation at a time; everything here is made of these, each an array operation of its
own, in one order. Matrices are small: as many columns as an exponential memory has numbers.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from decimal import Context, Decimal

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Array

_DIGITS = Context(prec=50)  # so many that a double rounded from them is the nearest one
_PARTS = 1 << 5  # of an octave, each with its power of two in a table
_LN2 = _DIGITS.ln(Decimal(2))
_POWERS = np.array([float(_DIGITS.power(2, _DIGITS.divide(i, _PARTS))) for i in range(_PARTS)])
_FARTHEST = 1100.0  # |x| beyond which e^x is 0 or infinite
_TINY = 2.0**-1000  # as good as 0 to any power
_EXP = [1.0 / math.factorial(k) for k in range(6, 1, -1)]
_LOG = [2.0 / (2 * k + 1) for k in range(11, 0, -1)]
_SINE = [(-1.0) ** k / math.factorial(2 * k + 1) for k in range(11, -1, -1)]
_COSINE = [(-1.0) ** k / math.factorial(2 * k) for k in range(12, -1, -1)]


def _split(value: Decimal) -> tuple[float, float]:
    """The value as the sum of two doubles, the first of them short enough to be multiplied exactly."""
    high = math.ldexp(math.floor(math.ldexp(float(value), 40)), -40)
    return high, float(_DIGITS.subtract(value, Decimal(high)))


_STEP = _split(_DIGITS.divide(_LN2, _PARTS))
_OCTAVE = _split(_LN2)
_STEPS_PER_UNIT = float(_DIGITS.divide(_PARTS, _LN2))
_SMALLEST = 0.5 * _STEP[0]


def _horner(coefficients: Iterable[float], x: Array) -> Array:
    """Highest power first."""
    found = np.zeros_like(x)
    for c in coefficients:
        found *= x
        found += c
    return found


def _less_one(r: Array) -> Array:
    """e^r − 1 for |r| ≤ ln 2 / 64."""
    found = _horner(_EXP, r)
    found *= r
    found *= r
    return found + r


def exp(x: ArrayLike) -> Array:
    """Return e^x for any numbers but NaN, shape of ``x``; off by less than one unit of the last place."""
    near: Array = np.clip(np.asarray(x, dtype=float), -_FARTHEST, _FARTHEST)
    steps = np.rint(near * _STEPS_PER_UNIT)
    rest = near - steps * _STEP[0]
    rest -= steps * _STEP[1]
    steps = steps.astype(np.intc)
    power = _POWERS[steps & (_PARTS - 1)]
    with np.errstate(over="ignore", under="ignore"):
        made: Array = np.ldexp(power + power * _less_one(rest), steps >> 5)
        return made


def expm1(x: ArrayLike) -> Array:
    """Return e^x − 1, shape of ``x``, to a relative 1e-14 even where ``x`` is small."""
    x = np.asarray(x, dtype=float)
    small = np.abs(x) <= _SMALLEST
    return np.where(small, _less_one(np.where(small, x, 0.0)), exp(x) - 1.0)


def log(x: ArrayLike) -> Array:
    """Return ln x for normal numbers > 0, shape of ``x``; off by about one unit of the last place."""
    part, octave = np.frexp(np.asarray(x, dtype=float))
    below = part < math.sqrt(0.5)
    over = np.where(below, 2.0 * part, part) - 1.0  # exact
    octave = octave - below
    # with s = f/(2 + f): ln(1 + f) = 2 artanh s, and 2 s = f − (1 − s) f²/2
    s, half = over / (2.0 + over), 0.5 * over * over
    square = s * s
    small = s * (half + square * _horner(_LOG, square)) + octave * _OCTAVE[1]
    made: Array = octave * _OCTAVE[0] + (over - (half - small))
    return made


def sine_cosine(x: ArrayLike) -> tuple[Array, Array]:
    """Return sin x and cos x for |x| ≤ π/2, both of the shape of ``x``; off by less than 1e-15."""
    x = np.asarray(x, dtype=float)
    square = x * x
    return x * _horner(_SINE, square), _horner(_COSINE, square)


def power(base: float, exponent: float) -> float:
    """Return the double nearest to ``base`` ** ``exponent``, ``base`` > 0; infinite beyond all doubles."""
    return float(_DIGITS.power(Decimal(base), Decimal(exponent)))


def powers(bases: Array, exponents: Array) -> Array:
    """Return every base in [0, 1] to every exponent, 0 or more: shape (bases, exponents)."""
    logs = log(np.maximum(bases, _TINY))
    return exp(logs[:, None] * exponents)


def total(parts: Iterable[Array]) -> Array:
    """Return the sum over the first axis, added up from its beginning."""
    rows = np.asarray(parts)
    found: Array = rows[0].copy()
    for part in rows[1:]:
        found += part
    return found


def exact_sum(values: ArrayLike) -> float:
    """Return the sum of all ``values``, any shape, rounded once; infinite where it is beyond a double.

    Python's own ``sum`` of floats has more digits from 3.12 on.
    """
    try:
        return math.fsum(np.asarray(values, dtype=float).ravel().tolist())
    except OverflowError:
        return math.inf


def l1(values: ArrayLike) -> float:
    """Return Σ |value|, rounded once."""
    return exact_sum(np.abs(values))


def rounded_up(bound: float, digits: int = 6) -> float:
    """Return the first number of so many decimal digits that is not below ``bound``, which is 0 or more."""
    if not math.isfinite(bound):
        return bound
    short = Context(prec=digits)
    near = short.create_decimal(bound)
    return float(near if float(near) >= bound else near.next_plus(short))


def solve(matrix: Array, right: Array) -> Array | None:
    """Return x of ``matrix`` x = ``right``, shapes (n, n) and (n,); None where the matrix is singular.

    Gaussian elimination, the largest pivot of each column first.
    """
    rows = np.column_stack([matrix, right])
    n = len(rows)
    for k in range(n):
        best = k + int(np.argmax(np.abs(rows[k:, k])))
        if rows[best, k] == 0.0:
            return None
        rows[[k, best]] = rows[[best, k]]
        rows[k + 1 :, k:] -= (rows[k + 1 :, k] / rows[k, k])[:, None] * rows[k, k:]
    return _substituted(rows[:, :n], rows[:, n].copy())


def _substituted(upper: Array, right: Array) -> Array:
    """x of ``upper`` x = ``right``; what is below the diagonal is not looked at. ``right`` is used up."""
    for k in range(len(right) - 1, -1, -1):
        right[k] /= upper[k, k]
        right[:k] -= right[k] * upper[:k, k]
    return right


def least_squares(matrix: Array, right: Array) -> Array | None:
    """Return the x that makes |``matrix`` x − ``right``|₂ least, shapes (m, n), m ≥ n, and (m,); None where
    the columns depend on one another.

    By Householder's reflections.
    """
    columns = np.vstack([matrix.T, right])  # one a row, so that each is contiguous
    n = len(columns) - 1
    for k in range(n):
        mirror = columns[k, k:].copy()
        size = math.sqrt(float(_halved(mirror * mirror)))
        if size == 0.0:
            return None
        mirror[0] += math.copysign(size, mirror[0])
        factor = 2.0 / float(_halved(mirror * mirror))
        along = _halved(columns[k:, k:] * mirror) * factor
        columns[k:, k:] -= along[:, None] * mirror
    return _substituted(columns[:n, :n].T, columns[n, :n].copy())


def _halved(values: Array) -> Array:
    """The sum over the last axis: its second half added to its first, until one number is left."""
    while (count := values.shape[-1]) > 1:
        half = (count + 1) // 2
        folded = values[..., :half].copy()
        folded[..., : count - half] += values[..., half:]
        values = folded
    return values[..., 0]
