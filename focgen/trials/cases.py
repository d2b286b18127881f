"""One sealed case: what is drawn, and what becomes of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from focgen.arrays import Array
from focgen.control.controller import Controller
from focgen.rig.rig import Ranges, Rig
from focgen.trials import patterns
from focgen.trials.designs import Design, Truth, draw_design
from focgen.trials.forms import Drawn, Spans
from focgen.trials.machine import Machine, Session, Setting, Trace
from focgen.trials.plan import Assignment
from focgen.trials.recording import MEASURED, Reader, Recorder, draw_recorder, floor_of, sample
from focgen.trials.rigs import draw_chain, draw_linear, in_time_unit, nominal_of
from focgen.trials.severity import SEVERITIES, VISIBLE, Trial, calibrate, surviving
from focgen.trials.vocabulary import draw_form

FINE = 0.0025  # s: step of the logs
_COARSE = 0.01  # s: step of the calibration


@dataclass(frozen=True, eq=False)
class Case:
    """A finished case: the nominal ``rig``, logs as (name, columns by role), the label of
    what is true, in closed loop the ideal controller, and in open loop the ``bench``, for further logs."""

    rig: Rig
    logs: list[tuple[str, dict[str, Any]]]
    unseen: list[tuple[str, dict[str, Any]]]
    recorder: Recorder
    label: dict[str, Any]
    controller: Controller | None = None
    bench: Bench | None = None


@dataclass(frozen=True, eq=False)
class Stage:
    """What a case is played on: the true rig, its spans, the experiments and their clocks."""

    rig: Rig
    full: float
    seen: list[patterns.Experiment]
    unseen: list[patterns.Experiment]
    clocks: list[float]
    spans: Spans
    coarse: Trial

    def commands(self, experiments: Sequence[patterns.Experiment], h: float) -> list[Array]:
        """The experiments' commands on the grid of step ``h``."""
        repeat = round(self.rig.sample_time / h)
        return [np.repeat(e.levels * self.full, repeat) for e in experiments]


def make_case(assignment: Assignment, signals: str, suite: str, rng: np.random.Generator) -> Case:
    """Draw and simulate one case. A design that cannot show its effect is drawn again, up to 12 times."""
    for _ in range(12):
        case = _draw_case(assignment, signals, suite, rng)
        if not assignment.must_show or all(t["visible"] for t in case.label["truth"]):
            break
    return case


def _draw_case(assignment: Assignment, signals: str, suite: str, rng: np.random.Generator) -> Case:
    design = draw_design(signals, rng) if assignment.kind == "unidentifiable" else None
    stage = _set_up(assignment, signals, suite, design, rng)
    spans = {name: getattr(stage.spans, name) for name in MEASURED}
    recorder = draw_recorder(rng, spans, stage.rig.sample_time)
    if design:
        truth = [draw_truth(design.truths[rng.integers(len(design.truths))], stage, rng)]
    else:
        truth = [draw_effect(effect, assignment.severity, stage, rng) for effect in assignment.effects]
    settings = [setting for setting, _ in truth]
    shown = visibility([facts for _, facts in truth], settings, stage, recorder)
    label = label_of(assignment, signals, suite, shown, recorder, design)
    return play_case(stage, settings, recorder, believed(assignment, stage.rig, rng), label, rng)


def label_of(
    assignment: Assignment,
    signals: str,
    suite: str,
    truth: list[dict[str, Any]],
    recorder: Recorder,
    design: Design | None = None,
) -> dict[str, Any]:
    """What is sealed, but for the noise floor, which the logs tell."""
    return {
        "kind": assignment.kind,
        "signals": signals,
        "suite": suite,
        "truth": truth,
        "design": design.facts() if design else None,
        "noise": recorder.noise,
    }


