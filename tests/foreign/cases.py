"""One case from a seed: a foreign rig, the rig file that its owner has, its logs, and what is true."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, Ranges, Rig, Signals
from tests.foreign.chain import Fault, Physics, Session
from tests.foreign.forms import MAKE, MOST, STAGE

TS, FINE, COARSE = 0.05, 0.01, 0.05  # s: of the logs, of their simulation, of the search for an amount
SETS = {"C": ("pressure", "curvature"), "B": ("pressure",), "A": ()}
SEVERITIES = (0.04, 0.08, 0.2)  # root mean square at the stage's exit, of that signal's span
_EXIT = {"regulator": "pressure", "actuator": "curvature", "sensor": "output"}


@dataclass(frozen=True)
class Scales:
    """Largest levels of the sound rig by signal, the session's length and the step ``h`` in s."""

    command: float
    pressure: float
    drive: float
    curvature: float
    output: float
    session: float
    h: float


@dataclass(frozen=True, eq=False)
class Case:
    """``rig`` and ``logs`` are what the owner has; ``unseen`` later logs, ``floor`` the noise's root mean
    square in their output. ``truth``: the family, or None. ``amount``: what the fault was made with."""

    rig: Rig
    logs: tuple[Experiment, ...]
    unseen: tuple[Experiment, ...]
    floor: float
    truth: str | None
    amount: float


def case(seed: int, signals: str, truth: str | None, severity: float = 0.08, exact: bool = False) -> Case:
    """A case of one fault, or of none. ``exact``: regulator and sensor are as given, and all logs begin at
    rest; else they are off within their uncertainty, and a third of the logs begin in a transient."""
    rng = np.random.default_rng([seed, 77])
    physics = _physics(rng)
    commands = [*_session(rng), *_later(rng)]
    plays = [_Play(physics, commands, step) for step in (COARSE, FINE)]
    sound = plays[0].traces(())
    scales = _scales(physics, sound, plays[0].clocks[-1][-1])
    state = rng.integers(2**32)

    def faults(amount: float, h: float) -> tuple[Fault, ...]:
        drawn = np.random.default_rng(state)  # the same fault, whatever its amount
        return (MAKE[truth](amount, replace(scales, h=h), drawn),) if truth else ()

    amount = _amount(plays[0], faults, sound, truth, severity) if truth else 0.0
    there = faults(amount, FINE)
    logs, floor = _recorded(plays[1].traces(there), plays[1].clocks, sound, rng, signals)
    logs = [_converted(log, there) for log in logs]
    seen, unseen = logs[: len(logs) - 2], logs[-2:]
    if not exact:
        seen = [_begun(log, rng) if rng.random() < 1 / 3 else log for log in seen]
    return Case(_believed(physics, scales, rng, exact), tuple(seen), tuple(unseen), floor, truth, amount)


def _physics(rng: np.random.Generator) -> Physics:
    return Physics(
        gain=float(rng.uniform(0.05, 0.2)),
        tau=float(rng.uniform(0.08, 0.3)),
        T=float(rng.uniform(0.6, 2.0)),
        alpha=float(rng.uniform(0.5, 0.95)),
        curve=(float(rng.uniform(0.01, 0.03)), float(rng.uniform(0.0, 0.05))),
        scale=float(rng.uniform(0.8, 1.2)),
        lag=float(rng.uniform(0.08, 0.25)),
    )


def _held(levels: Sequence[float], seconds: Sequence[float]) -> np.ndarray:
    return np.repeat(np.asarray(levels, float), [round(s / TS) for s in seconds])


def _session(rng: np.random.Generator) -> list[np.ndarray]:
    """Steps with releases, a chirp, a staircase, a hold, the first steps again: 0 … 2 V at the samples."""
    levels = rng.permutation([0.5, 0.9, 1.3, 1.6, 2.0, 1.1])
    mixed = _held([0, *(v for level in levels for v in (level, 0))], [1, *[8, 6] * 6])
    t = np.arange(round(60 / TS)) * TS
    chirp = 1.0 - (1.0 - 0.1 * rng.random()) * np.cos(2 * np.pi * (0.03 + 0.0035 * t) * t)
    stairs = _held([0, 0.5, 1.0, 1.4, 2.0, 1.2, 0.7, 0], [1, *[7] * 6, 5])
    hold = _held([0, rng.uniform(1.3, 1.8), 0], [1, 60, 25])
    return [mixed, chirp, stairs, hold, mixed[: round(43 / TS)]]


def _later(rng: np.random.Generator) -> list[np.ndarray]:
    ramps = np.interp(np.arange(round(50 / TS)) * TS, np.arange(0, 55, 5), [0, *rng.uniform(0.2, 2.0, 10)])
    t = np.arange(round(30 / TS)) * TS
    return [ramps, (1.0 - np.cos(2 * np.pi * 0.13 * t)) * rng.uniform(0.7, 0.95)]


