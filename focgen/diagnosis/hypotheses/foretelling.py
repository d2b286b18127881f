"""Whether each of several effects foretells: beside others, a form may only follow what theirs lack."""

from __future__ import annotations

import numpy as np

from focgen.diagnosis.fitting.fit import Fit, Weighing
from focgen.diagnosis.fitting.folds import folds, foreseen
from focgen.diagnosis.hypotheses.rivals import left_out
from focgen.diagnosis.numbers import NUMBERS
from focgen.rig.effects import library


def foretelling(best: Fit, weighing: Weighing) -> Fit:
    """``best`` without the effects that, on parts of the session which a fit does not see, leave
    :attr:`~focgen.diagnosis.numbers.Numbers.stays` of what they close where it does; the vainest is left out
    first, and one is kept. What a rounding or a wander does is foretold by nothing."""
    while len(names := _asked(best)) > 1 or (names and len(_families(best)) > 1):
        fold = folds([last - first for first, last in best.problem.segment.run.spans])
        both = foreseen(best, weighing, fold)
        tried = [_kept(name, best, both, weighing, fold) for name in names]
        least, without = min(tried, key=lambda pair: pair[0])
        if least >= 1.0 - NUMBERS.stays:
            break
        best = without
    return best


def _families(best: Fit) -> list[str]:
    return list(dict.fromkeys(c.effect for c in best.problem.candidates))


def _asked(best: Fit) -> list[str]:
    """The families that may be asked to foretell."""
    wandering = {c.effect for c in best.problem.candidates if c.form.wanders}
    return [n for n in _families(best) if n not in wandering and not library()[n].rounds]


def _kept(name: str, best: Fit, both: float, weighing: Weighing, fold: np.ndarray) -> tuple[float, Fit]:
    """The part of what a family closes beside the others that it closes where it is not fitted, too; and the
    fit without it. ``both``: the mean square that is foreseen with it."""
    own = [c for c in best.problem.candidates if c.effect == name]
    without = left_out(best, own, weighing)
    fitted = float(np.mean(without.weighed**2)) - float(np.mean(best.weighed**2))
    share = (foreseen(without, weighing, fold) - both) / fitted if fitted > 0.0 else 0.0
    return share, without
