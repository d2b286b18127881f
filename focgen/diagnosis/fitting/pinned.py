"""An effect whose numbers a fit leaves where they are: those that have no slope."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from focgen.diagnosis.fitting.fit import FIXED
from focgen.diagnosis.problem.candidates import CandidateEffect

_EITHER_WAY = 0.25 * FIXED  # of a reference: what is held may move either way


def pinned(candidate: CandidateEffect, entries: Iterable[float]) -> CandidateEffect:
    """The effect with its parameters held at these ``entries`` of a problem's vector."""
    parameters = []
    for p, entry in zip(candidate.form.parameters, entries):
        low, high = entry - _EITHER_WAY, entry + _EITHER_WAY
        low, high = (float(np.exp(low)), float(np.exp(high))) if p.log else (low, high)
        parameters.append(replace(p, lower=low, upper=high))
    return replace(candidate, form=replace(candidate.form, parameters=tuple(parameters)))
