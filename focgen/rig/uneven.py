"""A stage whose pace depends on its level, on the session's time or on its speed.

A rubber is damped more where it is stretched, a chamber takes longer where it has grown, oil gets warm. Of a
stage gain/(1 + Q), as T s^α of a lag, Q is then multiplied by a pace that is not even.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from focgen.arrays import Array
from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.rig import linear
from focgen.rig.delay import delayed
from focgen.rig.dynamics import Pace
from focgen.rig.effects import Run

_CLOSE = 1e-5  # of the largest input: two rounds that differ by less
_ROUNDS = 40


def run(
    transfer: TransferFunction, x: Array, run: Run, pace: Pace, between: Between | bool, delay: float = 0.0
) -> Array:
    """The response (n,) of a stage whose pace is not even.

    With (1 + m Q) y = x and m no less than f, (1 + f Q) y = x f/m + y (1 − f/m): of that y is found anew
    until it changes no more. The part that x has may jump between samples, that of y runs in lines.
    """
    fastest = float(np.exp(min(pace.rate, 0.0)))
    fast = _at(transfer, fastest)

    def passed(v: Array, way: Between | bool) -> Array:
        return linear.run(fast, v, run.rest, run.h, run.duration, way)

    gain = transfer.dc_gain
    y = linear.run(transfer, x, run.rest, run.h, run.duration, between)
    slowness = _slowness(pace, x, y / gain, run)
    largest = float(np.max(np.abs(x))) or 1.0
    for _ in range(_ROUNDS):
        share = fastest / slowness(y / gain)
        then = passed(x * share, between) + passed(y / gain * (1.0 - share), Between.STRAIGHT)
        close = np.max(np.abs(then - y)) < _CLOSE * largest * abs(gain)
        y = then
        if close:
            break
    return delayed(y, run.rest, run.h, delay) if delay else y


def _at(transfer: TransferFunction, factor: float) -> TransferFunction:
    """The stage as many times as slow throughout."""
    slower = [(c * (factor if order else 1.0), order) for c, order in transfer.den]
    return TransferFunction(transfer.num, slower)


def _slowness(pace: Pace, x: Array, y: Array, run: Run) -> Callable[[Array], Array]:
    """How many times as slow a stage is, as a function of its response over its gain, (n,), whose levels and
    speeds are about those of ``y``."""
    if pace.by == "time":
        began = run.clock - run.clock.min()
        made = np.exp(pace.rate * began / (float(began.max()) or 1.0))
        return lambda now: made
    if pace.by == "speed":
        fastest = float(np.max(np.abs(x - y))) or 1.0
        return lambda now: np.exp(pace.rate * np.minimum(np.abs(x - now) / fastest, 1.0))
    highest = float(np.max(np.abs(y))) or 1.0
    return lambda now: np.exp(pace.rate * np.clip(now / highest, -1.0, 1.0))
