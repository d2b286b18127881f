"""The report of the demo: one section a step of the chain."""

from __future__ import annotations

from collections.abc import Sequence

from focgen.codegen.generate import Generated
from focgen.diagnosis.drawn import Drawn
from focgen.diagnosis.model import Diagnosis
from focgen.identification.identification import Identification
from focgen.loop.design import Design
from focgen.loop.simulate import Simulation
from focgen.present import present
from focgen.report.control_summary import (
    margins_table,
    memory_line,
    points_table,
    schedule_lines,
    setpoints_table,
)
from focgen.report.identification_summary import gain_text, parameter_table, quality_table
from focgen.report.page import Page, Picture, Section, TableOf
from focgen.report.pages.control import design_sections, simulation_sections
from focgen.report.pages.diagnosis import diagnosis_sections
from focgen.report.pages.identification import identification_sections
from focgen.report.pages.parts import figures_of
from focgen.report.pages.study import study_sections
from focgen.report.study_summary import rows_table
from focgen.rig.rig import Rig
from focgen.studies.results import Study
from focgen.verification.verify import Verification


def demo_page(
    identification: Identification,
    design: Design,
    simulation: Simulation,
    memory: Study,
    generated: dict[str, Generated],
    verified: dict[str, Verification],
    diagnosis: Diagnosis,
    sealed: tuple[str, ...],
    drawn: Drawn,
) -> Page:
    """The page; its pictures are in ``pictures/``, the C in ``firmware/``, the sealed case in
    ``diagnosis/``. ``drawn`` is what the figures of that case draw.
    """
    sections = (
        _model(identification),
        _controller(design, identification.rig),
        _loop(simulation),
        _memory(memory),
        _firmware(generated, verified),
        _diagnosis(diagnosis, sealed, drawn),
    )
    return Page(
        "From step tests to a verified fractional-order controller",
        demo_lead(identification, design, verified),
        sections,
    )


def demo_lead(identification: Identification, design: Design, verified: dict[str, Verification]) -> str:
    """The whole result in a few sentences."""
    gof, joint = identification.gof, present(identification.joint)
    samples = sum(v.targets["host"].samples for v in verified.values())
    wrong = sum(v.targets["host"].mismatches for v in verified.values())
    return (
        f"A fractional model with T = {joint.T:.3g} and α = {joint.alpha:.3g} fits six step tests with a "
        f"mean GOF of {gof['fom']['mean']:.3f} (one pole: {gof['iom_1p']['mean']:.3f}; three poles and two "
        f"zeros: {gof['iom_3p2z']['mean']:.3f}). Inverted, it gives a controller that settles in "
        f"{design.settling_s:.2f} s on average with at most {design.overshoot_pct:.1f} % overshoot. "
        f"Its C, in four arithmetics, equals the Python reference in {samples - wrong} of {samples} samples."
    )


def _notes(notes: Sequence[str]) -> tuple[str, ...]:
    return tuple(f"Note: {note}." for note in notes)


def _sentence(line: str) -> str:
    return f"{line[0].upper()}{line[1:]}."


def _model(found: Identification) -> Section:
    pictures = [
        Picture("pictures/fits.png", "Six steps, and the fractional model of each (as Fig. 5)"),
        Picture(
            "pictures/gof.png", "Goodness of fit of the fractional and the integer-order models (Table I)"
        ),
        Picture("pictures/models.png", "One step, four models, and what each leaves (as Fig. 6)"),
        Picture("pictures/parameters.png", "The parameters over the level, with 95 % intervals (as Fig. 7)"),
        Picture("pictures/loops.png", "Sines that the model was not fitted to: where it fails (as Fig. 8)"),
    ]
    return Section(
        "Model",
        (gain_text(found), *_notes(found.warnings)),
        (quality_table(found), parameter_table(found)),
        tuple(pictures),
        ("identified.toml", "rig.toml", "logs/steps.csv", "logs/sines.csv"),
        figures_of(identification_sections(found)),
    )


def _controller(design: Design, rig: Rig) -> Section:
    pictures = (
        Picture("pictures/schedule.png", "The gain schedule, and the formula it stands for"),
        Picture("pictures/margins.png", "The open loop, ideal and as it will run"),
    )
    formula, *rest = schedule_lines(design)
    return Section(
        "Controller",
        (formula, *map(_sentence, [*rest, memory_line(design)]), *_notes(design.notes)),
        (points_table(design), margins_table(design)),
        pictures,
        ("controller.toml",),
        figures_of(design_sections(design, rig)),
    )


