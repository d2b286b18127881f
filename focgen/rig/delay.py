"""Signals that come later, by whole samples and by parts of one."""

from __future__ import annotations

import numpy as np

from focgen.arrays import Array, Bytes
from focgen.fractional.delay import split_delay
from focgen.rig import kernels


def shifted(x: Array, rest: Bytes, whole: int) -> Array:
    """``x`` (n,) later by ``whole`` samples, anew wherever ``rest`` (n,) is not 0; before it is zero, or
    where ``rest`` is ``BALANCED`` what it is at first."""
    y = np.zeros_like(x)
    firsts = np.flatnonzero(rest).tolist()
    for first, last in zip(firsts, [*firsts[1:], len(x)]):
        if rest[first] == kernels.BALANCED:
            y[first : min(first + whole, last)] = x[first]
        y[first + whole : last] = x[first : max(last - whole, first)]
    return y


def centred(x: Array, rest: Bytes) -> Array:
    """An input (n,) that is held between samples as one in lines, each of its jumps spread over the sample
    before and the one after."""
    made: Array = 0.5 * (x + shifted(x, rest, 1))
    return made


def delayed(x: Array, rest: Bytes, h: float, delay: float) -> Array:
    """``x`` (n,), linear between samples of ``h`` s, later by ``delay`` s, each experiment from zero."""
    whole, part = split_delay(delay, h)
    return (1.0 - part) * shifted(x, rest, whole) + part * shifted(x, rest, whole + 1)
