"""The input of a segment that quick stages made of a held command: how it runs within the samples."""

from __future__ import annotations

import numpy as np

from focgen.diagnosis.problem.problem import Problem
from focgen.logs.between import Between
from focgen.rig import within


def bent_within(ahead: Problem, vector: np.ndarray, x: np.ndarray) -> np.ndarray:
    """The input ``x`` (n,) of a segment, for what takes it to be straight between samples: with what lines
    miss of what the segment ``ahead`` makes of a held command, as fitted with the ``vector``."""
    segment, first = ahead.segment, ahead.segment.run.rest != 0
    if segment.between != Between.HELD or not within.kinks(ahead.rig(vector), segment.stages, segment.run.h):
        return x
    made = within.made_within(lambda late: ahead.simulate(vector, True, late), segment.run.h)
    values = within.read_within(x, made, first)
    return x if values is None else x + within.laid_on_samples(values, first)
