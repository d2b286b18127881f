"""Whether the effect that helps a residual most is there, or only mends what noise, a coarse converter or the
form of an effect found already leave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from focgen.diagnosis.belief.choice import likeliest
from focgen.diagnosis.belief.further import Ground, Surroundings
from focgen.diagnosis.fitting.fit import Fit, Weighing
from focgen.diagnosis.fitting.integrating import counted
from focgen.diagnosis.hypotheses.converter import Converter
from focgen.diagnosis.hypotheses.disturbance import disturbance
from focgen.diagnosis.hypotheses.search import Ranking, evidence, family
from focgen.diagnosis.problem.smooth import Strays
from focgen.rig.effects import library


@dataclass(frozen=True)
class AcceptanceCriteria:
    """What an effect has to show to be one. ``threshold``: nats of evidence that noise alone does not reach;
    ``unsure``: what the input may have lost, and what stays in it of its noise; ``converter``: that hides
    small ones, and so does what a logger has ``withheld``, root mean square, as a share of the output's
    level. ``granted``: it is there, and only its strength is asked."""

    threshold: float
    unsure: Strays | None
    converter: Converter | None
    withheld: float = 0.0
    granted: bool = False

    @property
    def surroundings(self) -> Surroundings:
        """What makes a misfit beside the forms."""
        hidden = self.converter.uneven if self.converter else self.withheld
        if self.unsure is None:
            return Surroundings(hidden**2)
        return Surroundings(hidden**2, _if_any(self.unsure.lost), _if_any(self.unsure.noise))


def _if_any(draw: np.ndarray) -> np.ndarray | None:
    return draw if np.any(draw) else None


def select(rankings: Sequence[Ranking], criteria: AcceptanceCriteria) -> Fit | None:
    """The likeliest next effect, or further form of one found already, where it is beyond chance and likelier
    than none."""
    ranking = rankings[-1]
    if ranking.winner is None or ranking.gain[ranking.winner] < criteria.threshold:
        return None
    if criteria.granted and (missing := _missing(ranking)) is not None:
        return missing
    tried = [f for f in ranking.on_all if evidence(f, ranking.base) > criteria.threshold]
    tried = [
        f for f in tried if counted(f, ranking.base) > criteria.threshold and not _goes_round(ranking.base, f)
    ]
    if not tried:
        return None
    weighing = Weighing(ranking.ar)
    ground = Ground.of(rankings[0].base, ranking.base, tried, weighing, criteria.surroundings)
    best, odds = likeliest(ground, tried)
    return best if odds > 0.0 else None


def _missing(ranking: Ranking) -> Fit | None:
    """The likeliest of the families not found yet that finds anything to mend."""
    found = ranking.base.problem.families
    return next((f for n, f in ranking.best.items() if n not in found and ranking.gain[n] > 0), None)


def _goes_round(base: Fit, winner: Fit) -> bool:
    """Whether a tone is to be explained by one in a closed loop: whatever hums there is in the input, too."""
    segment, response = base.problem.segment, base.problem.references.clocks["response"]
    if not segment.led or not library()[family(winner)].tonal:
        return False
    return disturbance(base.residual(), segment.run.h, response).tonal
