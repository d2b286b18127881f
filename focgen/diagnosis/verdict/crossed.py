"""Whether the columns of what a sensor reads and of its reading were exchanged, instead of what was found.

No sensor answers ahead of what it reads, so nothing in the library does. A relaxation that overshoots comes
closest. So what was found is held against the rig without any effect, and its columns in the other order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

from focgen.diagnosis.fitting.fit import Weighing, fit
from focgen.diagnosis.hypotheses.converter import is_rounded
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.verdict.instead import Instead, is_likelier, odds_over

_ITERATIONS = 6


@lru_cache(maxsize=16)
def exchanged(e: Explanation) -> Instead | None:
    """How likely the sensor's two columns were exchanged; None for another segment, or where nothing was
    found, or a rounding. Each of the two is judged by what it leaves as a share of what it is to explain."""
    segment, base = e.segment, e.nominal
    families = e.best.problem.families
    if (segment.entry, segment.exit) != ("curvature", "output") or not families or is_rounded(e.causes):
        return None
    other = replace(base.problem.segment, x=base.problem.segment.y, y=base.problem.segment.x)
    tried = fit(replace(base.problem, segment=other, memory={}), base.vector, Weighing(e.ar), _ITERATIONS)
    return Instead(frozenset(families), odds_over(e, base, tried.sse, 0))


def crossed(explanations: Sequence[Explanation]) -> list[Explanation]:
    """The segments on both sides of a signal that has another one's column."""
    if not any(is_likelier(exchanged(e)) for e in explanations):
        return []
    return [e for e in explanations if "curvature" in (e.segment.entry, e.segment.exit)]
