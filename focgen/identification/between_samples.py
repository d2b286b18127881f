"""What a command does between its samples, where a fit is driven by it: as the rig says, else as the data
show. A converter holds it; a logger that reads a smooth command at times of its own does not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Generic, TypeVar

import numpy as np

from focgen.arrays import Array
from focgen.errors import FitError
from focgen.identification.quality import effective_samples
from focgen.logs.between import Between

T = TypeVar("T")

_RESTS = 0.5  # of a command's samples at which it rests: then it is no smooth curve
# another way than held has to be likelier by _SURELY to one, and to leave no more than _LESS of the mean
# square: with many samples what a model lacks of the rig makes any odds
_SURELY, _LESS = 20.0, 0.95


@dataclass(frozen=True)
class Tried(Generic[T]):
    """A ``fit`` of so many ``numbers`` to a command that runs so ``between`` its samples, ``lead`` s ahead of
    its rows, and what it leaves (n,)."""

    between: Between
    fit: T
    left: Array
    numbers: int = 0
    lead: float = 0.0

    @property
    def square(self) -> float:
        """The mean square that it leaves."""
        return max(float(np.mean(self.left**2)), 1e-300)


@dataclass(frozen=True)
class Way(Generic[T]):
    """What a command does ``between`` its samples, the ``fit`` with it, and whether that is ``shown`` by the
    data. ``rival``: the fit with another way that is nearly as likely, None where there is none. ``lead``: by
    how much it is ahead of its rows, s."""

    between: Between
    fit: T
    shown: bool
    rival: T | None = None
    lead: float = 0.0

    @property
    def known(self) -> Between | None:
        """What it does, None where that does not show."""
        return self.between if self.shown else None


def likeliest_way(
    ways: Sequence[Between],
    tried: Callable[[Between], Tried[T]],
    rests: bool,
    early: Callable[[T], Tried[T]] | None = None,
) -> Way[T]:
    """The likeliest of the ``ways`` that a command may run between its samples, by a fit ``tried`` with each,
    and by one with an ``early`` command, which is told the usual one.

    The first of the ways is the usual one: another has to leave far less than it would by chance. Where a
    command ``rests`` between jumps, the usual one is as good as known. Raises FitError where that cannot be
    fitted.
    """
    usual, others = tried(ways[0]), [found for way in ways[1:] if (found := _if_fitted(partial(tried, way)))]
    first = _if_fitted(partial(early, usual.fit)) if early else None
    if first and is_far_likelier(first, usual) and all(_is_likelier(first, other) for other in others):
        return Way(first.between, first.fit, shown=True, lead=first.lead)
    closest = min(others, key=lambda other: other.square, default=None)
    if closest is None:
        return Way(usual.between, usual.fit, shown=len(ways) == 1)
    if is_far_likelier(closest, usual):
        return Way(closest.between, closest.fit, shown=True)
    shown = is_far_likelier(usual, closest)
    return Way(usual.between, usual.fit, shown, None if rests or shown else closest.fit)


def _if_fitted(tried: Callable[[], Tried[T]]) -> Tried[T] | None:
    try:
        return tried()
    except FitError:
        return None


def ways_of(given: Between | None, commands: Sequence[Array]) -> tuple[Between, ...]:
    """What commands (n,) may do between their samples, the usual first: the one that the rig has ``given``,
    or held, in straight lines, and smooth where they do not rest."""
    if given is not None:
        return (given,)
    if not any(map(np.ptp, commands)):
        return (Between.HELD,)
    return (Between.HELD, Between.STRAIGHT, Between.SMOOTH)[: 2 if at_rest(commands) else 3]


def at_rest(commands: Sequence[Array]) -> bool:
    """Whether commands (n,) rest but for jumps."""
    return bool(np.mean(np.concatenate([np.diff(x) == 0.0 for x in commands])) > _RESTS)


def _is_likelier(one: Tried[T], other: Tried[T]) -> bool:
    """Whether a fit is better than another one by Schwarz's criterion."""
    independent = effective_samples(one.left)
    more = (one.numbers - other.numbers) * np.log(independent)
    return bool(independent * np.log(other.square / one.square) > more)


def is_far_likelier(one: Tried[T], other: Tried[T]) -> bool:
    """Whether neither chance, by Schwarz's criterion, nor what a model lacks makes a fit so much better than
    another one."""
    independent = effective_samples(one.left)
    gain = 0.5 * independent * np.log(other.square / one.square)
    beyond_chance = gain - 0.5 * (one.numbers - other.numbers) * np.log(independent) > np.log(_SURELY)
    return bool(beyond_chance and one.square < _LESS * other.square)