class _Play:
    """The session's commands on a grid of step ``h``; each begins at rest, 12 s after the one before."""

    def __init__(self, physics: Physics, commands: Sequence[np.ndarray], h: float):
        self.physics, self.h, self.commands, self.clocks = physics, h, [], []
        every, now = round(TS / h), 0.0
        for command in commands:
            self.commands.append(np.repeat(command, every))
            self.clocks.append(now + h * np.arange(len(self.commands[-1])))
            now += len(command) * TS + 12.0

    def traces(self, faults: Sequence[Fault]) -> list[dict[str, np.ndarray]]:
        """Every experiment's signals at the log's samples."""
        session, every = Session(self.physics, tuple(faults), self.h), round(TS / self.h)
        made = [session.run(u, t) for u, t in zip(self.commands, self.clocks)]
        return [{role: x[::every] for role, x in m.items()} for m in made]


def _scales(physics: Physics, sound, session: float) -> Scales:
    top = {role: max(float(np.max(t[role])) for t in sound) for role in sound[0]}
    first, second = physics.curve
    drive = (first + second * top["pressure"]) * top["pressure"]
    return Scales(drive=drive, session=session, h=COARSE, **top)


def _amount(play: _Play, faults, sound, truth: str, severity: float) -> float:
    """The amount by which the signal behind the fault's stage departs by ``severity`` of its span."""
    role = _EXIT[STAGE[truth]]
    whole = np.concatenate([t[role] for t in sound])

    def departs(amount: float) -> float:
        there = faults(amount, COARSE)
        made = np.concatenate([t[role] for t in play.traces(there)])
        for fault in (f for f in there if f.slot == "converter"):
            made = fault.act(made, None, {})
        return float(np.sqrt(np.mean((made - whole) ** 2)) / np.ptp(whole))

    low, high = 1e-3, MOST.get(truth, 12.0)
    for _ in range(9):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if departs(middle) < severity else (low, middle)
    return float(low)


def _recorded(traces, clocks, sound, rng: np.random.Generator, signals: str):
    """The logs with noise, and the root mean square of the output's."""
    logs, noise = [], {}
    for role in ("pressure", "curvature", "output"):
        span = np.ptp(np.concatenate([t[role] for t in sound]))
        noise[role] = (float(np.exp(rng.uniform(np.log(0.004), np.log(0.02)))) * span, rng.uniform(0.3, 0.7))
    for i, (trace, clock) in enumerate(zip(traces, clocks)):
        kept = {"command": trace["command"]}
        for role in (*SETS[signals], "output"):
            kept[role] = trace[role] + _noise(rng, len(trace[role]), *noise[role])
        logs.append(Experiment(f"log{i + 1}", TS, kept, float(clock[0])))
    return logs, noise["output"][0]


def _converted(log: Experiment, faults: Sequence[Fault]) -> Experiment:
    """What a converter makes of the output and its noise."""
    for fault in (f for f in faults if f.slot == "converter"):
        log = replace(log, signals={**log.signals, "output": fault.act(log["output"], log.time, {})})
    return log


def _noise(rng: np.random.Generator, n: int, size: float, white: float) -> np.ndarray:
    """Of root mean square ``size``, the share ``white`` of its power white, the rest with a pole at 0.85."""
    slow = lfilter([np.sqrt(1 - 0.85**2)], [1.0, -0.85], rng.normal(size=n))
    return size * (np.sqrt(white) * rng.normal(size=n) + np.sqrt(1 - white) * slow)


def _begun(log: Experiment, rng: np.random.Generator) -> Experiment:
    """The log from up to 6 s after its input first moved."""
    moved = int(np.argmax(log["command"] > 0.05)) * TS
    return log.between(moved + rng.uniform(0.2, 6.0), None)


def _believed(physics: Physics, scales: Scales, rng: np.random.Generator, exact: bool) -> Rig:
    """What the owner's rig file says: the actuator 5 to 10 % off, the rest within its uncertainty."""
    off = 1.0 + rng.uniform(0.05, 0.1, 4) * rng.choice((-1.0, 1.0), 4)
    known = np.zeros(4) if exact else rng.uniform(-1.0, 1.0, 4) * (0.02, 0.1, 0.02, 0.1)
    gain, tau, scale, lag = (1.0 + known) * (physics.gain, physics.tau, physics.scale, physics.lag)
    alpha = float(np.clip(physics.alpha * (1.0 + 0.5 * (off[1] - 1.0)), 0.3, 1.0))
    curve = (physics.curve[0] * off[2], physics.curve[1] * off[3])
    return Rig(
        "foreign",
        TS,
        Signals("t", "y", "u", "p", "k"),
        Actuator(physics.T * off[0], alpha, curve),
        TransferFunction([(gain, 0.0)], [(tau, 1.0), (1.0, 0.0)]),
        TransferFunction([(scale, 0.0)], [(lag, 1.0), (1.0, 0.0)]),
        Ranges((0.0, scales.command), (0.0, 1.2 * scales.pressure), (0.0, 1.2 * scales.output)),
    )
