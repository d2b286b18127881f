"""One experiment: what every reader of logs delivers and everything else consumes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from focgen.arrays import Array, Ints
from focgen.errors import LogError
from focgen.logs.begin import REST, Begin

ROLES = ("command", "pressure", "curvature", "output", "reference")


@dataclass(frozen=True, eq=False, repr=False)
class Experiment:
    """Uniformly sampled signals of one experiment, by role.

    ``signals`` maps a role of :data:`ROLES` to an array of shape (n,) in the log's own units; sample k was
    taken ``k * sample_time`` seconds after ``start``. ``start`` is the session's time of sample 0 in s.
    ``raw_time`` has the logged time stamps (m,) in s before any resampling, ``rows`` the signals (m,) at
    those where they were resampled. ``notes`` says what was done to the log. ``continues``: the rig ran just
    before, in samples that are missing or cut out, so that the state in which it begins is unknown.
    ``begins``: by role, what a signal was before the first sample; others were at rest at 0. ``anew``:
    ahead of it the log's clock fell back. ``paused``: how long the rig rested before it is not known, and
    ``start`` is as if no time had passed. ``lasts``: a loop or a play lies where the experiment before left
    it, and not at 0. ``stands``: where a stage that integrates stood as it began, in its output's unit.
    ``open_loop``: no controller is to be looked for. ``readings``: by role, the rows that hold one, where a
    logger filled in the others.
    """

    name: str
    sample_time: float
    signals: Mapping[str, Array]
    start: float = 0.0
    raw_time: Array | None = None
    notes: tuple[str, ...] = ()
    rows: Mapping[str, Array] | None = None
    continues: bool = False
    begins: Mapping[str, Begin] = field(default_factory=dict)
    anew: bool = False
    paused: bool = False
    lasts: bool = False
    open_loop: bool = False
    stands: float = 0.0
    readings: Mapping[str, Ints] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "begins", MappingProxyType(dict(self.begins)))
        object.__setattr__(self, "readings", MappingProxyType(dict(self.readings)))
        object.__setattr__(self, "signals", MappingProxyType(dict(self.signals)))
        if self.rows is not None:
            object.__setattr__(self, "rows", MappingProxyType(dict(self.rows)))

    def __getstate__(self) -> dict[str, Any]:
        """For copies and other processes: views of mappings become mappings."""
        return {key: dict(x) if isinstance(x, MappingProxyType) else x for key, x in vars(self).items()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for key, value in state.items():
            object.__setattr__(self, key, value)
        self.__post_init__()

    def __repr__(self) -> str:
        told = f"{len(self)} samples every {self.sample_time:g} s: {', '.join(self.signals)}"
        return f"<Experiment {self.name!r}: {told}>"

    def __len__(self) -> int:
        return len(next(iter(self.signals.values())))

    def __contains__(self, role: str) -> bool:
        return role in self.signals

    def __getitem__(self, role: str) -> Array:
        return self.signals[role]

    def before(self, role: str) -> Begin:
        """What the signal of a role was before the first sample."""
        return self.begins.get(role, REST)

    def read(self, role: str) -> Ints | slice:
        """The rows at which the signal of a role was read: all of them where nothing was filled in."""
        return self.readings.get(role, slice(None))

    def without(self, role: str, note: str) -> Experiment:
        """The experiment as if the signal of a role had not been logged, with a note on that."""
        others = [r for r in self.signals if r != role]
        return replace(
            self,
            signals={r: self.signals[r] for r in others},
            readings={r: self.readings[r] for r in others if r in self.readings},
            begins={r: self.begins[r] for r in others if r in self.begins},
            notes=(*self.notes, note),
        )

    @property
    def time(self) -> Array:
        """Seconds since the first sample, shape (n,)."""
        return np.arange(len(self)) * self.sample_time

    def between(self, first: float | None, last: float | None) -> Experiment:
        """Return the part from ``first`` to ``last`` (s within the experiment, both included)."""
        lo = -np.inf if first is None else first - 1e-9
        hi = np.inf if last is None else last + 1e-9
        keep = (self.time >= lo) & (self.time <= hi)
        begin = int(np.argmax(keep)) if keep.any() else 0
        cut = {role: values[keep] for role, values in self.signals.items()}
        time, rows = self._rows_between(lo, hi)
        start = self.start + begin * self.sample_time
        begins, stands = (self.begins, self.stands) if begin == 0 else ({}, 0.0)
        kept = {} if len(self) > np.sum(keep) else self.readings
        found = replace(self, signals=cut, start=start, raw_time=time, rows=rows)
        return replace(found, begins=begins, stands=stands, readings=kept)

    def _rows_between(self, low: float, high: float) -> tuple[Array | None, Mapping[str, Array] | None]:
        """The raw time stamps and rows from ``low`` to ``high`` (s since the first)."""
        if self.raw_time is None:
            return None, None
        since = self.raw_time - self.raw_time[0]
        kept = (since >= low) & (since <= high)
        rows = self.rows and {role: values[kept] for role, values in self.rows.items()}
        return self.raw_time[kept], rows


def check_output(log: Experiment) -> None:
    """Raise LogError where an experiment has no output."""
    if "output" not in log:
        raise LogError(log.name, "has no output", "name its column in [signals]")
