"""What a command does between its samples, where a fit is driven by it: as the rig says, else as the data
show. A converter holds it; a logger that reads a smooth command at times of its own does not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from focgen.arrays import Array
from focgen.identification.quality import effective_samples
from focgen.logs.between import Between

T = TypeVar("T")

_RESTS = 0.5  # of a command's samples at which it rests: then it is no smooth curve
_SURELY = 20.0  # to one: another way than held has to be likelier by that


@dataclass(frozen=True)
class Way(Generic[T]):
    """What a command does ``between`` its samples, the ``fit`` with it, and whether that is ``sure``: known,
    or far likelier than anything else."""

    between: Between
    fit: T
    sure: bool


def likeliest_way(
    ways: Sequence[Between], made: Callable[[Between], T], left: Callable[[T], Array]
) -> Way[T]:
    """The likeliest of the ``ways`` that a command may run between its samples, with the fit ``made`` of it.

    ``left``: the residual of a fit (n,), as many numbers fitted whatever the way. The first of the ways is
    the usual one: another has to leave far less than it would by chance.
    """
    usual, *others = [(way, made(way)) for way in ways]
    if not others:
        return Way(*usual, sure=True)
    closest = min(others, key=lambda pair: _square(left(pair[1])))
    if _far_less(left(closest[1]), left(usual[1])):
        return Way(*closest, sure=True)
    return Way(*usual, sure=_far_less(left(usual[1]), left(closest[1])))


def ways_of(given: Between | None, commands: Sequence[Array]) -> tuple[Between, ...]:
    """What commands (n,) may do between their samples, the usual first: the one that the rig has ``given``,
    or held, in straight lines, and smooth where they do not rest."""
    if given is not None:
        return (given,)
    changes = np.concatenate([np.diff(x) for x in commands])
    if not np.any(changes):
        return (Between.HELD,)
    rests = np.mean(changes == 0.0) > _RESTS
    return (Between.HELD, Between.STRAIGHT) if rests else (Between.HELD, Between.STRAIGHT, Between.SMOOTH)


def _far_less(one: Array, other: Array) -> bool:
    """Whether a residual is smaller than another one by more than chance makes it."""
    fell = np.log(max(_square(other), 1e-300) / max(_square(one), 1e-300))
    return bool(0.5 * effective_samples(one) * fell > np.log(_SURELY))


def _square(residual: Array) -> float:
    return float(np.mean(residual**2))
