"""What is done to the rig: the experiments of a suite, as levels from 0 to 1 of the full command.

An excitation is an array of levels at the sample instants; every one begins at rest, at level 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from focgen.arrays import Array


@dataclass(frozen=True, eq=False)
class Experiment:
    """``levels`` (n,) at the sample instants, 0 … 1 of the full command."""

    name: str
    levels: Array


def _hold(level: float, seconds: float, Ts: float) -> Array:
    return np.full(round(seconds / Ts), level)


def _joined(*parts: Array, Ts: float) -> Array:
    return np.concatenate([_hold(0.0, 1.0, Ts), *parts])


def steps(rng: np.random.Generator, Ts: float, count: int, hold: float, release: float) -> Array:
    """Steps to shuffled levels, each released to zero."""
    levels = np.linspace(0.25, 1.0, count) + rng.uniform(-0.04, 0.0, count)
    rng.shuffle(levels)
    parts = [p for level in levels for p in (_hold(level, hold, Ts), _hold(0.0, release, Ts))]
    return _joined(*parts, Ts=Ts)


def rising_step(level: float, Ts: float, hold: float) -> Array:
    """One step up; the record ends before its release."""
    return _joined(_hold(level, hold, Ts), Ts=Ts)


def sines(
    rng: np.random.Generator, Ts: float, frequencies: Sequence[float], cycles: float, least: float
) -> Array:
    """Sines about a raised mean, at least ``least`` s each, the mean approached over 3 s."""
    mean, swing = rng.uniform(0.45, 0.55), rng.uniform(0.3, 0.42)
    parts = [np.linspace(0.0, mean, round(3.0 / Ts))]
    for f in frequencies:
        seconds = round(max(least, cycles / f) * f) / f
        t = np.arange(round(seconds / Ts)) * Ts
        parts.append(mean + swing * np.sin(2.0 * np.pi * f * t))
    return _joined(*parts, _hold(0.0, 5.0, Ts), Ts=Ts)


def staircase(rng: np.random.Generator, Ts: float, count: int, hold: float) -> Array:
    """Levels up and down again, unevenly spaced, the low ones included."""
    up = np.cumsum(rng.uniform(0.6, 1.4, count))
    up *= rng.uniform(0.95, 1.0) / up[-1]
    levels = [*up, *up[-2::-1], 0.0]
    return _joined(*(_hold(level, hold, Ts) for level in levels), Ts=Ts)


def multisine(rng: np.random.Generator, Ts: float, seconds: float, repeats: int) -> Array:
    """A random-phase odd multisine up to 2 Hz, repeated exactly."""
    n = round(seconds / Ts)
    t, lines = (
        np.arange(n) * Ts,
        np.unique(np.round(np.geomspace(1, 2.0 * seconds, 24) / 2).astype(int) * 2 + 1),
    )
    wave = sum(np.sin(2.0 * np.pi * k * t / seconds + rng.uniform(0, 2 * np.pi)) / k**0.35 for k in lines)
    wave = 0.5 + rng.uniform(0.3, 0.42) * wave / np.abs(wave).max()
    return _joined(
        np.linspace(0.0, wave[0], round(2.0 / Ts)), np.tile(wave, repeats), _hold(0.0, 3.0, Ts), Ts=Ts
    )


def long_hold(rng: np.random.Generator, Ts: float, hold: float, recovery: float) -> Array:
    """One level held long, then a long recovery."""
    return _joined(_hold(rng.uniform(0.65, 0.9), hold, Ts), _hold(0.0, recovery, Ts), Ts=Ts)


def minor_loops(rng: np.random.Generator, Ts: float, speed: float) -> Array:
    """A slow triangle with smaller loops inside; ``speed`` in levels per s."""
    low, high = rng.uniform(0.3, 0.4), rng.uniform(0.65, 0.75)
    corners = [0.0, high, low, 0.95, low + 0.1, high, 0.0]
    parts = [np.linspace(a, b, round(abs(b - a) / speed / Ts), endpoint=False) for a, b in pairwise(corners)]
    return _joined(*parts, _hold(0.0, 4.0, Ts), Ts=Ts)


def full(rng: np.random.Generator, Ts: float) -> list[Experiment]:
    """About 600 s."""
    first = steps(rng, Ts, 6, rng.uniform(9.0, 11.0), rng.uniform(7.0, 9.0))
    return [
        Experiment("steps", first),
        Experiment("sines", sines(rng, Ts, (0.05, 0.1, 0.2, 0.4), 1.5, 20.0)),
        Experiment("staircase", staircase(rng, Ts, 6, rng.uniform(6.5, 8.0))),
        Experiment("multisine", multisine(rng, Ts, 30.0, 2)),
        Experiment("hold", long_hold(rng, Ts, 100.0, 25.0)),
        Experiment("loops", minor_loops(rng, Ts, 0.045)),
        Experiment("repeat", first[: round(30.0 / Ts)].copy()),
    ]


def short(rng: np.random.Generator, Ts: float) -> list[Experiment]:
    """About 270 s: steps and releases, sines, one staircase."""
    first = steps(rng, Ts, 5, 9.0, 8.0)
    return [
        Experiment("steps", first),
        Experiment("sines", sines(rng, Ts, (0.05, 0.15, 0.4), 1.5, 20.0)),
        Experiment("staircase", staircase(rng, Ts, 4, 7.0)),
        Experiment("repeat", first[: round(20.0 / Ts)].copy()),
    ]


def rising(rng: np.random.Generator, Ts: float) -> list[Experiment]:
    """Rising positive steps only, each from rest: what the paper identifies its model from."""
    levels = np.linspace(0.35, 1.0, 6)
    return [Experiment(f"step{i + 1}", rising_step(level, Ts, 12.0)) for i, level in enumerate(levels)]


def unseen(rng: np.random.Generator, Ts: float) -> list[Experiment]:
    """About 100 s of another kind, kept sealed: random levels, and a sine about another mean."""
    levels = rng.uniform(0.1, 1.0, 7)
    jumps = _joined(
        *(_hold(level, rng.uniform(5.0, 9.0), Ts) for level in levels), _hold(0.0, 6.0, Ts), Ts=Ts
    )
    t = np.arange(round(40.0 / Ts)) * Ts
    f, mean = rng.uniform(0.12, 0.18), rng.uniform(0.35, 0.6)
    wave = mean + 0.32 * np.sin(2.0 * np.pi * f * t)
    return [
        Experiment("unseen_jumps", jumps),
        Experiment(
            "unseen_sine", _joined(np.linspace(0, mean, round(2 / Ts)), wave, _hold(0, 4.0, Ts), Ts=Ts)
        ),
    ]


def references(rng: np.random.Generator, Ts: float) -> list[Experiment]:
    """About 270 s of set points for a closed loop: steps, a staircase, a sine."""
    levels = rng.uniform(0.15, 0.85, 8)
    t = np.arange(round(60.0 / Ts)) * Ts
    mean = rng.uniform(0.4, 0.5)
    wave = mean + 0.3 * np.sin(2.0 * np.pi * 0.1 * t)
    return [
        Experiment(
            "setpoints", _joined(*(_hold(level, 10.0, Ts) for level in levels), _hold(0, 8.0, Ts), Ts=Ts)
        ),
        Experiment("climb", staircase(rng, Ts, 5, 9.0)),
        Experiment("sway", _joined(np.linspace(0, mean, round(4 / Ts)), wave, _hold(0, 5.0, Ts), Ts=Ts)),
    ]


def engine(rng: np.random.Generator, Ts: float) -> list[Experiment]:
    """About 290 s for rigs that respond within half a second."""
    first = steps(rng, Ts, 5, 6.0, 5.0)
    return [
        Experiment("steps", first),
        Experiment("sines", sines(rng, Ts, (0.08, 0.3, 0.9), 1.5, 12.0)),
        Experiment("staircase", staircase(rng, Ts, 5, 4.5)),
        Experiment("hold", long_hold(rng, Ts, 55.0, 18.0)),
        Experiment("loops", minor_loops(rng, Ts, 0.08)),
        Experiment("repeat", first[: round(20.0 / Ts)].copy()),
    ]


SUITES = {
    "full": full,
    "short": short,
    "closed": references,
    "engine": engine,
    "off": full,
    "begun": full,
    "sound": full,
    "plants": engine,
    "loops": references,
}
STREAMS = {"closed": 0, "full": 1, "short": 2, "engine": 3, "plants": 4, "loops": 5}
STREAMS |= dict.fromkeys(("off", "begun", "sound"), 1)
"""Of every suite its number in the seeds of its cases. Those of one number have the same cases, disturbed or
not (``disturbed``)."""
