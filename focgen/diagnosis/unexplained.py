"""Whether what the effects leave of a gap is more than noise: then no effect of the library is its cause."""

from __future__ import annotations

import numpy as np

from focgen.diagnosis.disturbance import Disturbance, disturbance
from focgen.diagnosis.explain import Explanation
from focgen.diagnosis.leftover import LEFT
from focgen.diagnosis.outside import from_outside
from focgen.rig.effects import library

_UNEXPLAINED = 0.25  # of what could be explained: beyond it no effect of the library is the cause
_HARDLY = 0.6  # of a mean square still there: its effects explain hardly anything
_LOOPED = 0.45  # the same in a closed loop, of what is less steady than noise, or slower
_SLOW = 6.0  # than noise, in power


def is_unknown(e: Explanation) -> bool:
    """Whether much of what inputs foretell of the nominal residual is still there after the effects, or what
    hardly any of them explains is not just noise; unless a coarse converter explains it."""
    if e.converter is not None and e.converter.explains(e.best):
        return False
    left = disturbed(e)
    if _stirred(e, left) or (e.segment.closed and _hidden(e, left)):
        return True
    if e.causes and not is_rounded(e) and from_outside(e):
        return True
    if e.left.share < LEFT:
        return False
    if e.segment.closed and left.restless and _rings(e):
        return True
    before, after = _squares(e)
    noise = after * (1 - e.left.share)
    return bool(after - noise > _UNEXPLAINED * (before - noise))


def disturbed(e: Explanation) -> Disturbance:
    """What is left of a segment, as a disturbance."""
    response = e.nominal.problem.references.clocks["response"]
    return disturbance(e.segment.parts(e.best.weighed), e.segment.run.h, response)


def is_rounded(e: Explanation) -> bool:
    """Whether a rounding is among the effects found."""
    return any(library()[c.rivals[0].effect].noiselike for c in e.causes)


def _stirred(e: Explanation, left: Disturbance) -> bool:
    """Whether bursts, slow swings, a hum or what pushes the rig are there, and the effects found, if any,
    take hardly any of the residual away. What a rounding leaves comes in bursts by nature."""
    loud = left.bursts or left.swings or left.hums or left.pushed
    if not e.causes:
        return loud
    before, after = _squares(e)
    return after > _HARDLY * before and (loud or left.restless) and not is_rounded(e)


def _hidden(e: Explanation, left: Disturbance) -> bool:
    """Whether the effects leave much that no noise is, in a closed loop, which moves the input against it, so
    that the reference foretells little of it."""
    if not e.causes or is_rounded(e):
        return False
    before, after = _squares(e)
    return after > _LOOPED * before and (left.slow > _SLOW or left.restless)


def _rings(e: Explanation) -> bool:
    """Whether a mode is among the effects found: it rings evenly, and what knocks about does not, though a
    closed loop makes a tone of it."""
    return any(library()[c.rivals[0].effect].tonal for c in e.causes)


def _squares(e: Explanation) -> tuple[float, float]:
    """The segment's mean squares without its effects and with them."""
    before, after = (float(np.mean(f.weighed**2)) for f in (e.nominal, e.best))
    return before, after
