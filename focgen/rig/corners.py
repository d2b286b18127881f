"""The corners of what is not known of a rig, and the rig as it would be in one of them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import product

from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import UNITY, Actuator, Delays, LinearActuator, Relative, Rig, Uncertainty
from focgen.rig.stages import STAGES

EXACT = Uncertainty(Relative(0.0, 0.0), Relative(0.0, 0.0), Relative(0.0, 0.0))
_ENDS = (-1.0, 1.0)


def corners(rig: Rig) -> tuple[Uncertainty, ...]:
    """Every combination of the ends of what is uncertain and makes a difference, the rig as given first.

    The gains of the stages multiply in a loop, so of their combinations only the lowest and the highest
    product are looked at.
    """
    sizes = {stage: _uncertain(rig, stage) for stage in STAGES}
    moves = [(stage, key) for stage in STAGES for key in ("time", "alpha") if getattr(sizes[stage], key)]
    ends = _ENDS if any(size.gain for size in sizes.values()) else (0.0,)
    found = [EXACT]
    for gain in ends:
        for signs in product(_ENDS, repeat=len(moves)):
            found.append(_corner(sizes, gain, dict(zip(moves, signs))))
    return tuple(dict.fromkeys(found))


def _corner(sizes: dict[str, Relative], gain: float, signs: dict[tuple[str, str], float]) -> Uncertainty:
    def end(stage: str, size: Relative) -> Relative:
        time, alpha = (signs.get((stage, key), 0.0) for key in ("time", "alpha"))
        return Relative(gain * size.gain, time * size.time, alpha * size.alpha)

    return Uncertainty(**{stage: end(stage, size) for stage, size in sizes.items()})


def _uncertain(rig: Rig, stage: str) -> Relative:
    """The stage's uncertainty, without what it has not got."""
    given, transfer = getattr(rig.uncertainty, stage), transfer_of(rig, stage)
    late = bool(getattr(rig.delays, stage))
    if transfer is None or (transfer == UNITY and not late):
        return Relative(0.0, 0.0)
    moves = late or any(transfer.orders)
    fractional = isinstance(rig.actuator, Actuator) and stage == "actuator"
    return Relative(given.gain, given.time if moves else 0.0, given.alpha if fractional else 0.0)


def transfer_of(rig: Rig, stage: str) -> TransferFunction | None:
    """The stage's linear part, None for an actuator that is absent."""
    if stage != "actuator":
        made: TransferFunction | None = getattr(rig, stage)
        return made
    return None if rig.actuator is None else rig.actuator.dynamics


def moved(rig: Rig, off: Uncertainty) -> Rig:
    """The rig that is ``off`` by that much: gains multiplied; T, or time itself (s by s times a factor), and
    the nominal delay stretched; α multiplied, at most halfway to 2.
    """
    delays = {stage: getattr(rig.delays, stage) * (1.0 + getattr(off, stage).time) for stage in STAGES}
    return replace(
        rig,
        regulator=_scaled(rig.regulator, off.regulator),
        actuator=_moved_actuator(rig.actuator, off.actuator),
        sensor=_scaled(rig.sensor, off.sensor),
        delays=Delays(**delays),
    )


def _moved_actuator(
    actuator: Actuator | LinearActuator | None, off: Relative
) -> Actuator | LinearActuator | None:
    if isinstance(actuator, LinearActuator):
        return replace(actuator, dynamics=_scaled(actuator.dynamics, off))
    if actuator is None:
        return None
    alpha = min(actuator.alpha * (1.0 + off.alpha), 0.5 * (actuator.alpha + 2.0))
    gain = tuple(g * (1.0 + off.gain) for g in actuator.gain)
    return Actuator(actuator.T * (1.0 + off.time), alpha, gain, actuator.offset)


def _scaled(transfer: TransferFunction, off: Relative) -> TransferFunction:
    gain, slower = 1.0 + off.gain, 1.0 + off.time
    return TransferFunction(
        [(gain * t.coefficient * slower**t.order, t.order) for t in transfer.num],
        [(t.coefficient * slower**t.order, t.order) for t in transfer.den],
    )


def without_gain(off: Uncertainty) -> tuple[float, Uncertainty]:
    """The factor of the whole chain's gain, and what is off besides."""
    parts = {stage: getattr(off, stage) for stage in STAGES}
    factor = math.prod(1.0 + part.gain for part in parts.values())
    return factor, Uncertainty(**{stage: replace(part, gain=0.0) for stage, part in parts.items()})


def differences(off: Uncertainty) -> Iterator[tuple[str, str, float]]:
    """Stage, what of it, and by how much of itself it is off."""
    for stage in STAGES:
        for key, value in vars(getattr(off, stage)).items():
            if value:
                yield stage, key, value
