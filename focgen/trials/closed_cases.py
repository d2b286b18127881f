"""One sealed case of a closed loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from focgen.arrays import Array
from focgen.control.controller import Controller
from focgen.control.equilibrium import actuator_of
from focgen.rig.rig import Ranges
from focgen.trials import patterns
from focgen.trials.cases import Case, Stage, believed, clocks_of, draw_effect, label_of, visibility
from focgen.trials.closed import (
    CONTROLLER_EFFECTS,
    Fault,
    Loop,
    Played,
    draw_controller,
    draw_fault,
    draw_unknown,
    logged,
)
from focgen.trials.forms import Spans
from focgen.trials.machine import Machine, Session
from focgen.trials.plan import Assignment
from focgen.trials.recording import MEASURED, Recorder, draw_recorder, floor_of
from focgen.trials.rigs import draw_chain
from focgen.trials.severity import Trial, rms

_TS, _FINE, _COARSE = 0.02, 0.001, 0.01
_EVERY = round(_TS / _FINE)
_NOTICED = 1e-3  # of the command's span: below, the controller did what the ideal one would have done


def make_closed_case(
    assignment: Assignment, signals: str, rng: np.random.Generator, suite: str = "closed"
) -> Case:
    """Draw and simulate one closed-loop case; in the suite "loops" nothing is told of the controller, which
    was not made for the rig."""
    stage, references = _set_up(signals, rng)
    recorder = replace(
        draw_recorder(rng, {n: getattr(stage.spans, n) for n in MEASURED}, _TS), jitter=0.0, skew=0.0
    )
    draw = draw_controller if suite == "closed" else draw_unknown
    controller = draw(stage.rig, stage.spans, rng)
    quiet = _run(Session(Machine(stage.rig), _FINE), controller, Fault(), stage, references, recorder, rng)
    commands = [trace.command for trace, *_ in quiet][: len(stage.seen)]
    every = round(_COARSE / _FINE)
    stage = replace(
        stage, coarse=Trial([c[::every] for c in commands], stage.clocks[: len(stage.seen)], _COARSE)
    )
    plant = [e for e in assignment.effects if e not in CONTROLLER_EFFECTS]
    drawn = [draw_effect(effect, assignment.severity, stage, rng) for effect in plant]
    settings = [setting for setting, _ in drawn]
    fault = draw_fault(
        next((e for e in assignment.effects if e in CONTROLLER_EFFECTS), None),
        assignment.severity,
        max(c.max() for c in commands),
        rng,
    )
    truth = visibility([facts for _, facts in drawn], settings, stage, recorder)
    session = Session(Machine(stage.rig, tuple(settings)), _FINE)
    played = _run(session, controller, fault, stage, references, recorder, rng)
    logs = [
        (e.name, logged(*run, reference, recorder, rng))
        for e, run, reference in zip([*stage.seen, *stage.unseen], played, references)
    ]
    count = len(stage.seen)
    if fault.effect:
        truth.append(
            _facts(fault, assignment.severity, Loop(session, controller, fault, stage.spans), logs[:count])
        )
    label = label_of(assignment, signals, suite, truth, recorder) | {"floor": floor_of(logs[count:])}
    rig = believed(assignment, stage.rig, rng)
    if recorder.one_file:
        rig = replace(rig, signals=replace(rig.signals, run="run"))
    known = controller if suite == "closed" else None
    return Case(rig, logs[:count], logs[count:], recorder, label, known)


def _set_up(signals: str, rng: np.random.Generator) -> tuple[Stage, list[Array]]:
    rig, full = draw_chain(rng, signals, _TS)
    rig = replace(rig, signals=replace(rig.signals, reference="ref"))
    seen, unseen = patterns.references(rng, _TS), patterns.unseen(rng, _TS)
    top = full * float(rig.regulator.dc_gain)
    drive = float(actuator_of(rig).drive(top))
    atmosphere = {"_bar": 1.013, "_kPa": 101.3, "_MPa": 0.1013}.get(
        f"_{(rig.signals.pressure or 'p_').split('_')[-1]}"
    )
    clocks = clocks_of([*seen, *unseen], _TS, rng)
    spans = Spans(full, top, drive, drive, drive, atmosphere or 5.0 * top, clocks[-1])
    rig = replace(rig, ranges=Ranges((0.0, 1.3 * full), None, (0.0, 1.3 * drive)))
    references = [np.repeat(0.88 * drive * e.levels, _EVERY) for e in [*seen, *unseen]]
    return Stage(rig, full, seen, unseen, clocks, spans, None), references  # type: ignore[arg-type]  # a loop has no trial


def _run(
    session: Session,
    controller: Controller,
    fault: Fault,
    stage: Stage,
    references: Sequence[Array],
    recorder: Recorder,
    rng: np.random.Generator,
) -> list[Played]:
    loop = Loop(session, controller, fault, stage.spans)
    return [
        loop.run(reference, _EVERY, clock, recorder, rng)
        for reference, clock in zip(references, stage.clocks)
    ]


def _facts(
    fault: Fault, severity: str, loop: Loop, logs: Sequence[tuple[str, dict[str, Array]]]
) -> dict[str, Any]:
    """The label of a controller's fault; its gap is that of the command to the ideal one's, as a share of the
    span.
    """
    missed = [
        columns["command"] - loop.ideal_output(columns["reference"] - columns["output"], columns["pressure"])
        for _, columns in logs
    ]
    gap = rms(np.concatenate(missed)) / loop.spans.command
    timing = fault.effect in ("sample_jitter", "missed_samples")
    return {
        "effect": fault.effect,
        "stage": "controller",
        "form": fault.form,
        "severity": severity,
        "parameters": [fault.length, fault.bits, fault.jitter, fault.lost, fault.limit],
        "memory": [],
        "gap": gap,
        "survives": {},
        "visible": bool(timing or gap >= _NOTICED),
    }
