"""Poles at the edges: of the sector, of what numbers can hold, of what a term outweighs; and poles that meet.

Red when a pole is counted twice or not, or what cannot be told is told.
"""

import math
import re

import numpy as np
import pytest

from focgen.fractional import poles
from focgen.fractional.poles import _Sector, first_sheet_zeros
from focgen.fractional.transfer import Term, TransferFunction
from tests.fractional.test_poles import SECTOR


def denominator(*terms):
    return TransferFunction([(1, 0)], terms).den


def pair(size, angle):
    """s² − 2 r cos(φ) s + r²."""
    return TransferFunction([(1, 0)], [(1, 2), (-2 * size * math.cos(angle), 1), (size**2, 0)])


def power(base, count):
    made = base
    for _ in range(count - 1):
        made = made * base
    return made


@pytest.mark.parametrize("order", [0.7, 1.3, 2.5, 4.2, 7.3])
@pytest.mark.parametrize("low", [0.0, 0.4])
@pytest.mark.parametrize("ratio", [3.7, -0.02])
def test_two_terms_have_the_roots_of_their_ratio(order, low, ratio):
    """Of a s^(α + l) + b s^l, each once: |s|^α = |b/a|, α arg s an odd or even multiple of π."""
    found = first_sheet_zeros(denominator((2.0, low + order), (2.0 * ratio, low)), SECTOR)
    multiples = [k for k in range(-20, 21) if k % 2 == (ratio > 0) and abs(k * math.pi / order) <= SECTOR]
    assert np.abs(found) == pytest.approx(np.full(len(multiples), abs(ratio) ** (1.0 / order)))
    assert np.sort(np.angle(found)) == pytest.approx([k * math.pi / order for k in multiples])


def test_a_root_on_the_edge_of_two_terms_counts():
    assert len(first_sheet_zeros(denominator((1, 1.5), (1, 0)), math.pi / 1.5)) == 2
    assert len(first_sheet_zeros(denominator((1, 1.5), (1, 0)), math.nextafter(math.pi / 1.5, 0))) == 0
    assert len(first_sheet_zeros(denominator((1, 1.5)), SECTOR)) == 0


@pytest.mark.parametrize("seed", range(10))
def test_beyond_its_radii_one_term_outweighs_the_others_twice(seed):
    """At them one of n others is a 2n-th of it, and none is more."""
    rng = np.random.default_rng(seed)
    orders, sizes = np.sort(rng.uniform(0.1, 3.0, 3))[::-1], 10 ** rng.uniform(-3, 3, 3)
    terms = [Term(float(c), float(o)) for c, o in zip(sizes, orders)]
    terms.append(Term(1.0, 0.0))
    sector = _Sector(tuple(terms), SECTOR)
    for index, x in ((0, sector.high), (-1, sector.low)):
        sizes = [t.coefficient * math.exp(t.order * x) for t in terms]
        own = sizes.pop(index)
        assert own >= 2.0 * sum(sizes) * (1.0 - 1e-12)
        assert own == pytest.approx(2.0 * len(sizes) * max(sizes), rel=1e-9)


@pytest.mark.parametrize(
    "beside, size",
    [
        *(([0.0], 1.0), ([0.0], 1e20), ([0.0, 0.01], 1.0), ([0.0, -0.01], 1e20)),
        pytest.param([0.0, 0.01], 1e20, marks=pytest.mark.long),
        pytest.param([0.0, -0.01], 1.0, marks=pytest.mark.long),
    ],
)
def test_poles_on_the_very_edge_are_on_one_side(size, beside):
    """Pairs there, or a hundredth beside it, and a term that makes it fractional: each is told or not, and
    no complaint is made."""
    made = pair(1.7 * size, 2.0) * TransferFunction([(1, 0)], [((1e3 * size) ** -0.3, 0.3), (1, 0)])
    for angle in beside:
        made = made * pair(size, SECTOR + angle)
    found = first_sheet_zeros(made.den, SECTOR)
    assert len(found) in range(2, 2 * len(beside) + 3, 2)
    for place in 1.7 * size * np.exp(1j * np.array([2.0, -2.0])):
        assert np.abs(found - place).min() < 1e-9 * size


@pytest.mark.parametrize("decades", [-9, 9])
@pytest.mark.parametrize("inside", [0.025, 0.05])
def test_an_edge_is_followed_closely_wherever_poles_are_next_to_it(decades, inside):
    """Nine decades to either side of what makes it fractional: there its argument turns at once."""
    two = pair(1.0, SECTOR - inside)
    far = TransferFunction([(1, 0)], [(10.0 ** (-0.3 * decades), 0.3), (1, 0)])
    found = first_sheet_zeros((two * two * far).den, SECTOR)
    assert len(found) == 4
    assert np.abs(np.abs(np.angle(found)) - (SECTOR - inside)).max() < 1e-5


