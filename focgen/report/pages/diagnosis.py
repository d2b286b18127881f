"""A diagnosis as a page: where, which, how far, what next, and what its numbers mean."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from focgen.diagnosis.drawn import Drawn
from focgen.diagnosis.model import Diagnosis, Estimate
from focgen.report.diagnosis_summary import diagnosis_story
from focgen.report.page import Page, Section, TableOf
from focgen.report.pages.diagnosis_figures import diagnosis_figures
from focgen.report.pages.parts import notes, number, sentence, warnings

_CONFIDENCE = (
    "A confidence is a probability. It was measured on simulated rigs whose effects were sealed until the "
    "diagnosis was made: of the names given there at 90 %, about nine in ten were right. So 96 % means that "
    "of a hundred diagnoses like this one about four name something else. It says how sure the name is, and "
    "nothing of how large the effect is."
)
_SHRINK = (
    "The share that will go is a promise for experiments that were not used. It counts from what is left "
    "when the rig's own numbers are refitted down to the noise, which no model takes away. Its interval is "
    "meant to hold nine times in ten."
)


def diagnosis_page(found: Diagnosis, drawn: Drawn | None, name: str) -> Page:
    """The page of a diagnosis of the rig ``name``; without figures of signals where ``drawn`` is None."""
    sections = diagnosis_sections(found, drawn)
    return Page(f"What the model of {name} lacks", diagnosis_lead(found, units_of(drawn)), sections)


def diagnosis_sections(found: Diagnosis, drawn: Drawn | None) -> tuple[Section, ...]:
    """Where, which, how far, what next, and what has to be said."""
    units = units_of(drawn)
    story = diagnosis_story(found, units)
    figures = diagnosis_figures(found, drawn, units)
    parts = [
        Section(
            "Where",
            _told(story["where"]),
            (_shares(found),) if found.where.share else (),
            figures=figures["where"],
        ),
        Section("Which", _told(story["which"]), sizes(found, units), figures=figures["which"]),
        Section("How far", _told(story["far"]), (), figures=figures["far"]),
    ]
    ahead = (*_told(story["next"]), *(_files(found) if found.verdict != "none" else ()))
    parts.append(
        Section("What next", ahead, (), (), ("diagnosis.json", found.refitted_rig, found.augmented_rig))
    )
    meaning = (_CONFIDENCE,) * bool(found.causes) + (_SHRINK,) * (found.shrink is not None)
    if meaning:
        parts.append(Section("What the numbers mean", meaning))
    said = (*warnings(found.warnings), *notes(found.notes))
    said += (
        ()
        if drawn
        else notes(
            ("the folder holds no signals.json, so that no signals are drawn; diagnose again for them",)
        )
    )
    return (*parts, Section("What has to be said", said)) if said else tuple(parts)


def units_of(drawn: Drawn | None) -> Mapping[str, str]:
    """The unit of each role, where it is known."""
    return drawn.units if drawn else {}


def _told(lines: Sequence[str]) -> tuple[str, ...]:
    """The sentences of the terminal without the word that leads them there: here it is the part's title."""
    heads = ("Where: ", "Which: ", "How far: ", "Next: ", "also: ", "nearest: ")
    found = []
    for line in lines:
        text = line.strip()
        head = next((head for head in heads if text.startswith(head)), "")
        rest = text.removeprefix(head)
        if not rest.startswith("A confidence is"):  # the page explains it at length
            found.append(sentence(f"{head}{rest}" if head in heads[4:] else rest))
    return tuple(found)


def diagnosis_lead(found: Diagnosis, units: Mapping[str, str]) -> str:
    """The answer in one paragraph."""
    story = diagnosis_story(found, units)
    return " ".join((*_told(story["where"]), *_told(story["which"])[:1], *_told(story["far"])))


def _files(found: Diagnosis) -> tuple[str, ...]:
    return (
        (
            f"{found.refitted_rig} is the rig with its own numbers refitted, {found.augmented_rig} the same "
            "with the effects in it. Both can be replayed, simulated and designed for."
        ),
    )


def _shares(found: Diagnosis) -> TableOf:
    rows = tuple((stage, f"{share:.1%}") for stage, share in found.where.share.items())
    return TableOf(("stage", "share of the gap"), rows, "The gap by stage")


def sizes(found: Diagnosis, units: Mapping[str, str]) -> tuple[TableOf, ...]:
    """Every candidate with its confidence, its sizes and the parameters of its form, in the log's units."""
    rows = []
    for i, cause in enumerate(found.causes, 1):
        for candidate in cause.candidates:
            head = (candidate.effect, str(i), cause.stage, f"{candidate.confidence:.0%}")
            known: list[tuple[str, Estimate | None]] = [*candidate.sizes.items()]
            known += [
                (f"{candidate.form}: {name}", e)
                for name, e in candidate.parameters.items()
                if name != "scale" and name not in candidate.sizes
            ]
            for name, estimate in known or [("–", None)]:
                rows.append((*head, name, *_cells(estimate, units)))
    if not rows:
        return ()
    heads = ("effect", "cause", "stage", "confidence", "size", "value", "95 % interval", "unit")
    return (TableOf(heads, tuple(rows), "What was found, with its size"),)


def _cells(estimate: Estimate | None, units: Mapping[str, str]) -> tuple[str, str, str]:
    if estimate is None:
        return "–", "–", ""
    unit = estimate.unit
    for role, known in units.items():
        unit = unit.replace(f"{role} unit", known or f"{role} unit")
    low, high = estimate.ci95
    return number(estimate.value), f"{number(low)} to {number(high)}", unit
