"""Two curves of one segment that cancel at rest: neither need be there.

A rig whose speed depends on its level is, by a change of variable, one of even speed between a bent way in
and the opposite bend on the way out. Where what both make of a level at rest is straight, the levels say
nothing of either: what the logs show is a speed, and no form of the library has that.
"""

from __future__ import annotations

import numpy as np

from focgen.diagnosis.fitting.fit import Fit
from focgen.diagnosis.numbers import NUMBERS
from focgen.logs.begin import Begin
from focgen.rig.effects import Run, library
from focgen.rig.engine import Chain, Placed

_LEVELS = 21  # over the range of the input
_HELD = 3  # samples of each


def cancelling(of: Fit) -> bool:
    """Whether the curves of two families in a fit together bend what a rest shows by no more than is a little
    wrong, of what each bends it by alone."""
    placed = of.problem.placed(of.vector)
    curves = [p for p in placed if library()[p.effect].bends]
    families = sorted({p.effect for p in curves})
    if len(families) < 2 or of.problem.segment.pace:
        return False
    alone = [_bend(of, [p for p in curves if p.effect == name]) for name in families]
    return _bend(of, curves) < NUMBERS.left * min(alone)


def _bend(of: Fit, placed: list[Placed]) -> float:
    """By how much (mean square, over the levels of the input) effects bend what the rig shows at rest,
    beyond a gain."""
    straight, bent = (_at_rest(of, effects) for effects in ([], placed))
    size = float(straight @ straight)
    left = bent - straight * (float(bent @ straight) / size if size else 0.0)
    return float(np.mean(left**2))


def _at_rest(of: Fit, placed: list[Placed]) -> np.ndarray:
    """What the rig shows (levels,) under levels that were held for ever."""
    segment = of.problem.segment
    levels = np.linspace(float(np.min(segment.x)), float(np.max(segment.x)), _LEVELS)
    begins = [Begin((float(level),)) for level in levels]
    run = Run.of([_HELD] * _LEVELS, [0.0] * _LEVELS, segment.run.h, begins)
    chain = Chain(of.problem.rig(of.vector), tuple(placed))
    first, last = segment.stages[0], segment.stages[-1]
    made: np.ndarray = chain.run(np.repeat(levels, _HELD), first, last, run, segment.between)
    return made[_HELD - 1 :: _HELD]
