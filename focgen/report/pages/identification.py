"""An identification as a page: the model, how well it fits, and what the logs cannot show."""

from __future__ import annotations

from typing import Any

import numpy as np

from focgen.identification.identification import Identification
from focgen.identification.stages import StageFit
from focgen.present import present
from focgen.report.figures import Area, Axis, Bars, Figure, Line, Panel, Rule, curve
from focgen.report.identification import LAST, candidates, named, swings
from focgen.report.identification_summary import (
    driving_role,
    gain_text,
    gain_unit,
    model_label,
    parameter_table,
    quality_table,
    stage_text,
)
from focgen.report.page import Page, Section, TableOf
from focgen.report.pages.parts import curves_table, notes, number, sentence, warnings
from focgen.report.style import CYCLE, GREY, with_unit

_RUNS = CYCLE[:-1]  # of experiments: models are drawn over them in black
_MOST_LOOPS = 4
_TIME = Axis("time (s)")


def identification_page(found: Identification) -> Page:
    """The page of an identification."""
    return Page(
        f"The identified model of {found.rig.name}",
        identification_lead(found),
        identification_sections(found),
    )


def identification_lead(found: Identification) -> str:
    """What was found, in a few sentences."""
    if found.joint is None:
        return " ".join(sentence(stage_text(fit)) for fit in found.stages.values())
    joint, gof = found.joint, found.gof
    text = (
        f"K(p)/(T s^α + 1) with T = {joint.T:.4g} and α = {joint.alpha:.4g} fits "
        f"{_count(len(found.experiments))} with a mean goodness of fit of {gof['rig']['mean']:.3f}; each "
        f"experiment by itself reaches {gof['fom']['mean']:.3f}."
    )
    others = [f"{model_label(m)} {v['mean']:.3f}" for m, v in gof.items() if m.startswith("iom_")]
    return text + (f" Models of integer order, each fitted alike: {', '.join(others)}." if others else "")


def _count(experiments: int) -> str:
    return "one experiment" if experiments == 1 else f"{experiments} experiments"


def identification_sections(found: Identification) -> tuple[Section, ...]:
    """The model, the fits and the stages; and what has to be said."""
    parts = []
    if found.joint is not None and found.experiments:
        unseen = tuple(f"Not fitted, only shown: {u.name} with a GOF of {u.gof:.3f}." for u in found.unseen)
        model = (*map(sentence, gain_text(found).splitlines()), *unseen)
        shown = (_fits(found), _gof(found), *_parameters(found), _models(found), *_loops(found))
        parts.append(Section("Model", model, (parameter_table(found), quality_table(found)), figures=shown))
    if found.stages:
        fits = found.stages.values()
        told = tuple(sentence(stage_text(fit)) for fit in fits)
        parts.append(Section("Regulator and sensor", told, figures=tuple(_stage(found, fit) for fit in fits)))
    said = (*warnings(found.warnings), *notes(found.notes))
    return (*parts, Section("What has to be said", said)) if said else tuple(parts)


def _fits(found: Identification) -> Figure:
    fitted = found.experiments[0].fitted
    tops, errors = [], []
    for i, fit in enumerate(found.experiments):
        joint = present(found.joint).simulated[fit.name]
        tops.append(curve(fit.name, fit.time, fit.measured, _RUNS[i % len(_RUNS)], width=1.4))
        tops.append(
            curve(
                f"{fit.name}, by itself",
                fit.time,
                fit.simulated,
                "ideal",
                dash="dotted",
                width=1.2,
                group="each by itself",
            )
        )
        tops.append(curve(f"{fit.name}, the rig", fit.time, joint, "ideal", width=1.2, group="the rig"))
        errors.append(curve(fit.name, fit.time, fit.measured - joint, _RUNS[i % len(_RUNS)], width=1.1))
    panels = (
        Panel(_TIME, Axis(named(found, fitted)), tuple(tops), height=340),
        Panel(
            _TIME,
            Axis(with_unit("error", found.rig.signals.unit_of(fitted))),
            (*errors, Rule(0.0)),
            height=190,
        ),
    )
    rows = tuple(
        (fit.name, number(fit.level), number(found.gof["rig"].get(fit.name)), number(fit.gof))
        for fit in found.experiments
    )
    return Figure(
        "Measured and identified",
        "Every experiment in colour; black the identified rig, one for all; dotted the model of each "
        "experiment by itself. Below, what the rig leaves.",
        f"Curves over time: {_count(len(found.experiments))} as measured, and as the identified rig has "
        "them.",
        panels,
        TableOf(("experiment", "level", "GOF of the rig", "by itself"), rows, "How well each is fitted"),
    )


def _gof(found: Identification) -> Figure:
    names = tuple([fit.name for fit in found.experiments] + ["mean"])
    width, at = 0.8 / len(found.gof), np.arange(len(names))
    bars = tuple(
        Bars(
            model_label(model),
            at + (i - 0.5 * (len(found.gof) - 1)) * width,
            np.array([max(values[name], 0.0) for name in names]),
            GREY if model == "rig" else CYCLE[i % len(CYCLE)],
            width=0.92 * width,
            names=names,
        )
        for i, (model, values) in enumerate(found.gof.items())
    )
    panel = Panel(Axis("experiment", places=names), Axis("goodness of fit", low=0.0, high=1.0), bars)
    return Figure(
        "Fractional and integer-order models",
        "Goodness of fit by eq. (4): 1 is exact, 0 no better than the mean. FOM: fractional, IOM: of "
        "integer order.",
        f"Bars: goodness of fit of {', '.join(map(model_label, found.gof))} in each experiment.",
        (panel,),
        quality_table(found),
    )


