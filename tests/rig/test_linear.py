"""Transfer functions of whole orders at their samples, against sixty digits.

Red when a stage that is slow beside the samples loses digits, or one that runs away stops a fit.
"""

import mpmath as mp
import numpy as np
import pytest
from scipy.signal import cont2discrete

from focgen.fractional.transfer import TransferFunction
from focgen.rig.linear import discrete


def exact(num, den, h, held):
    """Numerator and denominator in powers of z⁻¹, mode by mode, of one or two modes."""
    num, den = [mp.mpf(c) for c in num], [mp.mpf(c) for c in den]
    count = len(den) - 1
    half = -den[1] / den[0] / 2
    apart = mp.sqrt(half**2 - den[-1] / den[0]) if count == 2 else 0
    poles = [half + apart, half - apart] if count == 2 else [2 * half]
    whole = [mp.mpf(1)]
    for p in poles:
        whole = [x - mp.exp(p * h) * y for x, y in zip([*whole, 0], [0, *whole])]
    b = [num[0] / den[0] * w if len(num) == len(den) else mp.mpf(0) for w in whole]
    for i, p in enumerate(poles):
        others = [q for k, q in enumerate(poles) if k != i]
        residue = (
            sum(c * p**k for k, c in enumerate(num[::-1])) / (den[0] * mp.fprod(p - q for q in others)) * h
        )
        q, a = p * h, mp.exp(p * h)
        step, line = (a - 1) / q, (a * (q - 1) + 1) / q**2
        past, now = (step, 0) if held else (line, step - line)
        for k, rest in enumerate([mp.mpf(1), *(-mp.exp(o * h) for o in others)]):
            b[k] += residue * now * rest
            b[k + 1] += residue * past * rest
    return tuple(np.array([float(mp.re(c)) for c in row[: count + 1]]) for row in (b, whole))


@pytest.mark.parametrize("seed", range(60))
def test_a_stage_of_one_or_two_modes_is_exact_however_slow(seed):
    """Slow ones, of thousands of samples to a time constant, were off by up to 1e-5."""
    rng, order = np.random.default_rng(seed), 1 + seed % 2
    den = 10.0 ** rng.uniform(-3.0, 3.0, order + 1)
    num = rng.normal(size=rng.integers(1, order + 2)) * 10.0 ** rng.uniform(-2.0, 2.0)
    h, held = float(10.0 ** rng.uniform(-3.0, -1.0)), bool(seed % 3)
    terms = ([(float(c), float(len(x) - 1 - i)) for i, c in enumerate(x)] for x in (num, den))
    with mp.workdps(60):
        told = exact(num, den, h, held)
    for found, true in zip(discrete(TransferFunction(*terms), h, held), told):
        assert np.max(np.abs(found - true)) < 1e-9 * np.max(np.abs(true))


def test_three_modes_are_those_of_one_and_of_two():
    """And held from sample to sample they answer as scipy's matrix exponential has it."""
    den = np.convolve([1.0, 3.0], [1.0, 0.8, 2.0])
    terms = [(float(c), float(3 - i)) for i, c in enumerate(den)]
    b, a = discrete(TransferFunction([(6.0, 0.0)], terms), 0.05, True)
    one, two = ([(c, float(len(x) - 1 - i)) for i, c in enumerate(x)] for x in ([1.0, 3.0], [1.0, 0.8, 2.0]))
    poles = [discrete(TransferFunction([(1.0, 0.0)], part), 0.05, True)[1] for part in (one, two)]
    assert a == pytest.approx(np.convolve(*poles), abs=1e-14)
    assert b.sum() / a.sum() == pytest.approx(1.0, abs=1e-12)
    assert b == pytest.approx(cont2discrete(([6.0], den), 0.05)[0][0], abs=1e-14)


def test_what_no_number_holds_is_no_fault():
    b, a = discrete(TransferFunction([(1.0, 0.0)], [(1.0, 1.0), (-1e6, 0.0)]), 0.01, False)
    assert not np.all(np.isfinite([*a, *b]))