def _set_up(
    assignment: Assignment, signals: str, suite: str, design: Design | None, rng: np.random.Generator
) -> Stage:
    Ts = float(rng.choice((0.02, 0.05)))
    rig, full = draw_linear(rng, Ts) if assignment.linear else draw_chain(rng, signals, Ts)
    seen = design.draw(rng, Ts) if design else patterns.SUITES[suite](rng, Ts)
    unseen = patterns.unseen(rng, Ts)
    clocks = clocks_of([*seen, *unseen], Ts, rng)
    bare = Stage(rig, full, seen, unseen, clocks, None, None)  # type: ignore[arg-type]  # filled in below
    coarse = Trial(bare.commands(seen, _COARSE), clocks[: len(seen)], _COARSE)
    spans = spans_of(rig, full, coarse, clocks[-1])
    return replace(bare, spans=spans, coarse=coarse)


def clocks_of(experiments: Sequence[patterns.Experiment], Ts: float, rng: np.random.Generator) -> list[float]:
    """When each experiment begins: after the one before and a rest of 10 to 30 s; whole samples."""
    clocks, now = [], 0.0
    for experiment in experiments:
        clocks.append(now)
        now += round((len(experiment.levels) * Ts + rng.uniform(10.0, 30.0)) / Ts) * Ts
    return clocks


def spans_of(rig: Rig, full: float, trial: Trial, session: float) -> Spans:
    """What the healthy rig's signals span in a ``trial``; ``full``: its command, ``session``: s."""
    found = {name: float(np.ptp(values)) for name, values in trial.signals(rig).items()}
    top = full * rig.regulator.dc_gain
    drive = rig.actuator.drive(top) if rig.actuator else top
    return Spans(
        full,
        found["pressure"],
        abs(float(drive)),
        found["curvature"],
        found["output"],
        _atmosphere(rig, found["pressure"]),
        session,
    )


def _atmosphere(rig: Rig, span: float) -> float:
    """1.013 bar in the rig's unit of pressure; five spans where it has none."""
    for suffix, bar in (("_bar", 1.0), ("_kPa", 100.0), ("_MPa", 0.1)):
        if (rig.signals.pressure or "").endswith(suffix):
            return 1.013 * bar
    return 5.0 * span


def draw_effect(
    effect: str, severity: str, stage: Stage, rng: np.random.Generator
) -> tuple[Setting, dict[str, Any]]:
    """One of the effect's forms, calibrated, and what the label says of it."""
    drawn = draw_form(effect, rng, stage.spans)
    setting, gap = calibrate(drawn, stage.rig, stage.coarse, SEVERITIES[severity])
    return setting, _facts(drawn, setting, severity, gap)


def draw_truth(truth: Truth, stage: Stage, rng: np.random.Generator) -> tuple[Setting, dict[str, Any]]:
    """The effect and form that a design asks for, and what the label says of it."""
    drawn = draw_form(truth.effect, rng, stage.spans, truth.form)
    if truth.amplitude:
        return drawn.at(truth.amplitude), _facts(drawn, drawn.at(truth.amplitude), "given", None)
    setting, gap = calibrate(drawn, stage.rig, stage.coarse, truth.target)
    return setting, _facts(drawn, setting, "given", gap)


def _facts(drawn: Drawn, setting: Setting, severity: str, gap: float | None) -> dict[str, Any]:
    return {
        "effect": drawn.effect,
        "stage": drawn.stage,
        "form": drawn.form.name,
        "severity": severity,
        "parameters": list(setting.parameters),
        "memory": list(setting.memory or ()),
        "gap": gap,
    }


def visibility(
    truth: list[dict[str, Any]], settings: list[Setting], stage: Stage, recorder: Recorder
) -> list[dict[str, Any]]:
    """Add to each effect how much of it the logs can show, beside the others."""
    logged = [name for name in MEASURED if name in stage.rig.signals.columns()]
    if not truth:
        return []
    noise = {name: recorder.noise[name] for name in logged}
    whole = stage.coarse.signals(stage.rig, settings)
    marked = []
    for i, facts in enumerate(truth):
        without = stage.coarse.signals(stage.rig, settings[:i] + settings[i + 1 :])
        left = surviving(stage.rig, stage.coarse, {n: whole[n] - without[n] for n in logged}, noise)
        marked.append({**facts, "survives": left, "visible": max(left.values()) >= VISIBLE})
    return marked


