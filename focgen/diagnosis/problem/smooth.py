"""A measured signal freed of its noise, to be the next stage's input.

Noise in an input looks like a lag of the stage behind it. What the stage before is simulated to give is free
of noise; what it lacks is added back: what inputs foretell of that, or where they foretell much the whole,
smoothed a little. How much noise stays is known as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import savgol_filter

from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.segments import Segment

_SLOW = (0.15, 0.5, 1.5)  # of a response time: what is slower than that


def is_explained(left: float, noise: bool) -> bool:
    """Whether a signal is taken as simulated: inputs predict little of the residual, the share ``left``, and
    it is nothing but ``noise``."""
    return noise and left <= NUMBERS.much


def freed(
    segment: Segment, simulated: np.ndarray, foretold: np.ndarray, left: float, noise: bool
) -> np.ndarray:
    """The segment's output: as simulated, plus the residual less its quickest noise.

    ``left``: the share of the residual that inputs predict. Where it is small, and the residual is nothing
    but ``noise`` (no hum, no bursts), the simulation and what is ``foretold`` (n,) of the residual.
    """
    added = foretold if is_explained(left, noise) else _smoothed(segment.parts(segment.y - simulated))
    made: np.ndarray = simulated + added
    return made


@dataclass(frozen=True, eq=False)
class Strays:
    """What an input that was freed of its noise may be off by (n,), in its unit, a draw of each kind: the
    ``noise`` that stays in it, and what was ``lost`` of it, though inputs foretell that."""

    noise: np.ndarray
    lost: np.ndarray


def strays(segment: Segment, simulated: np.ndarray, response: float, left: float, noise: bool) -> Strays:
    """What :func:`freed` may be off by; ``response`` in s.

    The residual backwards in time has the size and the colour of the noise, and nothing to do with the input.
    Smoothed, it is what stays. Where the simulation alone is taken nothing stays; its slow part, as large as
    what inputs predict, is what may be lost.
    """
    backwards = [part[::-1] for part in segment.parts(segment.y - simulated)]
    none = np.zeros(len(segment.y))
    if not is_explained(left, noise):
        return Strays(np.sqrt(max(1.0 - left, 0.0)) * _smoothed(backwards), none)
    return Strays(none, _slow(segment, backwards, response, left))


def slow_rest(segment: Segment, taken: np.ndarray, response: float) -> np.ndarray:
    """The slow parts (n, k), ever slower, of what the output has beyond what is ``taken`` for it (n,).

    What a form lacks of the rig is in them, and the next stage's output has that, too. :func:`strays` allows
    for what is quicker, and for what no part of these shows.
    """
    rest = segment.parts(segment.y - taken)
    return np.column_stack([_slowed(segment, rest, response, part) for part in _SLOW])


def _slowed(segment: Segment, parts: Sequence[np.ndarray], response: float, part: float) -> np.ndarray:
    """What is slower than a ``part`` of the response time, and than four samples."""
    width = max(4.0, part * response / segment.run.h)
    return np.concatenate([gaussian_filter1d(p, min(width, len(p) / 6), mode="nearest") for p in parts])


def _slow(segment: Segment, backwards: Sequence[np.ndarray], response: float, left: float) -> np.ndarray:
    slow = _slowed(segment, backwards, response, _SLOW[0])
    most = left * sum(float(part @ part) for part in backwards)
    made: np.ndarray = slow * np.sqrt(max(most, 0.0) / max(float(slow @ slow), 1e-300))
    return made


def _smoothed(parts: Sequence[np.ndarray]) -> np.ndarray:
    return np.concatenate([savgol_filter(p, 7, 3) if len(p) > 7 else p for p in parts])
