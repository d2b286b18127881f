"""What is to be said about an identified regulator or sensor, in the field's words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.identification.directions import UpDown
from focgen.identification.rational import Record, responses
from focgen.identification.shapes import MARGIN, Fitted

_WORDS = {"regulator": ("fills", "vents", "pressure", "valve_asymmetry"), "sensor": ("rises", "falls", "output", "")}
_MATERIAL = 0.005  # of a gain
_NORMAL = 0.6745  # median of |x| of a standard normal x


def notes_of(
    stage: str,
    given: Sequence[str],
    chosen: Fitted,
    fits: Sequence[Fitted],
    up_down: UpDown | None,
    step: float,
) -> tuple[str, ...]:
    """Sentences on a stage's fit; ``given`` are the names of all experiments, ``step`` the sample time in s."""
    records = chosen.problem.records
    used = {r.name for r in records}
    said = [*_directions(stage, chosen, up_down), *_rate(stage, chosen, step), *_rivals(chosen, fits)]
    said += [f"{r.name}: begins with its step; taken as at rest at 0 before" for r in records if r.rests]
    if left := [name for name in given if name not in used]:
        said.append(f"{', '.join(left)}: not used, too short or without the {stage}'s two signals")
    compared = sum(map(len, fits[0].problem.records))
    if compared < sum(map(len, records)):
        said.append(f"the shapes were compared on {compared} samples, the one taken was fitted to all")
    return (*said, *_attenuated(stage, chosen))


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
    if chosen.shape.delayed and chosen.report.parameters["delay"][0] <= step * 1.001:
        return [
            f"the {stage} follows within one sample of {step:g} s; how fast cannot be seen, and a dead time of "
            "one sample stands for it"
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
    return [f"{' and '.join(alike)} fits as well; log steps at a higher rate to tell them apart"] if alike else []


def _attenuated(stage: str, chosen: Fitted) -> list[str]:
    """Noise on a measured input makes its gain look smaller, by the noise's share of what drives the fit."""
    if stage != "sensor":
        return []
    variance = np.mean([_noise(r) for r in chosen.problem.records])
    pulse = Record("pulse", np.eye(1, 4096, 2048)[0], np.zeros(4096), "linear", True)
    passed = responses(chosen.shape, chosen.solved.x, [pulse])[0][1][0]
    count = sum(map(len, chosen.problem.records))
    power = sum(float(np.sum((row - row.mean()) ** 2)) for row in (s[0] for _, s in chosen.solved.rows))
    share = float(variance * count * np.sum(passed**2) / power)
    if share <= max(_MATERIAL, chosen.half["gain"]):
        return []
    return [f"noise on the curvature makes the gain look smaller, by up to {share:.1%}; take larger swings"]


def _noise(record: Record) -> float:
    """Variance of the input's noise, from its second differences; an upper bound where the input is fast."""
    bend = np.abs(np.diff(record.drive, 2))
    return float((np.median(bend) / _NORMAL) ** 2 / 6.0)
