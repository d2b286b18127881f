"""The state in which each experiment begins, estimated where its data ask for it.

The state is told by what the input was before the first sample. Tried are, from the simplest on: a rest at
0; the first level held for ever; a step to it from rest at 0, at an unknown time; the same from an unknown
level; two steps from rest. A signal further on is tried as well with what the pasts of those ahead of it, as
told so far, make of it. A further unknown has to earn its place (Schwarz's criterion, on as many samples
as the residual's correlation leaves). And none is tried where the first samples are those of a rig at rest:
there it cannot have moved yet, whatever its parameters are, so that a past shows, and a misfit does not.
But an input that rests a little off 0 was held there, where the rig shows no step to it. At an input of 0 an
offset holds a rig off as a past does, but no larger one than what is left for good.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from focgen.arrays import Array
from focgen.logs.begin import REST, Begin
from focgen.logs.between import white_level
from focgen.logs.experiment import Experiment
from focgen.rig.carried import FIRST, carried, raised, stretched
from focgen.rig.effects import Run, library
from focgen.rig.engine import Chain, between_of
from focgen.rig.magnitudes import Magnitudes
from focgen.rig.placed import Placed
from focgen.rig.rig import UNITY, LinearActuator, Rig
from focgen.rig.stages import ENTERS, STAGES
from focgen.rig.stood import standing
from focgen.rig.tried import Try, damped_step, likeliest, nearest

NOTE = "begins away from rest: the state that it starts from is estimated"
_SEEN = 40.0  # response times from the beginning that are looked at,
_LEAST = 200  # and samples
_LONGEST = 20.0  # response times before the first sample: a step is looked for up to here
_TIMES = 10  # of a step, on the first grid
_SOONEST = 0.5  # samples before the first: a step as the log begins
_ROUNDS = 8  # of Gauss-Newton
_DAMPED, _STEP = 1e-3, 1e-3  # its damping at first, and its steps for derivatives
_FALLEN = 1e-4  # of the cost: less is no descent
_APART = 5.0  # standard errors by which the first samples have to be off from rest
_OFFSET = 4.0  # times better than any past: then a rest with an offset of any size is what there is
_NOTHING = 0.06  # of the input's largest magnitude: what counts as 0
_LITTLE = 0.01  # of it: less, held before a log, does not show
_BEYOND = 0.2  # of it: by so much earlier levels may leave the input's range
_WINDOW = 0.5  # of it: by what it may have been another in a window before, a standard deviation
_PARTS = (1.0, 0.5, 0.25)  # of the way that a rig would ask for which is linear
_TIMES_AS_FAR = (0.5, 2.0)  # a past that another signal's made may be from where the log begins
_NOWHERE = 1e3  # of a signal's largest magnitude: where a spring that gives way has nothing to hold it
_SHOWN = 0.3  # of a response time at 0: what is shorter shows no decay
_FORGOTTEN = 5.0  # response times after which the past shows no more,
_MOSTLY = 0.9  # of what is left from there on an offset may be: a signal that comes back to 0 has none


@dataclass(frozen=True)
class _Asked:
    """What a past has to show. ``off``: by what share of a signal's largest magnitude the first samples are
    off from rest; ``mended``: what part of that a past may leave at most, and ``surely``: so little that it
    rules a rest out where they are off by more than ``far``; ``offset``: shares up to there are no past;
    ``nats``: twice the evidence; ``cost``: what part of a rest's a past may leave over all of them."""

    off: float
    mended: float
    surely: float
    far: float
    offset: float
    nats: float
    cost: float = np.inf


_DRIVEN = _Asked(0.02, 0.7, 0.5, 0.15, 0.05, 0.0)
_IDLE = _Asked(0.05, 0.35, 0.0, np.inf, np.inf, 12.0)
"""At an input of 0 nothing but a past moves the rig; but a drift or an offset holds it off, too."""
_PASSING = replace(_IDLE, cost=0.05)
"""An input that is at 0 for a moment may be on its way through it, as every sine of a rig of both signs is.
No decay at rest shows the past then, so the past has to explain nearly all of what a rest leaves."""


