"""Weights as integers, in blocks of taps that each have their own scale.

Grünwald–Letnikov weights fall like j^−(1+α): in one scale of 16 bits only 453 of those of α = 0.6 differ from
zero. A block covers at most one octave of lags, so its weights are of one magnitude, and it is halved until
what rounding its weights costs, and what its sum's width costs, is a small share of what rounding the inputs
costs anyway. A block in which a weight would be lost is halved, too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from focgen.arrays import Array
from focgen.fractional.elementary import l1
from focgen.plan.formats import Interval, Word, exponent_for, integer, limit, weighted
from focgen.plan.plan import Block, Format

SPARE = 4  # bits between a sum's width and the widest alignment, so that its rounding fits too


@dataclass(frozen=True)
class Draft:
    """A block before its sum is aligned: real weights from lag ``first`` on, as multiples of
    2^``exponent``."""

    first: int
    real: Array
    exponent: int

    @property
    def counts(self) -> Array:
        """The weights, int64."""
        made: Array = np.rint(self.real * 2.0**-self.exponent).astype(np.int64)
        return made

    @property
    def error(self) -> float:
        """Bound on the sum of its weights' errors."""
        return 0.5 * len(self.real) * 2.0**self.exponent

    def coarser(self, exponent: int) -> Draft:
        """With a scale no finer than 2^``exponent``."""
        return Draft(self.first, self.real, max(self.exponent, exponent))


@dataclass(frozen=True)
class _Cut:
    """What every block keeps to: samples up to ``largest`` counts, ``word``, and an error ``allowed``."""

    largest: int
    word: Word
    allowed: float
    where: str

    def exponent(self, weights: Array) -> int:
        return finest_exponent(weights, self.largest, self.word, self.where)


def split(weights: Array, first: int, largest: int, word: Word, where: str = "[transfer]") -> list[Draft]:
    """Cut weights, by rising lag from ``first`` on, into blocks, newest first.

    ``largest`` is the largest magnitude of a sample in counts. Raises PlanError, naming ``where``, where no
    format covers the weights.
    """
    cut = _Cut(largest, word, 2.0 ** -(word.bits + 1) * l1(weights), where)
    drafts = []
    for start, stop in _octaves(first, first + len(weights)):
        drafts += _halved(weights[start - first : stop - first], start, cut)
    return drafts


def _octaves(first: int, stop: int) -> Iterator[tuple[int, int]]:
    """(start, stop) of the blocks 0, 1, 2–3, 4–7, …"""
    start = first
    while start < stop:
        end = min(max(1, 2 * start), stop) if start else min(1, stop)
        yield start, end
        start = end


def _halved(weights: Array, first: int, cut: _Cut) -> list[Draft]:
    if not weights.any():
        return [Draft(first, weights, 0)]
    draft = Draft(first, weights, cut.exponent(weights))
    lost = np.any((draft.counts == 0) & (weights != 0.0))
    if len(weights) == 1 or not (lost or draft.error > cut.allowed):
        return [draft]
    half = len(weights) // 2
    return _halved(weights[:half], first, cut) + _halved(weights[half:], first + half, cut)


def finest_exponent(weights: Array, largest: int, word: Word, where: str) -> int:
    """The finest scale at which every weight and the block's sum fit. Raises PlanError, naming ``where``,
    where it is out of reach."""
    magnitude = np.abs(weights)
    room = limit(word.sum_bits) - (1 << (word.sum_bits - SPARE))
    by_weight = exponent_for(float(magnitude.max()), word.limit, where, "a weight")
    by_sum = exponent_for(l1(weights) * largest, room, where, "a sum of weights")
    exponent = max(by_weight, by_sum)
    while int(np.abs(np.rint(weights * 2.0**-exponent)).sum()) * largest > room:
        exponent += 1
    return exponent


def finished(
    drafts: list[Draft], sample: int, total: int, each: Interval, word: Word, unit: str
) -> tuple[Block, ...]:
    """Align drafts at a total of 2^``total``; ``sample`` is log2 of the samples' lsb, ``each`` their
    range."""
    blocks = []
    for draft in reversed(drafts):
        finest = total - sample - (word.sum_bits - SPARE)
        draft = draft.coarser(finest if draft.real.any() else total - sample)
        counts, exponent = draft.counts, sample + draft.exponent
        reach = weighted(counts.tolist(), each)
        held = Format(integer(word.sum_bits), 2.0**exponent, reach.low, reach.high, unit)
        last = draft.first + len(counts) - 1
        blocks.append(
            Block(draft.first, last, tuple(counts.tolist()), 2.0**draft.exponent, held, total - exponent)
        )
    return tuple(blocks)


def coarsest(drafts: list[Draft]) -> int:
    """log2 of the coarsest weight scale."""
    return max((d.exponent for d in drafts if d.real.any()), default=-64)
