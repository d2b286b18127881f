"""The initial state: what an input before the first sample still does after it.

The state that a fractional system starts from is its whole past. Here the past is a drive K(p) p that stepped
once, or a few times, at unknown times before the first sample by unknown amounts within the drive's range. A
step by a that was θ ago still lacks a (1 − S(t + θ)) of its way. A held level is such a past with θ = 0, a
rest one without any step. More than a few steps are never needed: what they leave is ever smoother, so a few
stand for many.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from focgen.arrays import Array
from focgen.identification.excitation import Excitation
from focgen.identification.kernel import Kernels
from focgen.identification.noise import residual_model

MOST_STEPS = 3
SHOWS = 20_000  # first samples that show whether there was a past
_WHITE = 0.25  # effective samples a sample: what is left above it is noise, below it likely a misfit
_OLDER = 0.5  # of the reach: a level that was held an octave earlier differs by about so much
_AT_LEAST = 3.0  # effective samples
_ASKED_OF_MISFIT = 25.0  # χ² that a past has to take off a misfit …
_HALVED = 1.0  # … and variance, over what it leaves
EXACT = 1e-4  # of the spread: what is left below shows no past
_ASKED = 6.0  # χ² beyond what as many free values take off by chance, from which a past is estimated
_ASKED_AHEAD = 12.0  # … and of the few samples ahead of the answer alone, where less is known of the noise
_UNMOVED = 1.0  # standard deviations of what is left: nearer to its first value an answer has not begun
_TELLS = 8  # first samples without an answer, from which on they tell whether there was a past


@dataclass(frozen=True)
class Past:
    """A number of ``steps`` at unknown times, whose sizes are normal with standard deviation ``reach``,
    output units.

    What was before the first of them is not known either: at ``older`` times, samples before the first
    sample, further steps are allowed for, half as large. They are smooth by now, and only widen the
    intervals. An experiment that begins at a held level has them even where no step is found.
    """

    steps: int
    reach: float
    older: tuple[float, ...] = ()

    @property
    def reaches(self) -> Array:
        """Of every step, the older ones last, (steps + older,)."""
        return self.reach * np.repeat([1.0, _OLDER], [self.steps, len(self.older)])


def latest(x: Excitation) -> float:
    """The longest time before the first sample that a past is looked for, samples."""
    return float(x.looked_back - 2)


def times(x: Excitation, octave: int = 1) -> Array:
    """A grid of times before the first sample, in samples, so many an ``octave``."""
    return np.concatenate([[0.0], 2.0 ** np.arange(0.0, np.log2(latest(x)), 1.0 / octave)])


def older_times(x: Excitation, when: Array) -> tuple[float, ...]:
    """Octaves before the earliest of the times ``when``, from the first sample on where there is none;
    samples."""
    first = 2.0 * (float(np.max(when)) + 1.0) if len(when) else 1.0
    return tuple(first * 2.0**k for k in range(max(0, int(np.ceil(np.log2(latest(x) / first))))))


def columns(x: Excitation, kernels: Kernels, when: Array, rows: int = 3) -> Array:
    """What is left of unit steps made ``when`` (steps,) samples before the first one: (rows + 1, steps, n).

    The last row is the derivative by log(when + 1).
    """
    n, whole = len(x), np.floor(when).astype(int)
    answer = x.stepped.respond(kernels, rows, n + int(whole.max()) + 1)[:, 0]
    at, later = (np.stack([answer[:, k : k + n] for k in whole + one], axis=1) for one in (0, 1))
    left = at + (when - whole)[:, None] * (later - at)
    left[0] -= x.sensor_gain
    return np.concatenate([left, ((later - at)[:1] * (when + 1.0)[:, None])])


def best_time(residual: Array, made: Array) -> int:
    """Which of the columns ``made`` (times, n) takes most off a residual (n,), beside an offset."""
    centred = made - made.mean(axis=1, keepdims=True)
    sizes = np.maximum(np.linalg.norm(centred, axis=1), 1e-300)
    return int(np.argmax(np.abs(centred @ (residual - residual.mean())) / sizes))


def asks_for_past(residual: Array, made: Array, reach: float, answer: Array) -> bool:
    """Whether what the right model leaves, (n,), asks for a past with columns like ``made`` (times, n).

    ``answer`` (n,) is the model's from rest. The χ² that such a past takes off the whitened residual has to
    tell it from noise, see :func:`suggestion`. What a model that is not quite true leaves is no stationary
    noise, though. So the best single step has to take off enough of the residual itself, too, counted in as
    many samples as its rest is worth.

    Noise that came in with the input, and a misfit, wander as slowly as a past does. From rest nothing moves
    ahead of the answer, though, and what a past leaves moves fastest there. So a past has to show in the
    samples ahead of the answer, where they are enough to tell. One too slow for that has to halve what is
    left.
    """
    rows = _whitened(residual, made)
    if _beyond_chance(rows, reach) <= _ASKED:
        return False
    without = _without(residual, made[best_time(residual, made)])
    if not worth_it(residual, without):
        return False
    ahead = rows[: max(_ahead(residual, answer) - (len(residual) - len(rows)), 0)]
    shows = len(ahead) < _TELLS or _beyond_chance(ahead, reach) > _ASKED_AHEAD
    return shows or _halved(residual, without)


def _ahead(residual: Array, answer: Array) -> int:
    """How many first samples there are before the model's answer (n,) from rest begins."""
    away = np.abs(answer[: len(residual)] - answer[0]) > _UNMOVED * np.std(residual)
    return int(np.argmax(away)) if away.any() else len(residual)


