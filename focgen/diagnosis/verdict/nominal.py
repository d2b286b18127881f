"""Effects beside others that are likelier the nominal chain, off by itself: these are not named.

A chain that was fitted to a rig's logs is off by part of the noise. Alone, what looks like an effect of that
size is all that there is to say. Beside an effect that is there it would be a second fault to look for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from focgen.diagnosis.belief.standing import any_of, sureness
from focgen.diagnosis.fitting.fit import Weighing
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.rivals import Cause, without_family
from focgen.diagnosis.verdict.confidence import nominal_instead
from focgen.diagnosis.verdict.unexplained import is_unknown
from focgen.present import present


def likelier_nominal(explanations: Sequence[Explanation]) -> list[tuple[Explanation, Cause]]:
    """The causes, of several in all, that are as likely the nominal chain, or nothing at all, as an effect:
    an even chance is no second fault. The one that is so least stays. What is in a segment that is unknown
    with it does not count."""
    every = [(e, c) for e in explanations if e.causes and not is_unknown(e) for c in e.causes]
    every.sort(key=lambda each: _in_vain(each[1]))
    return [(e, c) for e, c in every[1:] if _in_vain(c) >= 0.5]


def _in_vain(cause: Cause) -> float:
    """How likely the chain is off by itself instead, or, whichever family it is of, no such effect is
    there."""
    none = -any_of([rival.odds for rival in cause.rivals])
    return max(nominal_instead(cause.rivals[0]), sureness(none))


def nominal_alone(
    explanations: Sequence[Explanation], others: Sequence[tuple[Explanation, Cause]]
) -> list[tuple[Explanation, Cause]]:
    """What left a segment without any effect, for the nominal chain is as good as sure to be off by it;
    beside ``others`` that were likelier the chain."""
    alone = [e for e in explanations if e.whole is not None and not e.causes and not is_unknown(e)]
    left = [(e, c) for e in alone for c in present(e.whole).causes]
    return [(e, c) for e, c in left if all(c is not other for _, other in others)]


def unnamed(e: Explanation, causes: Sequence[Cause]) -> Explanation:
    """``e`` without these of its causes, which are not named. What inputs predict stays as it was with them,
    and so does what may be there instead: they are explained."""
    if not causes:
        return e
    best, rest = e.best, tuple(c for c in e.causes if c not in causes)
    for cause in causes:
        best = without_family(best, cause.rivals[0].effect, Weighing(e.ar))
    return replace(e, best=best, causes=rest, whole=e.whole or e)
