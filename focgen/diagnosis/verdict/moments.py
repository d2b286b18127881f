"""Whether the rig became another at one moment, instead of what was found.

Nothing in the library changes at once. A path through the session's time follows a load that is hung on, a
zero that jumps or a mass that is added, and so does a trend, if badly; what either foretells is wrong. With
few runs, a curve or a softening of many values follows a gain that was switched between two of them. So
whatever was found is held against the same rig with nominal parameters of their own ahead of a moment and
behind it. They are free in every piece, so that a jump of any of them is seen, and need not be named. Or one
of them alone becomes another, or the gain as a whole, which takes fewer numbers.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from focgen.diagnosis.belief.likelihood import Scale, log_likelihood, paid
from focgen.diagnosis.belief.standing import sureness
from focgen.diagnosis.fitting.fit import Fit, Weighing, square_by
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.rivals import left_out, without
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.segments import Segment
from focgen.diagnosis.verdict.pieces import Pieces, pieces
from focgen.rig.effects import library


@dataclass(frozen=True)
class Moment:
    """``at``: s on the session's clock; ``within``: s since its ``experiment`` began. What leaves the segment
    is another from there on, until the next moment: by ``mean``, and root mean square ``rms``, in its
    unit."""

    at: float
    experiment: str
    within: float
    mean: float
    rms: float


@dataclass(frozen=True, eq=False)
class Changed:
    """How a segment became another, ``cut`` into pieces, ``instead`` of these families, and the log ``odds``
    of that over what was found."""

    cut: Pieces
    instead: frozenset[str]
    odds: float

    @cached_property
    def moments(self) -> tuple[Moment, ...]:
        """What becomes another at each of the cuts."""
        segment = self.cut.of_fit.problem.segment
        changes = self.cut.changes()
        return tuple(_moment(segment, sample, segment.level_out * by) for sample, by in changes)

    @property
    def sure(self) -> float:
        """How likely it is, if it is that or what was found."""
        return sureness(self.odds)


@lru_cache(maxsize=16)
def changed_at_once(e: Explanation) -> Changed | None:
    """How likely the rig became another at up to three moments instead of what was found, or of one part of
    it. None where its session is too short for that, or where a rounding was found: its steps are no noise,
    and what is smaller than they are tells nothing."""
    if any(library()[family].rounds for family in e.best.problem.families):
        return None
    weighing = Weighing(e.ar)
    before, after = (square_by(f, weighing) for f in (e.nominal, e.best))
    found = [_judged(e, before, after, cut) for fit in bases(e) for cut in pieces(fit, weighing)]
    odds, best = max(found, key=lambda f: f[0], default=(0.0, None))
    if best is None:
        return None
    instead = frozenset(e.best.problem.families) - frozenset(best.of_fit.problem.families)
    return Changed(best, instead, odds)


def bases(e: Explanation) -> Iterator[Fit]:
    """The fits that may become others: without any effect, and without each of several."""
    yield e.nominal
    candidates = e.best.problem.candidates
    families = {c.effect for c in candidates}
    for effect in sorted(families) if len(families) > 1 else ():
        yield left_out(e.best, [c for c in candidates if c.effect == effect], Weighing(e.ar))


def another(e: Explanation) -> Changed | None:
    """What changed at once, where that is likelier than what was found."""
    changed = changed_at_once(e)
    return changed if changed is not None and changed.odds > 0.0 else None


def lasting_part(e: Explanation) -> Explanation:
    """The explanation without the families instead of which it became another at once, where others are not
    in question; else as it is. These stay as they were fitted beside them, and so does how much inputs
    predict: a refit would make up for the change."""
    changed = another(e)
    if changed is None or not changed.instead < frozenset(e.best.problem.families):
        return e
    kept = tuple(c for c in e.causes if c.rivals[0].effect not in changed.instead)
    gone = [c for c in e.best.problem.candidates if c.effect in changed.instead]
    return replace(e, best=without(e.best, gone, Weighing(e.ar)), causes=kept) if kept else e


def _judged(e: Explanation, before: float, after: float, cut: Pieces) -> tuple[float, Pieces]:
    """The log odds of what is cut so over what was found, which leaves the sum of squares ``after`` of
    ``before``."""
    square = cut.square
    floor = max(min(after * (1.0 - e.predictability.share), square), 1e-300)
    count = len(e.segment.y)
    families = len(e.best.problem.families)
    others = len(cut.of_fit.problem.families) + cut.things
    found = log_odds(before, after, floor, count, e.best.size, families)
    at_once = log_odds(before, square, floor, count, cut.of_fit.size + cut.free, others)
    return at_once - found, cut


def log_odds(before: float, left: float, floor: float, count: int, free: int, things: int) -> float:
    """Of ``things`` found, each as rare as any, that leave the sum of squares ``left`` of ``before``."""
    unit = 0.5 * count / floor
    misfit, gained = max(left - floor, 0.0) * unit, max(before - left, 0.0) * unit
    scale = Scale(0.5 * count * NUMBERS.other).of(gained)
    prior = things * float(np.log(NUMBERS.rare))
    return log_likelihood(misfit, scale) - paid(free, gained, misfit, scale) + prior


def _moment(segment: Segment, sample: int, by: np.ndarray) -> Moment:
    """The moment of a sample from which on the output differs ``by`` so much."""
    number, (first, _) = next((i, s) for i, s in enumerate(segment.run.spans) if sample < s[1])
    within = (sample - first) * segment.run.h
    rms = float(np.sqrt(np.mean(by**2)))
    return Moment(float(segment.run.clock[sample]), segment.names[number], within, float(np.mean(by)), rms)
