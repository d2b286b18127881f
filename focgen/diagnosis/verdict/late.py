"""Whether the command was logged late, instead of what was found.

No rig answers ahead of its command, so nothing in the library does. A resonance, a mode or an actuator of
another order follows an answer that comes early, and then stands for a column out of step. So what was found
is held against the same rig with the command some samples earlier, and without one of the effects.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from focgen.diagnosis.belief.standing import sureness
from focgen.diagnosis.fitting.fit import Fit, Weighing, fit, square_by
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.problem.segments import Segment
from focgen.diagnosis.verdict.moments import bases, log_odds
from focgen.rig.effects import library

_LATEST = 16  # samples
_ITERATIONS = 6


@dataclass(frozen=True, eq=False)
class Late:
    """A command that came ``samples`` (``seconds``) before its log says, ``instead`` of these families, and
    the log ``odds`` of that over what was found."""

    samples: int
    seconds: float
    instead: frozenset[str]
    odds: float

    @property
    def sure(self) -> float:
        """How likely it is, if it is that or what was found."""
        return sureness(self.odds)


@lru_cache(maxsize=16)
def logged_late(e: Explanation) -> Late | None:
    """How likely the command was logged late, instead of an effect found where it enters; None where nothing
    was found there, or a rounding, whose steps are no noise."""
    families = e.best.problem.families
    if e.segment.entry != "command" or not families or any(library()[f].rounds for f in families):
        return None
    weighing = Weighing(e.ar)
    found = [_judged(e, base, weighing) for base in bases(e)]
    return max((late for late in found if late is not None), key=lambda late: late.odds, default=None)


def is_late(e: Explanation) -> bool:
    """Whether that is likelier than what was found."""
    late = logged_late(e)
    return late is not None and late.odds > 0.0


def _judged(e: Explanation, base: Fit, weighing: Weighing) -> Late | None:
    """The likeliest lateness beside what ``base`` has, None where an earlier command helps it nothing."""
    samples, best = 0, base
    for n, tried in _earlier(base, weighing):
        if tried.sse >= best.sse:
            break
        samples, best = n, tried
    if not samples:
        return None
    before, after = (square_by(f, weighing) for f in (e.nominal, e.best))
    floor = max(min(after * (1.0 - e.predictability.share), best.sse), 1e-300)
    count, had = len(e.segment.y), e.best.problem.families
    found = log_odds(before, after, floor, count, e.best.size, len(had))
    things = len(base.problem.families) + 1
    odds = log_odds(before, best.sse, floor, count, best.size + 1, things) - found
    instead = frozenset(had) - frozenset(base.problem.families)
    return Late(samples, samples * e.segment.run.h, instead, odds)


def _earlier(base: Fit, weighing: Weighing) -> Iterator[tuple[int, Fit]]:
    """``base`` fitted again with the command ever more samples earlier."""
    start = base.vector.copy()
    start[len(base.problem.nominal_start)] = 0.0  # an alignment that made up for a part of it
    for n in range(1, _LATEST + 1):
        segment = replace(base.problem.segment, x=_sooner(base.problem.segment, n))
        tried = fit(replace(base.problem, segment=segment, memory={}), start, weighing, _ITERATIONS)
        yield n, tried
        start = tried.vector


def _sooner(segment: Segment, samples: int) -> np.ndarray:
    """The input (n,) by so many samples sooner, each experiment held at its end."""
    parts = segment.parts(segment.x)
    return np.concatenate([np.r_[x[samples:], np.repeat(x[-1:], samples)][-len(x) :] for x in parts])
