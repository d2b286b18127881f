"""A diagnosis in a few sentences: where, which, how far, and what to do next."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from focgen.diagnosis.model import Candidate, Diagnosis, Estimate, Found

_SHOWN = 3  # parameters of an effect
_SURE = 1.0  # of a value: an interval that is wider says nothing of its size
_LIKELY = 0.5  # confidence of a cause: with less it is not the likeliest
_MEANS = (
    "A confidence is a probability, measured on the simulated rigs of docs/diagnosis.md: of names "
    "given at 90 % "
    "there, nine in ten are right."
)


def diagnosis_text(found: Diagnosis, units: Mapping[str, str], out: str) -> str:
    """The diagnosis for people; ``units`` by role, ``out`` the folder it is written to."""
    lines = [_where(found), *_which(found), _how_far(found, units), *_next(found)]
    lines += [f"warning: {w}" for w in found.warnings] + [f"note: {n}" for n in found.notes]
    return "\n".join([*lines, f"written to {out}"])


def _where(found: Diagnosis) -> str:
    where, share = found.where, found.where.share
    if found.verdict == "none":
        return "Where: nowhere; what is left does not depend on what was done to the rig."
    if where.stage is None:
        return "Where: these logs do not tell the stage."
    how = (
        "inferred from the dynamics, not from its own signals"
        if where.inferred
        else "seen in its own signals"
    )
    part = f" with {share[where.stage]:.0%} of the gap" if share.get(where.stage) else ""
    return f"Where: the {where.stage}{part}, {how}."


def _which(found: Diagnosis) -> list[str]:
    if found.verdict == "parameters":
        return [
            f"Which: no effect; the rig's own numbers were off, and {found.refitted_rig} has better ones."
        ]
    if found.verdict == "none":
        return ["Which: no effect."]
    said = [_cause(cause) for cause in found.causes]
    said += [_unexplained(place, what) for place, what in found.unexplained.items()]
    first = f"Which: {said[0]}" if said else "Which: none that is known."
    also = [f"  also: {one}" for one in said[1:]]
    return [first, *also, *_nearest(found), *([_MEANS] if found.causes else [])]


def _cause(cause: Found) -> str:
    best, *others = cause.candidates
    whole = "its departure from the described controller" if cause.stage == "controller" else "the gap"
    size = _size(best)
    rivals = f"; it may as well be {_listed(others)}" if others else ""
    if sum(c.confidence for c in cause.candidates) < _LIKELY:
        rivals += "; likelier it is something else, as the notes say"
    return (
        f"{best.effect} in the {cause.stage}{size}, {best.confidence:.0%} confident, "
        f"{max(cause.shrink, 0.0):.0%} of {whole}{rivals}."
    )


def _listed(candidates: list[Candidate]) -> str:
    return ", ".join(f"{c.effect} ({c.confidence:.0%})" for c in candidates)


def _size(candidate: Candidate) -> str:
    """How large it is, else the parameters that are known, with their units."""
    sizes = candidate.sizes or {k: e for k, e in candidate.parameters.items() if k != "scale"}
    known = [_value(name, e) for name, e in sizes.items() if _is_known(e)]
    return f" ({', '.join(known[:_SHOWN])})" if known else ""


def _is_known(estimate: Estimate) -> bool:
    low, high = estimate.ci95
    return 0.5 * (high - low) < _SURE * abs(estimate.value)


def _value(name: str, estimate: Estimate) -> str:
    half = 0.5 * (estimate.ci95[1] - estimate.ci95[0])
    return f"{name} {estimate.value:.3g} ± {half:.1g} {estimate.unit}".rstrip()


_DISTURBED = {
    ("low_frequency", "slow_swings"): "slow swings that no input predicts",
    ("pushed",): "something that pushes the rig at its own pace, predicted by no input",
    ("tonal", "hums"): "a tone that no input predicts",
    ("bursts",): "bursts that no input predicts",
}
"""By its names in diagnosis.json, of today and of before, what is said of a disturbance."""


def _unexplained(place: str, what: Mapping[str, Any]) -> str:
    """What is left, and what it goes with."""
    parts = [part for part in what.get("depends_on", ()) if part != "nothing"]
    parts += [words for names, words in _DISTURBED.items() if any(what.get(name) for name in names)]
    on = f"; it goes with {', '.join(parts)}" if parts else ""
    return f"something from {place} that no effect of the library explains{on}."


def _nearest(found: Diagnosis) -> list[str]:
    """The family that comes nearest where nothing was found; beside what was, a note says it of each
    place."""
    near = min(found.fits, key=lambda fit: fit.error, default=None)
    if near is None or found.causes or not found.unexplained:
        return []
    return [f"  nearest: {near.effect}, which by itself leaves {near.error:.0%} of the error where it acts."]


def _how_far(found: Diagnosis, units: Mapping[str, str]) -> str:
    gap, unit = found.gap, units.get("output") or found.gap.unit
    text = (
        f"How far: the output is off by {gap.as_given:.3g} {unit} as given, {gap.refitted:.3g} with "
        f"its own numbers refitted, {gap.explained:.3g} with what was found; the noise is {gap.floor:.3g}."
    )
    if found.shrink is None or found.shrink_interval is None:
        return text
    low, high = found.shrink_interval
    if found.shrink <= 0.0:
        return f"{text} On new experiments it brings the output no closer ({low:.0%} to {high:.0%})."
    share = f"{found.shrink:.0%} ({low:.0%} to {high:.0%})"
    return f"{text} For new experiments {share} of what can be explained will go."


def _next(found: Diagnosis) -> list[str]:
    if found.next_experiment:
        proposed = found.next_experiment
        file = f" (its input: {proposed.inputs['file']})" if "file" in proposed.inputs else ""
        return [f"Next: record {proposed.what}{file}, for {proposed.why}."]
    if found.verdict in ("named", "set"):
        return [f"Next: check the promise on a new log, `focgen replay {found.augmented_rig} LOG`."]
    return []


def diagnosis_story(found: Diagnosis, units: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """The same sentences apart: "where", "which", "far" and "next"."""
    return {
        "where": (_where(found),),
        "which": tuple(_which(found)),
        "far": (_how_far(found, units),),
        "next": tuple(_next(found)),
    }
