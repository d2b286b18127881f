"""What speaks for one more effect: the odds of each candidate over what was found without it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from focgen.diagnosis.belief.likelihood import Scale, log_likelihood, paid
from focgen.diagnosis.fitting.fit import Fit, Weighing, innovations
from focgen.diagnosis.numbers import NUMBERS


@dataclass(frozen=True)
class Surroundings:
    """What makes a misfit beside the forms. ``hidden``: the mean square that a coarse converter may make, as
    a share of the level's; ``trusted``: whether the input is free of noise."""

    hidden: float = 0.0
    trusted: bool = True

    def nats(self, count: int, noise: float) -> float:
        """Of ``count`` samples whose noise has the mean square ``noise``, a share of the level's."""
        share = NUMBERS.other + NUMBERS.carried * (not self.trusted) + self.hidden / max(noise, 1e-300)
        return 0.5 * count * share


@dataclass(frozen=True, eq=False)
class Ground:
    """What candidates for one more effect are weighed against.

    ``base``: the fit without it; ``floor``: a sum of squares that only noise leaves; ``changed``: what the
    effects of ``base`` change, nats; ``scale``: of the misfit that is no wonder.
    """

    base: Fit
    floor: float
    changed: float
    scale: Scale

    @classmethod
    def of(
        cls,
        first: Fit,
        base: Fit,
        tried: Sequence[Fit],
        weighing: Weighing,
        surroundings: Surroundings,
    ) -> Ground:
        """``first``: the fit without any effect, ``tried``: with one more than ``base``."""
        best = min([base, *tried], key=lambda f: f.sse)
        told = _told(best)
        count = len(base.innovations)
        noise = float(np.mean(best.weighed**2)) * (1.0 - told)
        floor = best.sse * (1.0 - told)
        before = _square(first, weighing) if base.problem.candidates else base.sse
        scale = Scale(surroundings.nats(count, noise))
        return cls(base, floor, _nats(before - base.sse, floor, count), scale)

    def misfit(self, of: Fit) -> float:
        """Nats by which a fit leaves more than noise."""
        return max(_nats(of.sse - self.floor, self.floor, len(of.innovations)), 0.0)

    def odds(self, of: Fit, most: int | None = None) -> float:
        """Log odds, before any prior, of a fit with one more effect over ``base``; at most ``most`` of its
        free values are counted. Own parameters closer to those given speak for it."""
        left, better = self.misfit(self.base), self.misfit(of)
        gained = max(left - better, 0.0)
        scale = self.scale.of(self.changed + gained)
        found = log_likelihood(better, scale) - log_likelihood(left, self.scale.of(self.changed))
        free = of.size - self.base.size
        found -= paid(free if most is None else min(free, most), gained, better, scale)
        return found + self.base.prior_penalty - of.prior_penalty


def _told(best: Fit) -> float:
    """The share of what a fit leaves that is more than noise, for inputs predict it."""
    return min(max(best.predictable_share - NUMBERS.chance, 0.0), 1.0 - 1e-9)


def _square(of: Fit, weighing: Weighing) -> float:
    """The sum of squares of a fit made to another colour of the noise, in this one."""
    found = innovations(of.problem, of.vector, weighing)
    return float(found @ found)


def _nats(square: float, floor: float, count: int) -> float:
    """A sum of squares in nats of the noise."""
    return 0.5 * count * square / max(floor, 1e-300)
