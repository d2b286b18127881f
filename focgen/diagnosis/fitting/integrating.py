"""Rigs that integrate: what a force a little wrong leaves of their output is kept, and grows.

Their residual is one slow path of few turns, which a drift or a curve of many values follows as well as the
cause does. So in the search residuals count less what they were a time constant of the rig ago, which leaves
about the force that is missing; and evidence is counted in turns of the residual, not in samples. What was
found is fitted once more to the output itself, which is what a simulation is to predict.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from focgen.diagnosis.fitting.fit import WHITE, Fit, fit
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.problem import Problem
from focgen.fractional.transfer import TransferFunction
from focgen.rig.corners import transfer_of
from focgen.rig.rig import Rig

_ROUNDS = 12  # of the last fit


def pace(rig: Rig, stages: Sequence[str], response: float) -> float:
    """The longest time constant of a stage that integrates, s, or the ``response`` of the rig where that only
    adds up; 0 where none does."""
    transfers = [t for stage in stages if (t := transfer_of(rig, stage)) is not None]
    found = [_slowest(t) or response for t in transfers if not np.isfinite(t.dc_gain)]
    return max(found, default=0.0)


def _slowest(transfer: TransferFunction) -> float:
    """By its denominator's two lowest orders, each power of s^-1 apart: s^a (1 + T s^b) has T."""
    terms = sorted(transfer.den, key=lambda t: t.order)
    if len(terms) < 2:
        return 0.0
    low, high = terms[:2]
    return float(abs(high.coefficient / low.coefficient) ** (1.0 / (high.order - low.order)))


def counted(of: Fit, against: Fit) -> float:
    """Nats of evidence of one fit over another, from as many errors as what the other leaves has independent
    ones; infinite where the rig does not integrate."""
    if not of.problem.segment.pace:
        return np.inf
    n = max(sum(_independent(part) for part in against.residual()), 2.0)
    before, after = (float(np.mean(f.weighed**2)) for f in (against, of))
    gain = 0.5 * n * np.log(max(before, 1e-300) / max(after, 1e-300))
    made: float = gain - 0.5 * (of.size - against.size) * np.log(n)
    return made


def _independent(left: np.ndarray) -> float:
    """How many independent errors a residual (n,) is worth: its samples over the sum of its correlations, up
    to where they first vanish (G. I. Taylor, Proc. London Math. Soc. 20, 1921)."""
    spectrum = np.abs(np.fft.rfft(left, 2 * len(left))) ** 2
    correlation = np.fft.irfft(spectrum)[: len(left)]
    if correlation[0] <= 0.0:
        return float(len(left))
    correlation = correlation / correlation[0]
    end = int(np.argmax(correlation <= 0.0)) or len(left)
    return float(len(left) / (1.0 + 2.0 * correlation[1:end].sum()))


def settled(of: Fit) -> Fit:
    """A fit with the vector that brings a rig that integrates closest to its output; others as they are."""
    return fit(of.problem, _to_the_path(of).vector, WHITE, 0) if of.problem.segment.pace else of


def as_they_show(of: Fit, without: Fit) -> tuple[Fit, Fit]:
    """Two fits by which it is seen what the rig does: to its whole path where a pump makes that, which adds
    up without further errors, or where the first leaves no more of it than noise; others as they are."""
    segment, rig = of.problem.segment, of.problem.nominals.rig
    if not segment.pace:
        return of, without
    whole = _to_the_path(of)
    noise = float(np.mean(of.problem.residual(of.vector) ** 2)) / segment.recent_share
    left = float(np.mean(whole.problem.residual(whole.vector) ** 2))
    shown = rig.integrator == "regulator" or noise > NUMBERS.above**2 * left
    return (whole, _to_the_path(without)) if shown else (of, without)


@lru_cache(maxsize=4)
def _to_the_path(of: Fit) -> Fit:
    problem = of.problem
    plain: Problem = replace(problem, segment=replace(problem.segment, pace=0.0), memory={})
    return fit(plain, of.vector, WHITE, _ROUNDS)
