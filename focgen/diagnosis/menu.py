"""Experiments worth making: what they are, and the command that makes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Choice:
    """One experiment: ``what`` to do, and the command (n,) in its unit, sampled every ``h`` s."""

    what: str
    command: np.ndarray
    h: float

    @property
    def seconds(self) -> float:
        """How long it takes."""
        return len(self.command) * self.h


def menu(top: float, response: float, h: float) -> tuple[Choice, ...]:
    """The experiments, for a command from 0 to ``top`` and a rig that responds in ``response`` s."""
    h = max(h, response / 200)
    hold = 6 * response
    mixed = [0, 0.6, 0, 1.0, 0, 0.35, 0, 0.8, 0, 0.6, 0, 1.0, 0]
    stairs = np.r_[0:11, 9:-1:-1] / 10
    fast = [0.5, 0.54, 0.5, 0.46, 0.5, 0.0, 1.0, 0.0]
    waves = [_sine(cycles / response, 6, h) for cycles in (0.1, 0.5, 2.0)]
    return tuple(
        Choice(what, top * u, h)
        for what, u in (
            ("steps in mixed order with releases, two of them repeated at the end", _levels(mixed, hold, h)),
            (
                "one hold at three quarters of the range, then as long a recovery",
                _levels([0, 0.75, 0], 60 * response, h),
            ),
            (
                "a slow triangle with nested smaller ones",
                _ramps([0, 1, 0.3, 0.7, 0.4, 1, 0, 0.5, 0], 12 * response, h),
            ),
            ("a staircase up and down in ten levels", _levels(stairs, hold, h)),
            ("sines about the middle, slow, medium, fast", np.concatenate(waves)),
            ("small steps about the middle and single fast steps", _levels(fast, hold, h)),
        )
    )


def _levels(values: Sequence[float], each: float, h: float) -> np.ndarray:
    """Every level held for ``each`` s."""
    return np.repeat(np.asarray(values, float), max(1, int(each / h)))


def _ramps(corners: Sequence[float], each: float, h: float) -> np.ndarray:
    """From corner to corner in ``each`` s."""
    count = max(2, int(each / h))
    return np.concatenate([np.linspace(a, b, count) for a, b in zip(corners, corners[1:])])


def _sine(frequency: float, cycles: int, h: float) -> np.ndarray:
    """``cycles`` of ``frequency`` in Hz, between a tenth and nine tenths."""
    t = np.arange(int(cycles / frequency / h)) * h
    return 0.5 - 0.4 * np.cos(2 * np.pi * frequency * t)