def _parameters(found: Identification) -> tuple[Figure, ...]:
    """K, T and alpha over the level with their intervals, where two experiments are steps."""
    steps = [fit for fit in found.experiments if fit.step]
    if len(steps) < 2:
        return ()
    levels, joint = np.array([fit.level for fit in steps]), present(found.joint)
    reach = np.linspace(levels.min(), levels.max(), 50)
    x = Axis(named(found, driving_role(found), "level of the "))
    panels = []
    for key, label in (("K", with_unit("K", gain_unit(found))), ("T", "T (s^α)"), ("alpha", "α")):
        spans = np.array([[a, b, np.nan] for a, b in (fit.ci95[key] for fit in steps)])
        marks: list[Any] = [
            Line(
                "95 % interval",
                np.repeat(levels, 3),
                spans.ravel(),
                "model",
                width=1.4,
                group="each experiment",
            ),
            Line(
                "each experiment",
                levels,
                np.array([getattr(f, key) for f in steps]),
                "model",
                "none",
                dots=8.0,
            ),
        ]
        if key == "K":
            line = np.polynomial.polynomial.polyval(reach, joint.gain)
            marks.append(Line("all together", reach, line, "ideal", width=1.2))
        else:
            low, high = joint.ci95[key]
            marks.append(Area("all together", reach, np.full(50, low), np.full(50, high), "measured"))
            marks.append(Line("all together", reach, np.full(50, getattr(joint, key)), "ideal", width=1.2))
        panels.append(Panel(x, Axis(label), tuple(marks), height=200))
    return (
        Figure(
            "Parameters over the level",
            "Each experiment by itself with its 95 % interval, and all together: the line K(p), one T, one "
            "α.",
            "Points with intervals: K, T and alpha of each experiment over its level, and of all together.",
            tuple(panels),
            parameter_table(found),
        ),
    )


def _models(found: Identification) -> Figure:
    """The experiment in the middle, with models of different kind and what they leave."""
    fit = sorted(found.experiments, key=lambda f: f.level)[len(found.experiments) // 2]
    tops, errors = [curve("measured", fit.time, fit.measured, "measured")], []
    for label, simulated, colour in candidates(fit):
        tops.append(curve(label, fit.time, simulated, colour, width=1.3))
        errors.append(curve(label, fit.time, fit.measured - simulated, colour, width=1.1))
    left = [(line.label, line.y) for line in errors]
    rows = tuple(
        (name, number(float(np.sqrt(np.mean(y**2)))), number(float(np.abs(y).max()))) for name, y in left
    )
    return Figure(
        f"Experiment {fit.name}: models of different kind",
        "Above, the measured output and the models fitted to it; below, what each leaves.",
        f"Curves of experiment {fit.name}: measured, and by each model; and their errors.",
        (
            Panel(_TIME, Axis(named(found, fit.fitted)), tuple(tops)),
            Panel(
                _TIME,
                Axis(with_unit("error", found.rig.signals.unit_of(fit.fitted))),
                (*errors, Rule(0.0)),
                height=190,
            ),
        ),
        TableOf(("model", "RMS error", "largest error"), rows, f"What the models leave of {fit.name}"),
    )


def _loops(found: Identification) -> tuple[Figure, ...]:
    """Output over input of what swings, once the start has died away."""
    shown = swings(found)[:_MOST_LOOPS]
    if not shown:
        return ()
    x, y = Axis(named(found, driving_role(found))), Axis(named(found, found.experiments[0].fitted))
    panels, curves = [], []
    for name, pressure, measured, simulated in shown:
        late = slice(int(len(pressure) * (1.0 - LAST)), None)
        log = curve("log", pressure[late], measured[late], "measured", width=1.2)
        rig = curve("identified rig", pressure[late], simulated[late], "model", width=1.3)
        panels.append(Panel(x, y, (log, rig), name, 300))
        curves += [(f"{name}, log", measured[late]), (f"{name}, identified rig", simulated[late])]
    return (
        Figure(
            "Loops",
            "The second half of every log that swings: what the rig does, and what the model says. A loop "
            "that the model lacks is a hysteresis or a friction; `focgen diagnose` names it.",
            f"Loops of output over input in {', '.join(name for name, *_ in shown)}, as logged and by the "
            "identified rig.",
            tuple(panels),
            curves_table("Output in the second half", curves),
            linked=False,
        ),
    )


def _stage(found: Identification, fit: StageFit) -> Figure:
    """What leaves a stage, measured and as identified."""
    leaves = {"regulator": "pressure", "sensor": "output"}[fit.stage]
    marks = []
    for i, (time, measured, simulated) in enumerate(fit.traces):
        marks.append(curve(fit.names[i], time, measured, _RUNS[i % len(_RUNS)], width=1.4))
        marks.append(
            curve(f"{fit.names[i]}, identified", time, simulated, "ideal", width=1.1, group="identified")
        )
    rows = tuple((name, number(value), f"± {number(half)}") for name, (value, half) in fit.parameters.items())
    return Figure(
        f"The {fit.stage}",
        f"Measured in colour, identified in black: {fit.shape}, with a goodness of fit of {fit.gof:.3f}.",
        f"Curves over time: what leaves the {fit.stage}, measured and as identified.",
        (Panel(_TIME, Axis(with_unit(leaves, found.rig.signals.unit_of(leaves))), tuple(marks)),),
        TableOf(("parameter", "value", "95 %"), rows, f"The {fit.stage}: {fit.shape}"),
    )
