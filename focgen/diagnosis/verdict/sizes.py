"""The sizes of an effect that was found: its parameters with their intervals, in the units of the log."""

from __future__ import annotations

import numpy as np

from focgen.control.units import units_of_rig
from focgen.diagnosis.fitting.fit import FIXED, Fit
from focgen.diagnosis.hypotheses.rivals import Rival
from focgen.diagnosis.model import Estimate
from focgen.rig.effects import Parameter
from focgen.rig.placed import slot_in
from focgen.rig.rig import Actuator, Rig

_SLACK = 1e-3  # of an end: closer is at it
_ROLES = {
    "command": "command",
    "chamber": "pressure",
    "supply": "pressure",
    "load": "pressure",
    "reading": "output",
}


def estimates(of: Fit, which: int, rig: Rig) -> dict[str, Estimate]:
    """The parameters of candidate effect number ``which`` of a fit with 95 % intervals from its information,
    by name.
    """
    problem, candidate = of.problem, of.problem.candidates[which]
    place = problem.head + sum(len(c.form.parameters) for c in problem.candidates[:which])
    sigma = of.sse / max(len(of.innovations) - len(of.vector), 1)
    spread = np.sqrt(np.maximum(np.diag(np.linalg.pinv(of.information)) * sigma, 0.0))
    slot, found = slot_in(candidate.form, candidate.stage), {}
    for i, parameter in enumerate(candidate.form.parameters):
        v, s = of.vector[place + i], 1.96 * spread[place + i]
        scale = problem.references.scale(parameter, slot)
        ends = [
            float(scale * (np.exp(np.clip(e, -60, 60)) if parameter.log else e)) for e in (v - s, v, v + s)
        ]
        found[parameter.name] = Estimate(ends[1], (ends[0], ends[2]), unit_of_parameter(parameter, slot, rig))
    return found


def at_their_ends(rival: Rival) -> tuple[str, ...]:
    """The shares and factors of an effect that are as large, or as small, as is looked for. 0 and 1, none of
    something and all of it, are no such ends, nor are those between which no fit moves a number."""
    of, found = rival.fit, []
    place = of.problem.head
    for candidate in of.problem.candidates:
        for p in candidate.form.parameters:
            value = np.exp(of.vector[place]) if p.log else of.vector[place]
            ends = [e for e in (p.lower, p.upper) if np.isfinite(e) and abs(e) not in (0.0, 1.0)]
            plain = candidate.effect == rival.effect and not p.level and not p.time
            plain = plain and p.upper - p.lower > FIXED
            if plain and any(abs(value - end) <= _SLACK * abs(end) for end in ends):
                found.append(p.name)
            place += 1
    return tuple(found)


def unit_of_parameter(parameter: Parameter, slot: str, rig: Rig) -> str:
    """The unit of a parameter of a form at ``slot``: "bar", "deg/s", "1/V", "" for a plain number.

    Where the rig and its columns do not tell the unit of a signal, it is called after it: "pressure unit".
    """
    return _quotient({_level(parameter.at or slot, rig): parameter.level, "s": parameter.time})


def _level(slot: str, rig: Rig) -> str:
    """The unit of what passes ``slot``. What drives K(p) p is a curvature; a ``num``/``den`` is driven by its
    input."""
    direct = slot == "drive" and not isinstance(rig.actuator, Actuator)
    role = "pressure" if direct else _ROLES.get(slot, "curvature")
    return units_of_rig(rig)[role] or f"{role} unit"


def _quotient(powers: dict[str, float]) -> str:
    """The product of units to their powers as one fraction; those of the form "1/mm" are turned over."""
    turned = [(u.removeprefix("1/"), -k if u.startswith("1/") else k) for u, k in powers.items()]
    above = " ".join(_power(u, k) for u, k in turned if k > 0)
    below = [_power(u, -k) for u, k in turned if k < 0]
    if not below:
        return above
    return f"{above or 1}/" + (below[0] if len(below) == 1 else f"({' '.join(below)})")


def _power(unit: str, power: float) -> str:
    return unit if power == 1 else f"{unit}^{power:g}"
