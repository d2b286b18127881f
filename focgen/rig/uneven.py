"""A stage whose pace depends on its level, on the session's time or on its speed.

A rubber is damped more where it is stretched, a chamber takes longer where it has grown, oil gets warm. Of a
stage gain/(1 + Q), as T s^α of a lag, Q is then multiplied by a pace that is not even.
"""

from __future__ import annotations

import numpy as np

from focgen.arrays import Array
from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.rig import linear, solved
from focgen.rig.delay import delayed
from focgen.rig.dynamics import Pace
from focgen.rig.effects import Run

_BY = {"time": 0, "level": 1, "speed": 2}  # as pace.c has them


def run(
    transfer: TransferFunction, x: Array, run: Run, pace: Pace, between: Between | bool, delay: float = 0.0
) -> Array:
    """The response (n,) of a stage whose pace is not even.

    With (1 + m Q) y = x, and f the least m of levels above 0, (1 + f Q) y = x f/m + y (1 − f/m): of that y is
    solved for at every sample. The part that x has may jump between samples, that of y runs in lines.
    """
    fastest = pace.fastest()
    scale, share = 1.0, np.empty(0)
    if pace.by == "time":
        share = fastest / pace.slowness(_moment(run))
    else:
        even = linear.run(transfer, x, run.rest, run.h, run.duration, between) / transfer.dc_gain
        scale = float(np.max(np.abs(even if pace.by == "level" else x - even))) or 1.0
    slowness = _BY[pace.by], (transfer.dc_gain, fastest, pace.rate, scale, pace.curve), share
    y = solved.run_paced(_at(transfer, fastest), x, run.rest, run.h, run.duration, between, slowness)
    return delayed(y, run.rest, run.h, delay) if delay else y


def _moment(run: Run) -> Array:
    """Each sample's moment (n,) as a share of the session."""
    began = run.clock - run.clock.min()
    made: Array = began / (float(began.max()) or 1.0)
    return made


def _at(transfer: TransferFunction, factor: float) -> TransferFunction:
    """The stage as many times as slow throughout."""
    slower = [(c * (factor if order else 1.0), order) for c, order in transfer.den]
    return TransferFunction(transfer.num, slower)
