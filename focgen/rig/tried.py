"""A try of what an input was before an experiment, and which of several the data ask for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from focgen.arrays import Array
from focgen.logs.begin import Begin
from focgen.rig.carried import FIRST

_ROUNDS = 3  # of telling noise from what is not yet made up for


@dataclass(frozen=True, eq=False)
class Try:
    """A begin with so many ``free`` numbers, and what it leaves (n, signals) of the signals, in shares of
    their largest magnitude: ``raw``, and ``left`` less an offset, the later the less it counts."""

    begin: Begin
    free: int
    raw: Array
    left: Array

    @property
    def cost(self) -> float:
        """The sum of the squares that are left."""
        return float(np.sum(self.left**2))

    @property
    def first(self) -> Array:
        """How far the first samples are off (signals,)."""
        made: Array = np.abs(self.raw[:FIRST].mean(axis=0))
        return made


def likeliest(tries: Sequence[Try], nats: float) -> Try:
    """The try of highest evidence (Schwarz's criterion); any but a rest needs so many ``nats`` more."""
    count = _effective(min(tries, key=lambda t: t.cost).left)

    def criterion(t: Try) -> float:
        asked = t.free * np.log(count) + (not t.begin.at_rest) * nats
        return float(count * np.log(max(t.cost, 1e-300)) + asked)

    return min(tries, key=criterion)


def nearest(rows: Array, left: Array) -> tuple[Array, int]:
    """How much of each of the ``rows`` (k, n) makes what is ``left`` (n in all) likeliest, where a standard
    deviation of each is 1, and how many free numbers that is worth."""
    sides, sizes, ways = np.linalg.svd(rows, full_matrices=False)
    share, rest = -ways @ left.ravel(), float(np.sum(left**2))
    count = _effective(left)
    for _ in range(_ROUNDS):
        kept = sizes**2 / (sizes**2 + max(rest, 1e-300) / count)
        rest = float(np.sum(left**2) - np.sum((1.0 - (1.0 - kept) ** 2) * share**2))
    made: Array = sides @ (kept * share / np.maximum(sizes, 1e-300))
    return made, round(float(np.sum(kept)))


def damped_step(slope: Array, left: Array, damping: float) -> Array:
    """Gauss and Newton's step by the ``slope`` (n, k) of what is ``left`` (n,), damped, 1 at most."""
    normal = slope.T @ slope
    weight = damping * np.diag(normal) + 1e-9 * np.trace(normal) + 1e-300
    made: Array = np.clip(np.linalg.solve(normal + np.diag(weight), slope.T @ left), -1.0, 1.0)
    return made


def _effective(left: Array) -> float:
    """How many samples a residual (n, signals) is worth, by its correlation from one to the next."""
    count = 0.0
    for part in left.T:
        part = part - part.mean()
        size = float(part @ part)
        rho = float(part[1:] @ part[:-1]) / size if size else 0.0
        count += len(part) * (1.0 - rho) / (1.0 + rho)
    return max(count, 2.0)
