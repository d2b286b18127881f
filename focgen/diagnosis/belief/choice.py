"""Which effect, if any, a residual asks for next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.diagnosis.belief.further import Ground
from focgen.diagnosis.fitting.fit import Fit
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.problem import CandidateEffect


def prior(effect: str, base: Fit) -> float:
    """Log odds, before the data, that ``base`` lacks ``effect``; of another form of a family that it has."""
    if effect in base.problem.families:
        return float(np.log(NUMBERS.again))
    return float(np.log(NUMBERS.rare))


def place(candidates: Sequence[CandidateEffect]) -> float:
    """Log odds, before the data, that effects act where they do."""
    return sum(c.form.rarer for c in candidates) * float(np.log(NUMBERS.behind))


def likeliest(ground: Ground, tried: Sequence[Fit]) -> tuple[Fit, float]:
    """Of candidates the one of the highest posterior odds over nothing more, and those, in nats, by what it
    explains: nominal parameters that come closer to those given choose among effects, and ask for none."""
    last = [f.problem.candidates[-1] for f in tried]
    odds = [ground.odds(f) + prior(c.effect, ground.base) + place([c]) for f, c in zip(tried, last)]
    best = int(np.argmax(odds))
    return tried[best], odds[best] - ground.closer(tried[best])
