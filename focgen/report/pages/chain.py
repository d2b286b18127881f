"""Rig, controller, generated folder and verification as pages, from the files that hold them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from focgen.control.controller import Controller
from focgen.logs.experiment import Experiment
from focgen.report.figures import Axis, Bars, Figure, Line, Panel, Rule, curve
from focgen.report.page import Section, TableOf
from focgen.report.pages.parts import curves_table, notes, number, warnings
from focgen.report.style import CYCLE, with_unit
from focgen.rig.replay import Replay, simulate_session
from focgen.rig.rig import Actuator, Rig
from focgen.rig.stages import STAGES

_STEPS, _SAMPLES = 5, 600  # what a rig is shown by
_TIME = Axis("time (s)")


# ------------------------------------------------------------------------------------------------- rig


def rig_section(rig: Rig) -> Section:
    """The model: its parameters, how well they are known, and how it answers steps."""
    effects = [str(effect.get("name", "")) for effect in rig.effects]
    told = (
        f"The rig {rig.name}, sampled every {rig.sample_time:g} s"
        + (f", with {', '.join(effects)}." if effects else "."),
    )
    figures = (_answers(rig),) if isinstance(rig.actuator, Actuator) else ()
    return Section("Model", told, (_stages(rig),), figures=figures)


def _stages(rig: Rig) -> TableOf:
    rows = []
    for stage in STAGES:
        known, delay = getattr(rig.uncertainty, stage), getattr(rig.delays, stage)
        made = _actuator_text(rig) if stage == "actuator" else str(getattr(rig, stage))
        alpha = f"; α ± {known.alpha:.1%}" if stage == "actuator" else ""
        rows.append(
            (
                stage,
                made,
                f"{delay:g} s" if delay else "–",
                f"gain ± {known.gain:.1%}; time ± {known.time:.1%}{alpha}",
            )
        )
    return TableOf(
        ("stage", "model", "dead time", "known to"), tuple(rows), "The chain, and how well it is known"
    )


def _actuator_text(rig: Rig) -> str:
    actuator = rig.actuator
    if actuator is None:
        return "not given"
    if not isinstance(actuator, Actuator):
        return str(actuator.dynamics)
    terms = [f"{g:.4g}{'' if i == 0 else ' p' if i == 1 else f' p^{i}'}" for i, g in enumerate(actuator.gain)]
    return f"K(p) p/({actuator.T:.4g} s^{actuator.alpha:.4g} + 1), K(p) = {' + '.join(terms)}"


def _answers(rig: Rig) -> Figure:
    """Steps of pressure from rest, through the actuator and what follows it."""
    low, high = rig.ranges.pressure or (0.0, 1.0)
    levels = np.linspace(0.0, 1.0, _STEPS + 1)[1:] * (high or low)
    actuator: Any = rig.actuator  # a fractional one: others have no such figure
    h = max(rig.sample_time, 12.0 * actuator.T ** (1.0 / actuator.alpha) / _SAMPLES)
    held = [
        Experiment(f"{p:.4g}", h, {"pressure": np.full(_SAMPLES, p)}, start=2.0 * i * _SAMPLES * h)
        for i, p in enumerate(levels)
    ]
    made = [simulate_session(rig, [one], (), False)[0]["output"] for one in held]
    marks = tuple(
        curve(f"to {e.name}", e.time, y, CYCLE[i % len(CYCLE)], width=1.8)
        for i, (e, y) in enumerate(zip(held, made))
    )
    unit = rig.signals.unit_of("pressure")
    return Figure(
        "How it answers steps of pressure",
        "From rest, by the nominal model without effects. A fractional order rises fast, then creeps.",
        "Curves over time: the output after steps of pressure to five levels.",
        (Panel(_TIME, Axis(with_unit("output", rig.signals.unit_of("output")), from_zero=True), marks),),
        curves_table(
            "Output after a step", [(f"pressure {with_unit(e.name, unit)}", y) for e, y in zip(held, made)]
        ),
    )


def replay_section(rig: Rig, logs: Sequence[Experiment], found: Replay) -> Section:
    """Logs beside what the rig makes of their inputs."""
    unit = rig.signals.unit_of("output")
    tops, errors = [], []
    for i, log in enumerate(logs):
        made, colour = found.simulated[log.name]["output"], CYCLE[i % (len(CYCLE) - 1)]
        tops.append(curve(log.name, log.time, log["output"], colour, width=1.4))
        tops.append(curve(f"{log.name}, the rig", log.time, made, "ideal", width=1.1, group="the rig"))
        errors.append(curve(log.name, log.time, log["output"] - made, colour, width=1.1))
    rows = tuple((name, number(one.gof), number(one.rmse)) for name, one in found.logs.items())
    table = TableOf(
        ("experiment", "GOF", with_unit("RMSE", unit)), rows, "The output, measured and simulated"
    )
    figure = Figure(
        "Logs, and the rig on their inputs",
        "Every experiment in colour, the rig in black; below, what it leaves.",
        f"Curves over time: {', '.join(log.name for log in logs)} as measured, and simulated.",
        (
            Panel(_TIME, Axis(with_unit("output", unit)), tuple(tops), height=340),
            Panel(_TIME, Axis(with_unit("error", unit)), (*errors, Rule(0.0)), height=190),
        ),
        table,
    )
    return Section("Logs", (*warnings(found.warnings), *notes(found.notes)), figures=(figure,))


# ------------------------------------------------------------------------------------------ controller


def controller_section(controller: Controller, rig: str | None = None) -> Section:
    """What a controller.toml says; ``rig``: the SHA-256 of the rig on the same page."""
    integral = ", then the integrator" if controller.integrator else ""
    gain = "the gain schedule" if controller.scheduled else f"{controller.gain:.4g}"
    told = (
        (
            f"{controller.name}: error → {controller.transfer} → × {gain}{integral}, every "
            f"{controller.sample_time:g} s."
        ),
        *notes(_designed_from_another(controller, rig)),
    )
    spans = vars(controller.ranges).items()
    rows = tuple((name, f"{span[0]:g} to {span[1]:g}") for name, span in spans if span is not None)
    tables = (TableOf(("signal", "range"), rows, "What the signals can reach"),)
    return Section(
        "Controller", told, tables, figures=(_schedule(controller),) if controller.scheduled else ()
    )


def _designed_from_another(controller: Controller, digest: str | None) -> tuple[str, ...]:
    source = controller.designed_from
    other = digest is not None and source is not None and source.sha256 != digest
    return ("this controller was designed from another rig than the one above",) * other


def _schedule(controller: Controller) -> Figure:
    unit = controller.units.schedule
    at, gains = np.array(controller.schedule.breakpoints), np.array(controller.gains)
    beyond = np.linspace(at[0] - 0.2 * (at[-1] - at[0]), at[-1] + 0.2 * (at[-1] - at[0]), 300)
    table = Line("schedule table", beyond, controller.gain_at(beyond), "running", width=2.2)
    dots = Line("breakpoints", at, gains, "running", "none", dots=7.0)
    return Figure(
        "The gain schedule",
        "Straight between breakpoints, held beyond them.",
        "Curve: the gain over the scheduling signal.",
        (
            Panel(
                Axis(with_unit("scheduling signal", unit)),
                Axis("gain", from_zero=True),
                (table, dots),
                height=260,
            ),
        ),
        TableOf(
            (with_unit("at", unit), "gain"),
            tuple((number(p), number(g)) for p, g in zip(at, gains)),
            "The schedule",
        ),
    )


# --------------------------------------------------------------------------------------------- folder


def firmware_section(
    manifest: Mapping[str, Any], made_from: str | None = None, faults: Sequence[str] = ()
) -> Section:
    """What a manifest says of the generated C: its size, and what is proved of it; ``made_from``: the SHA-256
    of the controller.toml on the same page. ``faults``: why the C that stands there may be another one."""
    bound, sizes = manifest["error_bound"]["quantisation"], manifest["sizes"]
    told = (
        (
            f"{manifest['name']} in {manifest['arithmetic']} with {manifest['memory']} memory, every "
            f"{manifest['sample_time']:g} s. Its state takes {sizes['state_bytes']} B, its tables "
            f"{sizes['table_bytes']} B. Against the same controller in float64 the signal ahead of the "
            f"integrator is off by {bound['operator']:.3g} at most, which is proved."
        ),
        *warnings((*faults, *_made_from_another(manifest, made_from))),
    )
    rows = tuple(
        (p["node"], number(p["worst"]), p["type"], number(p["margin_bits"]), p["how"])
        for p in manifest["proofs"]
    )
    table = TableOf(
        ("sum or signal", "worst case (counts)", "type", "margin (bits)", "how it was proved"), rows, "Proofs"
    )
    proved = [p for p in manifest["proofs"] if p["margin_bits"] is not None]
    figures = (_margins(proved, table),) if proved else ()
    return Section(f"C in {manifest['arithmetic']}", told, () if figures else (table,), figures=figures)


def _made_from_another(manifest: Mapping[str, Any], digest: str | None) -> tuple[str, ...]:
    inputs = manifest.get("inputs")
    named = inputs.get("controller.toml") if isinstance(inputs, dict) else None
    other = digest is not None and named != digest
    return ("this C was generated from another controller.toml than the one above",) * other


def _margins(proofs: Sequence[Mapping[str, Any]], table: TableOf) -> Figure:
    names = tuple(p["node"] for p in proofs)[::-1]
    bits = np.array([p["margin_bits"] for p in proofs], float)[::-1]
    bars = Bars(
        "margin", np.arange(len(names), dtype=float), bits, "good", names=names, across=True, width=0.7
    )
    panel = Panel(
        Axis("bits left in the worst case", from_zero=True),
        Axis("", places=names),
        (bars,),
        height=90 + 24 * len(names),
    )
    return Figure(
        "How far every sum stays from overflow",
        "Bits between the proved worst case and the largest number of its type, for any input whatever.",
        f"Bars: bits of margin of {', '.join(names)}.",
        (panel,),
        table,
        linked=False,
    )


def verification_section(found: Mapping[str, Any], folder: Path | None = None) -> Section:
    """What ``focgen verify --json`` found on every target; ``folder``: where what it speaks of stands."""
    ran = {name: one for name, one in found["targets"].items() if "skipped" not in one}
    rows = tuple(_compared(name, one) for name, one in found["targets"].items())
    verdict = "holds" if found["holds"] else "does NOT hold"
    skipped = [
        f"skipped on {name}: {one['skipped']}" for name, one in found["targets"].items() if "skipped" in one
    ]
    which = f"{found['name']} ({found['arithmetic']}{f', in {folder}' if folder else ''})"
    told = (
        f"The comparison of {which} with the reference {verdict}.",
        *_compared_files(found),
        *warnings(found["differences"]),
    )
    table = TableOf(
        ("target", "samples equal", "largest error", "proven bound"),
        rows,
        "The C against the reference, ahead of the integrator",
    )
    figures = (_used(ran, table),) if ran else ()
    return Section("Verification", (*told, *notes([*skipped, *found["notes"]])), (table,), figures=figures)


def _compared_files(found: Mapping[str, Any]) -> tuple[str, ...]:
    """Which files it speaks of, so that whoever has a folder can see whether it is this one."""
    digest = found.get("files", {}).get("manifest.json")
    if not digest:
        return ("It does not say which files it compared.",)
    return (f"It speaks of the folder whose manifest.json has the SHA-256 {digest}.",)


def _compared(name: str, one: Mapping[str, Any]) -> tuple[str, ...]:
    if "skipped" in one:
        return name, "skipped", "–", "–"
    error = one["max_error"] or {}
    equal = f"{one['samples'] - one['mismatches']} of {one['samples']}"
    return name, equal, number(error.get("operator")), number((one["error_bound"] or {}).get("operator"))


def _used(ran: Mapping[str, Any], table: TableOf) -> Figure:
    """How much of the proven bound the largest error seen takes."""
    names = tuple(
        name for name, one in ran.items() if one["max_error"] and (one["error_bound"] or {}).get("operator")
    )
    shares = np.array(
        [100.0 * ran[n]["max_error"]["operator"] / ran[n]["error_bound"]["operator"] for n in names]
    )
    bars = Bars("largest error", np.arange(len(names), dtype=float), shares, "model", names=names, width=0.5)
    return Figure(
        "The largest error seen, as a share of the proven bound",
        "Beyond 100 % the proof would be wrong; far below it, the inputs did not find the worst case.",
        f"Bars: largest error as a share of the bound on {', '.join(names)}.",
        (
            Panel(
                Axis("target", places=names),
                Axis("share of the bound (%)", from_zero=True),
                (bars,),
                height=260,
            ),
        ),
        table,
    )
