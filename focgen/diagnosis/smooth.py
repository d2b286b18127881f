"""A measured signal freed of its noise, to be the next stage's input.

Noise in an input looks like a lag of the stage behind it. What the stage before is simulated to give is free
of noise; what it lacks is added back, smoothed by the colour of the noise.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import savgol_filter

from focgen.diagnosis.segments import Segment

_RIGHT = 0.03  # of the residual foretold by inputs: below it the simulation is the better measurement
WRONG = 0.05  # of the residual foretold by inputs: beyond it the simulation is not to be relied on


def freed(segment: Segment, simulated: np.ndarray, response: float, left: float, noise: bool) -> np.ndarray:
    """The segment's output: as simulated, plus the residual below the pace of the rig; ``response`` in s.

    ``left``: the share of the residual that inputs foretell; where there is one, or the residual is not but
    ``noise`` (it hums, comes in bursts), little is smoothed away; else all that is not foretold.
    """
    if noise and left < _RIGHT:
        return simulated
    residual = segment.parts(segment.y - simulated)
    if left > WRONG or not noise:
        return simulated + np.concatenate([savgol_filter(p, 7, 3) if len(p) > 7 else p for p in residual])
    width = max(4.0, 0.15 * response / segment.run.h)
    slow = [gaussian_filter1d(part, min(width, len(part) / 6), mode="nearest") for part in residual]
    return simulated + np.concatenate(slow)
