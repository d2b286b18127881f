"""One segment and one hypothesis about it: a vector of parameters, the simulation, the residual."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from focgen.diagnosis.problem.candidates import CandidateEffect, References
from focgen.diagnosis.problem.excitation import excitation
from focgen.diagnosis.problem.free import gain_freedom
from focgen.diagnosis.problem.held import may_have_held, tells_what_is_held
from focgen.diagnosis.problem.nominal_parameters import NominalParameters
from focgen.diagnosis.problem.segments import Segment
from focgen.logs.between import Between
from focgen.rig.ahead import FARTHEST
from focgen.rig.begun import with_stands
from focgen.rig.effects import Excitation, Parameter, Run, library
from focgen.rig.engine import Chain
from focgen.rig.placed import Placed, slot_in
from focgen.rig.rig import Rig

Made = TypeVar("Made")

ZERO = 0.03  # of the level: what a zero is off by that nothing shows alone
_ALIGNED = 0.5  # of the slack of columns: what a standard deviation is; a delay is to be called one
_OFF = 3.0  # standard deviations that an input may be off in each way
_BEGUN = 10.0  # the same of begins, whose ways are of many windows
_FAR_OFF = 20.0  # the same of a zero that no effect moves
_QUICKEST = 4.0  # means of samples in a response at least
_STANDS = 0.1  # of the level: what a volume is off by that is told through an actuator
_BASELINE = 0.005  # of the level: what the zero of a reading differs by from one experiment to the next


@dataclass(eq=False)
class Problem:
    """Residuals of a segment under the rig with ``candidates``.

    The vector: the rig's nominal parameters, the nuisances (the alignment of input and output, the output
    late by at most ``slack`` samples, or early by at most ``lead``; where nothing of the segment has an
    offset of its own, one, and its gauge's error, at most ``gauge`` of what it reads; how far a simulated
    input is off in each of the ways it may be, in standard deviations; how far the begins of experiments are,
    likewise; where readings are ``uneven``, the zero of each experiment's, likewise; where what a pump held
    is told through an actuator, how far each experiment's is off, likewise), then every candidate effect's
    parameters, all of order one.
    ``weight``: of what is known of nominal parameters beforehand, against the data. ``zero_within``: the ends
    of the zero of the segment's readings, of the level.
    """

    segment: Segment
    nominals: NominalParameters
    references: References
    candidates: tuple[CandidateEffect, ...] = ()
    memory: dict[Any, Any] = field(default_factory=dict)
    slack: float = 1.0
    lead: float = 1.0
    gauge: float = 0.0
    uneven: bool = False
    weight: float = 1.0
    zero_within: tuple[float, float] = (-ZERO, ZERO)

    def __post_init__(self) -> None:
        self.nominal_start = self.nominals.start()
        zero = [] if self.nominals.has_offset else [ZERO]
        self.gauges = [*zero, self.gauge] if self.gauge else zero
        self.nuisances = 1 + len(self.gauges) + self.ways + self.zeros + self.stood

    @property
    def ways(self) -> int:
        """In how many ways input and begins may be off."""
        made: int = self.segment.input_modes.shape[1] + self.segment.loose.shape[1]
        return made

    @property
    def zeros(self) -> int:
        """How many experiments have a zero of their own."""
        return len(self.segment.run.spans) if self.uneven else 0

    @property
    def stood(self) -> int:
        """How many experiments began with what a pump held, told through an actuator: what that makes of it
        is known no better than the rig."""
        told, run = tells_what_is_held(self.nominals.rig, self.segment.stages), self.segment.run
        return len(run.spans) if told and any(may_have_held(run)) else 0

    @cached_property
    def excitation(self) -> Excitation:
        """What the experiments do to the segment."""
        segment = self.segment
        return excitation(segment.parts(segment.x), segment.run.h, self.references.clocks["response"])

    def lacks(self, effect: str) -> str | None:
        """What the experiments lack to show an effect."""
        return library()[effect].needs(self.excitation)

    @property
    def families(self) -> tuple[str, ...]:
        """Those of the candidate effects, each once, in their order."""
        return tuple(dict.fromkeys(c.effect for c in self.candidates))

    def untried(self, candidates: Sequence[CandidateEffect]) -> list[CandidateEffect]:
        """Those of ``candidates`` that may still be put to it: what is read off at sight is not fitted."""
        return [c for c in candidates if c not in self.candidates and not c.form.seen]

    def with_candidates(self, candidates: Sequence[CandidateEffect]) -> Problem:
        """The same segment under other effects, and a gain as free as they make it."""
        gain = gain_freedom([c.family for c in candidates if c.family])
        return replace(self, candidates=tuple(candidates), nominals=replace(self.nominals, gain=gain))

    @property
    def at_every_row(self) -> Problem:
        """The same at the rows that a logger filled in, too."""
        whole = self.segment.whole
        return replace(self, segment=replace(whole, pace=self.segment.pace), memory={}) if whole else self

    @property
    def coarsest(self) -> int:
        """Means of so many samples at most still show the response, and every experiment; of seldom readings
        there are none."""
        if self.segment.whole:
            return 1
        shortest = min(last - first for first, last in self.segment.run.spans)
        seen = int(self.references.clocks["response"] / self.segment.run.h / _QUICKEST)
        return max(1, min(shortest // 20, seen))

    def thinned(self, factor: int) -> Problem:
        """The same on means of ``factor`` samples at a time."""
        slack, lead = self.slack / factor, self.lead / factor
        return replace(self, segment=self.segment.thinned(factor), memory={}, slack=slack, lead=lead)

    def stretched(self, vector: np.ndarray, factor: float) -> np.ndarray:
        """``vector`` with its alignment, which is in samples, times ``factor``."""
        moved = vector.copy()
        moved[len(self.nominal_start)] *= factor
        return moved

    @property
    def head(self) -> int:
        """How many entries precede the candidate effects'."""
        return len(self.nominal_start) + self.nuisances

    def nominal(self) -> np.ndarray:
        """The vector of the rig as given, without the candidate effects' entries."""
        made: np.ndarray = np.r_[self.nominal_start, np.zeros(self.nuisances)]
        return made

    @cached_property
    def known(self) -> tuple[np.ndarray, np.ndarray]:
        """What every entry is expected to be beforehand, and how well that is known: 1/variance."""
        own, aligned = self.weight * self.nominals.precision, (self.slack * _ALIGNED) ** -2.0
        each, effects = self.zeros + self.stood, sum(len(c.form.parameters) for c in self.candidates)
        free = self.nuisances - 1 - each
        precision = np.r_[own, aligned, np.zeros(free), np.ones(each), np.zeros(effects)]
        return np.pad(self.nominal_start, (0, len(precision) - len(own))), precision

    def unlikely(self, vector: np.ndarray) -> float:
        """Nats against ``vector`` for what is known beforehand."""
        expected, precision = self.known
        return 0.5 * float(precision @ (vector - expected) ** 2)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds."""
        ends, (modes, loose) = self.nominals.bounds(), (self.segment.input_modes, self.segment.loose)
        ways = [_OFF] * modes.shape[1] + [_BEGUN] * loose.shape[1]
        zeros = [*[self._drift] * self.zeros, *[_OFF] * self.stood]
        lead, late = (0.0, 0.0) if self._shifted else self._reach
        others = [*self.gauges, *ways, *zeros]
        low: list[float] = [*ends[0], -lead, *(-b for b in others)]
        high: list[float] = [*ends[1], late, *others]
        for candidate in self.candidates:
            for p in candidate.form.parameters:
                least = self._least(p) if p.log else p.lower
                low.append(np.log(least) if p.log else least)
                high.append(np.log(max(p.upper, least)) if p.log else p.upper)
        if not self.nominals.has_offset:
            place = len(self.nominal_start) + 1
            low[place], high[place] = self.zero_within
        return np.array(low, float), np.array(high, float)

    @property
    def _reach(self) -> tuple[float, float]:
        """By how many samples the output may be earlier and later than the rig says: as early as a file may
        say, and as late as a rig that says nothing."""
        said = self.nominals.rig.lead / self.segment.fed.run.h if self.is_staircase else 0.0
        return min(self.lead, max(FARTHEST - said, 0.0)), self.slack + max(said, 0.0)

    @property
    def _drift(self) -> float:
        """How far a zero may be off, in standard deviations: of what the sensor reads, an effect stands for
        more; of another gauge, none does."""
        return _OFF if "sensor" in self.segment.stages else _FAR_OFF

    @property
    def _shifted(self) -> bool:
        """Whether a candidate effect says how late the output is: two numbers for one thing would share it at
        random.
        """
        return any(c.family and c.family.delays for c in self.candidates)

    def _least(self, p: Parameter) -> float:
        """The lower bound: a time constant of less than two samples is nothing that samples could show."""
        return (
            max(p.lower, 2.0 * self.segment.run.h / self.references.clocks[p.clock])
            if p.time == 1
            else p.lower
        )

    def starts(self, candidate: CandidateEffect) -> list[np.ndarray]:
        """Start values of one candidate effect's entries."""
        parameters = candidate.form.parameters
        most = max(len(p.starts) for p in parameters)
        rows = [[p.starts[min(i, len(p.starts) - 1)] for p in parameters] for i in range(most)]
        return [np.array([np.log(v) if p.log else v for p, v in zip(parameters, row)]) for row in rows]

    def shares(self, vector: np.ndarray) -> list[np.ndarray]:
        """The entries of a vector that each candidate effect has."""
        ends = np.cumsum([self.head, *(len(c.form.parameters) for c in self.candidates)])
        return [vector[a:b] for a, b in pairwise(ends)]

    def values(self, vector: np.ndarray) -> list[tuple[float, ...]]:
        """The candidate effects' parameters in the log's units."""
        found, place = [], self.head
        for candidate in self.candidates:
            slot, row = slot_in(candidate.form, candidate.stage), []
            for p in candidate.form.parameters:
                value = np.exp(vector[place]) if p.log else vector[place]
                row.append(float(value) * self.references.scale(p, slot))
                place += 1
            found.append(tuple(row))
        return found

    def rig(self, vector: np.ndarray) -> Rig:
        """The rig with the vector's nominal parameters; the same object where they are as lately: making one
        takes as long as running a stage."""
        values, given = vector[: len(self.nominal_start)], self.nominals.rig
        return self._lately("rigs", values.tobytes(), given, partial(self.nominals.put, given, values))

    @property
    def is_staircase(self) -> bool:
        """Whether a part of a sample shows that columns are out of step by: the input jumps and rests."""
        return self.lead > self.slack and self.segment.fed.between == Between.HELD

    def rig_of_logs(self, vector: np.ndarray) -> Rig:
        """The rig, with its command as far ahead of its rows as the vector says."""
        rig = self.rig(vector)
        shift = float(vector[len(self.nominal_start)]) if self.is_staircase else 0.0
        return replace(rig, lead=rig.lead - shift * self.segment.fed.run.h) if shift else rig

    def placed(self, vector: np.ndarray) -> tuple[Placed, ...]:
        """The candidate effects as effects of a chain."""
        return tuple(
            Placed(c.effect, c.form, c.stage, v) for c, v in zip(self.candidates, self.values(vector))
        )

    def simulate(self, vector: np.ndarray, probe: bool = False, late: float = 0.0) -> np.ndarray:
        """The segment's output (n,), in the log's units; a ``probe`` leaves nothing to the simulations that
        follow, which go on from another vector. ``late``: s by which a held command comes later. A plant
        that runs away with these numbers leaves no finite ones, which no fit takes: no fault to warn of."""
        own, segment = len(self.nominal_start), self.segment
        shift = float(vector[own])
        rig = self.rig_of_logs(vector)
        rig = replace(rig, lead=rig.lead - late) if late else rig
        chain = Chain(rig, self.placed(vector), self.memory, probe)
        gauges, off, begun, zeros, stood = self._parted(vector[own + 1 : self.head])
        run = self._begun(stood, probe)
        x = self._entered(shift, off, probe)
        with np.errstate(over="ignore", invalid="ignore"):
            made = chain.run(x, segment.stages[0], segment.stages[-1], run, segment.between)
        made = self._read(made if segment.readings is None else made[segment.readings], *gauges)
        made = made + self._kept("loose", begun, segment.loose.__matmul__, probe) if begun.any() else made
        return made + self._kept("zeros", zeros, self._uneven, probe) if zeros.any() else made

    def _kept(
        self, what: str, numbers: np.ndarray, of: Callable[[np.ndarray], np.ndarray], probe: bool
    ) -> np.ndarray:
        """What these ``numbers`` make, as it was where they are as lately: most others move without them."""
        return self._lately(what, numbers.tobytes(), None, partial(of, numbers), probe)

    def _lately(
        self, what: str, key: Hashable, of: object, make: Callable[[], Made], probe: bool = False
    ) -> Made:
        """What was made of the same ``key`` and the same object lately, or is now."""
        kept: list[tuple[Hashable, object, Made]] = self.memory.setdefault(what, [])
        for old, whose, made in kept:
            if whose is of and old == key:
                return made
        made = make()
        if not probe:
            kept.insert(0, (key, of, made))
            del kept[2:]
        return made

    def _parted(self, nuisances: np.ndarray) -> tuple[np.ndarray, ...]:
        """The nuisances behind the alignment: of gauges, of the input's ways, of begins, of zeros, and of
        what a pump held."""
        return tuple(nuisances[first:last] for first, last in self._parts)

    @cached_property
    def _parts(self) -> tuple[tuple[int, int], ...]:
        """First and last of each part."""
        ways = self.segment.input_modes.shape[1]
        ends = np.cumsum([0, len(self.gauges), ways, self.ways - ways, self.zeros, self.stood])
        return tuple(pairwise(ends.tolist()))

    def _begun(self, stood: np.ndarray, probe: bool) -> Run:
        """The run, with what a pump held as each experiment began off by so many standard deviations; the
        same object where that is as lately, by which its pasts are told once."""
        run = self.segment.fed.run
        if not stood.any():
            return run
        begun = partial(with_stands, run, self._held(stood))
        return self._lately("begun", stood.tobytes(), run, begun, probe)

    def zero(self, vector: np.ndarray) -> float:
        """What the output reads where nothing moves, in the log's unit; 0 where the rig has an offset."""
        gauges = vector[len(self.nominal_start) + 1 :]
        return 0.0 if self.nominals.has_offset else float(gauges[0]) * self.segment.level_out

    def held(self, vector: np.ndarray) -> tuple[float, ...]:
        """What a pump held as each experiment began; none where that is known."""
        return self._held(vector[self.head - self.stood : self.head]) if self.stood else ()

    def _held(self, stood: np.ndarray) -> tuple[float, ...]:
        off, run = _STANDS * self.nominals.level_in * stood, self.segment.run
        stands = run.stands or (0.0,) * len(run.spans)
        return tuple(float(s + o) if free else s for s, o, free in zip(stands, off, may_have_held(run)))

    def begun(self, vector: np.ndarray) -> np.ndarray:
        """How far each of the segment's ``loose`` ways (k,) is there."""
        end = self.head - self.zeros - self.stood
        return vector[end - self.segment.loose.shape[1] : end]

    def _uneven(self, zeros: np.ndarray) -> np.ndarray:
        """What the readings (n,) are off by where the zeros of experiments are."""
        lengths = [last - first for first, last in self.segment.run.spans]
        return np.repeat(zeros * _BASELINE * self.segment.level_out, lengths)

    def level(self, vector: np.ndarray, explained: bool = True) -> np.ndarray:
        """``vector`` with the zeros of all experiments alike, and at none where the rig has no offset and all
        is ``explained``: else the zero stands for part of what is not."""
        alike = vector.copy()
        if explained and not self.nominals.has_offset:
            alike[len(self.nominal_start) + 1] = 0.0
        alike[self.head - self.zeros - self.stood : self.head - self.stood] = 0.0
        return alike

    def _read(self, made: np.ndarray, zero: float = 0.0, gauge: float = 0.0) -> np.ndarray:
        """What is read of a signal by gauges off by so much; the same array where they are not."""
        made = made * (1.0 + gauge) if gauge else made
        return made + zero * self.segment.level_out if zero else made

    def _entered(self, shift: float, off: np.ndarray, probe: bool) -> np.ndarray:
        """The input, ``shift`` samples out of step and ``off`` in the ways it is unsure; the same array where
        nothing changed, by which a chain remembers what it made of it."""
        shift = 0.0 if self.is_staircase else shift  # the rig makes it
        key = (shift, *off.tolist())
        if not any(key):
            return self.segment.fed.bent
        make, near = partial(self._moved, shift, off), self.memory.get("entered")
        if probe and near:
            make = partial(self._beside, near[0], key)
        return self._lately("entered", key, None, make, probe)

    def _moved(self, shift: float, off: np.ndarray) -> np.ndarray:
        fed = self.segment.fed
        x = fed.bent
        x = x + abs(shift) * fed.moves[shift < 0] if shift else x
        return x + fed.input_modes @ off if off.any() else x

    def _beside(self, near: tuple[tuple[float, ...], None, np.ndarray], key: tuple[float, ...]) -> np.ndarray:
        """The same from what it is ``near``, where but one number is another: a way alone is quicker than
        all."""
        (old, _, made), others = near, [i for i, v in enumerate(key) if v != near[0][i]]
        if len(others) > 1 or (0 in others and old[0] * key[0] <= 0.0):
            return self._moved(key[0], np.array(key[1:]))
        for i in others:
            way = self.segment.fed.input_modes[:, i - 1] if i else self.segment.fed.moves[key[0] < 0]
            made = made + (abs(key[i]) - abs(old[i]) if i == 0 else key[i] - old[i]) * way
        return made

    def residual(self, vector: np.ndarray) -> np.ndarray:
        """Measured less simulated (n,), in the log's units; where the rig integrates, the recent part."""
        return self.segment.recent(self.segment.y - self.simulate(vector))

    def weighed(self, vector: np.ndarray) -> np.ndarray:
        """The residual (n,) as a share of the output's level, each sample by its trust."""
        made: np.ndarray = self.residual(vector) * self.segment.weight
        return made
