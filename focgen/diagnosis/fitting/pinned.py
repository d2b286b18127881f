"""An effect whose numbers a fit leaves where they are: those that have no slope."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from focgen.diagnosis.fitting.fit import FIXED
from focgen.diagnosis.problem.problem import CandidateEffect

_EITHER_WAY = 0.25 * FIXED  # of a reference: what is held may move either way


def pinned(candidate: CandidateEffect, entries: Iterable[float]) -> CandidateEffect:
    """The effect with its parameters held at these ``entries`` of a problem's vector."""
    ends = ((e - _EITHER_WAY, e + _EITHER_WAY) for e in entries)
    own = zip(candidate.form.parameters, ends)
    parameters = tuple(replace(p, lower=low, upper=high) for p, (low, high) in own)
    return replace(candidate, form=replace(candidate.form, parameters=parameters))
