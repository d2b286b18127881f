"""What is done to an axis: forces there and back, as levels from −1 to 1 of the full command.

Each experiment takes back what it gave, so that the axis stays about where it began.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.arrays import Array
from focgen.trials.patterns import Experiment


def _rest(seconds: float, Ts: float) -> Array:
    return np.zeros(round(seconds / Ts))


def doublets(rng: np.random.Generator, Ts: float, sizes: Sequence[float]) -> Array:
    """A push and its opposite of each size, with a rest behind it; every other one begins the other way."""
    parts = [_rest(1.0, Ts)]
    for i, size in enumerate(rng.permutation(sizes)):
        push = np.full(round(rng.uniform(0.6, 1.4) / Ts), float(size) * (-1.0) ** i)
        parts += [push, -push, _rest(rng.uniform(1.0, 2.0), Ts)]
    return np.concatenate(parts)


def sways(rng: np.random.Generator, Ts: float, frequencies: Sequence[float], size: float) -> Array:
    """Whole cycles of sines, at least 7 s of each."""
    parts = [_rest(1.0, Ts)]
    for f in frequencies:
        t = np.arange(round(np.ceil(7.0 * f) / f / Ts)) * Ts
        parts.append(size * np.sin(2.0 * np.pi * f * t))
    return np.concatenate([*parts, _rest(2.0, Ts)])


def ramps(rng: np.random.Generator, Ts: float, tops: Sequence[float], slope: float) -> Array:
    """Slow triangles, there and back: from them one reads what force begins to move."""
    parts = [_rest(1.0, Ts)]
    for top in tops:
        rise = np.linspace(0.0, top, round(top / slope / Ts))
        one = np.concatenate([rise, rise[::-1]])
        parts += [one, -one, _rest(0.5, Ts)]
    return np.concatenate(parts)


def mixed(rng: np.random.Generator, Ts: float, seconds: float) -> Array:
    """Three sines of other than whole ratios, with rests."""
    t = np.arange(round(seconds / Ts)) * Ts
    parts = zip((0.5, 0.35, 0.25), (0.15, 0.37, 0.81), rng.uniform(0.0, 2.0 * np.pi, 3))
    wave = sum(a * np.sin(2.0 * np.pi * f * t + p) for a, f, p in parts)
    return np.concatenate([_rest(1.0, Ts), wave * (np.sin(0.35 * t) > -0.7), _rest(2.0, Ts)])


def moves(rng: np.random.Generator, Ts: float) -> list[Experiment]:
    """About 170 s."""
    first = doublets(rng, Ts, (0.15, 0.3, 0.5, 0.75, 1.0))
    return [
        Experiment("doublets", first),
        Experiment("sways", sways(rng, Ts, (0.15, 0.4, 1.0), rng.uniform(0.5, 0.7))),
        Experiment("ramps", ramps(rng, Ts, (0.2, 0.5), 0.12)),
        Experiment("mixed", mixed(rng, Ts, 25.0)),
        Experiment("small", doublets(rng, Ts, (0.08, 0.15, 0.2, 0.3))),
        Experiment("gentle", sways(rng, Ts, (0.2, 0.5), rng.uniform(0.2, 0.3))),
        Experiment("repeat", first.copy()),
    ]


def unseen_moves(rng: np.random.Generator, Ts: float) -> list[Experiment]:
    """About 50 s of another kind, kept sealed."""
    return [
        Experiment("unseen_mixed", mixed(rng, Ts, 20.0)),
        Experiment("unseen_pushes", doublets(rng, Ts, (0.25, 0.4, 0.6, 0.9))),
    ]
