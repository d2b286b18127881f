"""Whether the output takes up another signal at once, instead of what was found.

A gauge on a wall that the pressure bulges, or a cable beside that of the drive, shows a part of them past all
stages between. Nothing in the library does. A lag, a resonance or a loop follows that, if badly. So what was
found is held against the same rig with so much of another logged signal in its output, and without one of the
effects.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from focgen.diagnosis.fitting.fit import Fit, Weighing, fit, jacobian
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.problem import Problem
from focgen.diagnosis.problem.segments import stages_of
from focgen.diagnosis.verdict.instead import Instead, gone, is_likelier, likeliest, odds_over
from focgen.rig.kernels import innovations as innovated

_ROUNDS, _ITERATIONS = 4, 6  # of how much, and of a fit at so much
_SETTLED = 1e-3  # of the sum of squares: less is no descent


@dataclass(frozen=True, eq=False)
class TakenUp(Instead):
    """An output that has the signal of a ``role`` in it, where that is largest a ``part`` of its own largest
    magnitude."""

    role: str
    part: float

    @property
    def may_be(self) -> str:
        """As of :class:`Instead`."""
        return (
            f"the output may ({self.sure:.0%}) take up the {self.role} at once, past what is between: up to "
            f"{self.part:+.2g} of the output's largest; look at the gauge, its place and its cable"
        )


@lru_cache(maxsize=16)
def taken_up(e: Explanation) -> TakenUp | None:
    """How likely the output takes up a signal at once, instead of an effect found or of none, though inputs
    predict much; None where they do not, where errors add up, or where a rounding was found."""
    if e.segment.pace or not (e.best.problem.families or e.amiss > NUMBERS.left):
        return None
    return likeliest(e, _judged)


def is_taken_up(e: Explanation) -> bool:
    """Whether that is likelier than what was found."""
    return is_likelier(taken_up(e))


def _judged(e: Explanation, base: Fit) -> TakenUp | None:
    """The likeliest signal beside what ``base`` has, None where none helps it: the segment's own input only
    where more than one stage lies between, for one stage alone answers at once as it may."""
    segment, stages = e.segment, stages_of(e.nominal.problem.nominals.rig)
    alone = sum(stage in stages for stage in segment.stages) < 2
    roles = [role for role in segment.passed if not (alone and role == segment.entry)]
    tried = [_beside(e, base, role) for role in roles]
    return max((t for t in tried if t is not None), key=lambda t: t.odds, default=None)


def _beside(e: Explanation, base: Fit, role: str) -> TakenUp | None:
    segment, weighing = base.problem.segment, Weighing(e.ar)
    shape = segment.passed[role] * segment.level_out
    part, best, left = 0.0, base, base.sse
    for _ in range(_ROUNDS):
        asked = _asked(best, shape, weighing)
        if not asked:
            break
        tried = fit(_less(base, (part + asked) * shape), best.vector, weighing, _ITERATIONS)
        # an output that is less has another level, which squares are shares of
        after = tried.sse * (tried.problem.segment.level_out / segment.level_out) ** 2
        if after > (1.0 - _SETTLED) * left:
            break
        part, best, left = part + asked, tried, after
    if not part or (not e.best.problem.families and best.predictable_share > NUMBERS.left):
        return None  # held against nothing, it is to explain the segment
    return TakenUp(gone(e, base), odds_over(e, base, left, 1), role, part)


def _asked(of: Fit, shape: np.ndarray, weighing: Weighing) -> float:
    """How much more of a ``shape`` (n,) is in the output, the fit's own numbers moving with it; 0 where that
    is worth no search."""
    segment, now = of.problem.segment, of.innovations
    moved = innovated(
        shape, np.zeros_like(shape), segment.weight, segment.run.rest, weighing.coarse, weighing.ar
    )
    rows = jacobian(of.problem, of.vector, now, weighing, *of.problem.bounds())[:-1].T
    own = np.linalg.lstsq(rows, moved, rcond=1e-8)[0]
    alone = moved - rows @ own
    size, along = float(alone @ alone), float(now @ alone)
    if size <= 1e-12 * float(moved @ moved) or along**2 < 2.0 * NUMBERS.nats * size * float(now @ now) / len(
        now
    ):
        return 0.0
    return along / size


def _less(base: Fit, taken: np.ndarray) -> Problem:
    """The problem with an output (n,) less what is ``taken`` up."""
    segment = base.problem.segment
    return replace(base.problem, segment=replace(segment, y=segment.y - taken), memory={})
