"""A chain that is run at more samples than a log has.

What a stage makes of a jump is no straight line to the next sample. Where the samples are far apart beside
two stages one after the other, the second would be driven by another area than the first one's, by h²/(12 T)
of each jump. So such a chain is run at parts of a sample, and read at the log's.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from weakref import WeakKeyDictionary

import numpy as np

from focgen.arrays import Array
from focgen.fractional.transfer import TransferFunction
from focgen.rig.corners import transfer_of
from focgen.rig.effects import Run
from focgen.rig.linear import single_lag
from focgen.rig.rig import UNITY, Rig
from focgen.rig.stages import STAGES

_WRONG = 1e-3  # of a jump: what the area of straight lines may make of it
_LEFT = 5e-4  # of a jump: what it is to make of it in parts of samples
_MOST = 8  # parts of a sample


def parts_of(rig: Rig, first: str, last: str, h: float) -> int:
    """Into how many parts a sample of ``h`` s is to go from stage ``first`` to ``last``."""
    stages = STAGES[STAGES.index(first) : STAGES.index(last) + 1]
    rates = [rate for stage in stages if (rate := _rate(transfer_of(rig, stage))) is not None]
    wrong = max((h * a * h * b / 12.0 for a, b in pairwise(rates)), default=0.0)
    if wrong < _WRONG:
        return 1
    doubled = math.ceil(0.5 * math.log2(wrong / _LEFT))  # so that a fit seldom meets another count
    return int(min(2**doubled, _MOST))


@lru_cache(maxsize=64)
def _rate(transfer: TransferFunction | None) -> float | None:
    """The part of a step, 1/s, by which its response begins to rise, 0 where it begins flat, as of two lags;
    None where it answers at once."""
    if transfer is None or transfer == UNITY:
        return None
    if lag := single_lag(transfer):
        _, T, alpha = lag
        return float(T ** (-1.0 / alpha)) if alpha <= 1.0 else 0.0
    num, den = transfer.num[0], transfer.den[0]
    if den.order - num.order > 1.0 or not np.isfinite(transfer.dc_gain) or not transfer.dc_gain:
        return 0.0
    return abs(num.coefficient / den.coefficient / transfer.dc_gain) if den.order > num.order else None


_FINER: WeakKeyDictionary[Run, dict[int, Run]] = WeakKeyDictionary()


def finer(run: Run, parts: int) -> Run:
    """The run at so many ``parts`` of each sample; made once, for fits simulate it again and again."""
    made = _FINER.setdefault(run, {})
    if parts not in made:
        made[parts] = _made_finer(run, parts)
    return made[parts]


def _made_finer(run: Run, parts: int) -> Run:
    rest = np.zeros(len(run.rest) * parts, np.uint8)
    rest[::parts] = run.rest
    clock = (run.clock[:, None] + run.h / parts * np.arange(parts)).ravel()
    guessed = tuple((first * parts, last * parts) for first, last in run.guessed)
    return replace(run, h=run.h / parts, rest=rest, clock=clock, guessed=guessed)


def at_samples(y: Array, tap: dict[str, Array] | None, parts: int) -> Array:
    """A signal (m,) at the samples alone, each of so many ``parts``, and what was tapped likewise."""
    if tap is not None:
        tap.update({stage: made[::parts] for stage, made in tap.items()})
    found: Array = y[::parts]
    return found
