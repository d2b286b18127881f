"""A study of the memory as a page."""

from __future__ import annotations

from collections.abc import Collection

from focgen.report.page import Page, Picture, Section
from focgen.report.study_summary import band_text, ideal_table, plant_table, rows_table, sample_times
from focgen.studies.model import Study

_CAPTIONS = {
    "accuracy.png": "Error of the memory operator: the worst of a step, a ramp, a sine and noise, each "
    "relative to its largest exact output, and the bound that is proved",
    "pareto.png": "What accuracy costs, short and exponential memory side by side",
    "frequency.png": "What the memory adds to phase and magnitude, over the band that matters to the loop",
    "loops.png": "A step of the closed loop, and its distance from infinite memory",
    "plant.png": "The plant simulated with short memory in its denominator never arrives",
}


def study_page(study: Study, pictures: Collection[str]) -> Page:
    """The page; ``pictures`` are the names of those that lie beside it."""

    def shown(*names: str) -> tuple[Picture, ...]:
        return tuple(Picture(name, _CAPTIONS[name]) for name in names if name in pictures)

    tables = tuple(rows_table(study, h) for h in sample_times(study))
    sections = [
        Section("Accuracy and cost", (), tables, shown("accuracy.png", "pareto.png"), ("study.json",)),
        Section(
            "In the loop",
            (f"The band is {band_text(study)}.",),
            (ideal_table(study),),
            shown("frequency.png", "loops.png"),
        ),
    ]
    if study.plant is not None:
        sentence = (
            "A short memory forgets in the denominator, too: the simulated plant ends elsewhere, for good."
        )
        sections.append(Section("In a plant", (sentence,), (plant_table(study),), shown("plant.png")))
    if study.notes:
        sections.append(Section("What has to be said", study.notes))
    return Page(f"How much memory {study.controller.name} needs", study.recommendation, tuple(sections))
