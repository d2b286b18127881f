"""A rig that adds up is judged by the recent part of its path: in all of it, what an input was measured wrong
adds up. What is small, or lasts for a moment, shows in a longer part first."""

from __future__ import annotations

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


def strays(best: Fit, kept: Problem) -> bool:
    """Whether nothing was found at the usual pace, or inputs predict much of what effects leave of a longer
    path, as it is ``kept``."""
    if not best.problem.candidates:
        return True
    beside = kept.with_candidates(best.problem.candidates)
    return fit(beside, best.vector, WHITE, _ITERATIONS).predictable_share > NUMBERS.much


def borne_out(shown: Fit, best: Fit, nominal: Fit, weighing: Weighing) -> bool:
    """Whether what a longer path has ``shown`` beside the ``best`` at the usual pace is seen a little there,
    too: what an input was measured wrong adds up in the path, and no force is behind it."""
    if not set(best.problem.families) < set(shown.problem.families):
        return False
    beside = nominal.problem.with_candidates(shown.problem.candidates)
    return evidence(fit(beside, shown.vector, weighing, _ITERATIONS), best) > 0.0
