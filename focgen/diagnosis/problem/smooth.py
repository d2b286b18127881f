"""A measured signal freed of its noise, to be the next stage's input.

Noise in an input looks like a lag of the stage behind it. What the stage before is simulated to give is free
of noise; what it lacks is added back, smoothed by the colour of the noise.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import savgol_filter

from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.segments import Segment


def freed(segment: Segment, simulated: np.ndarray, response: float, left: float, noise: bool) -> np.ndarray:
    """The segment's output: as simulated, plus the residual below the pace of the rig; ``response`` in s.

    ``left``: the share of the residual that inputs predict; where there is one, or the residual is not but
    ``noise`` (it hums, comes in bursts), little is smoothed away; else all that is not predicted.
    """
    if noise and left < NUMBERS.left:
        return simulated
    residual = segment.parts(segment.y - simulated)
    if left > NUMBERS.left or not noise:
        slow = [savgol_filter(p, 7, 3) if len(p) > 7 else p for p in residual]
    else:
        width = max(4.0, 0.15 * response / segment.run.h)
        slow = [gaussian_filter1d(part, min(width, len(part) / 6), mode="nearest") for part in residual]
    made: np.ndarray = simulated + np.concatenate(slow)
    return made
