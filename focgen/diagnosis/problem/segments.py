"""Cutting the chain at the signals that were logged: each segment is diagnosed on its own measured input."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from focgen.arrays import Ints
from focgen.diagnosis.numbers import NUMBERS
from focgen.logs.between import Between, white_level
from focgen.logs.experiment import Experiment
from focgen.logs.feedback import answers_reading, unlogged_reference
from focgen.logs.repeats import dead_band
from focgen.rig import kernels
from focgen.rig.effects import Run
from focgen.rig.rig import UNITY, Rig
from focgen.rig.session import entering, joined, run_of
from focgen.rig.stages import ENTERS, LEAVES, STAGES

_TIMING = 0.3  # of a sample: what loggers leave open
_FOLLOWED = 0.3  # correlation of an output with the reference that leads it
_EITHER = 0.1  # of the larger side at least: then a signal goes both ways
_ORDER = ("command", "pressure", "curvature", "output")


@dataclass(frozen=True, eq=False)
class Segment:
    """The stages between two logged signals: input ``x`` and output ``y`` (n,), experiments one after the
    other as in ``run``. ``between``: what the input does from one sample to the next. ``names`` of the
    experiments. ``trust`` (n,), 0 … 1: what a sample counts, less where a sample time a little off makes a
    difference beyond the noise. ``asked`` (n,), of order one: what was asked of the rig, which its noise has
    no part in: the reference in a closed loop, logged or not, else the input; ``led``: whether it was;
    ``closed``: whether a loop was closed around the rig; ``wanted`` (n,): its reference where it was, else
    the input, empty where none was. ``input_modes`` (n, k): ways in which an input that was simulated may be
    off, a standard deviation each. ``loose`` (n, k): what the output would be off by, were experiments to
    begin a little otherwise than ``run`` says, in the output's unit; the last of it, where a stage is
    ``paced`` otherwise at other levels, what that makes. ``pace``: s after which an error no
    longer counts, of a rig that integrates; 0: none is forgotten. ``whole``: where a logger filled rows in,
    the segment at every row, at which its input comes; the one itself has the ``readings`` (n,) of it alone.
    ``band``: by how much the output has to change to be logged, in its unit, 0 where all of it is.
    ``passed``: by role, logged signals (n,) that the output may take up at once, of order one. ``answers``:
    whether the input is a command that a controller made of the readings.
    """

    entry: str
    exit: str
    stages: tuple[str, ...]
    x: np.ndarray
    y: np.ndarray
    run: Run
    between: Between | bool
    names: tuple[str, ...]
    trust: np.ndarray
    asked: np.ndarray
    led: bool
    closed: bool
    input_modes: np.ndarray
    loose: np.ndarray
    pace: float = 0.0
    paced: bool = False
    wanted: np.ndarray = field(default_factory=lambda: np.zeros(0))
    whole: Segment | None = None
    readings: Ints | None = None
    band: float = 0.0
    passed: Mapping[str, np.ndarray] = field(default_factory=dict)
    answers: bool = False

    @property
    def fed(self) -> Segment:
        """The segment at every row at which its input comes."""
        return self.whole or self

    def anew(self, **changes: Any) -> Segment:
        """The same with ``changes`` of what it is at every row."""
        if self.whole is None or self.readings is None:
            return replace(self, **changes)
        whole = replace(self.whole, **changes)
        read = whole.read_at(self.readings)
        return replace(self, whole=whole, **{name: getattr(read, name) for name in changes})

    def read_at(self, rows: Ints) -> Segment:
        """The same whose output was read at these ``rows`` alone, the first of each experiment among them."""
        run = self.run
        h = run.h * len(run.rest) / len(run.rest[rows])
        seldom = replace(run, h=h, rest=run.rest[rows], clock=run.clock[rows])
        x, y, trust, asked, modes, loose = (
            v[rows] for v in (self.x, self.y, self.trust, self.asked, self.input_modes, self.loose)
        )
        read = replace(self, x=x, y=y, trust=trust, asked=asked, input_modes=modes, loose=loose, run=seldom)
        wanted = self.wanted[rows] if len(self.wanted) else self.wanted
        passed = {role: values[rows] for role, values in self.passed.items()}
        return replace(read, wanted=wanted, passed=passed, whole=self, readings=rows)

    @cached_property
    def level_in(self) -> float:
        """The largest magnitude of the input, in its unit."""
        return float(np.max(np.abs(self.x))) or 1.0

    @cached_property
    def both_ways(self) -> bool:
        """Whether the input goes well to either side of 0."""
        return bool(np.ptp(self.x) > (1.0 + _EITHER) * self.level_in)

    @cached_property
    def level_out(self) -> float:
        """The largest magnitude of the output, in its unit."""
        return float(np.max(np.abs(self.y))) or 1.0

    @property
    def withheld(self) -> float:
        """Root mean square, as a share of the output's level, of what a dead band may have kept back."""
        return NUMBERS.uneven * self.band / self.level_out

    @cached_property
    def weight(self) -> np.ndarray:
        """What residuals (n,) are multiplied by: the trust, by the output's level."""
        return self.trust / self.level_out

    @cached_property
    def moves(self) -> tuple[np.ndarray, np.ndarray]:
        """What the input (n,) was more a sample earlier, and is more a sample later."""
        before, after = _neighbours(self.bent, self.run.rest)
        return before - self.bent, after - self.bent

    @cached_property
    def bent(self) -> np.ndarray:
        """The input (n,), where it was measured with its bends sharpened: straight lines between samples of
        a smooth signal pass below its crests, by (2πfh)²/12 of them, which the second difference mends."""
        if self.entry == "command" or self.between != Between.STRAIGHT:
            return self.x
        before, after = _neighbours(self.x, self.run.rest)
        made: np.ndarray = self.x - (before - 2 * self.x + after) / 12.0
        return made

    def thinned(self, factor: int) -> Segment:
        """The same in means of ``factor`` samples at a time, for a rough run; what does not fill the last of
        an experiment is left out. One that was read at some rows only stays as it is."""
        if factor == 1 or self.whole:
            return self.anew(run=replace(self.fed.run, rough=True))
        counts = [(last - first) // factor for first, last in self.run.spans]
        kept = np.concatenate(
            [first + np.arange(n * factor) for (first, _), n in zip(self.run.spans, counts)]
        )
        x, y, trust, asked, clock, input_modes, loose = (
            v[kept].reshape(sum(counts), factor, *v.shape[1:]).mean(axis=1)
            for v in (self.x, self.y, self.trust, self.asked, self.run.clock, self.input_modes, self.loose)
        )
        rest = np.zeros(len(x), np.uint8)
        rest[np.cumsum([0, *counts[:-1]])] = 1
        run = replace(self.run, h=self.run.h * factor, rest=rest, clock=clock, rough=True)
        thin = replace(self, x=x, y=y, trust=trust, asked=asked, run=run, between=False)
        return replace(thin, input_modes=input_modes, loose=loose, passed={})

    def recent(self, signal: np.ndarray) -> np.ndarray:
        """``signal`` (n,), less what it was a ``pace`` ago."""
        if not self.pace:
            return signal
        return signal - kernels.lag(signal, self.run.rest, self.run.h, self.pace, self.pace)

    def seen_at(self, seen: np.ndarray) -> Segment:
        """The same, of which the samples ``seen`` (n,) alone are to be trusted."""
        return replace(self, trust=self.trust * seen)

    @cached_property
    def recent_share(self) -> float:
        """The part of white noise's mean square that is in its recent part."""
        impulse = np.zeros(len(self.run.rest))
        impulse[0] = 1.0
        return float(np.sum(self.recent(impulse) ** 2))

    def parts(self, signal: np.ndarray) -> list[np.ndarray]:
        """``signal`` (n, …) by experiment."""
        return [signal[first:last] for first, last in self.run.spans]


def _neighbours(x: np.ndarray, rest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The sample before and the one after of every sample (n,), experiments apart."""
    ends = np.r_[rest[1:], 1]
    return np.where(rest, x, np.roll(x, 1)), np.where(ends, x, np.roll(x, -1))


def stages_of(rig: Rig) -> tuple[str, ...]:
    """The stages that the rig file gives; the others are 1."""
    given = {
        "regulator": rig.regulator != UNITY,
        "actuator": rig.actuator is not None,
        "sensor": rig.sensor != UNITY,
    }
    return tuple(stage for stage, there in given.items() if there or getattr(rig.delays, stage))


def cuts(logs: Sequence[Experiment]) -> tuple[str, ...]:
    """The roles logged in every experiment, in the order of the chain."""
    return tuple(role for role in _ORDER if all(role in log for log in logs))


def between(entry: str, exit: str) -> tuple[str, ...]:
    """The stages between two signals."""
    last = next(stage for stage in STAGES if LEAVES[stage] == exit)
    return STAGES[STAGES.index(ENTERS[entry]) : STAGES.index(last) + 1]


def make(
    logs: Sequence[Experiment],
    entry: str,
    exit: str,
    x: np.ndarray | None = None,
    input_modes: np.ndarray | None = None,
) -> Segment:
    """The segment from ``entry`` to ``exit``, with the input as logged or as given; of the ways
    ``input_modes`` in which that may be off, those that the output can show.
    """
    x, y = entering(logs, entry) if x is None else x, joined(logs, exit)
    input_modes = np.zeros((len(x), 0)) if input_modes is None else input_modes
    names = tuple(log.name for log in logs)
    led = [exit == "output" and _is_led(log) for log in logs]
    hidden = _as_input([_hidden(log) if exit == "output" else None for log in logs], entry, x)
    closed = [_is_closed(log) for log in logs]
    looped = any(closed) or any(made is not None for made in hidden)
    trust = np.concatenate([_trust(np.asarray(log[exit], float), _unsteadiness(log)) for log in logs])
    whole = Segment(
        entry,
        exit,
        between(entry, exit),
        x,
        y,
        run_of(logs, entry),
        Between.HELD if entry == "command" else Between.STRAIGHT,
        names,
        trust,
        _asked(logs, x, led, hidden),
        any(led),
        looped,
        input_modes[:, _felt(input_modes, x, y)],
        np.zeros((len(x), 0)),
        wanted=_asked(logs, x, closed, hidden) if looped else np.zeros(0),
        band=dead_band(y),
        passed=_passed(logs, entry),
        answers=entry == "command" and any(map(answers_reading, logs)),
    )
    rows = _readings(logs, exit)
    return whole if rows is None else whole.read_at(rows)


def _passed(logs: Sequence[Experiment], entry: str) -> dict[str, np.ndarray]:
    """By role the logged signals (n,) up to the input, of order one."""
    roles = [r for r in _ORDER[: _ORDER.index(entry) + 1] if all(r in log for log in logs)]
    signals = {role: joined(logs, role) for role in roles}
    if "command" in signals:
        signals["command"] = np.concatenate([_made_ahead(log) for log in logs])
    return {role: x / (float(np.max(np.abs(x))) or 1.0) for role, x in signals.items()}


def _made_ahead(log: Experiment) -> np.ndarray:
    """The command (n,) without its part of the present reading, where a controller made it of that."""
    made = unlogged_reference(log)
    return np.asarray(log["command"], float) if made is None else made


def _readings(logs: Sequence[Experiment], role: str) -> Ints | None:
    """The session's rows that hold a reading, where a logger filled in others."""
    firsts = np.cumsum([0, *(len(log) for log in logs)])
    parts = [first + log.readings[role] for first, log in zip(firsts, logs) if role in log.readings]
    return np.concatenate(parts) if len(parts) == len(logs) else None


def _felt(input_modes: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Which ways of being off (k,) could gather a nat of evidence, were all of the noise white."""
    off = np.mean(input_modes**2, axis=0) / (np.max(x**2) or 1.0)
    noise = _noise(y) ** 2 / (np.max(y**2) or 1.0)
    made: np.ndarray = 0.5 * len(y) * off > noise
    return made


def _asked(
    logs: Sequence[Experiment],
    x: np.ndarray,
    led: Sequence[bool],
    hidden: Sequence[np.ndarray | None],
) -> np.ndarray:
    """The reference of those that are ``led``, what is ``hidden`` where none was logged, the input of the
    others: in a closed loop that carries the output's noise, and would predict it."""
    ends = np.cumsum([len(log) for log in logs])[:-1]
    x = np.concatenate([i if h is None else h for i, h in zip(np.split(x, ends), hidden)])
    inputs = np.split(x / (float(np.max(np.abs(x))) or 1.0), ends)
    top = max(
        (float(np.max(np.abs(log["reference"]))) for log, is_led in zip(logs, led) if is_led), default=1
    )
    return np.concatenate(
        [log["reference"] / top if is_led else i for log, i, is_led in zip(logs, inputs, led)]
    )


def _hidden(log: Experiment) -> np.ndarray | None:
    """What was asked of the rig in a loop whose reference nobody logged, or never moved; None where there is
    no such loop."""
    return None if _is_led(log) else unlogged_reference(log)


def _as_input(hidden: Sequence[np.ndarray | None], entry: str, x: np.ndarray) -> list[np.ndarray | None]:
    """What was asked in hidden loops in the unit of the input: behind the first stage, as large as that."""
    most = max((float(np.max(np.abs(h))) for h in hidden if h is not None), default=1.0) or 1.0
    by = 1.0 if entry == "command" else float(np.max(np.abs(x))) / most
    return [None if h is None else by * h for h in hidden]


def _is_led(log: Experiment) -> bool:
    """Whether the output follows a reference."""
    reference = log["reference"] if "reference" in log else np.zeros(1)
    if not np.all(np.isfinite(reference)) or min(np.ptp(reference), np.ptp(log["output"])) == 0.0:
        return False
    return bool(np.corrcoef(reference, log["output"])[0, 1] > _FOLLOWED)


def _is_closed(log: Experiment) -> bool:
    """Whether a loop was closed: the output follows a reference, or is held at one that never moves while
    the command does."""
    if _is_led(log):
        return True
    reference, inputs = (log[role] if role in log else np.zeros(1) for role in ("reference", "command"))
    still = bool(np.all(np.isfinite(reference))) and np.ptp(reference) == 0.0 < np.ptp(inputs)
    return still and len(reference) > 1 and abs(np.mean(log["output"]) - reference[0]) < np.std(log["output"])


def _unsteadiness(log: Experiment) -> float:
    """By how much of a sample the times of the samples are uncertain."""
    if log.raw_time is None or len(log.raw_time) < 3:
        return _TIMING
    steps = np.diff(log.raw_time)
    return _TIMING + min(2.0, float(np.std(steps) / max(float(np.median(steps)), 1e-300)))


def _trust(y: np.ndarray, timing: float) -> np.ndarray:
    """1/(the noise with that of timing, in units of the noise)."""
    if len(y) < 5:
        return np.ones(len(y))
    noise = _noise(y)
    slope = np.maximum(np.abs(np.diff(y, prepend=y[0])), np.abs(np.diff(y, append=y[-1])))
    error = timing * np.maximum(slope - 3 * noise, 0.0) / noise
    return 1.0 / np.sqrt(1.0 + error**2)


def _noise(y: np.ndarray) -> float:
    """The root mean square of what is white of a signal (n,), or a little of its span."""
    return max(white_level(y), 2e-3 * float(np.ptp(y)), 1e-300)


def is_single(rig: Rig) -> bool:
    """Whether the rig has one stage only: then every effect sits in it."""
    return len(stages_of(rig)) <= 1


def owner(rig: Rig) -> str | None:
    """The stage whose parameters are the rig's own."""
    given = stages_of(rig)
    return "actuator" if "actuator" in given or not given else given[0] if len(given) == 1 else None
