"""A study of the memory as a page: the recommendation, accuracy and cost, the loop, the plant."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from focgen.arrays import Array
from focgen.present import present
from focgen.report.figures import Area, Axis, Figure, Line, Mark, Panel, Rule, curve
from focgen.report.page import Page, Picture, Section, TableOf
from focgen.report.pages.parts import notes, number
from focgen.report.study import (
    ARITHMETIC_COLOURS,
    LEAST,
    PLACES,
    SHARES,
    chosen,
    own_rows,
    row_label,
)
from focgen.report.study_summary import band_text, ideal_table, plant_table, rows_table, sample_times
from focgen.report.style import CYCLE, GREY, with_unit
from focgen.studies.results import Curves, Row, Study

_LENGTHS = {"short": Axis("length L (past samples)", log=True), "exponential": Axis("exponentials")}
_ERROR = Axis("error / largest output", log=True)
_CAPTIONS = {
    "accuracy.png": "Error of the memory operator: the worst of a step, a ramp, a sine and noise, each "
    "relative to its largest exact output, and the bound that is proved",
    "pareto.png": "What accuracy costs, short and exponential memory side by side",
    "frequency.png": "What the memory adds to phase and magnitude, over the band that matters to the loop",
    "loops.png": "A step of the closed loop, and its distance from infinite memory",
    "plant.png": "The plant simulated with short memory in its denominator never arrives",
}


def study_page(study: Study, pictures: Collection[str] = ()) -> Page:
    """The page of a study; ``pictures`` are the names of those that lie beside it."""
    sections = study_sections(study, pictures)
    return Page(f"How much memory {study.controller.name} needs", study.recommendation, sections)


def study_sections(study: Study, pictures: Collection[str] = ()) -> tuple[Section, ...]:
    """Accuracy and cost, the loop, the plant, and what has to be said."""

    def beside(*names: str) -> tuple[Picture, ...]:
        return tuple(Picture(name, _CAPTIONS[name]) for name in names if name in pictures)

    tables = tuple(rows_table(study, h) for h in sample_times(study))
    shown = tuple(_accuracy(study, memory) for memory in PLACES if _of(study, memory))
    drawn = beside("accuracy.png", "pareto.png")
    parts = [Section("Accuracy and cost", (), tables, drawn, ("study.json",), (*shown, *_fronts(study)))]
    loops: tuple[Figure, ...] = (_frequency(study),) if any(c.omega for c in study.curves) else ()
    loops += (_loops(study),) if _closed(study) else ()
    drawn = beside("frequency.png", "loops.png")
    parts.append(
        Section(
            "In the loop", (f"The band is {band_text(study)}.",), (ideal_table(study),), drawn, figures=loops
        )
    )
    if study.plant is not None:
        told = "A short memory forgets in the denominator, too: the simulated plant ends elsewhere, for good."
        parts.append(
            Section(
                "In a plant", (told,), (plant_table(study),), beside("plant.png"), figures=(_plant(study),)
            )
        )
    if study.notes:
        parts.append(Section("What has to be said", notes(study.notes)))
    return tuple(parts)


def _of(study: Study, memory: str) -> list[Row]:
    place = PLACES[memory]
    return [r for r in own_rows(study) if r.memory == memory and getattr(r, place) is not None]


def _closed(study: Study) -> bool:
    return any(curves.time for curves in study.curves) and bool(chosen(study, "time"))


def _accuracy(study: Study, memory: str) -> Figure:
    """Error and proven bound against length, or against the number of exponentials."""
    marks, place = [], PLACES[memory]
    for arithmetic, colour in ARITHMETIC_COLOURS.items():
        rows = sorted(
            (r for r in _of(study, memory) if r.arithmetic == arithmetic), key=lambda r: getattr(r, place)
        )
        if rows:
            x = np.array([getattr(r, place) for r in rows], float)
            bounds = np.array([np.nan if r.bound is None else r.bound for r in rows])
            marks.append(Line(arithmetic, x, np.array([r.error for r in rows]), colour, dots=7.0))
            marks.append(Line(f"{arithmetic}, bound", x, bounds, colour, "dotted", 1.3, group="proven bound"))
    cells = tuple(
        (r.variant.label, r.arithmetic, number(r.error), number(r.bound)) for r in _of(study, memory)
    )
    return Figure(
        f"{memory.capitalize()} memory: what it leaves",
        "Error of the memory operator: the worst of a step, a ramp, a sine and noise, each relative to its "
        "largest exact output; dotted, what is proved that it cannot exceed.",
        f"Curves on logarithmic axes: error and proven bound over the size of {memory} memory, by "
        "arithmetic.",
        (Panel(_LENGTHS[memory], _ERROR, tuple(marks)),),
        TableOf(("memory", "arithmetic", "error", "bound"), cells, f"{memory.capitalize()} memory"),
    )


def _fronts(study: Study) -> tuple[Figure, ...]:
    """Error against cycles (multiplications where no target is named) and against bytes of state."""
    first = next((name for name in ("cycles", "instructions") if study.pareto.get(name)), "multiplies")
    panels = tuple(_front(study, cost) for cost in (first, "ram_bytes"))
    best = sorted({i for cost in (first, "ram_bytes") for i in study.pareto[cost]})
    rows = tuple(
        (r.variant.label, r.arithmetic, number(getattr(r, first)), number(r.ram_bytes), number(r.error))
        for r in (study.rows[i] for i in best)
    )
    return (
        Figure(
            "What accuracy costs",
            "Every variant by what it costs and what it leaves; the grey line joins those that no other "
            "beats in both.",
            "Points on logarithmic axes: error over cost of every variant, and the line of the best.",
            panels,
            TableOf(
                ("memory", "arithmetic", SHARES[first], SHARES["ram_bytes"], "error"),
                rows,
                "Best at their cost",
            ),
            linked=False,
        ),
    )


def _front(study: Study, cost: str) -> Panel:
    best = [study.rows[i] for i in study.pareto[cost]]
    marks: list[Mark] = [
        Line(
            "best at its cost",
            _costs(best, cost),
            np.array([r.error for r in best]),
            GREY,
            width=1.2,
            steps=True,
        )
    ]
    for memory in PLACES:
        for arithmetic, colour in ARITHMETIC_COLOURS.items():
            rows = [r for r in own_rows(study) if (r.memory, r.arithmetic) == (memory, arithmetic)]
            rows = [r for r in rows if getattr(r, cost) is not None]
            if rows:
                size = 7.0 if memory == "short" else 11.0
                name = f"{arithmetic}, {memory}{' (large)' if memory == 'exponential' else ''}"
                marks.append(
                    Line(
                        name, _costs(rows, cost), np.array([r.error for r in rows]), colour, "none", dots=size
                    )
                )
    return Panel(Axis(SHARES[cost], log=True), _ERROR, tuple(marks))


def _costs(rows: Sequence[Row], cost: str) -> Array:
    return np.array([getattr(r, cost) for r in rows], float)


def _how(row: Row, colour: str) -> dict[str, Any]:
    return {"colour": colour, "dash": "dashed" if row.memory == "exponential" else "solid", "width": 1.8}


def _frequency(study: Study) -> Figure:
    """What the memory adds to the controller's phase and magnitude, over the band that matters."""
    lines: list[tuple[Row, Curves, str]] = chosen(study, "omega")
    tops = [curve(row_label(r), c.omega, c.phase_deg, **_how(r, colour)) for r, c, colour in lines]
    bottoms = [curve(row_label(r), c.omega, c.magnitude_db, **_how(r, colour)) for r, c, colour in lines]
    ends = np.array([min(c.omega[0] for _, c, _ in lines), max(c.omega[-1] for _, c, _ in lines)])
    within = Area("±2°", ends, np.full(2, -2.0), np.full(2, 2.0), "measured")
    cross = [place for place in (study.band.crossover_low, study.band.crossover_high) if place is not None]
    rules = tuple(Rule(place, GREY, "dotted", upright=True) for place in cross)
    x = Axis("frequency (rad/s)", log=True)
    rows = tuple((row_label(r), number(r.phase_error_deg), number(r.magnitude_error_db)) for r, _, _ in lines)
    return Figure(
        "The controller's response against infinite memory",
        "What the memory adds to phase and magnitude. Upright dotted lines: the slowest and the fastest "
        "crossover of the loop.",
        "Curves over frequency: phase error and magnitude error by memory.",
        (
            Panel(x, Axis("phase error (°)"), (within, *tops, *rules)),
            Panel(x, Axis("magnitude error (dB)"), (*bottoms, *rules), height=230),
        ),
        TableOf(
            ("memory", "largest phase error (°)", "largest magnitude error (dB)"), rows, "Within the band"
        ),
    )


