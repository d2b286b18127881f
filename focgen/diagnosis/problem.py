"""One segment and one hypothesis about it: a vector of parameters, the simulation, the residual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from focgen.diagnosis.excitation import excitation
from focgen.diagnosis.own import Own
from focgen.diagnosis.segments import Segment
from focgen.rig.effects import Excitation, Form, library
from focgen.rig.engine import Chain, Placed, slot_in
from focgen.rig.model import Rig

_ZERO = 0.03  # of the level: an offset that is no fault
_ALIGNED = 0.5  # of the slack of columns: what a standard deviation is; a delay is to be called one
_OFF = 3.0  # standard deviations that an input may be off in each way


@dataclass(frozen=True)
class Clue:
    """An effect to be fitted: family, form, and the stage it is put in."""

    effect: str
    form: Form
    stage: str

    @property
    def name(self) -> str:
        """Family and form."""
        return f"{self.effect}/{self.form.name}"


@dataclass(frozen=True)
class References:
    """What multiples are taken of: a level by slot, and the clocks in s."""

    levels: dict[str, float]
    clocks: dict[str, float]

    def scale(self, parameter, slot: str) -> float:
        """The physical size of 1 in units of this parameter."""
        return (
            self.levels[parameter.at or slot] ** parameter.level
            * self.clocks[parameter.clock] ** parameter.time
        )


@dataclass(eq=False)
class Problem:
    """Residuals of a segment under the rig with ``clues``.

    The vector: the rig's own parameters, the nuisances (the alignment of input and output, at most ``slack``
    samples; where nothing of the segment has an offset of its own, one, and its gauge's error, at most
    ``gauge`` of what it reads; how far a simulated input is off in each of the ways it may be, in standard
    deviations; how far the begins of experiments are, likewise), then every clue's parameters, all of order
    one.
    """

    segment: Segment
    own: Own
    references: References
    clues: tuple[Clue, ...] = ()
    memory: dict = field(default_factory=dict)
    slack: float = 1.0
    gauge: float = 0.0

    def __post_init__(self):
        self.own_start = self.own.start()
        zero = [] if self.own.has_offset else [_ZERO]
        self.gauges = [*zero, self.gauge] if self.gauge else zero
        self.nuisances = 1 + len(self.gauges) + self.ways

    @property
    def ways(self) -> int:
        """In how many ways input and begins may be off."""
        return self.segment.unsure.shape[1] + self.segment.loose.shape[1]

    @cached_property
    def excitation(self) -> Excitation:
        """What the experiments do to the segment."""
        segment = self.segment
        return excitation(segment.parts(segment.x), segment.run.h, self.references.clocks["response"])

    def lacks(self, effect: str) -> str | None:
        """What the experiments lack to show an effect."""
        return library()[effect].needs(self.excitation)

    def untried(self, clues: Sequence[Clue]) -> list[Clue]:
        """Those of ``clues`` that may still be put to it: what is read off at sight is not fitted."""
        return [c for c in clues if c not in self.clues and not c.form.seen]

    def with_clues(self, clues: Sequence[Clue]) -> Problem:
        """The same segment under other effects. A curve is as steep at zero as before, whatever it does
        further on, so that the gain makes up for it."""
        bent = any(library()[c.effect].bends for c in clues)
        return replace(self, clues=tuple(clues), own=replace(self.own, bent=bent))

    def thinned(self, factor: int) -> Problem:
        """The same on means of ``factor`` samples at a time."""
        return replace(self, segment=self.segment.thinned(factor), memory={}, slack=self.slack / factor)

    def stretched(self, vector: np.ndarray, factor: float) -> np.ndarray:
        """``vector`` with its alignment, which is in samples, times ``factor``."""
        moved = vector.copy()
        moved[len(self.own_start)] *= factor
        return moved

    @property
    def head(self) -> int:
        """How many entries precede the clues'."""
        return len(self.own_start) + self.nuisances

    def nominal(self) -> np.ndarray:
        """The vector of the rig as given, without the clues' entries."""
        return np.r_[self.own_start, np.zeros(self.nuisances)]

    @cached_property
    def known(self) -> tuple[np.ndarray, np.ndarray]:
        """What every entry is expected to be beforehand, and how well that is known: 1/variance."""
        own, aligned = self.own.precision, (self.slack * _ALIGNED) ** -2.0
        rest = self.head - len(own) - 1 + sum(len(clue.form.parameters) for clue in self.clues)
        return np.pad(self.own_start, (0, 1 + rest)), np.r_[own, aligned, np.zeros(rest)]

    def unlikely(self, vector: np.ndarray) -> float:
        """Nats against ``vector`` for what is known beforehand."""
        expected, precision = self.known
        return 0.5 * float(precision @ (vector - expected) ** 2)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds."""
        low, high = self.own.bounds()
        nuisance = [0.0 if self._shifted else self.slack, *self.gauges, *[_OFF] * self.ways]
        low, high = [*low, *(-b for b in nuisance)], [*high, *nuisance]
        for clue in self.clues:
            for p in clue.form.parameters:
                least = self._least(p) if p.log else p.lower
                low.append(np.log(least) if p.log else least)
                high.append(np.log(max(p.upper, least)) if p.log else p.upper)
        return np.array(low, float), np.array(high, float)

    @property
    def _shifted(self) -> bool:
        """Whether a clue says how late the output is: two numbers for one thing would share it at random."""
        return any(library()[clue.effect].shifts for clue in self.clues)

    def _least(self, p) -> float:
        """The lower bound: a time constant of less than two samples is nothing that samples could show."""
        return (
            max(p.lower, 2.0 * self.segment.run.h / self.references.clocks[p.clock])
            if p.time == 1
            else p.lower
        )

    def starts(self, clue: Clue) -> list[np.ndarray]:
        """Start values of one clue's entries."""
        parameters = clue.form.parameters
        most = max(len(p.starts) for p in parameters)
        rows = [[p.starts[min(i, len(p.starts) - 1)] for p in parameters] for i in range(most)]
        return [np.array([np.log(v) if p.log else v for p, v in zip(parameters, row)]) for row in rows]

    def values(self, vector: np.ndarray) -> list[tuple[float, ...]]:
        """The clues' parameters in the log's units."""
        found, place = [], self.head
        for clue in self.clues:
            slot, row = slot_in(clue.form, clue.stage), []
            for p in clue.form.parameters:
                value = np.exp(vector[place]) if p.log else vector[place]
                row.append(float(value) * self.references.scale(p, slot))
                place += 1
            found.append(tuple(row))
        return found

    def rig(self, vector: np.ndarray) -> Rig:
        """The rig with the vector's own parameters; the same object where they are as lately: making one
        takes as long as running a stage."""
        values, kept = vector[: len(self.own_start)], self.memory.setdefault("rigs", [])
        key = values.tobytes()
        for old, given, rig in kept:
            if old == key and given is self.own.rig:
                return rig
        rig = self.own.put(self.own.rig, values)
        kept.insert(0, (key, self.own.rig, rig))
        del kept[2:]
        return rig

    def placed(self, vector: np.ndarray) -> tuple[Placed, ...]:
        """The clues as effects of a chain."""
        return tuple(Placed(c.effect, c.form, c.stage, v) for c, v in zip(self.clues, self.values(vector)))

    def simulate(self, vector: np.ndarray, probe: bool = False) -> np.ndarray:
        """The segment's output (n,), in the log's units; a ``probe`` leaves nothing to the simulations that
        follow, which go on from another vector."""
        chain = Chain(self.rig(vector), self.placed(vector), self.memory, probe)
        own, segment = len(self.own_start), self.segment
        ends = np.cumsum([len(self.gauges), segment.unsure.shape[1]])
        gauges, off, begun = np.split(vector[own + 1 : self.head], ends)
        x = self._entered(float(vector[own]), off)
        made = chain.run(x, segment.stages[0], segment.stages[-1], segment.run, segment.between)
        made = self._read(made, *gauges)
        return made + segment.loose @ begun if np.any(begun) else made

    def _read(self, made: np.ndarray, zero: float = 0.0, gauge: float = 0.0) -> np.ndarray:
        """What is read of a signal by gauges off by so much."""
        return made * (1.0 + gauge) + zero * self.segment.level_out

    def _entered(self, shift: float, off: np.ndarray) -> np.ndarray:
        """The input, ``shift`` samples out of step and ``off`` in the ways it is unsure; the same array where
        nothing changed, by which a chain remembers what it made of it."""
        x = self.segment.bent
        if shift == 0.0 and not np.any(off):
            return x
        key, kept = (shift, *off), self.memory.setdefault("entered", [])
        for old, y in kept:
            if old == key:
                return y
        y = x + abs(shift) * (self.segment.neighbours[shift < 0] - x) + self.segment.unsure @ off
        kept.insert(0, (key, y))
        del kept[2:]
        return y

    def residual(self, vector: np.ndarray) -> np.ndarray:
        """Measured less simulated (n,), in the log's units; where the rig integrates, the recent part."""
        return self.segment.recent(self.segment.y - self.simulate(vector))

    def weighed(self, vector: np.ndarray) -> np.ndarray:
        """The residual (n,) as a share of the output's level, each sample by its trust."""
        return self.residual(vector) * self.segment.weight
