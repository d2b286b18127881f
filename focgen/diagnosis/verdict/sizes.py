"""The sizes of an effect that was found: its parameters with their intervals, in the units of the log."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.control.units import units_of_rig
from focgen.diagnosis.fitting.fit import FIXED, Fit
from focgen.diagnosis.hypotheses.rivals import Rival
from focgen.diagnosis.model import Estimate
from focgen.rig.effects import STEP, Parameter
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
    places, covariance = spread(of, [which])
    deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    slot, found = slot_in(candidate.form, candidate.stage), {}
    for parameter, place, deviation in zip(candidate.form.parameters, places, deviations):
        v, s = of.vector[place], 1.96 * deviation
        scale = problem.references.scale(parameter, slot)
        ends = [
            float(scale * (np.exp(np.clip(e, -60, 60)) if parameter.log else e)) for e in (v - s, v, v + s)
        ]
        unit = unit_of_parameter(parameter, slot, rig)
        ends = _counted(ends, np.ptp(problem.segment.y)) if parameter.name == STEP else ends
        found[parameter.name] = Estimate(ends[1], (ends[0], ends[2]), unit)
    return found


def _counted(ends: Sequence[float], span: float) -> list[float]:
    """The interval of a step: its levels are counted, so that a step which is further off would be half a
    level off over the ``span`` of the readings."""
    low, step, high = ends
    off = 0.5 * step**2 / max(span, step)
    return [max(low, step - off), step, min(high, step + off)]


def spread(of: Fit, which: Sequence[int], own: bool = False) -> tuple[list[int], np.ndarray]:
    """Where in its vector the parameters of these candidate effects of a fit are, and their covariance; with
    the rig's ``own`` ahead of them. A gauge or a begin that may be off is no further off than it may be."""
    places = list(range(len(of.problem.nominal_start))) if own else []
    place = of.problem.head
    for number, candidate in enumerate(of.problem.candidates):
        count = len(candidate.form.parameters)
        places += range(place, place + count) if number in which else ()
        place += count
    return places, _covariance(of)[np.ix_(places, places)]


def _covariance(of: Fit) -> np.ndarray:
    """Of all numbers of a fit; none of those that cannot move."""
    sigma = of.sse / max(len(of.innovations) - len(of.vector), 1)
    low, high = of.problem.bounds()
    free = np.flatnonzero(high - low > FIXED)
    within = 12.0 / (high - low)[free] ** 2  # 1/variance of what may be anything between two ends
    within[(free < len(of.problem.nominal_start)) | (free >= of.problem.head)] = 0.0
    known = of.information[np.ix_(free, free)] + sigma * np.diag(within)
    scale = np.sqrt(np.maximum(np.diag(known), 1e-300))
    made = np.zeros((len(of.vector), len(of.vector)))
    made[np.ix_(free, free)] = sigma * np.linalg.pinv(known / np.outer(scale, scale)) / np.outer(scale, scale)
    return made


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
