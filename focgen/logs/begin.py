"""What a signal was before the first sample of a log: the state that a rig begins in, told by its input."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from focgen.arrays import Array


@dataclass(frozen=True)
class Begin:
    """A signal before the first sample: ``levels`` (k,) in its unit, the first held for ever, each up to
    ``ago`` (k − 1,) s before that sample, latest last, and the last level up to it. ``known``: earlier logs
    show it, and nothing of it is estimated. ``after``: how long, s, the last sample of the latest earlier log
    was ago; where that log is simulated just ahead of this one, the signal goes on from it.

    >>> Begin((0.0, 1.5), (3.0,))  # stepped from 0 to 1.5, 3 s before the log begins
    Begin(levels=(0.0, 1.5), ago=(3.0,), known=False, after=None)
    """

    levels: tuple[float, ...] = (0.0,)
    ago: tuple[float, ...] = ()
    known: bool = False
    after: float | None = None

    @property
    def at_rest(self) -> bool:
        """Whether nothing ever happened before."""
        return self.levels == (0.0,)

    @property
    def guessed(self) -> bool:
        """Whether no log shows anything of what was before, though something was."""
        return not (self.at_rest or self.known) and self.after is None

    def samples(self, h: float) -> Array:
        """The signal every ``h`` s up to the sample before the first, from where it was constant for ever; at
        least one.

        A step between two samples is a ramp of ``h`` about its time, so that the samples move with it evenly.
        """
        return _samples(self, h)


@lru_cache(maxsize=64)
def _samples(begin: Begin, h: float) -> Array:
    """Kept, for fits simulate from the same past again and again; read only."""
    count = int(np.ceil(max(begin.ago, default=0.0) / h + 0.5))
    before = np.arange(count, 0, -1, dtype=float)
    found = np.full(count, float(begin.levels[-1]))
    for earlier, later, ago in zip(begin.levels, begin.levels[1:], begin.ago):
        found += (earlier - later) * np.clip(before - ago / h + 0.5, 0.0, 1.0)
    found.setflags(write=False)
    return found


REST = Begin()
