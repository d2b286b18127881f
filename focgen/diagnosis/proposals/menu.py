"""Experiments worth making: what they are, and the input that makes them.

Each is a pattern of levels, −1 … 1 of the way from rest to either of the input's limits. Where the time is
short the holds are shorter, and what needs long ones is left out. A rig that integrates gets patterns that
bring it back to where it stood: pushes one way and twice as long the other way and back again, which return
the position as well as the speed, and waves that begin at their crest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from focgen.diagnosis.proposals.limits import InputLimits

_REST = 0.5  # response times at rest ahead of every experiment
_SHORTEST = 1.5  # response times: a level held for less shows no level


@dataclass(frozen=True, eq=False)
class Choice:
    """One experiment: ``what`` to do, and the ``levels`` (n,) of −1 … 1 that the input of ``limits`` goes
    through, at most ``share`` of the way to its ends; ``parts``: experiments of the menu in a row; ``sign``:
    what the input is times, to be as the rig's logs have it."""

    what: str
    levels: np.ndarray
    limits: InputLimits
    share: float = 1.0
    parts: int = 1
    sign: int = 1

    @property
    def input(self) -> np.ndarray:
        """The input (n,) in its unit, a sample every ``limits.h`` s."""
        return self.limits.of(self.levels, self.share)

    @property
    def logged(self) -> np.ndarray:
        """The input (n,) as the rig's logs have it."""
        return self.sign * self.input + 0.0  # no −0

    @property
    def seconds(self) -> float:
        """How long it takes."""
        return len(self.levels) * self.limits.h

    def then(self, other: Choice) -> Choice:
        """It with ``other`` behind it, as one input."""
        levels = np.concatenate([self.share * self.levels, other.share * other.levels])
        return Choice(f"{self.what}, then {other.what}", levels, self.limits, 1.0, self.parts + other.parts)


def menu(limits: InputLimits) -> tuple[Choice, ...]:
    """The experiments that fit into the time there is."""
    made = _returning if limits.integrates else _two_sided if limits.two_sided else _one_sided
    rest = np.zeros(max(1, int(_REST * limits.response / limits.h)))
    found = ((what, levels) for what, levels in made(limits) if levels is not None)
    return tuple(Choice(what, np.r_[rest, levels], limits) for what, levels in found)


Patterns = list[tuple[str, np.ndarray | None]]


def _one_sided(limits: InputLimits) -> Patterns:
    mixed = [0, 0.6, 0, 1.0, 0, 0.35, 0, 0.8, 0, 0.6, 0, 1.0, 0]
    stairs = np.r_[0:11, 9:-1:-1] / 10
    fast = [0.5, 0.54, 0.5, 0.46, 0.5, 0.0, 1.0, 0.0]
    return [
        ("steps in mixed order with releases, two of them repeated at the end", _levels(mixed, limits)),
        ("one hold at three quarters of the range, then as long a recovery", _hold(0.75, limits)),
        ("a slow triangle with nested smaller ones", _ramps([0, 1, 0.3, 0.7, 0.4, 1, 0, 0.5, 0], limits)),
        ("a staircase up and down in ten levels", _levels(stairs, limits)),
        ("sines about the middle, slow, medium, fast", _waves(lambda t: 0.5 - 0.4 * np.cos(t), limits)),
        ("small steps about the middle and single fast steps", _levels(np.r_[0, fast], limits)),
    ]


def _two_sided(limits: InputLimits) -> Patterns:
    mixed = [0, 0.6, 0, -1.0, 0, 0.35, -0.35, 1.0, 0, -0.6, 0.8, 0, 0.6, 0, -1.0, 0]
    stairs = np.r_[0:6, 4:-6:-1, -4:1] / 5
    fast = [0, 0.04, 0, -0.04, 0, 1.0, -1.0, 0]
    corners = [0, 1, -1, 0.5, -0.5, 0.8, -1, 0.3, 0]
    return [
        ("steps to both sides in mixed order, two of them repeated at the end", _levels(mixed, limits)),
        ("one hold at three quarters of the range, then as long a recovery", _hold(0.75, limits)),
        ("a slow triangle to both sides with nested smaller ones", _ramps(corners, limits)),
        ("a staircase up, down to the other side and back", _levels(stairs, limits)),
        ("sines about rest, slow, medium, fast", _waves(lambda t: 0.8 * np.sin(t), limits)),
        ("small steps about rest and single fast steps", _levels(fast, limits)),
    ]


def _returning(limits: InputLimits) -> Patterns:
    sizes = [0.6, -1.0, 0.35, 0.8, -0.6, 1.0]
    there = [part for size in sizes for part in (size, -size, -size, size, 0.0)]
    ramps = [part for size in sizes for part in (size, 0.0, -size, 0.0, 0.0, -size, 0.0, size, 0.0)]
    paces = (("short", 0.5), ("", 1.0), ("long", 2.5))
    what = "pushes there and back, of several sizes"
    pushes = [
        (f"{pace} {what}".strip(), _levels(np.r_[0, there], limits, each, each)) for pace, each in paces
    ]
    return [
        *pushes,
        ("slow pushes there and back that swell and fade", _ramps([0.0, *ramps], limits, 2.0, 0.5)),
        ("sines that begin at their crest, slow, medium, fast", _waves(lambda t: 0.8 * np.cos(t), limits)),
    ]


def _time(limits: InputLimits) -> float:
    """What the rest ahead leaves of the time there is, s."""
    return limits.seconds - _REST * limits.response


def _held_for(count: int, limits: InputLimits, usual: float, least: float) -> float:
    """Seconds for each of ``count`` parts: ``usual`` response times, fewer where time is short; 0 where those
    were less than ``least``."""
    each = min(usual * limits.response, _time(limits) / count)
    return each if each >= least * limits.response * (1 - 1e-9) else 0.0


def _levels(
    values: Sequence[float], limits: InputLimits, usual: float = 6.0, least: float = _SHORTEST
) -> np.ndarray | None:
    """Every level held for as long."""
    each = _held_for(len(values), limits, usual, least)
    return np.repeat(np.asarray(values, float), max(1, int(each / limits.h))) if each else None


def _hold(level: float, limits: InputLimits) -> np.ndarray | None:
    """One long hold, and as long a recovery."""
    each = min(60.0 * limits.response, 0.5 * _time(limits))
    if each < 10.0 * limits.response:
        return None
    return np.repeat([level, 0.0], max(1, int(each / limits.h)))


def _ramps(
    corners: Sequence[float], limits: InputLimits, usual: float = 12.0, least: float = 3.0
) -> np.ndarray | None:
    """From corner to corner in as long."""
    each = _held_for(len(corners) - 1, limits, usual, least)
    count = max(2, int(each / limits.h))
    parts = [np.linspace(a, b, count) for a, b in pairwise(corners)]
    return np.concatenate(parts) if each else None


def _waves(shape: Callable[[np.ndarray], np.ndarray], limits: InputLimits) -> np.ndarray | None:
    """A wave of 0.1, 0.5 and 2 cycles a response time, six cycles each or as many as there is time for."""
    parts: list[np.ndarray] = []
    left = _time(limits)
    for cycles in (2.0, 0.5, 0.1):
        period = limits.response / cycles
        count = min(6, int(left / period + 1e-9))
        if count:
            t = np.arange(int(count * period / limits.h)) * limits.h
            parts.insert(0, shape(2.0 * np.pi * t / period))
            left -= count * period
    return np.concatenate(parts) if len(parts) > 1 else None
