"""One sealed case of the suite "plants"."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from focgen.trials import patterns
from focgen.trials.cases import (
    Case,
    Stage,
    believed,
    clocks_of,
    draw_truth,
    label_of,
    play_case,
    spans_of,
    visibility,
)
from focgen.trials.designs import Truth
from focgen.trials.disturbed import off
from focgen.trials.machine import Setting
from focgen.trials.plan import Assignment
from focgen.trials.plants import AXIS, draw_kind, draw_plant, forms_on, given_of
from focgen.trials.plants_moves import moves, unseen_moves
from focgen.trials.recording import MEASURED, draw_recorder
from focgen.trials.severity import SEVERITIES, Trial

_TS, _COARSE = 0.02, 0.01
_AGAIN = 6  # times that a design which cannot show its effect is drawn


def make_plants_case(assignment: Assignment, signals: str, rng: np.random.Generator) -> Case:
    """Draw and simulate one case; one that cannot show what it has to is drawn again, up to 6 times. Gain and
    times of regulator and sensor are given as off within their uncertainty, but to rigs that are exact."""
    kind = draw_kind(assignment.effects, rng)
    for _ in range(_AGAIN):
        stage = _set_up(kind, signals, rng)
        spans = {name: getattr(stage.spans, name) for name in MEASURED}
        recorder = draw_recorder(rng, spans, stage.rig.sample_time)
        drawn = [_draw(effect, assignment.severity, kind, stage, rng) for effect in assignment.effects]
        settings = [setting for setting, _ in drawn]
        truth = visibility([facts for _, facts in drawn], settings, stage, recorder)
        if all(t["visible"] for t in truth) or not assignment.must_show:
            break
    nominal = believed(assignment, stage.rig, rng)
    nominal = nominal if assignment.kind == "none" else off(nominal, rng)
    label = label_of(assignment, signals, "plants", truth, recorder) | {"plant": kind}
    case = play_case(stage, settings, recorder, nominal, label, rng)
    return replace(case, rig=given_of(case.rig, 1.3 * stage.spans.output)) if kind == AXIS else case


def _set_up(kind: str, signals: str, rng: np.random.Generator) -> Stage:
    rig, full = draw_plant(rng, kind, signals, _TS)
    given, kept = (moves, unseen_moves) if kind == AXIS else (patterns.engine, patterns.unseen)
    seen, unseen = given(rng, _TS), kept(rng, _TS)
    clocks = clocks_of([*seen, *unseen], _TS, rng)
    bare = Stage(rig, full, seen, unseen, clocks, None, None)  # type: ignore[arg-type]  # filled in below
    coarse = Trial(bare.commands(seen, _COARSE), clocks[: len(seen)], _COARSE)
    return replace(bare, spans=spans_of(rig, full, coarse, clocks[-1]), coarse=coarse)


def _draw(
    effect: str, severity: str, kind: str, stage: Stage, rng: np.random.Generator
) -> tuple[Setting, dict[str, Any]]:
    """One of the effect's forms that the plant can have, calibrated, and what the label says of it."""
    forms = forms_on(kind, effect)
    name = forms[rng.integers(len(forms))].name
    setting, facts = draw_truth(Truth(effect, name, SEVERITIES[severity]), stage, rng)
    return setting, {**facts, "severity": severity}
