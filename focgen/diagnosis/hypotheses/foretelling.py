"""Whether each of several effects foretells: beside others, a form may only follow what theirs lack."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from focgen.diagnosis.fitting.fit import Fit, Weighing
from focgen.diagnosis.fitting.folds import foretold, judged_error
from focgen.diagnosis.hypotheses.rivals import without_family
from focgen.diagnosis.numbers import NUMBERS
from focgen.rig.effects import library


def foretelling(best: Fit, weighing: Weighing, known: Sequence[Fit] = ()) -> Fit:
    """``best`` without the effects that, on parts of the session which a fit does not see, leave
    :attr:`~focgen.diagnosis.numbers.Numbers.stays` of what they close where it does; the vainest is left out
    first, and one is kept. What a rounding or a wander does is foretold by nothing.

    ``known``: fits from the search. A fit without an effect that is stuck far from its least leaves more than
    parts of it foretell, and then the effect seems to close what it does not."""
    if not _asked(best):
        return best
    error = foretold(best, weighing)
    while names := _asked(best):
        vainest = min(
            (_Left.of(name, best, error, weighing, known) for name in names), key=lambda each: each.share
        )
        if vainest.share >= 1.0 - NUMBERS.stays:
            break
        best, error = vainest.without, vainest.error
    return best


def _asked(best: Fit) -> list[str]:
    """The families that may be asked to foretell: none where there is only one."""
    families = best.problem.families
    wandering = {c.effect for c in best.problem.candidates if c.form.wanders}
    asked = [n for n in families if n not in wandering and not library()[n].rounds]
    return asked if len(families) > 1 else []


@dataclass(frozen=True, eq=False)
class _Left:
    """What is left ``without`` a family: a fit, the mean square ``error`` it foretells, and the ``share`` of
    what the family closes beside the others that it closes where it is not fitted, too."""

    without: Fit
    error: float
    share: float

    @classmethod
    def of(cls, name: str, best: Fit, error: float, weighing: Weighing, known: Sequence[Fit]) -> _Left:
        """``error``: the mean square that is foretold with the family."""
        without = without_family(best, name, weighing, known)
        fitted = float(np.mean(judged_error(without) ** 2)) - float(np.mean(judged_error(best) ** 2))
        alone = foretold(without, weighing)
        return cls(without, alone, (alone - error) / fitted if fitted > 0.0 else 0.0)