def _loop(simulation: Simulation) -> Section:
    caption = "Output and command at seven set points, from rest, bit for bit as the C will run (as Fig. 10)"
    return Section(
        "Closed loop",
        _notes(simulation.notes),
        (setpoints_table(simulation),),
        (Picture("pictures/setpoints.png", caption),),
        (),
        figures_of(simulation_sections(simulation)),
    )


def _memory(study: Study) -> Section:
    pictures = (
        Picture(
            "memory/pareto.png", "Short and exponential memory: error against multiplications, and bytes"
        ),
        Picture(
            "memory/loops.png",
            "A step of the closed loop by memory, and how far it is from infinite memory's",
        ),
    )
    return Section(
        "Memory",
        (study.recommendation,),
        (rows_table(study, study.controller.sample_time),),
        pictures,
        ("memory/report.html", "memory/study.json"),
        figures_of(study_sections(study)),
    )


def _firmware(generated: dict[str, Generated], verified: dict[str, Verification]) -> Section:
    table = firmware_table(generated, verified)
    files = tuple(f"firmware/{a}/{made.plan.name}.c" for a, made in generated.items())
    return Section(
        "C",
        (
            (
                "Every sample of the C is compared with a reference that shares no code with it: output, "
                "increment and flags, in every bit. The error is against the same controller in float64."
            ),
        ),
        (table,),
        (),
        files,
    )


def _diagnosis(found: Diagnosis, sealed: tuple[str, ...], drawn: Drawn) -> Section:
    shown = {
        "ladder.png": "Where the gap is: measured signals put in place of simulated ones, stage by stage",
        "residual.png": "What the refitted model leaves, against level, rate, direction and time, "
        "and with the effect",
        "loops.png": "Output against input, measured and simulated, before and after",
        "candidates.png": "Which effect: the candidates, and how far each is behind the best",
        "waterfall.png": "How far: what parameters, effect and noise account for",
    }
    pictures = tuple(Picture(f"diagnosis/found/{name}", caption) for name, caption in shown.items())
    return Section(
        "A diagnosis, blind",
        (diagnosis_sentence(found, sealed),),
        (),
        pictures,
        ("diagnosis/found/diagnosis.json", "diagnosis/found/augmented.toml"),
        figures_of(diagnosis_sections(found, drawn)),
    )


def diagnosis_sentence(found: Diagnosis, sealed: tuple[str, ...]) -> str:
    """What the diagnosis says of the sealed rig, and what the seal says."""
    causes = [
        " or ".join(f"{c.effect} ({100.0 * c.confidence:.0f} %)" for c in cause.candidates)
        for cause in found.causes
    ]
    gof = found.gap.gof
    return (
        f"A rig with a sealed effect: the diagnosis says {' and '.join(causes) or found.verdict}, and takes "
        f"the goodness of fit from {gof['refitted']:.3f} to {gof['explained']:.3f} of a possible "
        f"{gof['possible']:.3f}. The seal says {', '.join(sealed) or 'nothing'}."
    )


def firmware_table(generated: dict[str, Generated], verified: dict[str, Verification]) -> TableOf:
    """Size, equality and error bound of each arithmetic."""
    rows = []
    for arithmetic, made in generated.items():
        result, sizes = verified[arithmetic].targets["host"], made.manifest["sizes"]
        rows.append(
            (
                arithmetic,
                f"{sizes['state_bytes']} B",
                f"{sizes['table_bytes']} B",
                f"{result.samples - result.mismatches} of {result.samples}",
                f"{present(result.max_error).operator:.2g}",
                f"{present(result.error_bound)['operator']:.2g}",
                "yes" if verified[arithmetic].holds else "NO",
            )
        )
    heads = ("arithmetic", "state", "tables", "samples equal", "largest error", "proven bound", "verified")
    units = {made.plan.controller.units.output for made in generated.values()} - {""}
    per_second = f"{units.pop()}/s" if len(units) == 1 else "output units per second"
    return TableOf(heads, tuple(rows), f"The C, ahead of the integrator, in {per_second}")
