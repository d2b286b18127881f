"""Whether two columns go by clocks of their own, instead of what was found.

Two loggers drift apart: as the session goes on, the answer comes ever later, or ever sooner. Nothing in the
library does, and a drift follows it, if badly. So what was found is held against the same rig with the input
on a clock that runs at another rate, and without one of the effects.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from focgen.diagnosis.fitting.fit import Fit, Weighing, fit, innovations
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.problem import Problem
from focgen.diagnosis.verdict.instead import Instead, gone, is_likelier, likeliest, odds_over

_ROUNDS, _ITERATIONS = 6, 6  # of the rate, and of a fit at one
_SETTLED = 1e-3  # of the sum of squares: less is no descent


@dataclass(frozen=True, eq=False)
class Apart(Instead):
    """An output whose clock gains so many ``seconds`` on the input's from the session's first sample to its
    last, a part ``rate`` of it."""

    rate: float
    seconds: float

    @property
    def may_be(self) -> str:
        """As of :class:`Instead`."""
        return (
            f"the two columns may ({self.sure:.0%}) go by clocks of their own, {abs(self.seconds):.3g} s "
            f"apart in the session ({abs(self.rate):.2%}); record both by one logger"
        )


@lru_cache(maxsize=16)
def clocks_apart(e: Explanation) -> Apart | None:
    """How likely input and output go by clocks of their own, instead of an effect found between them; None
    where nothing was found there, or a rounding."""
    if not e.best.problem.families:
        return None
    return likeliest(e, _judged)


def are_apart(e: Explanation) -> bool:
    """Whether that is likelier than what was found."""
    return is_likelier(clocks_apart(e))


def _judged(e: Explanation, base: Fit) -> Apart | None:
    """The likeliest rate beside what ``base`` has, None where another clock helps it nothing."""
    clock, rate, best = e.segment.run.clock, 0.0, base
    step = 2.0 * e.segment.fed.run.h / float(np.ptp(clock))  # a sample sooner and later at the session's ends
    for _ in range(_ROUNDS):
        asked = _asked(best, base.problem, rate, step, Weighing(e.ar))
        if not asked:
            break
        tried = fit(_paced(base.problem, rate + asked), best.vector, Weighing(e.ar), _ITERATIONS)
        if tried.sse > (1.0 - _SETTLED) * best.sse:
            break
        rate, best = rate + asked, tried
    if not rate:
        return None
    return Apart(gone(e, base), odds_over(e, base, best.sse, 1), rate, rate * float(np.ptp(clock)))


def _asked(of: Fit, problem: Problem, rate: float, step: float, weighing: Weighing) -> float:
    """By how much more the clock would run apart, as if what a ``step`` of that changes grew in proportion; 0
    where that is worth no search."""
    now = innovations(of.problem, of.vector, weighing)
    toward = innovations(_paced(problem, rate + step), of.vector, weighing) - now
    size, along = float(toward @ toward), float(now @ toward)
    if not size or along**2 < 2.0 * NUMBERS.nats * size * float(now @ now) / len(now):
        return 0.0
    return -step * along / size


def _paced(problem: Problem, rate: float) -> Problem:
    """The problem with its input on a clock that gains a part ``rate``, right in the session's middle."""
    segment = problem.segment.fed
    clock = segment.run.clock
    sooner = clock + rate * (clock - 0.5 * (clock[0] + clock[-1]))
    parts = zip(segment.parts(sooner), segment.parts(clock), segment.parts(segment.x))
    x = np.concatenate([np.interp(at, t, x) for at, t, x in parts])
    return replace(problem, segment=problem.segment.anew(x=x), memory={})
