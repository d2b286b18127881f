"""What an input does between its samples: jumps, straight lines and bends, read off the samples.

A step of a gauge's noisy pressure is a step: the change stands alone and is far above the noise. Everything
else is joined by curves, each from the polynomial through those six samples around it whose fifth difference
is least (Harten's essentially non-oscillatory choice, J. Comput. Phys. 71, 1987), so that the kink where a
pressure begins to rise spoils no neighbour. Where bends drown in noise the line is straight.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cache

import numpy as np

from focgen.arrays import Array, Bools

_FAR = 8.0  # standard deviations of a difference: a jump is larger
_NEAR = 4.0  # standard deviations: a neighbour of a jump moves less than this …
_QUIET = 0.1  # … or less than this share of the jump
_SMALL = 0.02  # of the reach: a smaller change is no jump
_SEEN = 5.0  # standard deviations: a bend below is noise
_ROUNDING = 1e-14  # of the largest value: a bend below is rounding
_POINTS = (6, 4)  # of a polynomial; the second where a jump or the log's end leaves no room for the first
_CENTRED = (4, 6, 8)  # the same of a smooth signal, from the ends inwards
_OFF_MIDDLE = 3.0  # a polynomial off the middle has to have a highest difference so much smaller
_ORDER = 6  # of the difference that noise is told from a signal by
_OF_SIXTH = 924.0**0.5  # standard deviation of white noise's sixth difference
_NORMAL = 0.6745  # median of |x| of the normal distribution


class Between(IntEnum):
    """What an input does between its samples: it runs in straight lines, is held until it jumps, or is
    smooth."""

    STRAIGHT = 0
    HELD = 1
    SMOOTH = 2


@dataclass(frozen=True, eq=False)
class Course:
    """An input as the dynamics see it; each (powers, n).

    ``values`` at the samples; ``jumps`` at a sample, the first one included; in the sample that ends at each
    index (0 at the first): ``straight``, the change made in a line, and ``bends``, ``twists``, the
    coefficients of x (x − 1) and x (x − 1)(2x − 1) beside it, None where there are none.
    """

    values: Array
    jumps: Array
    straight: Array
    bends: Array | None = None
    twists: Array | None = None

    @property
    def jumps_at_first(self) -> bool:
        """Whether the input jumps at the first sample."""
        return bool(np.any(self.jumps[:, 0] != 0.0))

    def first(self, count: int) -> Course:
        """The first ``count`` powers alone."""
        return replace(self, **{name: part[:count] for name, part in vars(self).items() if part is not None})

    def until(self, count: int) -> Course:
        """The first ``count`` samples alone."""
        return replace(
            self, **{name: part[:, :count] for name, part in vars(self).items() if part is not None}
        )


def noise_level(values: Array) -> float:
    """The standard deviation of a signal's white noise (n,), from its sixth differences; robust to jumps."""
    if len(values) <= _ORDER:
        return 0.0
    return float(np.median(np.abs(np.diff(values, _ORDER)))) / _NORMAL / _OF_SIXTH


def white_level(values: Array) -> float:
    """The standard deviation of what is white of a signal (n,), n ≥ 3, from its second differences: what is
    slower than a few samples counts little."""
    return float(1.4826 * np.median(np.abs(np.diff(values, 2))) / np.sqrt(6.0))


def jumps_of(values: Array) -> Bools:
    """Where a signal (n,) jumps: (n,) bool, true at the first sample after a jump.

    A jump is far above the noise, and stands alone: a pressure on its way up moves in two samples in a row.
    """
    way = np.abs(np.diff(values))
    noise = noise_level(values) * 2.0**0.5
    before, after = np.pad(way, 1)[:-2], np.pad(way, 1)[2:]
    large = way > max(_FAR * noise, _SMALL * float(np.ptp(values)))
    alone = np.maximum(before, after) <= np.maximum(_NEAR * noise, _QUIET * way)
    return np.concatenate([[False], large & alone])


