"""Whether a stage has a pace that depends on its level, on time or on its speed, instead of what was found.

Nothing in the library does. A loop of hysteresis, a bent gain or one that drifts follows a time constant that
is another at another level or moment, if badly. So what was found is held against the same rig with one stage
of an uneven pace, and without one of the effects.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from focgen.diagnosis.fitting.fit import Fit, Weighing, fit, square_by
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.search import likeliest_on_all
from focgen.diagnosis.hypotheses.uneven_pace import uneven_paces
from focgen.diagnosis.verdict.instead import Instead, gone, is_likelier, likeliest, odds_over
from focgen.rig.dynamics import Pace

_ITERATIONS = 12
_AT = {
    "level": "at its highest level as at 0",
    "time": "at the session's end as at its begin",
    "speed": "at its greatest speed as near rest",
}

_ON_THE_WAY = {
    "level": "at {:.0%} of its highest level as at 0",
    "time": "after {:.0%} of the session as at its begin",
    "speed": "at {:.0%} of its greatest speed as near rest",
}


@dataclass(frozen=True, eq=False)
class Uneven(Instead):
    """A ``stage`` that is ``slowness`` times as slow at its highest level, at the session's end or at its
    greatest speed, ``by`` any of these, as at none; or at so much of the way there (``at``), where it is
    that most."""

    stage: str
    by: str
    slowness: float
    at: float = 1.0

    @property
    def may_be(self) -> str:
        """As of :class:`Instead`."""
        slower = self.slowness >= 1.0
        times = self.slowness if slower else 1.0 / self.slowness
        return (
            f"the {self.stage} may be ({self.sure:.0%}) {times:.2g} times as {'slow' if slower else 'fast'} "
            f"{_AT[self.by] if self.at == 1.0 else _ON_THE_WAY[self.by].format(self.at)}, which no effect of "
            "the library is"
        )


@lru_cache(maxsize=16)
def unevenly_paced(e: Explanation) -> Uneven | None:
    """The likeliest uneven pace instead of what was found, or of a part of it. None where errors add up, as
    there is no pace, or where a rounding was found."""
    if e.segment.pace:
        return None
    return likeliest(e, _judged)


def is_uneven(e: Explanation) -> bool:
    """Whether that is likelier than what was found."""
    return is_likelier(unevenly_paced(e))


def _judged(e: Explanation, base: Fit) -> Uneven | None:
    """The likeliest uneven pace beside what ``base`` has, fitted as long as it may reach what was found."""
    first = likeliest_on_all(base.problem, base.vector, uneven_paces(base.problem))
    if first is None:
        return None
    weighing = Weighing(e.ar)
    best = fit(first.problem, first.vector, weighing, _ITERATIONS, leader=e.best)
    odds = odds_over(e, base, square_by(best, weighing), best.size - base.size)
    found = best.problem.candidates[-1]
    pace = Pace(found.form.name, *best.problem.values(best.vector)[-1])
    at = pace.farthest()
    return Uneven(gone(e, base), odds, found.stage, pace.by, float(pace.slowness(at)), at)