@pytest.mark.parametrize("count", [1, 2, 3, 4])
@pytest.mark.parametrize("angle", [0.0, 1.2, 2.6])
def test_poles_that_meet_are_located_together(count, angle):
    """(1 + s^0.35) times as many equal pairs, or real poles to the right: each near, their mean nearer."""
    single = pair(2.0, angle) if angle else TransferFunction([(1, 0)], [(1, 1), (-2.0, 0)])
    cut = TransferFunction([(1, 0)], [(1, 0.35), (1, 0)])
    found = first_sheet_zeros((power(single, count) * cut).den, SECTOR)
    assert len(found) == count * (2 if angle else 1)
    upper = found[found.imag > 0] if angle else found
    truth = 2.0 * np.exp(1j * angle)
    each = 6.0 * 1e-15 ** (1.0 / count) + 1e-13  # what rounding leaves of where one of so many is
    assert np.abs(upper - truth).max() < each and abs(upper.mean() - truth) < 1e-10
    assert np.abs(found[:, None] - found.conj()).min(axis=0).max() < each


@pytest.mark.parametrize("gap", [1e-2, 2e-3, 5e-4, 1e-5])
def test_two_poles_that_nearly_meet_are_both_there(gap):
    cut = TransferFunction([(1, 0)], [(1, 0.35), (1, 0)])
    found = first_sheet_zeros((pair(2.0, 1.2) * pair(2.0 * (1.0 + gap), 1.2) * cut).den, SECTOR)
    upper = np.sort_complex(found[found.imag > 0])
    truth = np.exp(1.2j) * np.array([2.0, 2.0 * (1.0 + gap)])
    assert len(found) == 4
    assert np.abs(upper.mean() - truth.mean()) < 1e-11
    assert np.abs(upper - np.sort_complex(truth)).max() < 1e-13 / gap + 1e-12


@pytest.mark.parametrize("seed", range(12))
def test_simple_zeros_are_right_to_the_last_digits(seed):
    """Every term of irrational order: what is left of the sum is rounding beside its terms."""
    rng = np.random.default_rng(seed)
    orders = np.append(np.sort(rng.uniform(0.05, 3.4, 3))[::-1], 0.0)
    coefficients = 10 ** rng.uniform(-4, 4, 4) * rng.choice([-1, 1], 4, p=[0.2, 0.8])
    found = first_sheet_zeros(denominator(*zip(coefficients, orders)), SECTOR)
    for s in found:
        parts = coefficients * s**orders
        assert abs(parts.sum()) < 2e-13 * np.abs(parts).sum()
    assert len(found) == _turns(coefficients, orders, SECTOR)


def _turns(coefficients, orders, angle):
    """Zeros in the sector: turns of Σ c s^α around it, by half a million steps."""
    x = np.linspace(-120.0, 120.0, 90_001)
    ray = [x[::-1] - 1j * angle, x[0] + 1j * np.linspace(-angle, angle, 4001), x + 1j * angle]
    arc = x[-1] + 1j * np.linspace(angle, -angle, 4001)
    path = np.concatenate([ray[0], ray[1], ray[2], arc])
    values = (coefficients * np.exp(np.outer(path, orders) - 120.0 * orders.max())).sum(axis=1)
    return -round(float(np.angle(values[1:] / values[:-1]).sum()) / (2.0 * math.pi))


@pytest.mark.parametrize("middle", [1.2, 1.3])
@pytest.mark.parametrize("top, kept", [(0.3, True), (1.3, False), (2.4, False)])
def test_sizes_are_taken_as_far_as_numbers_go(top, kept, middle):
    """s^2.5 + 10^(100 top) s^middle + 1: its fastest and its slowest share, each to the power 2.5."""
    size = 10.0 ** (100.0 * top)
    terms = denominator((1, 2.5), (size, middle), (1, 0))
    ends = math.log(4.0 * size) / np.array([2.5 - middle, middle])
    assert (2.5 * ends.max() < 600.0) == kept
    if kept:
        found = first_sheet_zeros(terms, SECTOR)
        for s in found:
            parts = [s**2.5, size * s**middle, 1.0]
            assert abs(sum(parts)) < 1e-9 * sum(map(abs, parts))
    else:
        with pytest.raises(ArithmeticError, match="its time constants are too far apart") as refused:
            first_sheet_zeros(terms, SECTOR)
        fast, slow = map(int, re.search(r"1e(-?\d+) to 1e(-?\d+) s", str(refused.value)).groups())
        assert (-fast, slow) == tuple(np.rint(ends / math.log(10.0)).astype(int))


def test_an_edge_that_cannot_be_followed_is_told(monkeypatch):
    """With fewer steps along it than poles next to it need."""
    monkeypatch.setattr(poles, "_MOST_STEPS", 200)
    with pytest.raises(ArithmeticError, match="a pole lies on the edge of the sector"):
        first_sheet_zeros(
            (pair(1.0, SECTOR - 0.03) * pair(1.001, SECTOR - 0.03) * pair(3.0, 1.0)).den, SECTOR
        )