def begun(rig: Rig, logs: Sequence[Experiment], placed: Sequence[Placed] = ()) -> tuple[Experiment, ...]:
    """The experiments, each with what every signal that enters a stage was before, where the data ask for
    it.

    ``placed``: effects in the rig. What integrates has no equilibrium to begin from: of a rig that does is
    told where it stood, and, behind a regulator that does, what the stages there came from.
    """
    if not all(map(len, logs)):
        return tuple(logs)
    if any(not np.isfinite(gain) for gain in _gains(rig)):
        behind = replace(rig, regulator=UNITY)
        if rig.integrator == "regulator" and all(map(np.isfinite, _gains(behind))):
            logs = _driven(rig, behind, logs, placed)
        return tuple(standing(rig, log, placed, NOTE) for log in logs)
    return _told(rig, logs, placed, tuple(ENTERS))


def in_windows(rig: Rig, logs: Sequence[Experiment], placed: Sequence[Placed] = ()) -> tuple[Experiment, ...]:
    """The experiments with the pasts that are estimated told in windows. What few steps leave is taken for
    the pasts' own, so that the ``rig`` has to have the numbers that suit the logs, and be with all that is
    ``placed`` in it. What wears, or lies where its last turn was, asks for the earlier logs themselves."""
    keeps = any(p.form.leaves or library()[p.effect].remembers for p in placed)
    begins = [begin for log in logs for begin in log.begins.values()]
    if not any(_is_free(begin, keeps) for begin in begins) or not all(map(np.isfinite, _gains(rig))):
        return tuple(logs)
    sizes = Magnitudes.of(rig, logs)
    return tuple(_in_windows(rig, log, placed, sizes, keeps) for log in logs)


def _is_free(begin: Begin, keeps: bool) -> bool:
    """Whether a past is estimated; where the rig ``keeps`` what was, and no earlier log tells of it."""
    return not begin.known and not (keeps and begin.after is not None)


def _in_windows(
    rig: Rig, log: Experiment, placed: Sequence[Placed], sizes: Magnitudes, keeps: bool
) -> Experiment:
    closer = {
        entry: _Setting(rig, log, entry, placed, sizes).in_windows(begin)
        for entry, begin in log.begins.items()
        if _is_free(begin, keeps) and sizes.behind(entry)
    }
    return replace(log, begins={**log.begins, **closer}) if closer else log


def _driven(
    rig: Rig, behind: Rig, logs: Sequence[Experiment], placed: Sequence[Placed]
) -> tuple[Experiment, ...]:
    """The experiments of a regulator that integrates, with what its command was, which may move it as a log
    begins, and what entered the stages ``behind`` it."""
    moved = _told(rig, logs, placed, ("command",))
    others = [p for p in placed if p.stage != "regulator"]
    came = _told(behind, logs, others, ("pressure", "curvature"))
    return tuple(replace(b, begins={**a.begins, **b.begins}) for a, b in zip(moved, came))


def _told(
    rig: Rig, logs: Sequence[Experiment], placed: Sequence[Placed], entries: Sequence[str]
) -> tuple[Experiment, ...]:
    """The experiments with what the signals were before that enter a stage, those of the ``entries`` that are
    logged."""
    scales = Magnitudes.of(rig, logs)
    logged = [role for role in entries if role in scales.sizes and scales.behind(role)]
    return tuple(_begun(rig, log, placed, logged, scales) for log in logs)


def _begun(
    rig: Rig, log: Experiment, placed: Sequence[Placed], entries: Iterable[str], scales: Magnitudes
) -> Experiment:
    if any(begin.known or begin.after is not None for begin in log.begins.values()):
        return log  # earlier logs tell
    if len(log) < 2 * FIRST or not all(np.all(np.isfinite(log[role])) for role in scales.sizes):
        return log
    found: dict[str, Begin] = {}
    for entry in entries:
        setting = _Setting(rig, log, entry, placed, scales)
        told = [setting.told_by(ahead, begin) for ahead, begin in found.items() if begin.ago]
        found[entry] = setting.chosen([t for tries in told for t in tries])
    found = {entry: begin for entry, begin in found.items() if not begin.at_rest}
    notes = tuple(note for note in log.notes if note != NOTE)
    return replace(log, begins=found, notes=(*notes, NOTE) if found else notes)


