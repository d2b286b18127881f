"""1/(T s^α + 1) as a sum of first-order modes: one pass over the samples, no memory to cut off.

For 0 < α < 2 the impulse response is ∫ μ(ξ) e^{−ξt} dξ, μ(ξ) = T ξ^α sin(απ)/(π (1 + 2 T ξ^α cos(απ) + T²
ξ^{2α})), plus, for α > 1, the pole pair at T^{−1/α} e^{±iπ/α} (diffusive representation; G. Montseny, ESAIM
Proc. 5, 1998). The trapezoidal rule in ln ξ converges geometrically but for that pole, whose share is known
in closed form: its residue times 1/(exp(2πd/Δ) + 1), d = π(1 − α)/α, with nodes half a spacing Δ either side
of it. One formula then holds for all α, α = 1 included, where the pole alone remains.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np

from focgen.arrays import Array, Bytes
from focgen.fractional.delay import split_delay
from focgen.rig import kernels
from focgen.rig.delay import delayed, shifted
from focgen.rig.dynamics import UNCHANGED, Dynamics

SPACING = 0.8  # Δ in ln ξ; the rule's own error is about exp(−π²/Δ) = 4e-6
QUICK = 300.0  # of a sample: faster modes pass at once, which is off by their share over that
_LARGEST = 300.0  # of an exponent
_SHORTEST = -12  # power of two: a share of a sample that is as good as none
_SLOW = 1e-4  # of a mode's decay over a sample: below, (e^q − 1)/q loses its digits


@dataclass(frozen=True)
class Modes:
    """Rates (m,) in 1/s, weights (m,) in 1/s, the pair's pole and residue (1/s), the instantaneous share, and
    pole and residue of every further pair. A residue is that of both poles of a pair."""

    rates: Array
    weights: Array
    pole: complex
    residue: complex
    through: float
    others: tuple[tuple[complex, complex], ...] = ()

    @cached_property
    def gain(self) -> float:
        """Of what is held for as long as the slowest mode takes."""
        pairs = sum((residue / pole).real for pole, residue in ((self.pole, self.residue), *self.others))
        return self.through + float(np.sum(self.weights / self.rates)) - pairs

    @property
    def in_one_row(self) -> Modes:
        """With a lag in the place of every further pair, of its gain and its size, for loops that take one
        row. Next to the branch cut, where most such pairs lie, they hardly swing."""
        size = np.array([abs(pole) for pole, _ in self.others])
        gain = np.array([-(residue / pole).real for pole, residue in self.others])
        rates, weights = np.append(self.rates, size), np.append(self.weights, gain * size)
        return replace(self, rates=rates, weights=weights, others=())

    @property
    def further(self) -> list[Modes]:
        """Every further pair by itself."""
        return [Modes(np.ones(1), np.zeros(1), *pair, 0.0) for pair in self.others]


@lru_cache(maxsize=256)
def fractional_lag(T: float, alpha: float, h: float, duration: float) -> Modes:
    """The modes of 1/(T s^α + 1) for responses from ``h`` to ``duration`` seconds."""
    centre = -math.log(T) / alpha
    first = math.floor((math.log(1e-3 / duration) - centre) / SPACING)
    last = max(math.ceil((math.log(QUICK / h) - centre) / SPACING), first + 2)
    tail = math.ceil((math.log(1e6) / alpha) / SPACING) + 10  # far beyond the samples: acts at once
    x = centre + (np.arange(first, max(last, 0) + tail) + 0.5) * SPACING
    power = np.exp(alpha * (x - centre))  # T ξ^α
    density = power * (math.sin(alpha * math.pi) / math.pi)
    density /= 1 + power * (2 * math.cos(alpha * math.pi) + power)
    seen = int(np.searchsorted(x, math.log(QUICK / h), side="right"))
    xi = np.exp(x[:seen])  # of the others, at low orders, no number is large enough
    weights = SPACING * xi * density[:seen]
    distance = math.pi * (1 - alpha) / alpha
    share = 1.0 / (math.exp(min(2 * math.pi * distance / SPACING, 700.0)) + 1.0)
    size = math.exp(min(max(centre, -_LARGEST), _LARGEST))  # beyond, the pole has no share
    pole = size * cmath.exp(1j * math.pi / alpha)
    residue = -2 * pole / alpha * share  # both of the pair: twice the real part of one
    if distance > math.pi / 2:  # its share is below 1e-5 there, and the mode would grow
        pole, residue = -1.0 + 0j, 0j
    return Modes(xi, weights, pole, residue, float(SPACING * np.sum(density[seen:])))


def respond(
    x: Array,
    rest: Bytes,
    h: float,
    T: float,
    alpha: float,
    duration: float,
    dynamics: Dynamics = UNCHANGED,
    delay: float = 0.0,
    held: bool = False,
) -> Array:
    """The response of 1/(T s^alpha + 1) to ``x`` (n,), linear or ``held`` between samples of ``h`` s, later
    by ``delay`` s; ``rest`` (n,) is true where an experiment begins, none longer than ``duration`` s.

    With changed ``dynamics`` the response, too, counts as linear between samples: the delay is exact there in
    whole samples only. Friction bears the springs and the springpot from sample to sample: y stays where it
    was as long as that takes no more than ``stick``. What it bears jumps with a held input.
    """
    if delay and dynamics == UNCHANGED:
        whole, part = split_delay(delay, h)
        if part:
            modes = fractional_lag(T, alpha, h * seen_share(1.0 - part), about_as_long(duration))
            made = settled(between(x, rest, h, modes, 1.0 - part, held), x, rest, 1.0 - modes.gain)
            return shifted(made, rest, whole)
    if delay:
        return delayed(respond(x, rest, h, T, alpha, duration, dynamics, held=held), rest, h, delay)
    unloading, longest = dynamics.unloading, about_as_long(duration)
    a, b0, b1, pair, through = tables(T, alpha, h, longest, unloading)
    switching = unloading != 1.0
    if dynamics.changed & {"bend", "loss", "preload"} or dynamics.place < 0.0:
        made = kernels.bent_modes(x, rest, a, b0, b1, pair, through, switching, dynamics.bending(), held)
    else:
        borne = dynamics.place, dynamics.stiffness, *dynamics.drag.held
        made = kernels.modes(x, rest, a, b0, b1, pair, through, switching, *borne, held)
    return settled(made, x, rest, 1.0 - fractional_lag(T, alpha, h, longest).gain)


def seen_share(share: float) -> float:
    """The part of a sample that modes have to be made for, where a response is asked at this ``share`` of
    one: the whole, unless modes that pass at once would show there; then a power of two, which fits share."""
    return min(1.0, 32.0 * 2.0 ** max(math.floor(math.log2(max(share, 1e-300))), _SHORTEST))


def about_as_long(duration: float) -> float:
    """The next power of two, s: runs of about as long share their modes."""
    return 2.0 ** math.ceil(math.log2(duration))


def settled(made: Array, x: Array, rest: Bytes, missing: float) -> Array:
    """The response (n,), just made, with what modes too slow to move, of gain ``missing``, keep of an input
    held for ever before an experiment."""
    if not missing or rest.max() != kernels.BALANCED:
        return made
    firsts = np.flatnonzero(rest).tolist()
    for a, b in pairwise([*firsts, len(x)]):
        if rest[a] == kernels.BALANCED:
            made[a:b] += missing * x[a]
    return made


def between(x: Array, rest: Bytes, h: float, modes: Modes, share: float, held: bool = False) -> Array:
    """The response to ``x`` (n,) at the ``share``, 0 … 1, of the way to each sample from the one before.

    What a mode was a sample ago decays over that share, which is one more factor of its input; the rest is
    the answer to the straight line since, or to what is ``held``.
    """
    rates, pole = np.append(-modes.rates, modes.pole), modes.pole
    gains = np.append(modes.weights / modes.rates, -modes.residue / pole)
    decay, past, now = hold(share * h * rates)
    before, after = ((gains * c).sum().real for c in (past, now))
    on = 0.0 if held else share  # the way to the next sample
    before, after = before + (1.0 - on) * (after + modes.through), on * (after + modes.through)
    _, b0, b1 = hold(h * rates)
    weight = gains * decay
    rows = [np.exp(h * rates[:-1].real), (weight * b0)[:-1].real, (weight * b1)[:-1].real]
    pair = [np.exp(h * pole), (weight * b0)[-1], (weight * b1)[-1]]
    a, past, now, twins = (np.stack([row, row]) for row in (*rows, _parts(pair)))
    kept = kernels.modes(x, rest, a, past, now, twins, 0.0, switching=False, held=held)
    made: Array = shifted(kept + before * x, rest, 1) + after * x
    return made + sum(between(x, rest, h, pair, share, held) for pair in modes.further)


@lru_cache(maxsize=256)
def tables(
    T: float, alpha: float, h: float, duration: float, unloading: float
) -> tuple[Array, Array, Array, Array, float]:
    """What the compiled loop needs, rows loading and unloading."""
    modes = fractional_lag(T, alpha, h, duration)
    loading = speeded(modes, h, 1.0)
    falling = loading if unloading == 1.0 else speeded(modes, h, unloading)
    a, past, now, pair = (np.array(rows) for rows in zip(loading, falling))
    return a, past, now, pair, modes.through


def speeded(modes: Modes, h: float, speed: float) -> tuple[Array, Array, Array, Array]:
    """What the compiled loop needs of ``modes`` that run ``speed`` times as fast: a, b0, b1 (m,), pair
    (6,)."""
    a, b0, b1 = hold(-modes.rates * speed * h)
    gain = modes.weights / modes.rates
    pa, p0, p1 = _held(modes.pole * speed * h)
    scale = -modes.residue / modes.pole
    return a, gain * b0, gain * b1, _parts([pa, scale * p0, scale * p1])


def swings(x: Array, rest: Bytes, h: float, modes: Modes, held: bool = False) -> Array | float:
    """What the further pairs of ``modes`` make of ``x`` (n,)."""
    made: Array | float = 0.0
    for pair in modes.further:
        a, b0, b1, both = (np.stack([row, row]) for row in speeded(pair, h, 1.0))
        made = made + kernels.modes(x, rest, a, b0, b1, both, 0.0, switching=False, held=held)
    return made


def _held(q: complex) -> tuple[complex, complex, complex]:
    """:func:`hold` of one mode."""
    a = cmath.exp(q)
    mean = 1 + q / 2 + q * q / 6 if abs(q) < _SLOW else (a - 1) / q
    return a, mean - a, 1 - mean


def _parts(pair: Sequence[complex]) -> Array:
    """Real and imaginary parts in turn."""
    return np.array([part for c in pair for part in (c.real, c.imag)])


def hold(q: Array) -> tuple[Array, Array, Array]:
    """Coefficients of z' = λ(z − x), λh = q, for x linear over the sample: a, of the past and of the present
    x."""
    a, slow = np.exp(q), np.abs(q) < _SLOW
    mean = np.where(slow, 1 + q / 2 + q * q / 6, (a - 1) / np.where(slow, 1, q))
    return a, mean - a, 1 - mean
