"""What a quick regulator makes of a held command within each sample.

Lines and curves through readings know of no kink at a jump of the command. A regulator that is through with
its way before the next reading looks as if it jumped then, or went there in a line: up to a sample late. What
is fitted behind it makes up for that with a wrong T, order and gain. So what the regulator does within a
sample is taken from its model, and only what that leaves of the readings runs in straight lines.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from focgen.arrays import Array
from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Course, noise_level
from focgen.rig.corners import transfer_of
from focgen.rig.rig import UNITY, Rig

_GAUSS, _SHARES = np.polynomial.legendre.leggauss(6)
PLACES = 0.5 * (1.0 + np.r_[_GAUSS, 1.0])  # of a sample, 0 … 1, where a course within it is known
_SHARES = 0.5 * _SHARES  # of a sample, that each but the last stands for
_QUICK = 0.2  # of its way in two samples: a slower regulator is straight enough between them
_FOLLOWS = 0.3  # of what lines miss: where readings are as far from the model, it does not tell more


def is_quick(regulator: TransferFunction, step: float) -> bool:
    """Whether a regulator is known to go far in two samples of ``step`` s."""
    end = regulator.dc_gain
    if not np.isfinite(end) or not end:
        return False
    try:
        return bool(Convolution(regulator, step).run(np.ones(3))[2] / end > _QUICK)
    except ArithmeticError:
        return False


def kinks(rig: Rig, stages: Sequence[str], step: float) -> bool:
    """Whether all of the ``stages`` are quick against samples of ``step`` s, so that what leaves them turns
    within a sample as a held command jumps: lines between its readings miss some of its area."""
    found = [transfer_of(rig, stage) for stage in stages]
    moving = [transfer for transfer in found if transfer is not None and transfer != UNITY]
    return bool(moving) and all(is_quick(transfer, step) for transfer in moving)


def made_within(run: Callable[[float], Array], step: float) -> Array:
    """What is made of a held command, within samples of ``step`` s: (7, n), at the ``PLACES`` of the sample
    that ends at each index. ``run``: makes it (n,) at the samples, so many s later than it is."""
    return np.array([run(step * (1.0 - place)) for place in PLACES])


def by_regulator(regulator: TransferFunction, step: float, command: Array, late: float) -> Array:
    """The same of a ``regulator`` that was at rest at 0, its ``command`` (n,) ``late`` s after its row."""
    sent, late = as_sent(command, step, late)
    return made_within(lambda more: Convolution(regulator, step, delay=late + more).run(sent), step)


def as_sent(command: Array, step: float, late: float) -> tuple[Array, float]:
    """A ``command`` (n,) that comes ``late`` s after its row, whole samples sooner where that is before it,
    and by how much it is late then, s."""
    ahead = min(max(math.ceil(-late / step), 0), len(command))
    sent = np.r_[command[ahead:], np.full(ahead, command[-1])] if ahead else command
    return sent, max(late + ahead * step, 0.0)


def scaled_to(readings: Array, made: Array) -> Array:
    """What was made (7, n), with the gain and the zero that suit the ``readings`` (n,)."""
    columns = np.column_stack([np.ones(len(readings)), made[-1]])
    (zero, gain), *_ = np.linalg.lstsq(columns, readings, rcond=None)
    found: Array = zero + gain * made
    return found


def read_within(readings: Array, made: Array, first: Array) -> Array | None:
    """A signal that was read (n,) within its samples (7, n), from what was ``made`` (7, n) of the command:
    the rest in straight lines. ``first`` (n,): true where an experiment begins. None where the readings do
    not follow the model closely enough to tell how they run."""
    rest = readings - made[-1]
    before = _before(rest, first)
    missed, _ = _areas(made[None], first)
    strays = np.mean((rest - before) ** 2) - 2.0 * noise_level(rest) ** 2
    if strays > _FOLLOWS**2 * np.mean(missed**2):
        return None
    found: Array = made + before + PLACES[:, None] * (rest - before)
    return found


def course_within(values: Array) -> Course:
    """The course of inputs (powers, 7, n) that are known within each sample, 0 before the first: with the
    same area, and the same moment about the middle, in each."""
    at = values[:, -1]
    jumps, straight = np.zeros_like(at), np.diff(at, axis=1, prepend=at[:, :1])
    jumps[:, 0] = at[:, 0]
    area, moment = _areas(values, np.arange(at.shape[1]) == 0)
    return Course(at, jumps, straight, -6.0 * area, -30.0 * moment)


def laid_on_samples(values: Array, first: Array) -> Array:
    """By how much a signal (n,) known within its samples (7, n) is to be more at each of them, for what takes
    it to be straight between: both ends of a sample get what lines miss of it, with its moment."""
    (area,), (moment,) = _areas(values[None], first)
    begin, end = 0.5 * (area - moment), 0.5 * (area + moment)
    made: Array = end + np.r_[begin[1:], 0.0]
    return made


def _before(x: Array, first: Array) -> Array:
    """The sample before each one of a signal (…, n), the first of an experiment itself."""
    made: Array = np.where(first, x, np.roll(x, 1, axis=-1))
    return made


def _areas(values: Array, first: Array) -> tuple[Array, Array]:
    """The area (powers, n) of what lines miss of inputs (powers, 7, n) in each sample, none in those at which
    an experiment begins, and its moment about the middle, in half samples."""
    at, within = values[:, -1], values[:, :-1]
    before = _before(at, first)
    off = within - before[:, None] - PLACES[:-1, None] * (at - before)[:, None]
    off = np.where(first, 0.0, off)
    weights = np.stack([_SHARES, _SHARES * _GAUSS])
    area, moment = np.einsum("wp,mpn->wmn", weights, off)
    return area, moment