def _gains(rig: Rig) -> list[float]:
    """The stages' gains at rest."""
    actuator = [rig.actuator.dynamics.dc_gain] if isinstance(rig.actuator, LinearActuator) else []
    return [rig.regulator.dc_gain, *actuator, rig.sensor.dc_gain]


class _Setting:
    """One experiment, the rig, and what is measured behind the ``entry``."""

    def __init__(
        self, rig: Rig, log: Experiment, entry: str, placed: Sequence[Placed], scales: Magnitudes
    ) -> None:
        self.chain, self.entry, self.h = Chain(rig, tuple(placed)), entry, log.sample_time
        self.anywhere = False  # a stage that adds up may have stood anywhere, with what moves it on top
        self.pace, self.reach = scales.pace, scales.sizes[entry]
        self.range = [end / self.reach for end in scales.ranges[entry]]
        self.n = n = min(len(log), max(int(_SEEN * self.pace / self.h), _LEAST))
        self.longest = max(_LONGEST * self.pace, 20.0 * self.h)
        self.roles = scales.behind(entry)
        self.stages = ENTERS[entry], list(self.roles)[-1]
        self.log = log
        self.x, self.start = np.asarray(log[entry], float)[:n], log.start
        self.units = [scales.sizes[r] for r in self.roles.values()]
        measured = (np.asarray(log[role], float)[:n] for role in self.roles.values())
        self.y = np.stack([y / unit for y, unit in zip(measured, self.units)], axis=1)
        self.level = float(self.x[0] if entry == "command" else np.mean(self.x[:FIRST]))
        self.counts = (self.pace / (self.pace + np.arange(n) * self.h))[:, None]
        self.asked = _DRIVEN
        if abs(self.level) < _NOTHING * self.reach:
            self._near_nothing(max(_SHOWN * self.pace / self.h, 2 * FIRST))

    def _near_nothing(self, least: float) -> None:
        """What counts where the input is 0 at first: its rest there, where that is as long as ``least``."""
        still = self._still()
        self.asked = _IDLE if still >= least else _PASSING
        if still >= least:
            self.counts[still:] = 0.0

    def _still(self) -> int:
        """For how many samples the input stays what it was at first."""
        moved = np.abs(self.x - self.level) > _NOTHING * self.reach
        return int(np.argmax(moved)) if moved.any() else self.n

    def at(self, begin: Begin, free: int) -> Try:
        """What a begin leaves, ``free`` numbers of which are fitted."""
        raw = self._missed(begin)
        if self.anywhere:
            return Try(begin, free + 1, raw - self._mean(raw), self._counted(raw, np.inf))
        return Try(begin, free, raw, self._counted(raw, np.minimum(self.asked.offset, self.borne)))

    def _missed(self, begin: Begin) -> Array:
        """What is measured less what a begin makes (n, signals)."""
        run = Run.of([self.n], [self.start], self.h, [begin])
        tap: dict[str, Array] = {}
        self.chain.run(self.x, *self.stages, run, between_of(self.chain.rig, self.entry), tap)
        made = [tap[stage] / unit for stage, unit in zip(self.roles, self.units)]
        missed: Array = self.y - np.stack(made, axis=1)
        return np.nan_to_num(missed, nan=_NOWHERE, posinf=_NOWHERE, neginf=-_NOWHERE)

    @cached_property
    def borne(self) -> Array:
        """How large an offset is (signals,) at most: what a rest leaves for good, once the past is
        forgotten."""
        later = self._missed(REST)[int(_FORGOTTEN * self.pace / self.h) :]
        return np.quantile(np.abs(later), _MOSTLY, axis=0) if len(later) else np.full(len(self.units), np.inf)

    def _counted(self, raw: Array, offset: float | Array) -> Array:
        """What is left (n, signals) less an offset of so much at most, the later the less it counts."""
        made: Array = (raw - np.clip(self._mean(raw), -offset, offset)) * self.counts
        return made

    def _mean(self, raw: Array) -> Array:
        return np.average(raw, axis=0, weights=np.broadcast_to(self.counts**2, raw.shape))

    def in_windows(self, begin: Begin) -> Begin:
        """The begin with what the input was before in windows, the longer the longer they are ago, each as
        near to what it is there as the data let it be: few steps do not tell what a fractional actuator
        remembers of many. Every signal counts by what is left of it, an offset like all else, and none may
        be left with more."""
        ends = self.h * 2.0 ** np.arange(max(np.ceil(np.log2(self.longest / self.h)), 1.0) + 1.0)
        spans = list(zip([*ends, np.inf], [0.0, *ends]))
        step, off = _WINDOW * self.reach, self._missed(begin)
        trust = self.counts / np.maximum(np.sqrt(np.mean((off * self.counts) ** 2, axis=0)), 1e-300)
        rows = [self._missed(raised(begin, step, *span)) - off for span in spans]
        by, free = nearest(np.stack([(row * trust).ravel() for row in rows]), off * trust)
        tries = [Try(begin, 0, off, off * trust)]
        for part in _PARTS:
            found = begin
            for span, size in zip(spans, by):
                found = raised(found, part * step * float(size), *span)
            left = self._missed(found)
            if np.all(np.sum(left**2, axis=0) <= np.sum(off**2, axis=0)):
                tries.append(Try(found, free, left, left * trust))
        return likeliest(tries, 0.0).begin

    def told_by(self, ahead: str, begin: Begin) -> Iterator[Try]:
        """The past that the signal ``ahead`` makes of the input, where that one's is ``begin``: as it is, and
        so many times as far from where the log begins as suits best."""
        leaves = STAGES[STAGES.index(ENTERS[self.entry]) - 1]
        base = self.at(carried(self.chain, self.log, ahead, begin, leaves), 0)
        toward = self.at(stretched(base.begin, 2.0), 0).left - base.left
        times = 1.0 - float(np.sum(toward * base.left)) / max(float(np.sum(toward**2)), 1e-300)
        yield base
        yield self.at(stretched(base.begin, float(np.clip(times, *_TIMES_AS_FAR))), 1)

    def chosen(self, further: Sequence[Try] = ()) -> Begin:
        """The begin that the data ask for, of all kinds and the ``further`` ones."""
        rest, asked = self.at(REST, 0), self.asked
        noise = np.array([white_level(y) for y in self.y.T])
        moved = rest.first > np.maximum(_APART * noise / np.sqrt(FIRST), asked.off)
        if not moved.any():
            return self._kept(rest)

        def off(t: Try) -> float:
            return float(np.linalg.norm(t.first[moved]) / np.linalg.norm(rest.first[moved]))

        most = asked.cost * rest.cost
        tries = [t for t in (*further, *self.tries()) if off(t) < asked.mended and t.cost < most]
        if tries and ENTERS[self.entry] == self.chain.rig.integrator:
            return likeliest([*tries, *self._from_anywhere()], _IDLE.nats).begin  # a stroke is asked for
        if not tries:
            return REST
        sure = np.max(rest.first) > asked.far and min(map(off, tries)) < asked.surely
        if sure and self._offset_explains(rest, tries):
            return REST
        return likeliest(tries if sure else [rest, *tries], asked.nats).begin

    def _from_anywhere(self) -> list[Try]:
        """A rest, and the tries, of a stage that adds up and may have stood anywhere before what moves it."""
        of = copy(self)
        of.anywhere = True
        rest = of.at(REST, 0)
        least = self.asked.mended * np.linalg.norm(rest.first)
        return [rest, *(t for t in of.tries() if np.linalg.norm(t.first) < least)]

    def _kept(self, rest: Try) -> Begin:
        """The first level held for ever where a log begins near rest: a valve that sticks keeps a little in
        the rig. The rig has to be found where that level holds it: what is off otherwise stays so."""
        least = _APART * white_level(self.x) / np.sqrt(FIRST)
        if self.asked is not _IDLE or abs(self.level) <= max(least, _LITTLE * self.reach):
            return REST
        held = self.at(Begin((self.level,)), 0)
        if np.linalg.norm(held.first) > self.asked.mended * np.linalg.norm(rest.first):
            return REST
        return likeliest([rest, held], self.asked.nats).begin

    def _offset_explains(self, rest: Try, tries: Sequence[Try]) -> bool:
        """Whether a rest, with an offset of any size, is much better than any past without one."""
        left = self._counted(rest.raw, np.inf)
        return _OFFSET * float(np.sum(left**2)) < min(t.cost for t in tries)

    # -- candidates, from the simplest on -------------------------------------------------------------------

    def tries(self) -> list[Try]:
        """The best of each kind of begin but a rest."""
        held = self.at(Begin((self.level,)), 0)
        times = np.log(np.geomspace(_SOONEST * self.h, self.longest, _TIMES))
        stepped = [self.at(self._stepped(np.array([t])), 1) for t in times]
        one = self._descended([times[int(np.argmin([t.cost for t in stepped]))]], self._stepped)
        from_level = self._descended(self._one_start(times, stepped), self._stepped)
        two = self._descended(self._two_start(times, from_level.begin), self._twice)
        return [held, one, from_level, two]

    def _one_start(self, times: Array, stepped: Sequence[Try]) -> Array:
        """Where to begin to look for a step from a level: the time and the level that leave least.

        A step from rest does not tell the time: where the input is near 0 at first, that is nothing.
        """
        found = []
        for time, base in zip(times, stepped):
            found.append((self._asking(base, self._stepped, [time]), time))
        (_, level), time = min(found)
        return np.array([time, level])

    def _two_start(self, times: Array, one: Begin) -> Array:
        """The same of two steps from rest, the later as the log begins or where the ``one`` was found."""
        found = []
        for late in (times[0], float(np.log(one.ago[0]))):
            base = self.at(self._stepped(np.array([late])), 1)
            for early in times[times > late]:
                found.append((self._asking(base, self._twice, [late], [early]), late, early))
        (_, level), late, early = min(found)
        return np.array([late, level, early])

    def _asking(
        self,
        base: Try,
        begin: Callable[[Array], Begin],
        ahead: Sequence[float],
        behind: Sequence[float] = (),
    ) -> tuple[float, float]:
        """What a begin leaves, and at which level before, as if the answer were in proportion to that.

        ``base``: the same begin with a level of 0; ``ahead`` and ``behind``: its numbers around the level.
        """
        end = max(self.range, key=abs) or 1.0
        toward = (self.at(begin(np.array([*ahead, end, *behind])), 0).left - base.left) / end
        level = -float(np.sum(toward * base.left)) / max(float(np.sum(toward**2)), 1e-300)
        level = float(np.clip(level, self.range[0] - _BEYOND, self.range[1] + _BEYOND))
        return float(np.sum((base.left + level * toward) ** 2)), level

    def _stepped(self, x: Array) -> Begin:
        earlier = float(x[1]) * self.reach if len(x) > 1 else 0.0
        return Begin((earlier, self.level), (float(np.exp(x[0])),))

    def _twice(self, x: Array) -> Begin:
        late, early = float(np.exp(x[0])), float(np.exp(max(x[2], x[0])))
        return Begin((0.0, float(x[1]) * self.reach, self.level), (early, late))

    def _descended(self, start: Sequence[float] | Array, begin: Callable[[Array], Begin]) -> Try:
        """Gauss-Newton on log times and levels, damped where it fails."""
        low, high = self._bounds(len(start))
        x: Array = np.clip(np.array(start, float), low, high)
        now, damping = self.at(begin(x), len(x)), _DAMPED
        for _ in range(_ROUNDS):
            moved = [self.at(begin(x + _STEP * e), 0).left - now.left for e in np.eye(len(x))]
            slope = np.stack([m.ravel() for m in moved], axis=1) / _STEP
            trial_x = np.clip(x - damped_step(slope, now.left.ravel(), damping), low, high)
            trial = self.at(begin(trial_x), len(x))
            if trial.cost >= now.cost:
                damping *= 30.0
                continue
            fallen = now.cost - trial.cost
            x, now, damping = trial_x, trial, damping * 0.1
            if fallen < _FALLEN * now.cost:
                break
        return now

    def _bounds(self, count: int) -> tuple[Array, Array]:
        """Of the log time of a step, the level before, and the log time of an earlier step."""
        first, last = np.log([_SOONEST * self.h, self.longest])
        rows = [(first, last), (self.range[0] - _BEYOND, self.range[1] + _BEYOND), (first, last)]
        low, high = np.array(rows[:count]).T
        return low, high
