"""Poles on the first sheet against polynomial roots in s^q, and the places they were put.

Red when a pole is missed, or put where there is none.
"""

import math

import numpy as np
import pytest

from focgen.fractional.poles import first_sheet_zeros
from focgen.fractional.transfer import TransferFunction

SECTOR = math.pi - 0.2


def commensurate_truth(transfer, base):
    """Roots w of the polynomial in w = s^base with |arg w| < base·sector are the poles w^(1/base)."""
    top = round(transfer.den[0].order / base)
    dense = np.zeros(top + 1)
    for coefficient, order in transfer.den:
        dense[top - round(order / base)] += coefficient
    roots = np.roots(dense)
    roots = roots[(np.abs(np.angle(roots)) < base * SECTOR) & (np.abs(roots) > 0)]
    return np.abs(roots) ** (1 / base) * np.exp(1j * np.angle(roots) / base)


def distance(found, truth):
    """The largest relative distance, each to its nearest, with counts equal."""
    assert len(found) == len(truth)
    return max((np.min(np.abs(found - t)) / abs(t) for t in truth), default=0.0)


@pytest.mark.parametrize("seed", range(40))
def test_random_commensurate_denominators(seed):
    rng = np.random.default_rng(seed)
    base = float(rng.choice([0.1, 0.2, 0.25, 0.5]))
    orders = base * np.append(0, rng.choice(np.arange(1, 12), rng.integers(1, 5), replace=False))
    coefficients = rng.choice([-1, 1], len(orders), p=[0.2, 0.8]) * 10 ** rng.uniform(-2, 2, len(orders))
    transfer = TransferFunction([(1, 0)], list(zip(coefficients, orders)))
    truth = commensurate_truth(transfer, base)
    edge = np.abs(np.abs(np.angle(truth)) - SECTOR)
    if edge.min(initial=1.0) < 0.02:
        pytest.skip("a pole is at the edge of the sector, where either answer is right")
    assert distance(first_sheet_zeros(transfer.den, SECTOR), truth) < 1e-9


def test_regulator_times_a_model_of_an_irrational_order():
    regulator = TransferFunction([(152.48, 0)], [(1, 2), (53.39, 1), (1528, 0)])
    model = TransferFunction([(1, 0)], [(1.32, math.e / 5), (1, 0)])
    found = first_sheet_zeros((regulator * model).den, SECTOR)
    assert distance(found, np.roots([1, 53.39, 1528])) < 1e-12


@pytest.mark.parametrize("power", [2, 3])
def test_multiple_poles_count_as_often_as_they_occur(power):
    single = TransferFunction([(1, 0)], [(0.2, 1.83), (0.3, 0.41), (1, 0)])
    product = single
    for _ in range(power - 1):
        product = product * single
    pole = first_sheet_zeros(single.den, SECTOR)
    found = first_sheet_zeros(product.den, SECTOR)
    assert len(pole) == 2 and len(found) == 2 * power
    upper = found[found.imag > 0]
    assert abs(upper.mean() - pole[pole.imag > 0][0]) < 1e-9  # each within ε^(1/power), their mean within ε


@pytest.mark.parametrize("order", [0.3, 0.9, 1.0, 1.05, 1.5, 2.0, 2.7])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_two_terms(order, sign):
    found = first_sheet_zeros(TransferFunction([(1, 0)], [(1.32, order), (sign, 0)]).den, SECTOR)
    assert np.max(np.abs(1.32 * found**order + sign), initial=0.0) < 1e-13
    angles = (np.arange(-5, 6) * 2 + (sign > 0)) * math.pi / order
    assert len(found) == np.sum(np.abs(angles) <= SECTOR)


@pytest.mark.parametrize("side", [-0.035, 0.035])
@pytest.mark.parametrize("size", [1e-5, 1.0, 1e7])
def test_poles_next_to_the_edge_of_the_sector(side, size):
    """A fractional term nine decades away makes the edge long, the poles next to it make it turn sharply."""
    angle = SECTOR + side
    pair = TransferFunction([(1, 0)], [(1, 2), (-2 * size * math.cos(angle), 1), (size**2, 0)])
    far = TransferFunction([(1, 0)], [((1e9 * size) ** -0.3, 0.3), (1, 0)])
    found = first_sheet_zeros((pair * pair * far).den, SECTOR)
    expected = size * np.exp(1j * angle * np.array([1, 1, -1, -1])) if side < 0 else []
    assert distance(found, expected) < 1e-6  # a double pole is known to the root of rounding


def test_sizes_beyond_numbers_are_refused():
    """s + 5 s^0.001 + 1e-5: the last two balance at s = 1e-5699."""
    with pytest.raises(ArithmeticError, match="too far apart"):
        first_sheet_zeros(TransferFunction([(1, 0)], [(1, 1), (5, 0.001), (1e-5, 0)]).den, SECTOR)


def test_a_power_of_s_has_no_zeros():
    assert len(first_sheet_zeros(TransferFunction([(1, 0)], [(3, 1.7)]).den, SECTOR)) == 0
