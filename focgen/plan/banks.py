"""Modes as integers, and as floating numbers: the banks of an exponential memory.

u is the history's value (m = 1) or its latest difference (m = 2). L = u·2^up lies within the range of u,
widened by what rounding can add to it for ever: D·2^to_drive is within half of it of u·2^up − L, and the
shift of a·D, if there is one, adds half a count of L a sample, which the rate takes away again.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from focgen.arrays import Array
from focgen.fractional.elementary import exact_sum
from focgen.plan.blocks import SPARE, finest_exponent
from focgen.plan.formats import RUNTIME, Interval, Word, integer, limit, weighted
from focgen.plan.memory import Speed, by_speed
from focgen.plan.mode_sums import Modes
from focgen.plan.plan import Bank, Format, Sum


@dataclass(frozen=True)
class BankDraft:
    """A bank before its sum is aligned: real weights as multiples of 2^``exponent``, D in counts of
    2^``guard`` of the history's.
    """

    order: float
    speed: Speed
    rates: tuple[int, ...]
    real: Array
    exponent: int
    guard: int
    state: Interval
    drive: Interval
    word: Word

    @property
    def counts(self) -> tuple[int, ...]:
        """The weights."""
        return tuple(np.rint(self.real * 2.0**-self.exponent).astype(np.int64).tolist())

    @property
    def modes(self) -> Modes:
        """As they are quantised."""
        rates = np.array(self.rates) * 2.0 ** -(self.speed.to_drive + self.speed.rate_shift)
        return Modes(self.order, rates, np.array(self.counts) * 2.0**self.exponent)

    def finished(self, sample: int, total: int) -> Bank:
        """Align at a total of 2^``total``; ``sample`` is log2 of the history's lsb."""
        unit = sample + self.guard
        exponent = max(self.exponent, total - unit - (self.word.sum_bits - SPARE))
        counts = tuple(np.rint(self.real * 2.0**-exponent).astype(np.int64).tolist())
        reach = weighted(counts, self.drive)
        speed, up = self.speed, self.speed.to_drive - self.guard
        return Bank(
            order=self.order,
            rates=self.rates,
            weights=counts,
            rate=_format(speed.rate_bits, -(speed.to_drive + speed.rate_shift), _span(self.rates)),
            lsb=2.0**exponent,
            state=_format(speed.state_bits, sample - up, self.state),
            drive=_format(self.word.bits, unit, self.drive),
            sum=_format(self.word.sum_bits, unit + exponent, reach),
            up=up,
            to_drive=speed.to_drive,
            rate_shift=speed.rate_shift,
            align=total - (unit + exponent),
        )


def _format(bits: int, exponent: int, reach: Interval) -> Format:
    return Format(integer(bits), 2.0**exponent, reach.low, reach.high)


def _span(counts: Iterable[int]) -> Interval:
    return Interval(min(counts), max(counts))


def driven_by(each: Interval, differences: int) -> Interval:
    """The range of u for a history whose counts lie in ``each`` (0 included: the rest before the first
    sample)."""
    each = each.hull(0)
    return each if differences == 1 else each - each


def mean_of(u: Interval, up: int, to_drive: int, rate_shift: int, slowest: float) -> Interval:
    """The range of L; ``slowest`` is the smallest rate. See the module's description."""
    spare = (1 << (to_drive - 1)) + (math.ceil(0.5 / slowest) if rate_shift else 0)
    return Interval((u.low << up) - spare, (u.high << up) + spare)


def departure(u: Interval, mean: Interval, up: int) -> Interval:
    """The range of u·2^up − L: both lie within the range of L."""
    return Interval(-1, 1) * Interval(0, max((u.high << up) - mean.low, mean.high - (u.low << up)))


def bank_drafts(modes: tuple[Modes, ...], each: Interval, word: Word, where: str) -> list[BankDraft]:
    """One draft for each fractional term and speed; ``each`` is the range of the history's counts. Raises
    PlanError, naming ``where``, where no format covers the weights."""
    return [
        _draft(Modes(m.order, m.rates[place], m.weights[place]), speed, each, word, where)
        for m in modes
        for speed, place in by_speed(RUNTIME[word.bits], m.rates)
    ]


def _draft(modes: Modes, speed: Speed, each: Interval, word: Word, where: str) -> BankDraft:
    u, guard = driven_by(each, modes.differences), 0
    while True:
        up = speed.to_drive - guard
        mean = mean_of(u, up, speed.to_drive, speed.rate_shift, float(modes.rates.min()))
        far = departure(u, mean, up)
        drive = far.shifted(speed.to_drive)
        if drive.worst <= word.limit and far.worst + (1 << (speed.to_drive - 1)) <= limit(speed.state_bits):
            break
        guard += 1
    counts = tuple(int(c) for c in speed.nearest(modes.rates))
    exponent = finest_exponent(modes.weights, drive.worst, word, where)
    return BankDraft(modes.order, speed, counts, modes.weights, exponent, guard, mean, drive, word)


def drive_error(made: Sum) -> float:
    """What the rounding of every D can add to a sum, in counts of its total, in any one sample.

    D is off by its own rounding and by the mean of those before, at most a count in all; and by what the
    shift of a·D adds to L.
    """
    return exact_sum([_each_error(bank) for bank in made.banks]) / made.total.lsb


def _each_error(bank: Bank) -> float:
    """In units of the history."""
    late = 0.5 * bank.state.lsb if bank.rate_shift else 0.0
    return exact_sum([abs(c) * (bank.drive.lsb + late / q) for c, q in zip(bank.values, bank.real_rates)])


# ------------------------------------------------------------------------------------------------ floating


def floating_banks(modes: tuple[Modes, ...], kind: type[np.floating[Any]], real: Format) -> tuple[Bank, ...]:
    """The banks of one history in float or double."""
    arithmetic, found = "f32" if kind is np.float32 else "f64", []
    for m in modes:
        for speed, place in by_speed(arithmetic, m.rates):
            rates, weights = (tuple(kind(x[place]).astype(float).tolist()) for x in (m.rates, m.weights))
            bank = Bank(m.order, rates, weights, real, 1.0, real, real, real, compensated=speed.compensated)
            found.append(bank)
    return tuple(found)
