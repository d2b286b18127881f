"""Stages of whole orders as a sum of first-order lags, which may run at another pace each way: chambers side
by side, all of which fill more slowly than they vent."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from focgen.arrays import Array, Bytes, Complex
from focgen.fractional.transfer import TransferFunction
from focgen.rig import kernels, linear
from focgen.rig.delay import delayed
from focgen.rig.modes import Modes, speeded

_REAL = 1e-6  # of a pole: what rounding makes of two that are one
_APART = 1.5e-3  # of a pole: what two that are one are kept apart by


def is_sum_of_lags(transfer: TransferFunction) -> bool:
    """Whether it is a stable sum of first-order lags and one complex pair at most, of whole orders, that
    holds a level."""
    if not (transfer.is_integer and transfer.is_proper) or transfer.den[0].order == 0.0:
        return False
    poles = _poles(transfer)
    stable, pairs = bool(np.all(poles.real < 0.0)), int(np.sum(poles.imag > 0.0))
    return stable and pairs <= 1 and not linear.coincide(poles) and bool(transfer.dc_gain)


def run_paces(
    transfer: TransferFunction,
    x: Array,
    rest: Bytes,
    h: float,
    paces: tuple[float, float],
    delay: float = 0.0,
) -> Array:
    """The response to ``x`` (n,) of a stage that :func:`is_sum_of_lags`. Each lag runs so many times as fast
    while the load exceeds the response, and so many while it falls short of it. The input counts as linear
    between samples, and the delay is exact in whole samples only."""
    modes, gain = _lags(transfer), transfer.dc_gain
    rows = [speeded(modes, h, speed) for speed in paces]
    a, b0, b1, pair = (np.stack(part) for part in zip(*rows))
    made = gain * kernels.modes(x, rest, a, b0, b1, pair, modes.through, switching=True)
    return delayed(made, rest, h, delay) if delay else made


def is_filled(transfer: TransferFunction) -> bool:
    """Whether it is one lag after another: a valve that is driven, and what it fills."""
    num, den = transfer.num, transfer.den
    if not transfer.is_integer or len(num) != 1 or num[0].order or not den[0].order or den[-1].order:
        return False
    poles = _poles(transfer)
    return bool(np.all(poles.real < 0.0) and np.all(np.abs(poles.imag) <= _REAL * np.abs(poles)))


@lru_cache(maxsize=256)
def parted(transfer: TransferFunction) -> tuple[TransferFunction, TransferFunction]:
    """What is ahead of the slowest lag of a stage that :func:`is_filled`, and that lag with the gain: a valve
    is quicker than what it fills. A fit may make two lags a pair that swings: then what is ahead leads."""
    poles, den = _poles(transfer), transfer.den
    slowest = int(np.argmax(poles.real))
    lag = [(-1.0 / float(poles[slowest].real), 1.0), (1.0, 0.0)]
    chamber = TransferFunction([(transfer.dc_gain, 0.0)], lag)
    if abs(poles[slowest].imag) > _REAL * abs(poles[slowest]):
        return TransferFunction(lag, [(c / den[-1].coefficient, order) for c, order in den]), chamber
    ahead = np.atleast_1d(np.poly(np.delete(poles, slowest))).real
    orders = range(len(ahead) - 1, -1, -1)
    return TransferFunction([(1.0, 0.0)], [(c / ahead[-1], n) for c, n in zip(ahead, orders)]), chamber


def _poles(transfer: TransferFunction) -> Complex:
    made: Complex = np.roots(linear.coefficients(transfer.den)).astype(complex)
    return made


@lru_cache(maxsize=64)
def _lags(transfer: TransferFunction) -> Modes:
    """Its partial fractions, over its gain."""
    num, den = linear.coefficients(transfer.num) / transfer.dc_gain, linear.coefficients(transfer.den)
    poles = _poles(transfer)
    if linear.coincide(poles):  # as a fit may have it: a little apart, for each counts by itself
        poles = poles.real * (1.0 + _APART * np.arange(len(poles))) + 0j
    residues = linear.residues(num, den, poles)
    real, pair = poles.imag == 0.0, np.flatnonzero(poles.imag > 0.0)
    swings = (complex(poles[pair[0]]), complex(2.0 * residues[pair[0]])) if len(pair) else (-1.0 + 0j, 0j)
    through = float(num[0] / den[0]) if len(num) == len(den) else 0.0
    return Modes(-poles[real].real, residues[real].real, *swings, through)
