"""A rig that adds up is judged by the recent part of its path: in all of it, what an input was measured wrong
adds up. What is small, or lasts for a moment, shows in a longer part first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.diagnosis.fitting.fit import WHITE, Fit, Weighing, fit
from focgen.diagnosis.hypotheses.search import evidence
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.problem import Problem
from focgen.diagnosis.problem.segments import Segment
from focgen.rig.rig import Rig

_KEPT = 10.0  # times the pace at which a rig that integrates is searched where that shows nothing: of a small
# force the path shows more above the sensor's noise the longer it is kept,
_HELD = 100.0  # and a pump's for so long first: it adds up without further errors
_ITERATIONS = 12  # of a refit by which paths are compared


def times_as_long(rig: Rig, segment: Segment) -> tuple[float, ...]:
    """Times the pace at which a segment is searched once more."""
    if not segment.pace:
        return ()
    return (_HELD, _KEPT) if rig.integrator == "regulator" else (_KEPT,)


def may_show_more(best: Fit, kept: Problem, only: Sequence[str] | None) -> bool:
    """Whether nothing was found at the usual pace, or inputs predict much of what effects leave of a pump's
    longer path, as it is ``kept``: of an axis what inputs were measured wrong would do as well. ``only``: the
    effects to consider, which may all have been found."""
    found, pumped = best.problem.families, kept.nominals.rig.integrator == "regulator"
    if not found or not pumped or (only is not None and set(only) <= set(found)):
        return not found
    return _refitted(best, kept, WHITE).predictable_share > NUMBERS.much


def borne_out(shown: Fit, best: Fit, usual: Problem, weighing: Weighing) -> bool:
    """Whether what a longer path has ``shown`` beside the ``best`` of the ``usual`` one is seen a little
    there, too: what an input was measured wrong adds up in the path, and no force is behind it. By itself it
    has to foretell (Akaike, 1974). Beside another, of which it may follow what a form lacks, it has to be
    evident (Schwarz, 1978)."""
    if not set(best.problem.families) < set(shown.problem.families):
        return False
    without, beside = (_refitted(of, usual, weighing) for of in (best, shown))
    further, n = beside.size - without.size, len(beside.innovations)
    allowed = further * (0.5 * np.log(n) - 1.0) if not best.problem.families else 0.0
    return evidence(beside, without) + allowed > 0.0


def at_pace(of: Fit, pace: float) -> Fit:
    """A fit made anew to a path that is kept for ``pace``, s. What is kept longer adds up to more, so that
    squares left on paths of unlike length cannot be compared."""
    kept = replace(of.problem, segment=replace(of.problem.segment, pace=pace), memory={})
    return fit(kept, of.vector, WHITE, _ITERATIONS)


def _refitted(of: Fit, problem: Problem, weighing: Weighing) -> Fit:
    """The effects of a fit in another ``problem``."""
    return fit(problem.with_candidates(of.problem.candidates), of.vector, weighing, _ITERATIONS)
