"""What is to be said about an identified regulator or sensor, in the field's words."""

from __future__ import annotations

from collections.abc import Sequence

from focgen.identification.directions import UpDown
from focgen.identification.input_noise import attenuation
from focgen.identification.shapes import MARGIN, Fitted, delay_seconds

_WORDS = {
    "regulator": ("fills", "vents", "pressure", "the valve's asymmetry"),
    "sensor": ("rises", "falls", "output", ""),
}
_MATERIAL = 0.005  # of a gain


def notes_of(
    stage: str,
    given: Sequence[str],
    chosen: Fitted,
    fits: Sequence[Fitted],
    up_down: UpDown | None,
    step: float,
) -> tuple[str, ...]:
    """Sentences on a stage's fit; ``given`` names all experiments, ``step`` is the sample time in s."""
    records = chosen.problem.records
    used = {r.name for r in records}
    said = [*early_told(max(-delay_seconds(chosen, step), 0.0), step, _WORDS[stage][2])]
    said += _directions(stage, chosen, up_down) + _rate(stage, chosen, step) + _rivals(chosen, fits)
    said += [f"{r.name}: begins with its step; taken as at rest at 0 before" for r in records if r.rests]
    if left := [name for name in given if name not in used]:
        said.append(f"{', '.join(left)}: not used, too short or without the {stage}'s two signals")
    compared = sum(map(len, fits[0].problem.records))
    if compared < sum(map(len, records)):
        said.append(f"the shapes were compared on {compared} samples, the one taken was fitted to all")
    return (*said, *_attenuated(chosen))


def early_told(lead: float, step: float, signal: str) -> tuple[str, ...]:
    """That a ``signal`` answers ``lead`` s ahead of the command's rows, ``step`` s apart, where it does; or
    behind them, where that is less than 0."""
    if not lead:
        return ()
    if lead < 0.0:
        what = f"{-lead:.2g} s ({-lead / step:.2g} samples) behind its command: columns out of step, it seems"
        return (f"the {signal} answers {what}, and written as a lead; give --delay where it is a dead time",)
    what = f"{lead:.2g} s ({lead / step:.2g} samples) ahead of its command, as no rig does"
    why = "its rows have a command beside what was read later; written as lead in [signals]"
    return (f"the {signal} answers {what}: {why}",)


def _directions(stage: str, chosen: Fitted, found: UpDown | None) -> list[str]:
    rises, falls, signal, effect = _WORDS[stage]
    if not chosen.shape.poles:
        return []
    if found is None:
        return [f"whether the {signal} falls as it rises cannot be seen; log steps up and down, each held"]
    if found.one_line_will_do:
        return []
    named = f"; `focgen diagnose` names {effect}" if effect else ""
    times = f"{rises} in {found.rising[0]:.2g} s and {falls} in {found.falling[0]:.2g} s"
    return [f"{times}: one linear {stage} cannot do both; the one written lies between{named}"]


def _rate(stage: str, chosen: Fitted, step: float) -> list[str]:
    if chosen.shape.poles:
        return []
    if chosen.shape.delayed and 0.0 <= chosen.report.parameters["delay"][0] <= step * 1.001:
        return [
            (
                f"the {stage} follows within one sample of {step:g} s; how fast cannot be seen, and a dead "
                "time of one sample stands for it"
            )
        ]
    return [f"no dynamics of the {stage} are seen at {step:g} s a sample; sample faster to see them"]


def _rivals(chosen: Fitted, fits: Sequence[Fitted]) -> list[str]:
    """Other shapes of no more parameters that fit as well."""
    alike = [
        f.report.shape
        for f in fits
        if f.shape != chosen.shape
        and not f.report.refused
        and f.shape.parameters <= chosen.shape.parameters
        and f.report.bic < chosen.report.bic + MARGIN
    ]
    if not alike:
        return []
    return [f"{' and '.join(alike)} fits as well; log steps at a higher rate to tell them apart"]


def _attenuated(chosen: Fitted) -> list[str]:
    """Noise on a measured input makes its gain look smaller, by the noise's share of what drives the fit."""
    share = attenuation(chosen.problem, chosen.solved)
    if share <= max(_MATERIAL, chosen.half["gain"]):
        return []
    return [f"noise on the curvature makes the gain look smaller, by up to {share:.1%}; take larger swings"]
