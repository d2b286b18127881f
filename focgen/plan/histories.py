"""Histories as the reference runs them, sample by sample: the recursion's sum, and modes."""

from __future__ import annotations

from typing import Any

import numpy as np

from focgen.arrays import Kind, Numbers
from focgen.plan.formats import shift
from focgen.plan.plan import Bank, Sum


class Recursion:
    """S of the past of v, shape (lanes, lags), oldest first."""

    def __init__(self, table: Sum, kind: Kind) -> None:
        self.kind, self.table = kind, table
        self.weights: Numbers = np.array(table.weights[::-1], dtype=kind)
        self.last = table.last
        self.blocks = [(table.last - b.last, table.last - b.first + 1, b.align) for b in table.blocks]

    def __call__(self, past: Numbers) -> Numbers:
        """S in counts of the total, shape (lanes,)."""
        products = past * self.weights
        if self.kind is not np.int64:
            made: Numbers = np.add.accumulate(products, axis=1)[:, -1] + self.kind(0)
        else:
            made = sum(shift(products[:, a:b].sum(axis=1), align) for a, b, align in self.blocks)
        return made


class Latest:
    """The two latest values of a history, shape (lanes,)."""

    def __init__(self, lanes: int, kind: Kind) -> None:
        self.last, self.before = np.zeros(lanes, kind), np.zeros(lanes, kind)

    def settle(self, lane: int, constant: Any) -> None:
        """As if the history of a lane had been ``constant`` for ever."""
        self.last[lane] = self.before[lane] = constant

    def push(self, values: Numbers) -> None:
        """Take in the latest values (lanes,)."""
        self.before, self.last = self.last, values.copy()


class BankRun:
    """One bank, sample by sample; ``mean`` L and ``rest`` r have the shape (lanes, modes)."""

    def __init__(self, bank: Bank, kind: Kind, lanes: int) -> None:
        self.bank, self.kind = bank, kind
        self.rates, self.weights = np.array(bank.rates, kind), np.array(bank.weights, kind)
        self.mean: Numbers = np.zeros((lanes, bank.modes), kind)
        self.rest: Numbers = np.zeros((lanes, bank.modes), kind)

    def settle(self, lane: int, constant: Any) -> None:
        """As if the history had been ``constant`` for ever."""
        still = constant if self.bank.differences == 1 else self.kind(0)
        self.mean[lane] = still if self.kind is not np.int64 else still << self.bank.up
        self.rest[lane] = 0

    def step(self, past: Latest) -> Numbers:
        """M of this sample, in counts of the total; then the means take in what is past."""
        u = past.last if self.bank.differences == 1 else past.last - past.before
        return self._whole(u[:, None]) if self.kind is np.int64 else self._floating(u[:, None])

    def _whole(self, u: Numbers) -> Numbers:
        bank = self.bank
        drive = shift((u << bank.up) - self.mean, bank.to_drive)
        self.mean = self.mean + shift(self.rates * drive, bank.rate_shift)
        made: Numbers = shift((self.weights * drive).sum(axis=1), bank.align)
        return made

    def _floating(self, u: Numbers) -> Numbers:
        drive = u - self.mean
        if self.bank.compensated:
            drive = drive - self.rest
            step = self.rest + self.rates * drive
            mean = self.mean + step
            self.rest = step - (mean - self.mean)
            self.mean = mean
        else:
            self.mean = self.mean + self.rates * drive
        made: Numbers = np.add.accumulate(self.weights * drive, axis=1)[:, -1] + self.kind(0)
        return made
