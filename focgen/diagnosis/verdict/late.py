"""Whether the command was logged late, instead of what was found.

No rig answers ahead of its command, so nothing in the library does. A resonance, a mode or an actuator of
another order follows an answer that comes early, and then stands for a column out of step. So what was found
is held against the same rig with the command some samples earlier, and without one of the effects.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from focgen.diagnosis.fitting.fit import Fit, Weighing, fit
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.problem.segments import Segment
from focgen.diagnosis.verdict.instead import Instead, gone, is_likelier, likeliest, odds_over
from focgen.rig.rig import Rig

_LATEST = 16  # samples
_ITERATIONS = 6


@dataclass(frozen=True, eq=False)
class Late(Instead):
    """A command that came ``samples`` (``seconds``) before its log says."""

    samples: int
    seconds: float

    @property
    def may_be(self) -> str:
        """As of :class:`Instead`."""
        return (
            f"the command may be ({self.sure:.0%}) logged {self.seconds:.3g} s late ({self.samples} "
            "samples); see to it that each row has what was sent as the readings were taken"
        )


def ahead_told(e: Explanation, rig: Rig) -> tuple[str, ...]:
    """That the command is ahead of its rows, or behind them, where the ``rig`` that is written says so and
    the one given did not."""
    lead, given, step = rig.lead, e.best.problem.nominals.rig.lead, e.segment.fed.run.h
    if e.segment.entry != "command" or lead == given:
        return ()
    what = f"the command is {abs(lead):.2g} s ({abs(lead) / step:.2g} samples)"
    if lead < 0.0:
        return (f"{what} behind its rows, or that is a dead time: written as lead in [signals]",)
    return (
        f"{what} ahead of its rows, which have it beside what was read later: written as lead in [signals]",
    )


@lru_cache(maxsize=16)
def logged_late(e: Explanation) -> Late | None:
    """How likely the command was logged late, instead of an effect found where it enters; None where nothing
    was found there, or a rounding."""
    if e.segment.entry != "command" or not e.best.problem.families:
        return None
    return likeliest(e, _judged)


def is_late(e: Explanation) -> bool:
    """Whether that is likelier than what was found."""
    return is_likelier(logged_late(e))


def _judged(e: Explanation, base: Fit) -> Late | None:
    """The likeliest lateness beside what ``base`` has, None where an earlier command helps it nothing."""
    samples, best = 0, base
    for n, tried in _earlier(base, Weighing(e.ar)):
        if tried.sse >= best.sse:
            break
        samples, best = n, tried
    if not samples:
        return None
    odds = odds_over(e, base, best.sse, 1)
    return Late(gone(e, base), odds, samples, samples * e.segment.fed.run.h)


def _earlier(base: Fit, weighing: Weighing) -> Iterator[tuple[int, Fit]]:
    """``base`` fitted again with the command ever more samples earlier."""
    start = base.vector.copy()
    start[len(base.problem.nominal_start)] = 0.0  # an alignment that made up for a part of it
    for n in range(1, _LATEST + 1):
        segment = base.problem.segment.anew(x=_sooner(base.problem.segment.fed, n))
        tried = fit(replace(base.problem, segment=segment, memory={}), start, weighing, _ITERATIONS)
        yield n, tried
        start = tried.vector


def _sooner(segment: Segment, samples: int) -> np.ndarray:
    """The input (n,) by so many samples sooner, each experiment held at its end."""
    parts = segment.parts(segment.x)
    return np.concatenate([np.r_[x[samples:], np.repeat(x[-1:], samples)][-len(x) :] for x in parts])