def suggestion(residual: Array, made: Array, reach: float) -> float:
    """The χ² that a past takes off the whitened residual, beyond what as many free values as the data really
    determine take off by chance (Akaike's criterion), and a margin."""
    return _beyond_chance(_whitened(residual, made), reach) - _ASKED


def _whitened(residual: Array, made: Array) -> Array:
    """Columns: residual, offset and those of a past, made white and in units of the noise; without the first
    samples, which the filter needs."""
    basis = np.vstack([np.ones(len(residual)), made]).T
    model = residual_model(residual - basis @ np.linalg.lstsq(basis, residual, rcond=1e-6)[0])
    white = lfilter(model.a, [1.0], np.column_stack([residual, basis]), axis=0)[len(model.a) - 1 :]
    rows: Array = white / np.sqrt(model.variance)
    return rows


def _beyond_chance(rows: Array, reach: float) -> float:
    """The χ² that the columns of a past take off, less twice the number of values that are free."""
    gained, free = _gain(rows, reach)
    return gained - 2.0 * free


def _gain(rows: Array, reach: float) -> tuple[float, float]:
    """χ² that the columns take off and their effective number; ``rows``: residual, offset, columns, in units
    of the noise."""
    mean = rows[:, 1] / np.linalg.norm(rows[:, 1])
    rows = rows - np.outer(mean, mean @ rows)
    singular, sizes, _ = np.linalg.svd(reach * rows[:, 2:], full_matrices=False)
    share = sizes**2 / (1.0 + sizes**2)
    return float(share @ (singular.T @ rows[:, 0]) ** 2), float(np.sum(share))


def _without(residual: Array, column: Array) -> Array:
    """What one column, beside an offset, leaves of a residual, (n,) each."""
    basis = np.column_stack([np.ones(len(residual)), column])
    left: Array = residual - basis @ np.linalg.lstsq(basis, residual, rcond=None)[0]
    return left


def worth_it(before: Array, after: Array) -> bool:
    """Whether a residual (n,) fell by enough, over the variance of what is left, in effective samples; by
    half where what is left is likely a misfit."""
    effective = max(residual_model(after).effective, _AT_LEAST)
    if effective > _WHITE * len(after):
        return _taken(before, after) * effective > _ASKED
    return _halved(before, after) and _taken(before, after) * effective > _ASKED_OF_MISFIT


def _halved(before: Array, after: Array) -> bool:
    return _taken(before, after) > _HALVED


def _taken(before: Array, after: Array) -> float:
    """The variance that was taken off, over what is left."""
    return float(np.var(before)) / max(float(np.var(after)), 1e-300) - 1.0
