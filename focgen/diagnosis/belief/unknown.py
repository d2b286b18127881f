"""Whether what is left is none of the library's: the same gap, by a form that may be wrong by all it does."""

from __future__ import annotations

import numpy as np

from focgen.diagnosis.belief.likelihood import log_likelihood
from focgen.diagnosis.numbers import NUMBERS


def is_none(misfit: float, changed: float) -> bool:
    """Whether effects that take a mean square ``changed`` and leave ``misfit`` that inputs predict are
    less likely than a form that nobody wrote down.

    That one is a further effect, as rare as any, and explains whatever inputs predict. It pays for it with a
    discrepancy as large as the gap, where a form of the library has one of a small part of that.
    """
    if changed <= 0.0:
        return misfit > 0.0
    known = log_likelihood(misfit, NUMBERS.form**2 * changed)
    return known < float(np.log(NUMBERS.rare)) - 0.5 * NUMBERS.turns * float(np.log(changed))
