"""Experiments worth making: what they are, and the input that makes them.

Each is a pattern of levels, −1 … 1 of the way from rest to either end of the input's reach. Where the time is
short the holds are shorter, and what needs long ones is left out. A rig that integrates gets patterns that
bring it back to where it stood: pushes one way and twice as long the other way and back again, which return
the position as well as the speed, and waves that begin at their crest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from focgen.diagnosis.proposals.reach import Reach

_REST = 0.5  # response times at rest ahead of every experiment
_SHORTEST = 1.5  # response times: a level held for less shows no level


@dataclass(frozen=True, eq=False)
class Choice:
    """One experiment: ``what`` to do, and the ``levels`` (n,) of −1 … 1 that the input of ``reach`` goes
    through, at most ``share`` of the way to its ends."""

    what: str
    levels: np.ndarray
    reach: Reach
    share: float = 1.0

    @property
    def input(self) -> np.ndarray:
        """The input (n,) in its unit, a sample every ``reach.h`` s."""
        return self.reach.of(self.levels, self.share)

    @property
    def seconds(self) -> float:
        """How long it takes."""
        return len(self.levels) * self.reach.h


def menu(reach: Reach) -> tuple[Choice, ...]:
    """The experiments that fit into the reach's time."""
    made = _returning if reach.integrates else _two_sided if reach.two_sided else _one_sided
    rest = np.zeros(max(1, int(_REST * reach.response / reach.h)))
    found = ((what, levels) for what, levels in made(reach) if levels is not None)
    return tuple(Choice(what, np.r_[rest, levels], reach) for what, levels in found)


Patterns = list[tuple[str, np.ndarray | None]]


def _one_sided(reach: Reach) -> Patterns:
    mixed = [0, 0.6, 0, 1.0, 0, 0.35, 0, 0.8, 0, 0.6, 0, 1.0, 0]
    stairs = np.r_[0:11, 9:-1:-1] / 10
    fast = [0.5, 0.54, 0.5, 0.46, 0.5, 0.0, 1.0, 0.0]
    return [
        ("steps in mixed order with releases, two of them repeated at the end", _levels(mixed, reach)),
        ("one hold at three quarters of the range, then as long a recovery", _hold(0.75, reach)),
        ("a slow triangle with nested smaller ones", _ramps([0, 1, 0.3, 0.7, 0.4, 1, 0, 0.5, 0], reach)),
        ("a staircase up and down in ten levels", _levels(stairs, reach)),
        ("sines about the middle, slow, medium, fast", _waves(lambda t: 0.5 - 0.4 * np.cos(t), reach)),
        ("small steps about the middle and single fast steps", _levels(np.r_[0, fast], reach)),
    ]


def _two_sided(reach: Reach) -> Patterns:
    mixed = [0, 0.6, 0, -1.0, 0, 0.35, -0.35, 1.0, 0, -0.6, 0.8, 0, 0.6, 0, -1.0, 0]
    stairs = np.r_[0:6, 4:-6:-1, -4:1] / 5
    fast = [0, 0.04, 0, -0.04, 0, 1.0, -1.0, 0]
    corners = [0, 1, -1, 0.5, -0.5, 0.8, -1, 0.3, 0]
    return [
        ("steps to both sides in mixed order, two of them repeated at the end", _levels(mixed, reach)),
        ("one hold at three quarters of the range, then as long a recovery", _hold(0.75, reach)),
        ("a slow triangle to both sides with nested smaller ones", _ramps(corners, reach)),
        ("a staircase up, down to the other side and back", _levels(stairs, reach)),
        ("sines about rest, slow, medium, fast", _waves(lambda t: 0.8 * np.sin(t), reach)),
        ("small steps about rest and single fast steps", _levels(fast, reach)),
    ]


def _returning(reach: Reach) -> Patterns:
    sizes = [0.6, -1.0, 0.35, 0.8, -0.6, 1.0]
    there = [part for size in sizes for part in (size, -size, -size, size, 0.0)]
    ramps = [part for size in sizes for part in (size, 0.0, -size, 0.0, 0.0, -size, 0.0, size, 0.0)]
    paces = (("short", 0.5), ("", 1.0), ("long", 2.5))
    what = "pushes there and back, of several sizes"
    pushes = [(f"{pace} {what}".strip(), _levels(np.r_[0, there], reach, each, each)) for pace, each in paces]
    return [
        *pushes,
        ("slow pushes there and back that swell and fade", _ramps([0.0, *ramps], reach, 2.0, 0.5)),
        ("sines that begin at their crest, slow, medium, fast", _waves(lambda t: 0.8 * np.cos(t), reach)),
    ]


def _time(reach: Reach) -> float:
    """What the rest ahead leaves of the reach's time, s."""
    return reach.seconds - _REST * reach.response


def _held_for(count: int, reach: Reach, usual: float, least: float) -> float:
    """Seconds for each of ``count`` parts: ``usual`` response times, fewer where time is short; 0 where those
    were less than ``least``."""
    each = min(usual * reach.response, _time(reach) / count)
    return each if each >= least * reach.response * (1 - 1e-9) else 0.0


def _levels(
    values: Sequence[float], reach: Reach, usual: float = 6.0, least: float = _SHORTEST
) -> np.ndarray | None:
    """Every level held for as long."""
    each = _held_for(len(values), reach, usual, least)
    return np.repeat(np.asarray(values, float), max(1, int(each / reach.h))) if each else None


def _hold(level: float, reach: Reach) -> np.ndarray | None:
    """One long hold, and as long a recovery."""
    each = min(60.0 * reach.response, 0.5 * _time(reach))
    if each < 10.0 * reach.response:
        return None
    return np.repeat([level, 0.0], max(1, int(each / reach.h)))


def _ramps(
    corners: Sequence[float], reach: Reach, usual: float = 12.0, least: float = 3.0
) -> np.ndarray | None:
    """From corner to corner in as long."""
    each = _held_for(len(corners) - 1, reach, usual, least)
    count = max(2, int(each / reach.h))
    parts = [np.linspace(a, b, count) for a, b in pairwise(corners)]
    return np.concatenate(parts) if each else None


def _waves(shape: Callable[[np.ndarray], np.ndarray], reach: Reach) -> np.ndarray | None:
    """A wave of 0.1, 0.5 and 2 cycles a response time, six cycles each or as many as there is time for."""
    parts: list[np.ndarray] = []
    left = _time(reach)
    for cycles in (2.0, 0.5, 0.1):
        period = reach.response / cycles
        count = min(6, int(left / period + 1e-9))
        if count:
            t = np.arange(int(count * period / reach.h)) * reach.h
            parts.insert(0, shape(2.0 * np.pi * t / period))
            left -= count * period
    return np.concatenate(parts) if len(parts) > 1 else None