def course_of(powers: Array, jumps: Bools, between: Between = Between.SMOOTH) -> Course:
    """The course of inputs ``powers`` (m, n), 0 before their first sample, with ``jumps`` (n,) by
    :func:`jumps_of`; ``between``: what they do where they do not jump.
    """
    changes = np.diff(powers, axis=1, prepend=0.0)
    at_once = jumps | (between == Between.HELD)
    at_once[0] = True
    jumped = np.where(at_once, changes, 0.0)
    course = Course(powers, jumped, changes - jumped)
    if between != Between.SMOOTH or np.all(at_once):
        return course
    bends, twists = zip(*(_bent(row, at_once) for row in powers))
    if not np.any(bends):
        return course
    return replace(course, bends=np.array(bends), twists=np.array(twists))


def smooth_bends(values: Array) -> tuple[Array, Array]:
    """The coefficients of both bends in the sample that ends at each index, (n,) each, of a signal without
    noise or jumps: of the polynomial through the eight samples around it, near the ends through fewer.

    What is left is 1e-3 of the bend at 5 samples a period, and falls with the seventh power of the frequency.
    """
    bends, twists = np.zeros(len(values)), np.zeros(len(values))
    for points in _CENTRED:
        if len(values) >= points:
            middle = slice(points // 2, points // 2 + len(values) - points + 1)
            bend, twist = _weights(points, points // 2 - 1)
            bends[middle] = np.correlate(values, bend, "valid")
            twists[middle] = np.correlate(values, twist, "valid")
    return bends, twists


def _bent(values: Array, jumps: Bools) -> tuple[Array, Array]:
    """The coefficients of both bends in the sample that ends at each index, (n,) each."""
    noise = noise_level(values)
    bends, twists = np.zeros(len(values)), np.zeros(len(values))
    open_yet = np.concatenate([[False], ~jumps[1:]])
    for points in _POINTS:
        if len(values) < points:
            continue
        found, bend, twist = _smoothest(values, jumps, points, noise)
        fits = found & open_yet
        bends[fits], twists[fits] = bend[fits], twist[fits]
        open_yet &= ~found
    return bends, twists


def _smoothest(values: Array, jumps: Bools, points: int, noise: float) -> tuple[Bools, Array, Array]:
    """Where a polynomial through ``points`` samples crosses no jump, and both bends from the one whose
    highest difference is least; (n,) each."""
    n = len(values)
    windows = np.lib.stride_tricks.sliding_window_view(values, points)
    crossed = np.cumsum(jumps[1:])  # jumps up to each sample
    jumped = np.concatenate([[0], crossed])
    whole = jumped[points - 1 :] == jumped[: n - points + 1]
    highest = np.abs(np.diff(windows, points - 1, axis=1)[:, 0])
    least_seen = max(_SEEN * noise, _ROUNDING * float(np.abs(values).max()))
    least = np.full(n, np.inf)
    bends, twists = np.zeros(n), np.zeros(n)
    for ahead in range(points - 1):  # samples of the polynomial ahead of the one that begins
        weights = _weights(points, ahead)
        off = 1.0 if 2 * ahead == points - 2 else _OFF_MIDDLE
        size = np.full(n, np.inf)
        size[ahead + 1 : ahead + 1 + len(windows)] = np.where(whole, off * highest, np.inf)
        better = size < least
        made = np.zeros((2, n))
        made[:, ahead + 1 : ahead + 1 + len(windows)] = weights @ windows.T
        seen = np.abs(made) > least_seen * np.linalg.norm(weights, axis=1)[:, None]
        least = np.where(better, size, least)
        bends = np.where(better, made[0] * seen[0], bends)
        twists = np.where(better, made[1] * seen[1], twists)
    return np.isfinite(least), bends, twists


@cache
def _weights(points: int, ahead: int) -> Array:
    """What the samples −ahead … points − 1 − ahead weigh in the bend and the twist between 0 and 1; (2,
    points).

    The bend c (x² − x) has the area of what the polynomial is below the straight line, c/6; the twist the
    difference of its second derivatives at both ends, 12 times its coefficient.
    """
    power = np.arange(points)
    inverse = np.linalg.inv((power - ahead)[:, None].astype(float) ** power)  # coefficients from samples
    area = 1.0 / (power + 1.0) - 0.5 * ((power > 0) + 2.0 * (power == 0))
    curving = np.where(power > 2, power * (power - 1.0), 0.0)
    return np.array([-6.0 * area, curving / 12.0]) @ inverse
