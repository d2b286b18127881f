"""One sealed case of a rig that the physics engine moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from focgen.arrays import Array
from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import Ranges, Rig
from focgen.trials import patterns
from focgen.trials.cases import FINE, Bench, Case, clocks_of, label_of, programme
from focgen.trials.engine.bodies import Body
from focgen.trials.engine.forms import BODY, HANDS, Angles
from focgen.trials.engine.machine import EngineRig, EngineSession, EngineTrial
from focgen.trials.engine.nominal import believed, fitted
from focgen.trials.forms import Drawn, Spans
from focgen.trials.machine import Setting
from focgen.trials.plan import Assignment
from focgen.trials.recording import MEASURED, Recorder, draw_recorder, floor_of
from focgen.trials.rigs import Units, columns_of, draw_regulator, draw_units, nominal_of
from focgen.trials.severity import SEVERITIES, VISIBLE, Trial, below_one, calibrate, surviving
from focgen.trials.vocabulary import draw_form

_COARSE = 0.005  # s: step of the calibration
_NOISE = (0.005, 0.01)  # of each span
_AGAIN = 6  # times that a design which cannot show its effect is drawn


@dataclass(frozen=True, eq=False)
class Scene:
    """What a case is played on: the true rig, its full command and spans, experiments and clocks."""

    true: EngineRig
    full: float
    seen: list[patterns.Experiment]
    unseen: list[patterns.Experiment]
    clocks: list[float]
    spans: Spans
    angles: Angles
    trial: EngineTrial

    def commands(self, experiments: Sequence[patterns.Experiment], h: float) -> list[Array]:
        """The experiments' commands on the grid of step ``h``."""
        repeat = round(self.true.rig.sample_time / h)
        return [np.repeat(e.levels * self.full, repeat) for e in experiments]


def make_engine_case(assignment: Assignment, signals: str, rng: np.random.Generator) -> Case:
    """Draw and simulate one case. A design that cannot show its effect is drawn again, up to 6 times."""
    for _ in range(_AGAIN):
        scene = _set_up(signals, rng)
        recorder = _recorder(scene, rng)
        drawn = [_draw(effect, assignment.severity, scene, rng) for effect in assignment.effects]
        truth = [_seen(facts, setting, scene, recorder) for setting, facts in drawn]
        if all(t["visible"] for t in truth) or not assignment.must_show:
            break
    label = label_of(assignment, signals, "engine", truth, recorder)
    return _play(scene, [setting for setting, _ in drawn], recorder, label, rng)


def _set_up(signals: str, rng: np.random.Generator) -> Scene:
    Ts, units = float(rng.choice((0.01, 0.02))), draw_units(rng)
    true, full, angle = _draw_rig(units, signals, Ts, rng)
    seen, unseen = patterns.engine(rng, Ts), patterns.unseen(rng, Ts)
    clocks = clocks_of([*seen, *unseen], Ts, rng)
    bare = Scene(true, full, seen, unseen, clocks, None, None, None)  # type: ignore[arg-type]  # filled in below
    trial = EngineTrial(bare.commands(seen, _COARSE), clocks[: len(seen)], _COARSE)
    scene = replace(bare, trial=trial, angles=Angles(angle, true.body.time, clocks[-1]))
    scene = replace(scene, true=_identified(scene, rng))
    spans = {n: float(np.ptp(v)) for n, v in trial.signals(scene.true).items()}
    curvature = spans["curvature"]
    return replace(
        scene,
        spans=Spans(
            full, spans["pressure"], curvature, curvature, spans["output"], 1.013 * units.pressure, clocks[-1]
        ),
    )


def _draw_rig(
    units: Units, signals: str, Ts: float, rng: np.random.Generator
) -> tuple[EngineRig, float, float]:
    """The true rig, its full command, and the angle in rad that this bends it by."""
    links = 5 if rng.random() < 0.35 else 1
    lag = float(rng.uniform(0.03, 0.08)) if rng.random() < 0.3 else 0.0
    body = Body(links, float(rng.uniform(0.3, 0.9)), float(rng.uniform(0.004, 0.02)), lag)
    top, angle = rng.uniform(0.15, 0.35) * units.pressure, float(rng.uniform(0.5, 1.1))
    unit = units.curvature * rng.uniform(0.01, 0.02) / angle
    regulator, gain = draw_regulator(rng, units)
    pole = rng.uniform(8.0, 20.0)
    sensor = TransferFunction([(pole, 0.0)], [(1.0, 1.0), (pole, 0.0)])
    rig = Rig(f"joint{rng.integers(1000)}", Ts, columns_of(units, signals), None, regulator, sensor)
    return EngineRig(rig, body, angle / top, unit), top / gain, angle


