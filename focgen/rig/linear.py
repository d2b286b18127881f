"""Transfer functions run over samples, from rest: whole orders exactly, real orders as a sum of modes."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import combinations

import numpy as np

from focgen.arrays import Array, Bytes, Complex
from focgen.fractional.decomposition import dense
from focgen.fractional.delay import split_delay
from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import Polynomial, TransferFunction
from focgen.logs.between import Between
from focgen.rig import kernels
from focgen.rig.courses import course, sharpened
from focgen.rig.delay import delayed, shifted
from focgen.rig.modes import (
    Modes,
    about_as_long,
    between,
    fractional_lag,
    hold,
    respond,
    seen_share,
    settled,
    speeded,
    swings,
    tables,
)
from focgen.rig.real_orders import modes_of
from focgen.rig.rig import UNITY

_SLOW = 0.03  # of a pole times the sample time, q: less is a series
_STEP = tuple(1.0 / math.factorial(k + 1) for k in range(8))  # of (e^q − 1)/q
_LINE = tuple(1.0 / (math.factorial(k) * (k + 2)) for k in range(8))  # of (e^q (q − 1) + 1)/q²
_LARGEST = 700.0  # of an exponent


def run(
    transfer: TransferFunction,
    x: Array,
    rest: Bytes,
    h: float,
    duration: float,
    between: Between | bool = Between.STRAIGHT,
    delay: float = 0.0,
) -> Array:
    """The response to ``x`` (n,) sampled every ``h`` s, later by ``delay`` s, at rest wherever ``rest`` (n,)
    is true, every ``duration`` s or sooner.

    ``between``: what the input does from one sample to the next. A smooth one's bends are taken as they are
    by whole orders, and by their area otherwise.
    """
    whole, part = split_delay(delay, h)
    if between == Between.SMOOTH:
        if transfer.is_integer and transfer.den[0].order and not part:
            return shifted(_smooth(transfer, x, rest, h), rest, whole)
        if transfer != UNITY:
            x = sharpened(np.ascontiguousarray(x, float), rest)
    held = between == Between.HELD
    if transfer == UNITY:
        return x if delay == 0.0 else _passed(x, rest, h, delay, held)
    if part:
        found = _between(transfer, x, rest, h, duration, held, 1.0 - part)
    else:
        found = _at_samples(transfer, x, rest, h, duration, held)
    return shifted(found, rest, whole) if whole else found


def _passed(x: Array, rest: Bytes, h: float, delay: float, held: bool) -> Array:
    """A pure delay: between its samples a staircase is what it was at the one before."""
    whole, part = split_delay(delay, h)
    return shifted(x, rest, whole + (part > 0.0)) if held else delayed(x, rest, h, delay)


def _smooth(transfer: TransferFunction, x: Array, rest: Bytes, h: float) -> Array:
    """The response of whole orders to an input that runs in lines and bends."""
    x = np.ascontiguousarray(x, float)
    line, bend, twist = course(x, rest, Between.SMOOTH)
    (b, a), pulses = discrete(transfer, h, True), _bent(transfer, h)
    made = kernels.rational(x, rest, b, a)
    for part, weights in zip((line, bend, twist), pulses):
        if np.any(part):
            made = made + kernels.rational(part, rest, weights, a)
    return made


@lru_cache(maxsize=512)
def _bent(transfer: TransferFunction, h: float) -> tuple[Array, ...]:
    """Numerators in powers of z^-1 of what a sample's inputs t, t (t − 1) and t (t − 1)(2 t − 1), t = 0 … 1,
    leave, over the denominator of :func:`discrete`: from the first samples of the exact responses."""
    _, a = discrete(transfer, h, True)
    count = len(a)
    power = [
        _powers(transfer, h, k, count) for k in range(4)
    ]  # of t^k within one sample, and of nothing after
    shapes = (power[1], power[2] - power[1], 2.0 * power[3] - 3.0 * power[2] + power[1])
    return tuple(np.convolve(a, shape)[:count] for shape in shapes)


def _powers(transfer: TransferFunction, h: float, k: int, count: int) -> Array:
    """The output (count,) at the end of a sample in which the input is t^k, and at the ends that follow."""
    from scipy.linalg import expm
    from scipy.signal import tf2ss

    A, B, C, _ = tf2ss(coefficients(transfer.num), coefficients(transfer.den))
    n = len(A)
    whole = np.zeros((n + k + 1, n + k + 1))
    whole[:n, :n], whole[:n, n : n + 1] = A * h, B * h
    whole[range(n, n + k), range(n + 1, n + k + 1)] = np.arange(1, k + 1)
    state, kept, made = expm(whole)[:n, n + k], expm(A * h), []
    for _ in range(count):
        made.append(float((C @ state)[0]))
        state = kept @ state
    return np.array(made)


def _at_samples(
    transfer: TransferFunction, x: Array, rest: Bytes, h: float, duration: float, held: bool
) -> Array:
    if transfer.is_integer:
        return kernels.rational(x, rest, *discrete(transfer, h, held))
    lag = single_lag(transfer)
    if lag:
        gain, T, alpha = lag
        return gain * respond(x, rest, h, T, alpha, duration, held=held)
    longest = about_as_long(duration)
    rows, pair, through = _tables(transfer, h, longest)
    made = kernels.modes(x, rest, *rows, pair, through, switching=False, held=held)
    modes = modes_of(transfer, h, longest)
    return settled(made + swings(x, rest, h, modes, held), x, rest, _missing(transfer, modes))


def _missing(transfer: TransferFunction, modes: Modes) -> float:
    """The gain at rest that its modes lack; none where it integrates."""
    return transfer.dc_gain - modes.gain if np.isfinite(transfer.dc_gain) else 0.0


def _between(
    transfer: TransferFunction, x: Array, rest: Bytes, h: float, duration: float, held: bool, share: float
) -> Array:
    """The response at the ``share`` of the way from the sample before to each."""
    if transfer.is_integer:
        return kernels.rational(x, rest, *_discrete_between(transfer, h, held, share))
    lag, longest = single_lag(transfer), about_as_long(duration)
    if lag:
        gain, T, alpha = lag
        modes = fractional_lag(T, alpha, h * seen_share(share), longest)
        return gain * settled(between(x, rest, h, modes, share, held), x, rest, 1.0 - modes.gain)
    modes = modes_of(transfer, h * seen_share(share), longest)
    return settled(between(x, rest, h, modes, share, held), x, rest, _missing(transfer, modes))


def holds_level(transfer: TransferFunction) -> bool:
    """Whether it is a constant over dynamics that come to rest at a level: a force on what a spring holds."""
    num, den = transfer.num, transfer.den
    return len(num) == 1 and num[0].order == 0.0 and len(den) > 1 and den[-1].order == 0.0


def is_spring(transfer: TransferFunction) -> bool:
    """Whether it :func:`holds_level`, and all its orders are whole."""
    return holds_level(transfer) and transfer.is_integer


def row_of(
    transfer: TransferFunction, h: float, duration: float
) -> tuple[float, tuple[Array, Array, Array, Array, float], float]:
    """What multiplies the response of the modes, the one row of them that a compiled loop needs, and the gain
    at rest that they lack."""
    lag = single_lag(transfer)
    if not lag:
        modes = modes_of(transfer, h, duration).in_one_row
        return 1.0, (*speeded(modes, h, 1.0), modes.through), _missing(transfer, modes)
    gain, T, alpha = lag
    a, b0, b1, pair, through = tables(T, alpha, h, duration, 1.0)
    missing = 1.0 - fractional_lag(T, alpha, h, duration).gain
    return gain, (a[0], b0[0], b1[0], pair[0], through), missing


def oscillator(x: Array, rest: Bytes, h: float, period: float, damping: float, speed: bool = False) -> Array:
    """The response of w²/(s² + 2 d w s + w²), w = 2π/``period`` (s), ``damping`` d < 1, input linear between
    samples; ``speed``: its rate of change over w instead."""
    w = 2.0 * np.pi / period
    pole = w * complex(-damping, np.sqrt(1.0 - damping**2))
    scale = -2.0 * (w * w / (2j * pole.imag)) * (1.0 / w if speed else 1.0 / pole)
    a, b0, b1 = hold(np.array([pole * h]))
    pair = np.array([[c.real, c.imag] for c in map(complex, (a[0], scale * b0[0], scale * b1[0]))]).ravel()
    none = np.zeros((2, 1))
    return kernels.modes(x, rest, none, none, none, np.stack([pair, pair]), 0.0, switching=False)


def single_lag(transfer: TransferFunction) -> tuple[float, float, float] | None:
    """(gain, T, alpha) where the transfer function is gain/(T s^alpha + 1) with 0 < alpha < 2."""
    if len(transfer.num) != 1 or transfer.num[0].order != 0 or len(transfer.den) != 2:
        return None
    high, low = transfer.den
    T = high.coefficient / low.coefficient
    if low.order != 0 or not 0 < high.order < 2 or T <= 0:
        return None
    return transfer.num[0].coefficient / low.coefficient, T, high.order


@lru_cache(maxsize=512)
def discrete(transfer: TransferFunction, h: float, held: bool) -> tuple[Array, Array]:
    """Numerator and denominator in powers of z^-1, exact at the samples: the modes one by one, put together
    again."""
    num, den = coefficients(transfer.num), coefficients(transfer.den)
    if len(den) == 1:
        return num / den[0], np.ones(1)
    through = num[0] / den[0] if len(num) == len(den) else 0.0
    poles = _roots(den)
    if coincide(poles):
        return _by_exponential(num, den, h, held)
    return _put_together(poles.tolist(), residues(num, den, poles).tolist(), through, h, held)


def _put_together(
    poles: Sequence[complex], weights: Sequence[complex], through: float, h: float, held: bool
) -> tuple[Array, Array]:
    """Numerator and denominator of modes, in numbers one by one: a fit makes them anew at every step, and
    arrays of one or two take several times as long."""
    kept = [_grown(p * h) for p in poles]
    whole = _product(kept)
    b = [through * w for w in whole]
    for i, (p, weight) in enumerate(zip(poles, weights)):
        past, now = _counted(p * h, weight * h, held)
        for k, rest in enumerate(_product([*kept[:i], *kept[i + 1 :]])):
            b[k] += now * rest
            b[k + 1] += past * rest
    return np.array(b, complex).real, np.array(whole, complex).real


def _product(roots: Sequence[complex]) -> list[complex]:
    """The polynomial 1 − r z^-1 times the same of the others, in powers of z^-1."""
    made = [1.0 + 0j]
    for root in roots:
        made = [x - root * y for x, y in zip([*made, 0j], [0j, *made])]
    return made


def _roots(den: Array) -> Complex:
    """The roots of a polynomial, highest power first; of the second order by the formula that cancels
    nothing."""
    if len(den) != 3:
        return np.roots(den).astype(complex) if len(den) > 2 else -np.asarray(den[1:] / den[0], complex)
    a, b, c = map(float, den)
    q = -0.5 * (b + cmath.sqrt(b * b - 4.0 * a * c) * (1.0 if b >= 0.0 else -1.0))
    return np.array([q / a, c / q if q else 0.0], complex)


def _counted(q: complex, residue: complex, held: bool) -> tuple[complex, complex]:
    """What the past and the present input of a mode count that is e^q as large a sample later. Of a slow mode
    the formulas would cancel most of their digits."""
    if abs(q) < _SLOW:
        gain, past = _summed(q, _STEP), _summed(q, _LINE)
    else:
        a = _grown(q)
        gain, past = (a - 1.0) / q, (a * (q - 1.0) + 1.0) / (q * q)
    return (residue * gain, 0j) if held else (residue * past, residue * (gain - past))


def _grown(q: complex) -> complex:
    """e^q, infinite where no number is as large."""
    return cmath.exp(q) if q.real < _LARGEST else complex(math.inf)


def _summed(q: complex, series: Sequence[float]) -> complex:
    """A series in powers of ``q``, the lowest first."""
    made = 0j
    for coefficient in reversed(series):
        made = made * q + coefficient
    return made


def residues(num: Array, den: Array, poles: Complex) -> Complex:
    """What each of the ``poles`` (k,), all different, counts in num/den, highest power first: (k,)."""
    above, first, every = num.tolist()[::-1], float(den[0]), poles.tolist()
    apart = (
        math.prod((p - q for k, q in enumerate(every) if k != i), start=1.0 + 0j) for i, p in enumerate(every)
    )
    return np.array([_summed(p, above) / (first * others) for p, others in zip(every, apart)], complex)


def _held(poles: Complex, residues: Complex, h: float, held: bool) -> tuple[Complex, Complex, Complex]:
    """What is left of each mode after ``h`` s, and what the past and the present input count."""
    pairs = [_counted(p * h, r * h, held) for p, r in zip(poles.tolist(), residues.tolist())]
    past, now = np.array(pairs, complex).reshape(-1, 2).T
    return np.exp(poles * h), past, now


@lru_cache(maxsize=512)
def _discrete_between(transfer: TransferFunction, h: float, held: bool, share: float) -> tuple[Array, Array]:
    """As :func:`discrete`, but the response at the ``share`` of the way from the sample before to each."""
    num, den = coefficients(transfer.num), coefficients(transfer.den)
    through = num[0] / den[0] if len(num) == len(den) else 0.0
    poles = _roots(den)
    if coincide(poles):
        return _by_pulse(transfer, _by_exponential(num, den, h, held)[1], h, held, share)
    weights = residues(num, den, poles)
    a, past, now = _held(poles, weights, h, held)
    decay, before, after = _held(poles, weights, share * h, held)
    whole, line = np.atleast_1d(np.poly(a)), after.sum() + through
    # the input on the way from the last sample: what it was there, or a share of the line to this one
    recent = [0.0, before.sum() + through] if held else [share * line, before.sum() + (1.0 - share) * line]
    b = np.convolve(whole, recent)
    for i in range(len(poles)):
        b[1:] += decay[i] * np.convolve([now[i], past[i]], np.atleast_1d(np.poly(np.delete(a, i))))
    return b.real, whole.real


def _by_pulse(
    transfer: TransferFunction, a: Array, h: float, held: bool, share: float
) -> tuple[Array, Array]:
    """The same from the first samples of the exact response to a pulse, which repeated poles do not
    trouble.
    """
    late = Convolution(transfer, h, "zero" if held else "linear", (1.0 - share) * h)
    pulse = late.run(np.eye(1, len(a) + 2, 1)[0])[1:]
    return np.convolve(a, pulse)[: len(a) + 1], a


def coincide(poles: Complex) -> bool:
    """Whether two poles are so close that their residues would cancel."""
    pairs = combinations(poles.tolist(), 2)
    return any(_size(a - b) < 1e-3 * max(_size(a), _size(b), 1e-12) for a, b in pairs)


def _size(pole: complex) -> float:
    return math.hypot(pole.real, pole.imag)


def _by_exponential(num: Array, den: Array, h: float, held: bool) -> tuple[Array, Array]:
    """The same from the matrix exponential, which repeated poles do not trouble, but which takes longer."""
    from scipy.signal import cont2discrete

    scale = abs(den[-1] / den[0]) ** (1 / (len(den) - 1)) or 1.0  # time in units of 1/scale: well conditioned
    powers = scale ** np.arange(len(den) - 1, -1, -1.0)
    num, den = num * powers[-len(num) :], den * powers
    b, a, _ = cont2discrete((num / den[0], den / den[0]), h * scale, "zoh" if held else "foh")
    return np.atleast_2d(b)[0], a


def coefficients(terms: Polynomial) -> Array:
    """One for each power, the highest first."""
    return dense(terms) if terms else np.zeros(1)


@lru_cache(maxsize=64)
def _tables(
    transfer: TransferFunction, h: float, duration: float
) -> tuple[tuple[Array, Array, Array], Array, float]:
    """What the compiled loop needs of them: rows of the modes, the pair, and what passes at once."""
    modes = modes_of(transfer, h, duration)
    *rows, pair = (np.array([row, row]) for row in speeded(modes, h, 1.0))
    a, past, now = rows
    return (a, past, now), pair, modes.through
