"""What no effect is, held against what was found: as rare as an effect, and instead of one or of all."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from focgen.diagnosis.belief.likelihood import Scale, log_likelihood, paid
from focgen.diagnosis.belief.standing import sureness
from focgen.diagnosis.fitting.fit import Fit, Weighing, square_by
from focgen.diagnosis.hypotheses.converter import is_rounded
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.rivals import left_out, without
from focgen.diagnosis.numbers import NUMBERS


@dataclass(frozen=True, eq=False)
class Instead:
    """What no effect is, ``instead`` of these families, and the log ``odds`` of it over what was found."""

    instead: frozenset[str]
    odds: float

    @property
    def sure(self) -> float:
        """How likely it is, if it is that or what was found."""
        return sureness(self.odds)


def is_likelier(other: Instead | None) -> bool:
    """Whether it is likelier than what was found."""
    return other is not None and other.odds > 0.0


def bases(e: Explanation) -> Iterator[Fit]:
    """The fits that it may stand beside: without any effect, and without each of several. None where a
    rounding was found: its steps are no noise, and what is smaller than they are tells nothing."""
    if is_rounded(e.causes):
        return
    yield e.nominal
    candidates = e.best.problem.candidates
    families = {c.effect for c in candidates}
    for effect in sorted(families) if len(families) > 1 else ():
        yield left_out(e.best, [c for c in candidates if c.effect == effect], Weighing(e.ar))


def gone(e: Explanation, base: Fit) -> frozenset[str]:
    """The families found that are not in ``base``."""
    return frozenset(e.best.problem.families) - frozenset(base.problem.families)


def sound_part(e: Explanation, other: Instead | None) -> Explanation:
    """The explanation without the families instead of which something else is likelier, where others are not
    in question; else as it is. These stay as they were fitted beside them, and so does how much inputs
    predict: a refit would make up for what is there instead."""
    if other is None or not is_likelier(other) or not other.instead < frozenset(e.best.problem.families):
        return e
    kept = tuple(c for c in e.causes if c.rivals[0].effect not in other.instead)
    gone = [c for c in e.best.problem.candidates if c.effect in other.instead]
    return replace(e, best=without(e.best, gone, Weighing(e.ar)), causes=kept) if kept else e


def odds_over(e: Explanation, left: float, free: int, things: int) -> float:
    """The log odds of ``things`` with so many ``free`` values, which leave the sum of squares ``left``, over
    what was found; each is as rare as any."""
    before, after = _squares(e)
    floor = max(min(after * (1.0 - e.predictability.share), left), 1e-300)
    unit = 0.5 * len(e.segment.y) / floor

    def log_odds(left: float, free: int, things: int) -> float:
        misfit, gained = max(left - floor, 0.0) * unit, max(before - left, 0.0) * unit
        scale = Scale(0.5 * len(e.segment.y) * NUMBERS.other).of(gained)
        prior = things * float(np.log(NUMBERS.rare))
        return log_likelihood(misfit, scale) - paid(free, gained, misfit, scale) + prior

    return log_odds(left, free, things) - log_odds(after, e.best.size, len(e.best.problem.families))


@lru_cache(maxsize=16)
def _squares(e: Explanation) -> tuple[float, float]:
    """The sums of squares that are left without any effect, and with what was found."""
    before, after = (square_by(f, Weighing(e.ar)) for f in (e.nominal, e.best))
    return before, after