def _identified(scene: Scene, rng: np.random.Generator) -> EngineRig:
    """The true rig with the actuator that its owner finds in its healthy motion."""
    true, body = scene.true, scene.true.body
    session = EngineSession(true, (), _COARSE)
    traces = [session.run(c, t) for c, t in zip(scene.trial.commands, scene.trial.clocks)]
    order = 2 if body.filter or rng.random() < 0.3 else 1
    pressures, curvatures = [t.pressure for t in traces], [t.curvature for t in traces]
    actuator = fitted(pressures, curvatures, _COARSE, order, body.time)
    return replace(true, rig=replace(true.rig, actuator=actuator))


def _recorder(scene: Scene, rng: np.random.Generator) -> Recorder:
    drawn = draw_recorder(rng, {n: getattr(scene.spans, n) for n in MEASURED}, scene.true.rig.sample_time)
    noise = {n: getattr(scene.spans, n) * float(rng.uniform(*_NOISE)) for n in MEASURED}
    return replace(drawn, noise=noise, jitter=0.0, skew=0.0)


def _draw(
    effect: str, severity: str, scene: Scene, rng: np.random.Generator
) -> tuple[Setting, dict[str, Any]]:
    """One of the effect's forms, calibrated, and what the label says of it."""
    forms = BODY.get(effect) or HANDS.get(effect)
    if forms:
        form = forms[rng.integers(len(forms))]
        drawn = Drawn(effect, "actuator", form, form.draw(rng, scene.angles), None)
    else:
        drawn = draw_form(effect, rng, scene.spans)
    setting, gap = calibrate(drawn, scene.true, scene.trial, SEVERITIES[severity])
    facts = {"effect": effect, "stage": drawn.stage, "form": drawn.form.name, "severity": severity}
    kept = {"parameters": list(setting.parameters), "memory": list(setting.memory or ()), "gap": gap}
    return setting, {**facts, **kept}


def _seen(facts: dict[str, Any], setting: Setting, scene: Scene, recorder: Recorder) -> dict[str, Any]:
    """Add how much of the effect the logs can show, once the rig's nominal parameters are refitted."""
    rig = below_one(scene.true.rig)
    logged = [name for name in MEASURED if name in rig.signals.columns()]
    whole, without = (scene.trial.signals(scene.true, s) for s in ((setting,), ()))
    gap = {n: whole[n] - without[n] for n in logged}
    plain = Trial(scene.trial.commands, scene.trial.clocks, scene.trial.h)
    left = surviving(rig, plain, gap, {n: recorder.noise[n] for n in logged})
    return {**facts, "survives": left, "visible": max(left.values()) >= VISIBLE}


def _play(
    scene: Scene, settings: list[Setting], recorder: Recorder, label: dict[str, Any], rng: np.random.Generator
) -> Case:
    rig = scene.true.rig
    done, count = programme([*scene.seen, *scene.unseen], scene), len(scene.seen)
    bench = Bench(done, count, rig.sample_time, lambda: EngineSession(scene.true, settings, FINE), recorder)
    played = bench.play(rng)
    nominal = believed(rig, rng)
    if label["kind"] == "parameters":
        nominal = nominal_of(nominal, rng, (0.08, 0.2))
    if recorder.one_file:
        nominal = replace(nominal, signals=replace(nominal.signals, run="run"))
    ranges = Ranges((0.0, 1.2 * scene.full), None, (0.0, 1.3 * scene.spans.output))
    nominal = replace(nominal, ranges=ranges if rng.random() < 0.7 else Ranges())
    label = {**label, "floor": floor_of(played[count:])}
    return Case(nominal, played[:count], played[count:], recorder, label, bench=bench)
