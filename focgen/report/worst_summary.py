"""What becomes of a loop within its rig's uncertainty, as a JSON payload and as text."""

from __future__ import annotations

import math
from typing import Any

from focgen.loop.worst import Extreme, Worst
from focgen.report.page import TableOf, text_table
from focgen.rig.corners import differences
from focgen.rig.rig import Uncertainty

_MARGINS = ("phase_deg", "gain_db", "delay_s")
_STEPS = ("overshoot_pct", "settling_s")
_MEANING = {
    "phase_deg": "phase margin (°)",
    "gain_db": "gain margin (dB)",
    "delay_s": "delay margin (s)",
    "overshoot_pct": "largest overshoot (%)",
    "settling_s": "longest settling (s)",
}


def worst_payload(worst: Worst) -> dict[str, Any]:
    """The worst values, those of the rig as given, and ``at`` which pressure or set point of which corner."""
    extremes = {name: getattr(worst, name) for name in _MEANING}
    return {
        **{name: extreme.value for name, extreme in extremes.items()},
        "stable": worst.stable,
        "nominal": {name: extreme.nominal for name, extreme in extremes.items()},
        "at": {
            name: {"pressure" if name in _MARGINS else "setpoint": extreme.at, "off": _nested(extreme.off)}
            for name, extreme in extremes.items()
        },
        "corners": worst.corners,
        "simulated": [_nested(off) for off in worst.simulated],
        "out_of_reach": list(worst.beyond),
    }


def _nested(off: Uncertainty) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for stage, key, value in differences(off):
        found.setdefault(stage, {})[key] = value
    return found


def worst_text(worst: Worst) -> str:
    """The worst for people: a table, and the corners that it names."""
    return "\n".join([text_table(worst_table(worst)), *worst_sentences(worst)])


def worst_sentences(worst: Worst) -> list[str]:
    """The corners that the table names, whether all are stable, and what was left out."""
    lines = [f"{letter}: {corner_text(off)}" for off, letter in _letters(worst).items()]
    if not worst.stable:
        lines.append("the loop is not stable in every corner")
    if worst.beyond:
        points = ", ".join(f"{point:.4g}" for point in worst.beyond)
        lines.append(f"out of the command's reach in a corner, and left out there: {points}")
    return lines


def _letters(worst: Worst) -> dict[Uncertainty, str]:
    """A letter for every corner in which something is worst."""
    named = dict.fromkeys(getattr(worst, name).off for name in _MEANING)
    return {off: _letter(i) for i, off in enumerate(off for off in named if _nested(off))}


def _letter(index: int) -> str:
    return "ABCDE"[index]


def worst_table(worst: Worst) -> TableOf:
    """Margins and steps as given, at their worst, and where that is."""
    letters = _letters(worst)
    rows = tuple(_cells(name, getattr(worst, name), letters) for name in _MEANING)
    heads = ("within the uncertainty", "as given", "worst", "at", "corner")
    return TableOf(
        heads,
        rows,
        f"The worst within the rig's uncertainty: margins in {worst.corners} corners, steps in "
        f"{len(worst.simulated)} of them",
    )


def _cells(name: str, extreme: Extreme, letters: dict[Uncertainty, str]) -> tuple[str, ...]:
    place = f"{'p' if name in _MARGINS else 'set point'} = {extreme.at:.4g}"
    values = (_number(extreme.nominal), _number(extreme.value))
    return (_MEANING[name], *values, place, letters.get(extreme.off, "as given"))


def _number(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.3g}"


def corner_text(off: Uncertainty) -> str:
    """By how much what is off, as "actuator gain +20 %, time −20 %; sensor time +10 %"."""
    return "; ".join(
        f"{stage} " + ", ".join(f"{key} {_percent(value)}" for key, value in parts.items())
        for stage, parts in _nested(off).items()
    )


def _percent(value: float) -> str:
    return f"{'−' if value < 0.0 else '+'}{abs(100.0 * value):.3g} %"
