"""A transfer function of real orders as a sum of first-order modes and complex pairs.

The impulse response is what the branch cut leaves, ∫ μ(ξ) e^{−ξt} dξ, and the residues of the poles on the
principal sheet. The trapezoidal rule in x = ln ξ converges geometrically, but for poles next to the cut, on
either sheet. Of such a pole with ln s = x_p + i (π − d), the rule with nodes at x₀ + kΔ has a share of its
own: with the residue R, R / (1 − e^{−w}), w = 2π (d + i (x_p − x₀)) / Δ, is what is left to add, on both
sheets (residue theorem, with the kernel π cot(π (x − x₀)/Δ)). Far inside that is R, and far beyond nothing.
"""

from __future__ import annotations

import math
from functools import cache, lru_cache

import numpy as np

from focgen.arrays import Array, Complex
from focgen.errors import RigError
from focgen.fractional.poles import zeros_in_log
from focgen.fractional.transfer import Polynomial, TransferFunction
from focgen.rig.modes import QUICK, Modes

_SPACING = 0.4  # Δ: the rule's own error is about exp(−π²/Δ) = 2e-11
_BEYOND = (1.2, 1.0, 0.8)  # rad behind the cut: a pole farther on has a share below exp(−2π 1.2/Δ) = 7e-9
_QUICKER = 60.0  # in x: so far the cut goes on beyond; an order of 0.3 falls by 1e-8
_PLACES = (0.5, 0.3, 0.7, 0.4, 0.6)  # of a spacing, of nodes from the pole that is closest to the cut
_CLEAR = 0.5  # of |1 − e^{−w}|, which a node on a pole would bring to 0
_APART = 1.5  # in ln s, of poles from the circle about 0: closer, the cut goes as no power there
_BELOW = 12  # spacings that the circle may be smaller for that
_WITHIN = 0.02  # of a turn: so far about 0 goes the longest response
_RATES = (0.1, 0.4, 0.7, 1.0)  # of that, of modes that stand for what is within: their error is 0.02⁴/4!
_AROUND = 80  # places on that circle
_NEAR = 0.75 * np.exp(2j * math.pi * (np.arange(32) + 0.5) / 32)  # ln s about the first node: half of _APART
# Of Euler and Maclaurin: a sum from its first term on is short of the integral over its spacing Δ by
# Σ w_j Δ^j g_j, with g_j the coefficients of the terms' Taylor series about the first
_END = np.array([-1 / 2, 1 / 12, 0.0, -6 / 720, 0.0, 120 / 30240, 0.0, -5040 / 1209600])
_SPLIT = 1e-7  # by which a coefficient is moved where poles coincide: it parts them by the root of that
_CLOSE = 1e-4  # in ln s: closer poles coincide
_ON_AXIS = 1e-9  # rad from an axis


@lru_cache(maxsize=64)
def modes_of(transfer: TransferFunction, h: float, duration: float) -> Modes:
    """Its modes, for responses from ``h`` to ``duration`` seconds. What is quicker than samples show passes
    at once.

    Raises RigError where its poles cannot be located.
    """
    transfer, zeros = _parted(transfer)
    first, quick = _first(zeros, math.log(_WITHIN / duration)), math.log(QUICK / h)
    zeros = zeros[zeros.real > first]
    rates, weights, through = _cut(transfer, first, quick)
    rates, weights = np.append([rates, weights], _about_zero(transfer, first), axis=1)
    pairs: list[tuple[complex, complex]] = []
    for zero, share in zip(zeros, _shares(zeros, first)):
        both = 2.0 if zero.imag > _ON_AXIS else 1.0
        pole, residue = complex(np.exp(zero)), both * complex(share) * _residue(transfer, zero)
        if zero.real >= quick:
            through -= (residue / pole).real
        elif min(zero.imag, abs(zero.imag - math.pi)) < _ON_AXIS:
            rates, weights = np.append(rates, -pole.real), np.append(weights, residue.real)
        else:
            pairs.append((pole, residue))
    pairs.sort(key=lambda pair: -abs(pair[1] / pair[0]))
    return Modes(rates, weights, *(pairs or [(-1.0 + 0j, 0j)])[0], through, tuple(pairs[1:]))


def _parted(transfer: TransferFunction) -> tuple[TransferFunction, Complex]:
    """It, with poles that coincide a little apart, and ln s of its poles in the upper half."""
    zeros = _zeros(transfer.den)
    apart = np.abs(np.subtract.outer(zeros, zeros))[~np.eye(len(zeros), dtype=bool)]
    if np.min(apart, initial=1.0) < _CLOSE:
        (lead, order), *rest = transfer.den
        transfer = TransferFunction(transfer.num, [(lead * (1.0 + _SPLIT), order), *rest])
        zeros = _zeros(transfer.den)
    return transfer, zeros[zeros.imag >= 0.0]


