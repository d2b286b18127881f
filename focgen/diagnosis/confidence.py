"""From separations to probabilities, by a map fitted on cases whose cause was known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.diagnosis.rivals import Rival

SET_WITHIN = 2.0  # separations below this leave a rival in the set
CLOSE = 0.5  # and it must reach this part of the best one's evidence,
NEAR = 8.0  # or fall short of it by no more than these nats
FIRST, TEMPER = 1.7, 0.15  # weight of another than the best that stays in the set: exp(-FIRST - TEMPER z)
# probability that the cause is none of the set; of a lesser cause, beside a larger one
ELSEWHERE = (0.045, 0.35)
LESSER = 0.3  # of what the segment's causes explain: below it a cause is a lesser one


def tied(rivals: Sequence[Rival]) -> tuple[Rival, ...]:
    """The rivals that the data cannot tell from the best, the best first."""
    best = rivals[0].gain
    return tuple(
        r for r in rivals if r.separation < SET_WITHIN and (r.gain > CLOSE * best or best - r.gain < NEAR)
    )


def confidences(kept: Sequence[Rival], share: float = 1.0) -> np.ndarray:
    """The probability of every rival of the set ``kept``, the best first; they sum to less than 1.
    ``share``: what the cause explains of its segment's gap; 0 where own parameters far from those given do
    as much of it.

    That one is the best, by however little, tells more than by how much, as long as it stays below
    ``SET_WITHIN``.
    """
    z = np.array([max(r.separation, 0.0) for r in kept])
    weight = np.exp(-FIRST * (np.arange(len(z)) > 0) - TEMPER * z)
    return (1.0 - ELSEWHERE[share < LESSER]) * weight / weight.sum()
