"""How the results of the chain are shown: model, controller, loop, C, its verification and its costs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from focgen.codegen.generate import Generated
from focgen.identification.identification import Identification
from focgen.loop.design import Design
from focgen.loop.simulate import Simulation
from focgen.report.control_summary import (
    mean_settling,
    points_table,
    schedule_lines,
    setpoints_table,
    specification_line,
)
from focgen.report.figures import Axis, Bars, Figure, Panel
from focgen.report.firmware_summary import controller_title, costs_table, verification_payload
from focgen.report.identification_summary import parameter_table, stage_text
from focgen.report.page import TableOf
from focgen.report.pages.chain import firmware_section, verification_section
from focgen.report.pages.control import design_sections, simulation_lead, simulation_sections
from focgen.report.pages.identification import identification_lead, identification_sections
from focgen.report.pages.parts import figures_of, notes, number, sentence, warnings
from focgen.report.results.view import Rows, View
from focgen.report.style import CYCLE
from focgen.rig.proposal import Proposal
from focgen.verification.costs import Costs
from focgen.verification.verify import Verification

_PROVED = ("node", "worst", "type", "margin_bits", "how")


# -------------------------------------------------------------------------------------------- proposal


def _proposed(found: Proposal) -> str:
    roles = ", ".join(f"{role} {column}" for role, column in found.rig.signals.columns().items())
    doubts = "1 doubt" if len(found.doubts) == 1 else f"{len(found.doubts)} doubts"
    return f"{found.rig.name}: {roles}; {doubts}"


def _roles(found: Proposal) -> Rows:
    """A row for each role, the time among them."""
    signals, ranges = found.rig.signals, found.rig.ranges
    rows = []
    for role, column in {"time": signals.time, **signals.columns()}.items():
        low, high = getattr(ranges, role, None) or (None, None)
        unit = "s" if role == "time" else signals.units.get(role)
        rows.append({"role": role, "column": column, "unit": unit, "low": low, "high": high})
    return rows


def _roles_table(found: Proposal) -> TableOf:
    cells = (
        (row["role"], row["column"], row["unit"] or "?", number(row["low"]), number(row["high"]))
        for row in _roles(found)
    )
    caption = "The rig that is proposed; print() shows its file"
    return TableOf(("role", "column", "unit", "from", "to"), tuple(cells), caption)


PROPOSAL = View[Proposal](
    _proposed,
    lambda found: f"One sample every {found.rig.sample_time:g} s. Next: {found.next}",
    _roles_table,
    _roles,
    lambda found: (),
    lambda found: tuple(f"Unsure: {sentence(doubt)}" for doubt in found.doubts),
)


# -------------------------------------------------------------------------------------- identification


def _identified(found: Identification) -> str:
    if found.joint is None:
        return f"{found.rig.name}: {', '.join(found.stages)} identified"
    joint = found.joint
    delay = f", delay {joint.delay:.3g} s" if joint.delay else ""
    fits = f"GOF {found.gof['rig']['mean']:.3f} of {len(found.experiments)} experiments"
    return f"{found.rig.name}: T {joint.T:.4g}, α {joint.alpha:.4g}{delay}, {fits}"


def _parameters(found: Identification) -> TableOf | None:
    return None if found.joint is None else parameter_table(found)


def _experiments(found: Identification) -> Rows:
    """A row for each experiment, or for each stage where the actuator was not asked for."""
    if found.joint is None:
        return [{"stage": name, "shape": f.shape, "gof": f.gof} for name, f in found.stages.items()]
    rows = []
    for fit in found.experiments:
        row: dict[str, Any] = {"experiment": fit.name, "level": fit.level}
        for key in ("K", "T", "alpha"):
            low, high = fit.ci95[key]
            row |= {key: getattr(fit, key), f"{key}_low": low, f"{key}_high": high}
        models = {f"gof_{m}": runs.get(fit.name) for m, runs in found.gof.items()}
        rows.append(row | {"offset": fit.offset} | models)
    return rows


IDENTIFICATION = View[Identification](
    _identified,
    lambda found: (
        identification_lead(found) if found.joint else " ".join(map(stage_text, found.stages.values()))
    ),
    _parameters,
    _experiments,
    lambda found: figures_of(identification_sections(found)),
    lambda found: (*warnings(found.warnings), *notes(found.notes)),
)


# -------------------------------------------------------------------------------------- the closed loop


def _designed(found: Design) -> str:
    kept = "" if found.holds else ", NOT as specified"
    worst = min(found.margins, key=lambda point: point.running.phase_deg).running
    return (
        f"{found.controller.name}: settles in {number(found.settling_s)} s, overshoot "
        f"{found.overshoot_pct:.2g} %, phase margin {worst.phase_deg:.3g}°, "
        f"{found.controller.arithmetic}{kept}"
    )


def _points(found: Design) -> Rows:
    """A row for each operating point."""
    margins = {one.pressure: one.running for one in found.margins}
    rows = []
    for point in found.points:
        row = {key: getattr(point, key) for key in ("reference", "pressure", "command", "K", "K_o", "gain")}
        row |= asdict(point.proof) | {"peak_pressure": point.peak_pressure}
        loop = margins[point.pressure]
        rows.append(row | {"phase_margin_deg": loop.phase_deg, "gain_margin_db": loop.gain_db})
    return rows


def _design_figures(found: Design) -> Sequence[Figure]:
    return figures_of(design_sections(found, found.rig)) if found.rig is not None else ()


DESIGN = View[Design](
    _designed,
    lambda found: f"{schedule_lines(found)[0]}. {sentence(specification_line(found))}",
    points_table,
    _points,
    _design_figures,
    lambda found: notes(found.notes),
)


def _simulated(found: Simulation) -> str:
    settled = sum(one.verdict == "settles" for one in found.setpoints)
    over = max(one.overshoot_pct for one in found.setpoints)
    return (
        f"{found.rig.name}: {settled} of {len(found.setpoints)} set points settle, in "
        f"{number(mean_settling(found))} s, overshoot {over:.2g} %, {found.arithmetic}, {found.remembers}"
    )


_MEASURED = ("reference", "start", "pressure", "settling_s", "overshoot_pct", "steady_error", "peak_pressure")

SIMULATION = View[Simulation](
    _simulated,
    simulation_lead,
    setpoints_table,
    lambda found: [{key: getattr(r, key) for key in (*_MEASURED, "verdict")} for r in found.setpoints],
    lambda found: figures_of(simulation_sections(found)),
    lambda found: notes(found.notes),
)


# ------------------------------------------------------------------------------------------------- C


def _generated(found: Generated) -> str:
    made, bound = found.manifest, found.manifest["error_bound"]["quantisation"]["operator"]
    sizes = f"{made['sizes']['state_bytes']} B state, {made['sizes']['table_bytes']} B tables"
    return f"{made['name']}: {made['arithmetic']}, {made['memory']} memory, {sizes}, error bound {bound:.3g}"


GENERATED = View[Generated](
    _generated,
    lambda found: f"{firmware_section(found.manifest).sentences[0]} It lies in {found.folder}.",
    lambda found: TableOf(("file",), tuple((name,) for name in found.files)),
    lambda found: [{key: proof[key] for key in _PROVED} for proof in found.manifest["proofs"]],
    lambda found: firmware_section(found.manifest).figures,
)


def _verified(found: Verification) -> str:
    ran = {name: one for name, one in found.targets.items() if one.skipped is None}
    equal = "; ".join(f"{name} {one.samples - one.mismatches} of {one.samples}" for name, one in ran.items())
    verdict = "verified" if found.holds else "NOT verified"
    return f"{found.name}: {found.arithmetic}, {verdict}, samples equal: {equal or 'none ran'}"


def _targets(found: Verification) -> Rows:
    """A row for each target."""
    rows = []
    for name, one in found.targets.items():
        error, bound = one.max_error, one.error_bound or {}
        rows.append(
            {
                "target": name,
                "samples": one.samples,
                "mismatches": one.mismatches,
                "max_error": None if error is None else error.operator,
                "error_bound": bound.get("operator"),
                "within": one.within,
                "skipped": one.skipped,
            }
        )
    return rows


VERIFICATION = View[Verification](
    _verified,
    lambda found: verification_section(verification_payload(found)).sentences[0],
    lambda found: verification_section(verification_payload(found)).tables[0],
    _targets,
    lambda found: verification_section(verification_payload(found)).figures,
    lambda found: (*warnings(found.differences), *notes(found.notes)),
)


# --------------------------------------------------------------------------------------------- costs


def _counted(found: Costs) -> Rows:
    """A row for each controller and target."""
    rows = []
    for one in found.controllers:
        for target, cost in one.targets.items():
            row: dict[str, Any] = {"name": one.name, "arithmetic": one.arithmetic, "memory": one.memory}
            row |= {"length": one.length if one.memory == "short" else None, "target": target}
            for key in ("instructions_per_step", "cycles_per_step"):
                per = getattr(cost, key)
                row |= {key: None if per is None else per.mean}
                row |= {f"{key}_worst": None if per is None else per.worst}
            sizes = {key: getattr(cost, key) for key in ("flash_bytes", "ram_bytes", "stack_bytes")}
            rows.append(row | sizes | {"skipped": cost.skipped})
    return rows


def _costs(found: Costs) -> str:
    ran = [row for row in _counted(found) if row["instructions_per_step"] is not None]
    steps = "; ".join(f"{r['target']} {r['instructions_per_step']:.0f}" for r in ran[:6])
    names = ", ".join(dict.fromkeys(controller_title(one) for one in found.controllers))
    return f"{names}: instructions a step: {steps or 'none counted'}"


def _instructions(found: Costs) -> Sequence[Figure]:
    """Bars by target, a colour for each controller."""
    rows = [row for row in _counted(found) if row["instructions_per_step"] is not None]
    targets = tuple(dict.fromkeys(row["target"] for row in rows))
    titles = [controller_title(one) for one in found.controllers]
    if not rows:
        return ()
    width = 0.8 / len(titles)
    bars = []
    for i, (title, one) in enumerate(zip(titles, found.controllers)):
        there = [
            (t, per) for t in targets if t in one.targets and (per := one.targets[t].instructions_per_step)
        ]
        places = [targets.index(t) + (i - 0.5 * (len(titles) - 1)) * width for t, _ in there]
        tops = np.array([per.mean for _, per in there])
        bars.append(Bars(title, np.array(places), tops, CYCLE[i % len(CYCLE)], width=width))
    panel = Panel(
        Axis("target", places=targets),
        Axis("instructions a step, the mean of all", from_zero=True),
        tuple(bars),
    )
    caption = "What the core executes for one sample, counted on the emulated core."
    alt = f"Bars: instructions a step on {', '.join(targets)}."
    return (Figure("Instructions of a step", caption, alt, (panel,), costs_table(found), linked=False),)


def _skipped(found: Costs) -> Sequence[str]:
    every = {
        f"{name} skipped: {c.skipped}"
        for o in found.controllers
        for name, c in o.targets.items()
        if c.skipped
    }
    return notes(sorted(every))


COSTS = View[Costs](_costs, lambda found: f"{_costs(found)}.", costs_table, _counted, _instructions, _skipped)