def _zeros(den: Polynomial) -> Complex:
    for beyond in _BEYOND:
        try:
            return zeros_in_log(den, math.pi + beyond)
        except ArithmeticError as error:
            why = str(error)
    raise RigError("den of real orders", f"its poles cannot be located: {why}", "check its coefficients")


def _first(zeros: Complex, about: float) -> float:
    """The first node, at ``about`` or some spacings below: no pole next to the cut is at a node, and none
    near the circle through the first. It is the highest that will do, or the best."""
    near = zeros[np.abs(zeros.imag - math.pi) < _SPACING]
    anchor = near[np.argmin(np.abs(near.imag - math.pi))].real if len(near) else about
    best, clearest = about, -1.0
    for below in range(_BELOW):
        for place in _PLACES:
            first = about - below * _SPACING - (about - anchor + place * _SPACING) % _SPACING
            clear = _clear(zeros, near, first)
            if clear >= 1.0:
                return first
            if clear > clearest:
                best, clearest = first, clear
    return best


def _clear(zeros: Complex, near: Complex, first: float) -> float:
    """How far from poles the nodes are, and the circle through the first: 1 is enough."""
    nodes = 1.0 / np.max(np.abs(_shares(near, first)), initial=1.0)
    return float(min(nodes / _CLEAR, np.min(np.abs(zeros.real - first), initial=_APART) / _APART))


def _shares(zeros: Complex, first: float) -> Complex:
    """1 / (1 − e^{−w}) of each."""
    made: Complex = 1.0 / (1.0 - np.exp(-2.0 * math.pi / _SPACING * (math.pi + 1j * (zeros - first))))
    return made


def _cut(transfer: TransferFunction, first: float, quick: float) -> tuple[Array, Array, float]:
    """Rates and weights (m,) of the cut, up to e^``quick``, and what passes at once."""
    x = np.arange(first, quick + _QUICKER, _SPACING)
    xi, weights = np.exp(x), _SPACING * _density(transfer, x)
    seen = x < quick
    through = float(np.real(transfer(xi[-1:]))[0]) + float(np.sum(weights[~seen] / xi[~seen]))
    return xi[seen], weights[seen], through


def _density(transfer: TransferFunction, x: Array) -> Array:
    """ξ μ(ξ) at ξ = e^x."""
    xi = np.exp(x)
    made: Array = -np.imag(transfer(xi * np.exp(1j * math.pi))) / math.pi * xi
    return made


def _about_zero(transfer: TransferFunction, first: float) -> tuple[Array, Array]:
    """Rates and weights (k,) of what lies within e^``first`` of s = 0, as pole or cut: modes there that have
    the first moments, (1/2πi) ∮ H s^k ds, of its circle, and of what the rule lacks at its end there."""
    radius = math.exp(first)
    turned, counts = _circle()
    values = counts * transfer(radius * turned) * turned
    each = np.arange(len(_RATES))
    moments = np.array([0.5 * radius * float(np.real(np.sum(values * turned**k))) for k in each])
    moments += (-1.0) ** each * _end(transfer, first)
    rates = np.array(_RATES)
    return radius * rates, np.linalg.solve(np.vander(-rates, increasing=True).T, moments)


@cache
def _circle() -> tuple[Complex, Array]:
    """Places on the circle of radius 1, from cut to cut, and their weights (Gauss and Legendre)."""
    nodes, counts = np.polynomial.legendre.leggauss(_AROUND)
    return np.exp(1j * math.pi * nodes), counts


def _end(transfer: TransferFunction, first: float) -> Array:
    """What the sum of the rule's terms is short of at its ``first``, for each power of ξ / e^``first``.

    The density may change its sign there: it goes as a power of ξ only close to 0.
    """
    about, scale = first + _NEAR, _SPACING ** np.arange(1, len(_END) + 1)
    turned = (_at(transfer, about - 1j * math.pi) - _at(transfer, about + 1j * math.pi)) * np.exp(about)
    made = []
    for power in range(len(_RATES)):
        values = turned / (2j * math.pi) * np.exp(power * _NEAR)
        series = [np.mean(values / _NEAR**j).real for j in range(len(_END))]
        made.append(float(np.sum(_END * scale * series)))
    return np.array(made)


def _at(transfer: TransferFunction, x: Complex) -> Complex:
    """H(e^``x``), beyond the cut too."""
    num, den = (
        sum(t.coefficient * np.exp(t.order * x) for t in side) for side in (transfer.num, transfer.den)
    )
    made: Complex = num / den
    return made


def _residue(transfer: TransferFunction, zero: complex) -> complex:
    """Of the simple pole whose ln s is ``zero``, on its sheet."""
    num = sum(t.coefficient * np.exp(t.order * zero) for t in transfer.num)
    slope = sum(t.coefficient * t.order * np.exp((t.order - 1.0) * zero) for t in transfer.den)
    return complex(num / slope)
