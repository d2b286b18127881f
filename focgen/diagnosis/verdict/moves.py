"""How far a refit moved the rig's nominal parameters: said where their uncertainty lets expect less."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from focgen.diagnosis.problem.factors import LEAST, WITHIN
from focgen.diagnosis.problem.free import factor_ends
from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import Actuator, LinearActuator, Relative, Rig

_EITHER = "either that is wrong, or what is named beside it"
_SLACK = 1e-4  # of a number: what stands at the end of its range is not beyond it


def far_moves(given: Rig, refitted: Rig) -> tuple[str, ...]:
    """A line for each number that the refit moved by more than three times its uncertainty."""
    return tuple(
        f"the refit moves the {stage}'s {what} by {100 * moved:+.3g} %, more than three times its "
        f"uncertainty of {100 * known:.3g} %"
        for stage, what, moved, known in _moves(given, refitted)
        if abs(moved) > WITHIN * known + _SLACK
    )


def at_the_end(given: Rig, refitted: Rig) -> tuple[str, ...]:
    """A line for each number of the actuator that the refit moved as far as it lets one go; one of all of
    them where it is a gain's curve, which moves as a whole."""
    found = [
        f"the refit moves the actuator's {what} by {100 * moved:+.3g} %, which is as far as it lets a number "
        f"go whose uncertainty is {100 * known:.3g} %: {_EITHER}"
        for stage, what, moved, known in _moves(given, refitted)
        if stage == "actuator" and what != "delay" and known and _is_at_the_end(moved, known)
    ]
    return tuple(found) or (f"the refit moves a number of the actuator as far as it lets one go: {_EITHER}",)


def _is_at_the_end(moved: float, known: float) -> bool:
    end = WITHIN * known if moved > 0.0 else min(WITHIN * known, 1.0 - LEAST)
    return abs(abs(moved) - end) <= _SLACK


def _moves(given: Rig, refitted: Rig) -> Iterator[tuple[str, str, float, float]]:
    """Stage, what of it, by which part of itself it moved, and to which part it was known."""
    for stage in ("regulator", "sensor"):
        known: Relative = getattr(given.uncertainty, stage)
        gain, time = _factors(getattr(given, stage), getattr(refitted, stage))
        yield stage, "gain", gain - 1.0, known.gain
        yield stage, "times", time - 1.0, known.time
        damping = _damping(getattr(given, stage), getattr(refitted, stage), time)
        yield stage, "damping", damping - 1.0, known.time
    before, after = given.actuator, refitted.actuator
    if isinstance(before, Actuator) and isinstance(after, Actuator):
        yield "actuator", "T", after.T / before.T_at(after.alpha) - 1.0, given.uncertainty.actuator.time
        yield "actuator", "alpha", after.alpha / before.alpha - 1.0, given.uncertainty.actuator.alpha
        if len(before.gain) == 1 and before.gain[0]:
            yield "actuator", "gain", after.gain[0] / before.gain[0] - 1.0, given.uncertainty.actuator.gain
    if isinstance(before, LinearActuator) and isinstance(after, LinearActuator):
        for what, moved, uncertain in _coefficients(before, after, given.uncertainty.actuator):
            yield "actuator", what, moved, uncertain
    for stage in ("regulator", "actuator", "sensor"):
        if delay := getattr(given.delays, stage):
            later = getattr(refitted.delays, stage) / delay - 1.0
            yield stage, "delay", later, getattr(given.uncertainty, stage).time


def _coefficients(
    before: LinearActuator, after: LinearActuator, known: Relative
) -> Iterator[tuple[str, float, float]]:
    """Of each coefficient but the denominator's last, which only scales the others: its name, by which part
    of itself it moved, and to which it was known in that direction, as follows from gain and times."""
    gain, time = factor_ends(known.gain), factor_ends(known.time)
    last = before.dynamics.den[-1].order
    for part, usual, zero in (("num", gain, 0.0), ("den", 0.0 * gain, last)):
        old, new = getattr(before.dynamics, part), getattr(after.dynamics, part)
        for a, b in zip(old, new, strict=True):
            moved = b.coefficient / a.coefficient - 1.0
            ends = np.expm1(usual + (a.order - zero) * time)
            if part == "num" or a.order != last:
                yield (
                    f"{part} coefficient of s^{a.order:g}",
                    moved,
                    float(np.max(ends * np.sign(moved))) / WITHIN,
                )


def _damping(before: TransferFunction, after: TransferFunction, time: float) -> float:
    """What the coefficients between the first and the last of the denominator are times, beside a factor of
    ``time``."""
    if len(before.den) < 3:
        return 1.0
    old, new, last = before.den[1], after.den[1], before.den[-1]
    scale = after.den[-1].coefficient / last.coefficient
    return float(new.coefficient / old.coefficient / scale / time ** (old.order - last.order))


def _factors(before: TransferFunction, after: TransferFunction) -> tuple[float, float]:
    """The gain and the time that ``after`` is ``before`` times, where it differs by these."""
    part = "den" if any(t.order for t in before.den) else "num"
    old, new = getattr(before, part), getattr(after, part)
    highest, lowest = 0, len(old) - 1
    if old[highest].order == old[lowest].order:
        return after.num[-1].coefficient / before.num[-1].coefficient, 1.0
    share = [n.coefficient / o.coefficient for n, o in zip(new, old)]
    time = (share[highest] / share[lowest]) ** (1.0 / (old[highest].order - old[lowest].order))
    ends = [t.num[-1].coefficient / t.den[-1].coefficient for t in (before, after)]
    order = before.num[-1].order - before.den[-1].order
    return ends[1] / ends[0] / time**order, time
