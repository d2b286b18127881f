"""A command that was sent ahead of its row, as the rig says of its logs.

Such a command's jumps lie within samples, and the reading of its own row answers to it already. It is run
with a dead time of the first stage that takes time, which a simulation has at any part of a sample. What
leaves the chain is taken whole samples sooner.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np

from focgen.arrays import Ints
from focgen.rig.corners import transfer_of
from focgen.rig.effects import Run
from focgen.rig.rig import UNITY, Rig
from focgen.rig.stages import STAGES

FARTHEST = 4  # samples that a command may be ahead of its row: more is another row's
_ROUNDING = 1e-9  # samples


def in_step(rig: Rig, first: str, last: str, h: float) -> tuple[Rig, int, dict[str, int]]:
    """The rig of a command that is not ahead, from stage ``first`` to ``last``, and how many samples of ``h``
    s sooner what leaves it comes; by stage, how many of these are too many for what answers at once: its own
    row's command, or one that was ahead by a sample or more."""
    stages = STAGES[STAGES.index(first) : STAGES.index(last) + 1]
    stage = next((stage for stage in stages if takes_time(rig, stage)), None)
    if stage is None:
        return replace(rig, lead=0.0), 0, {}
    late = getattr(rig.delays, stage) - rig.lead
    count = max(math.ceil(-late / h - _ROUNDING), 0)
    delays = replace(rig.delays, **{stage: max(late + count * h, 0.0)})
    whole = math.floor(rig.lead / h + _ROUNDING)
    at_once = dict.fromkeys(stages[: stages.index(stage)], count - whole)
    return replace(rig, lead=0.0, delays=delays), count, at_once


def takes_time(rig: Rig, stage: str) -> bool:
    """Whether a stage is there, and more than 1."""
    return transfer_of(rig, stage) not in (None, UNITY)


def told_lead(lead: float) -> float:
    """A lead, s, with as many digits as a log can show."""
    return float(f"{lead:.3g}")


@dataclass(frozen=True, eq=False)
class Longer:
    """A run whose experiments go on for some samples: the ``rows`` (m,) of the other that its input is, and
    where (n,) what is ``kept`` of what it makes is."""

    run: Run
    rows: Ints
    kept: Ints


_LONGER: WeakKeyDictionary[Run, dict[int, Longer]] = WeakKeyDictionary()


def longer(run: Run, count: int) -> Longer:
    """The run going on for ``count`` samples, of which as many of the first are left out; made once, for fits
    simulate it again and again."""
    made = _LONGER.setdefault(run, {})
    if count not in made:
        made[count] = _made_longer(run, count)
    return made[count]


def _made_longer(run: Run, count: int) -> Longer:
    spans, place = run.spans, np.arange(count)
    rows = np.concatenate([np.r_[np.arange(a, b), np.full(count, b - 1)] for a, b in spans])
    more = np.concatenate([np.r_[np.zeros(b - a, int), place + 1] for a, b in spans])
    ahead = np.repeat(count * np.arange(len(spans)), [b - a for a, b in spans])
    rest = np.where(more > 0, 0, run.rest[rows]).astype(np.uint8)
    there = np.append(np.arange(len(run.rest)) + ahead, len(rows))
    guessed = tuple((int(there[first]), int(there[last - 1]) + 1) for first, last in run.guessed)
    clock = run.clock[rows] + run.h * (more - count)  # what is made there is read as many rows later
    long = replace(run, rest=rest, clock=clock, guessed=guessed)
    long = replace(long, duration=run.duration + count * run.h)
    return Longer(long, rows, there[:-1] + count)
