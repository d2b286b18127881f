"""What no effect is, held against what was found: as rare as an effect, and instead of one or of all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar, TypeVar

import numpy as np

from focgen.diagnosis.belief.choice import beforehand
from focgen.diagnosis.belief.likelihood import Scale, speaks_or_is_right
from focgen.diagnosis.belief.standing import sureness
from focgen.diagnosis.fitting.fit import Fit, Weighing, square_by
from focgen.diagnosis.fitting.predictability import predictability
from focgen.diagnosis.hypotheses.converter import is_rounded
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.rivals import at_its_least, left_out, without
from focgen.diagnosis.numbers import NUMBERS


@dataclass(frozen=True, eq=False)
class Instead:
    """What no effect is, ``instead`` of these families, and the log ``odds`` of it over what was found.
    ``fills``: whether these make up for what other families' forms lack, which a refit of those does less of,
    and not these for what is there instead."""

    instead: frozenset[str]
    odds: float
    fills: ClassVar[bool] = False

    @property
    def sure(self) -> float:
        """How likely it is, if it is that or what was found."""
        return sureness(self.odds)

    @property
    def said(self) -> str:
        """What it is instead of, how likely, and what to do about it."""
        named = f"instead of {' and '.join(sorted(self.instead))}" if self.instead else "beside no effect"
        return f"{named} {self.may_be}"

    @property
    def may_be(self) -> str:
        """What it is, how likely, and what to do about it."""
        raise NotImplementedError


def is_likelier(other: Instead | None) -> bool:
    """Whether it is likelier than what was found."""
    return other is not None and other.odds > 0.0


T = TypeVar("T", bound=Instead)


def likeliest(e: Explanation, judged: Callable[[Explanation, Fit], T | None]) -> T | None:
    """The likeliest of what is ``judged`` beside each of the :func:`bases`; None where nothing is there."""
    found = [judged(e, base) for base in bases(e)]
    return max((one for one in found if one is not None), key=lambda one: one.odds, default=None)


@lru_cache(maxsize=16)
def bases(e: Explanation) -> tuple[Fit, ...]:
    """The fits that it may stand beside: without any effect, and without each of several. None where a
    rounding was found: its steps are no noise, and what is smaller than they are tells nothing. None where
    this is what is not in question of a whole that was asked."""
    if is_rounded(e.causes) or e.whole is not None:
        return ()
    candidates = e.best.problem.candidates
    families = sorted(e.best.problem.families) if len(e.best.problem.families) > 1 else ()
    fewer, weighing = ([c for c in candidates if c.effect == effect] for effect in families), Weighing(e.ar)
    return e.nominal, *(at_its_least(left_out(e.best, gone, weighing), weighing) for gone in fewer)


def gone(e: Explanation, base: Fit) -> frozenset[str]:
    """The families found that are not in ``base``."""
    return frozenset(e.best.problem.families) - frozenset(base.problem.families)


def sound_part(e: Explanation, others: Sequence[Instead | None]) -> Explanation | None:
    """The explanation without the families instead of which ``others`` are likelier; None where none is, or
    all are in question. What stays, stays as it was fitted beside them, and so does how much inputs predict:
    a refit would make up for what is there instead. Where only what ``fills`` is in question, it is fitted
    again, and so is how much inputs predict."""
    likelier = [other for other in others if other and is_likelier(other)]
    out = frozenset[str]().union(*(other.instead for other in likelier))
    kept = tuple(c for c in e.causes if c.rivals[0].effect not in out)
    if not out or not kept:
        return None
    left = [c for c in e.best.problem.candidates if c.effect in out]
    if not all(other.fills for other in likelier):
        return replace(e, best=without(e.best, left, Weighing(e.ar)), causes=kept, whole=e)
    best = left_out(e.best, left, Weighing(e.ar))
    left_by_it = predictability(e.segment, best.weighed, e.nominal.problem.references.clocks["response"])
    return replace(e, best=best, causes=kept, predictability=left_by_it, whole=e)


def odds_over(e: Explanation, base: Fit, left: float, free: int, things: int = 1) -> float:
    """The log odds, over what was found, of so many ``things`` with ``free`` values beside ``base``, which
    leave the sum of squares ``left``; each is as rare as an effect."""
    before, after = _squares(e)
    floor = max(min(after * (1.0 - e.predictability.share), left), 1e-300)
    unit, scale = 0.5 * len(e.segment.y) / floor, Scale(0.5 * len(e.segment.y) * NUMBERS.other)

    def of(beside: Fit, left: float, free: int) -> float:
        misfit, gained = max(left - floor, 0.0) * unit, max(before - left, 0.0) * unit
        count = beside.size - e.nominal.size + free
        return speaks_or_is_right(count, gained, misfit, scale, gained) + beforehand(
            beside.problem.candidates
        )

    return of(base, left, free) + things * float(np.log(NUMBERS.rare)) - of(e.best, after, 0)


@lru_cache(maxsize=16)
def _squares(e: Explanation) -> tuple[float, float]:
    """The sums of squares that are left without any effect, and with what was found."""
    before, after = (square_by(f, Weighing(e.ar)) for f in (e.nominal, e.best))
    return before, after