def believed(assignment: Assignment, rig: Rig, rng: np.random.Generator) -> Rig:
    """The nominal rig that the case is given."""
    scatter = {"none": (0.0, 0.0), "parameters": (0.08, 0.2)}.get(assignment.kind, (0.06, 0.15))
    return nominal_of(rig, rng, scatter)


class InUse(Reader, Protocol):
    """A rig in use: what outlives a rest stays from one experiment to the next."""

    def run(self, command: Array, clock: float) -> Trace:
        """One experiment from rest, the command (n,) held from step to step, begun at ``clock`` s."""
        ...


@dataclass(frozen=True, eq=False)
class Bench:
    """The true rig of a case, and how its logs are taken.

    ``programme``: what was done, as (name, command (n,) at steps of ``FINE``, clock in s); the first ``seen``
    of it is logged, the rest sealed. ``Ts``: the rig's sample time, s. ``fresh``: the rig as it was ahead.
    """

    programme: Sequence[tuple[str, Array, float]]
    seen: int
    Ts: float
    fresh: Callable[[], InUse]
    recorder: Recorder

    def play(self, rng: np.random.Generator) -> list[tuple[str, dict[str, Any]]]:
        """The session and what stays sealed, as (name, columns by role)."""
        session = self.fresh()
        return [
            (name, self._sampled(session.run(command, clock), session, rng))
            for name, command, clock in self.programme
        ]

    def further(self, command: Array, rng: np.random.Generator) -> dict[str, Any]:
        """One more experiment after the session: the log by role of a ``command`` (n,) in its unit."""
        session = self.fresh()
        for _, before, clock in self.programme[: self.seen]:
            session.run(before, clock)
        fine = np.repeat(np.asarray(command, float), round(self.Ts / FINE))
        return self._sampled(session.run(fine, self.programme[self.seen][2]), session, rng)

    def _sampled(self, trace: Trace, session: InUse, rng: np.random.Generator) -> dict[str, Any]:
        return sample(trace, self.Ts, self.recorder, session, rng)


class Played(Protocol):
    """What a case is played on: commands on a grid, and when each begins, s."""

    @property
    def clocks(self) -> list[float]:
        """Of all experiments."""
        ...

    def commands(self, experiments: Sequence[patterns.Experiment], h: float) -> list[Array]:
        """On the grid of step ``h`` s."""
        ...


def programme(experiments: Sequence[patterns.Experiment], on: Played) -> list[tuple[str, Array, float]]:
    """All experiments, as a :class:`Bench` makes them."""
    commands = on.commands(experiments, FINE)
    return [(e.name, c, at) for e, c, at in zip(experiments, commands, on.clocks)]


def play_case(
    stage: Stage,
    settings: Sequence[Setting],
    recorder: Recorder,
    nominal: Rig,
    label: dict[str, Any],
    rng: np.random.Generator,
) -> Case:
    """The session, made by the stage's rig with these ``settings`` and given with the ``nominal`` one."""
    machine, count = Machine(stage.rig, tuple(settings)), len(stage.seen)
    done = programme([*stage.seen, *stage.unseen], stage)
    bench = Bench(done, count, stage.rig.sample_time, lambda: Session(machine, FINE), recorder)
    played = bench.play(rng)
    unit = float(rng.choice((0.001, 0.1, 1.0, 60.0))) if label["kind"] == "linear" else 1.0
    rig = in_time_unit(nominal, unit)
    if recorder.one_file:
        rig = replace(rig, signals=replace(rig.signals, run="run"))
    rig = replace(rig, ranges=_ranges(stage) if rng.random() < 0.7 else Ranges())
    label = {**label, "floor": floor_of(played[count:])}
    recorder = replace(recorder, time_unit=unit)
    return Case(rig, played[:count], played[count:], recorder, label, bench=bench)


def _ranges(stage: Stage) -> Ranges:
    spans = stage.spans
    pressure = (0.0, 1.2 * spans.pressure) if stage.rig.signals.pressure else None
    return Ranges((0.0, 1.2 * spans.command), pressure, (0.0, 1.3 * spans.output))
