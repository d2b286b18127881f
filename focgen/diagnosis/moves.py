"""How far a refit moved the rig's own parameters: said where their uncertainty lets expect less."""

from __future__ import annotations

from collections.abc import Iterator

from focgen.diagnosis.factors import WITHIN
from focgen.fractional.transfer import TransferFunction
from focgen.rig.model import Actuator, Relative, Rig

_SLACK = 1e-4  # of a number: what stands at the end of its range is not beyond it


def far_moves(given: Rig, refitted: Rig) -> tuple[str, ...]:
    """A line for each number that the refit moved by more than three times its uncertainty."""
    return tuple(
        f"the refit moves the {stage}'s {what} by {100 * moved:+.3g} %, more than three times its "
        f"uncertainty of {100 * known:.3g} %"
        for stage, what, moved, known in _moves(given, refitted)
        if abs(moved) > WITHIN * known + _SLACK
    )


def _moves(given: Rig, refitted: Rig) -> Iterator[tuple[str, str, float, float]]:
    """Stage, what of it, by which part of itself it moved, and to which part it was known."""
    for stage in ("regulator", "sensor"):
        known: Relative = getattr(given.uncertainty, stage)
        gain, time = _factors(getattr(given, stage), getattr(refitted, stage))
        yield stage, "gain", gain - 1.0, known.gain
        yield stage, "times", time - 1.0, known.time
    before, after = given.actuator, refitted.actuator
    if isinstance(before, Actuator) and isinstance(after, Actuator):
        yield "actuator", "T", after.T / before.T - 1.0, given.uncertainty.actuator.time
        yield "actuator", "alpha", after.alpha / before.alpha - 1.0, given.uncertainty.actuator.alpha
        if len(before.gain) == 1 and before.gain[0]:
            yield "actuator", "gain", after.gain[0] / before.gain[0] - 1.0, given.uncertainty.actuator.gain
    for stage in ("regulator", "actuator", "sensor"):
        if delay := getattr(given.delays, stage):
            later = getattr(refitted.delays, stage) / delay - 1.0
            yield stage, "delay", later, getattr(given.uncertainty, stage).time


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
