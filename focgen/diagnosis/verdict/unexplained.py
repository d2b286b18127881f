"""Whether what the effects leave of a gap is more than noise: then no effect of the library is its cause."""

from __future__ import annotations

import numpy as np

from focgen.diagnosis.belief.unknown import is_none
from focgen.diagnosis.hypotheses.converter import is_rounded, rms
from focgen.diagnosis.hypotheses.disturbance import Disturbance, disturbance
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.rivals import lack_of
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.verdict.clocks import are_apart
from focgen.diagnosis.verdict.late import is_late
from focgen.diagnosis.verdict.moments import another
from focgen.diagnosis.verdict.outside import from_outside
from focgen.diagnosis.verdict.restless import is_restless
from focgen.diagnosis.verdict.taken_up import is_taken_up
from focgen.diagnosis.verdict.uneven import is_uneven
from focgen.diagnosis.verdict.unsteady import is_unsteady
from focgen.rig.effects import library


def is_unknown(e: Explanation) -> bool:
    """Whether much of what inputs predict of the nominal residual is still there after the effects, or what
    hardly any of them explains is not just noise, or what moves with time moves at once, or the command was
    logged late, columns go by clocks of their own or a pace is uneven instead; unless a coarse converter
    or a logger's dead band explains it, or the nominal chain that is off by itself does."""
    if e.whole is not None and not e.causes:
        return _is_unknown(e.whole, instead=e.amiss >= NUMBERS.left or not lack_of(e.best))
    return _is_unknown(e)


def _is_unknown(e: Explanation, instead: bool = True) -> bool:
    """The same of ``e`` with its causes; ``instead``: whether what none of the library is may be there in
    their place, and not the form of the nominal chain."""
    if e.converter is not None and e.converter.explains(e.best):
        return False
    if not e.causes and rms(e.best.weighed) < e.segment.withheld:
        return False
    whole = e.whole or e  # what is not named, for the nominal chain or another thing may be it, is explained
    left = disturbed(whole)
    if _is_disturbed(whole, left) or (e.segment.closed and _hidden(whole, left)):
        return True
    if (
        instead
        and e.causes
        and not is_rounded(e.causes)
        and (
            from_outside(e)
            or another(e)
            or is_late(e)
            or are_apart(e)
            or is_uneven(e)
            or is_taken_up(e)
            or is_unsteady(e)
        )
    ):
        return True
    if e.amiss < NUMBERS.left:
        return False
    if e.segment.closed and left.bursts and _rings(e):
        return True
    before, after = _squares(e)
    return is_none(after * e.amiss, before - after)


def disturbed(e: Explanation) -> Disturbance:
    """What is left of a segment, as a disturbance."""
    response = e.nominal.problem.references.clocks["response"]
    return disturbance(e.segment.parts(e.best.weighed), e.segment.run.h, response)


def acts_besides(e: Explanation) -> bool:
    """Whether something else acts where effects were found: what they leave is driven by it, or is far louder
    where the rig moves."""
    return bool(e.causes) and (is_driven(e) or is_restless(e))


def is_driven(e: Explanation) -> bool:
    """Whether what effects leave of a segment has passed through the rig, far above its noise, and inputs
    predict little of it. What goes round in a loop, or adds up, is left so by noise, and what jumps by whole
    jumps at another time."""
    if not e.causes or e.segment.closed or e.segment.pace or is_rounded(e.causes):
        return False
    if any(candidate.form.jumps for candidate in e.best.problem.candidates):
        return False
    return e.amiss < NUMBERS.left and disturbed(e).pushed


def is_noise(e: Explanation) -> bool:
    """Whether what a segment leaves is noise, but for a little that its input predicts. Where errors add up,
    all that is left has to be, however long ago it came about."""
    if e.segment.pace and _added_up(e):
        return False
    left = disturbed(e)
    quiet = not (left.bursts or left.low_frequency or left.tonal or left.pushed or is_restless(e))
    return not is_unknown(e) or (quiet and e.amiss <= NUMBERS.much)


def _added_up(e: Explanation) -> bool:
    """Whether the output of a rig that integrates is off by far more than its noise."""
    segment, response = e.segment, e.nominal.problem.references.clocks["response"]
    off = segment.y - e.best.problem.simulate(e.best.vector)
    return disturbance(segment.parts(off), segment.run.h, response).above > NUMBERS.pushed


def _is_disturbed(e: Explanation, left: Disturbance) -> bool:
    """Whether bursts, slow swings, a hum, what pushes the rig or is louder as it moves are there, and the
    effects found, if any, take hardly any of the residual away. What a rounding leaves comes in bursts by
    nature."""
    loud = left.bursts or left.low_frequency or left.tonal or left.pushed or is_restless(e)
    if not e.causes:
        return loud
    before, after = _squares(e)
    return after > NUMBERS.stays * before and loud and not is_rounded(e.causes)


def _hidden(e: Explanation, left: Disturbance) -> bool:
    """Whether the effects leave much that no noise is, in a closed loop, which moves the input against it, so
    that the reference predicts little of it."""
    if not e.causes or is_rounded(e.causes):
        return False
    before, after = _squares(e)
    return after > NUMBERS.stays * before and (left.slow > NUMBERS.looped or left.bursts)


def _rings(e: Explanation) -> bool:
    """Whether a mode is among the effects found: it rings evenly, and what knocks about does not, though a
    closed loop makes a tone of it."""
    return any(library()[c.rivals[0].effect].tonal for c in e.causes)


def _squares(e: Explanation) -> tuple[float, float]:
    """The segment's mean squares without its effects and with them."""
    before, after = (float(np.mean(f.weighed**2)) for f in (e.nominal, e.best))
    return before, after
