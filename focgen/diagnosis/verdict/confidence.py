"""The families that may be one cause, and how sure each is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.diagnosis.belief.standing import least_set, probabilities, sureness
from focgen.diagnosis.hypotheses.rivals import Rival


def tied(rivals: Sequence[Rival]) -> tuple[tuple[Rival, ...], np.ndarray]:
    """The least set of rivals that holds the cause, the likeliest first, and their probabilities."""
    sure = probabilities([r.odds for r in rivals], [r.off for r in rivals])
    places = least_set(sure)
    return tuple(rivals[i] for i in places), sure[places]


def nominal_instead(rival: Rival) -> float:
    """How likely the nominal chain is off by itself, and there is no such effect as ``rival``."""
    return sureness(rival.off)
