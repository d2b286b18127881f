"""What a session's input does between its samples, as the stages see it."""

from __future__ import annotations

from weakref import ref

import numpy as np

from focgen.arrays import Array, Bytes
from focgen.logs.between import Between, smooth_bends
from focgen.rig.kernels import BALANCED

_KEPT = 6
Course = tuple[Array, Array, Array]

# the last inputs by (input, rest, way), and their courses: reading one takes as long as a stage takes to run
_known: list[tuple[ref[Array], ref[Bytes], Between | bool, Course]] = []


def course(x: Array, rest: Bytes, between: Between | bool) -> Course:
    """How the input ``x`` (n,) moves within the sample that ends at each (n,): by how much in a line, and its
    bend and twist as in :class:`~focgen.logs.between.Course`; what is missing, it jumps. Experiments apart;
    a smooth one jumps at the first sample.
    """
    for old, old_rest, way, found in _known:
        if old() is x and old_rest() is rest and way == between:
            return found
    found = _smooth(x, rest) if between == Between.SMOOTH else _plain(x, rest, between)
    _known.insert(0, (ref(x), ref(rest), between, found))
    del _known[_KEPT:]
    return found


def sharpened(x: Array, rest: Bytes) -> Array:
    """The input (n,) with the area of its bends laid on the samples at both ends, for what takes it to be
    straight between them."""
    _, bend, _ = course(x, rest, Between.SMOOTH)
    ahead = np.where(np.r_[rest[1:], 1], 0.0, np.roll(bend, -1))
    return x - (bend + ahead) / 12.0


def _plain(x: Array, rest: Bytes, between: Between | bool) -> Course:
    line = np.zeros_like(x) if between == Between.HELD else np.diff(x, prepend=0.0)
    line = np.where(rest == BALANCED, 0.0, np.where(rest, x * (between != Between.HELD), line))
    return line, np.zeros_like(x), np.zeros_like(x)


def _smooth(x: Array, rest: Bytes) -> Course:
    bend, twist = np.zeros_like(x), np.zeros_like(x)
    firsts = np.flatnonzero(rest).tolist()
    for first, last in zip(firsts, [*firsts[1:], len(x)]):
        bend[first:last], twist[first:last] = smooth_bends(x[first:last])
    return np.where(rest, 0.0, np.diff(x, prepend=0.0)), bend, twist