def _loops(study: Study) -> Figure:
    """The step to the middle set point by memory, and what it is off the ideal."""
    at = [ideal.sample_time for ideal in study.ideal].index(own_rows(study)[0].sample_time)
    ideal = study.ideal_curves[at]
    perfect, lines = np.array(ideal.output), chosen(study, "time")
    tops, bottoms = [curve("infinite memory", ideal.time, perfect, "ideal", width=1.2)], []
    for row, curves, colour in lines:
        there = np.interp(curves.time, ideal.time, perfect)  # each curve may be thinned in its own way
        off = 100.0 * np.abs(np.array(curves.output) - there) / abs(ideal.reference - perfect[0])
        tops.append(curve(row_label(row), curves.time, curves.output, **_how(row, colour)))
        bottoms.append(curve(row_label(row), curves.time, np.maximum(off, LEAST), **_how(row, colour)))
    time = Axis("time (s)")
    rows = tuple(
        (row_label(r), number(r.settling_s), number(r.overshoot_pct), number(r.margin_deg))
        for r, _, _ in lines
    )
    return Figure(
        f"A step of the closed loop, {lines[0][0].arithmetic}",
        "Above, the step by memory; below, how far it is off the loop with infinite memory.",
        "Curves over time: the output of the closed loop by memory, and its distance from infinite memory.",
        (
            Panel(
                time,
                Axis(with_unit("output", study.controller.units.measurement)),
                (*tops, Rule(present(ideal.reference), GREY)),
            ),
            Panel(time, Axis("off the ideal (% of step)", log=True), tuple(bottoms), height=230),
        ),
        TableOf(
            ("memory", "settling (s)", "overshoot (%)", "margin (°)"),
            rows,
            "The closed loop over all set points",
        ),
    )


def _plant(study: Study) -> Figure:
    """The plant's step, simulated with each memory in its denominator."""
    plant, marks = present(study.plant), []
    for i, row in enumerate(plant.rows):
        name = f"L = {row.length}" if row.length else f"{row.states} exponentials"
        marks.append(curve(name, plant.time, row.output, CYCLE[i % len(CYCLE)], width=2.0))
    marks.append(curve("exact", plant.time, plant.exact, "ideal", width=1.2))
    return Figure(
        "Short memory in a plant's denominator",
        f"A step of 1 into {plant.transfer}, simulated with each memory: where it ends, and when it leaves "
        "the exact course.",
        "Curves over logarithmic time: the plant's step with each memory, and the exact one.",
        (Panel(Axis("time after the step (s)", log=True), Axis("output"), tuple(marks)),),
        plant_table(study),
    )
