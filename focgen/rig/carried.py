"""What a signal was before a log begins, told by the signal that it comes from.

A gauge's first samples alone say little of what its input was before them: many pasts suit a reading that is
quick. But the load's past, through the actuator, is what the curvature was. The rig makes its shape; where it
ended is measured.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from focgen.arrays import Array
from focgen.logs.begin import Begin
from focgen.logs.experiment import Experiment
from focgen.rig.effects import Run
from focgen.rig.engine import Chain, between_of
from focgen.rig.stages import ENTERS, LEAVES

FIRST = 5  # samples that tell what an input was last, and where what it drives began
_WIDTH = 0.1  # of how long ago it is: a window, for what is left of it changes no faster


def carried(chain: Chain, log: Experiment, entry: str, begin: Begin, last: str) -> Begin:
    """What the signal that leaves stage ``last`` was, where ``entry`` was what its ``begin`` says.

    ``log`` has both signals. What was longer ago is given by means over longer windows.
    """
    past = begin.samples(log.sample_time)
    ahead = replace(begin, levels=begin.levels[:1], ago=())
    run = Run.of([len(past) + FIRST], [log.start], log.sample_time, [ahead])
    if begin.guessed:
        run = replace(run, guessed=((0, len(past)),))
    x = np.concatenate([past, np.asarray(log[entry], float)[:FIRST]])
    made = chain.run(x, ENTERS[entry], last, run, between_of(chain.rig, entry))
    off = float(np.mean(np.asarray(log[LEAVES[last]], float)[:FIRST] - made[-FIRST:]))
    means, ago = _in_windows(made[: len(past)] + off, log.sample_time)
    return Begin((float(made[0]), *means), ago)


def stretched(begin: Begin, times: float) -> Begin:
    """The begin with every level so many ``times`` as far from the last."""
    last = begin.levels[-1]
    return replace(begin, levels=tuple(last + times * (level - last) for level in begin.levels))


def raised(begin: Begin, by: float, early: float, late: float) -> Begin:
    """The begin with its signal higher ``by`` so much from ``early`` to ``late`` s before the log."""
    ends = sorted({*begin.ago, early, late} - {0.0, np.inf}, reverse=True)
    levels = []
    for upper, lower in zip([np.inf, *ends], [*ends, 0.0]):
        level = begin.levels[sum(t >= upper for t in begin.ago)]
        levels.append(level + by if late <= lower and upper <= early else level)
    return replace(begin, levels=tuple(levels), ago=tuple(ends))


def _in_windows(past: Array, h: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """A past (n,), a sample every ``h`` s up to one ahead of the log: its means over windows, the latest
    last, and how long ago, s, each began."""
    starts = [0]
    while (ahead := starts[-1] + max(1, int(_WIDTH * starts[-1]))) < len(past):
        starts.append(ahead)
    means = np.add.reduceat(past[::-1], starts) / np.diff([*starts, len(past)])
    ago = (np.array([*starts[1:], len(past)]) + 0.5) * h
    return tuple(map(float, means[::-1])), tuple(map(float, ago[::-1]))
