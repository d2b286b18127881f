"""Experiments worth making: what they are, and the command that makes them."""

from __future__ import annotations

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

    def levels(values, each):
        return np.repeat(np.asarray(values, float) * top, max(1, int(each / h)))

    def ramp(points, each):
        count = max(2, int(each / h))
        return np.concatenate([np.linspace(a, b, count) for a, b in zip(points, points[1:])]) * top

    def sine(cycles_per_response, cycles):
        t = np.arange(int(cycles * response / cycles_per_response / h)) * h
        return top * (0.5 - 0.4 * np.cos(2 * np.pi * cycles_per_response * t / response))

    mixed = levels([0, 0.6, 0, 1.0, 0, 0.35, 0, 0.8, 0, 0.6, 0, 1.0, 0], hold)
    return tuple(
        Choice(what, u, h)
        for what, u in (
            ("steps in mixed order with releases, two of them repeated at the end", mixed),
            (
                "one hold at three quarters of the range, then as long a recovery",
                levels([0, 0.75, 0], 60 * response),
            ),
            (
                "a slow triangle with nested smaller ones",
                ramp([0, 1, 0.3, 0.7, 0.4, 1, 0, 0.5, 0], 12 * response),
            ),
            (
                "a staircase up and down in ten levels",
                levels([*np.arange(0, 11), *np.arange(9, -1, -1)], hold) / 10,
            ),
            (
                "sines about the middle, slow, medium, fast",
                np.concatenate([sine(f, 6) for f in (0.1, 0.5, 2.0)]),
            ),
            (
                "small steps about the middle and single fast steps",
                levels([0.5, 0.54, 0.5, 0.46, 0.5, 0.0, 1.0, 0.0], hold),
            ),
        )
    )
