"""The worst that a controller, as designed, meets within what is not known of its rig.

The margins are looked at in every corner of the rig's uncertainty, at the operating points' pressures. Steps
are simulated in those few corners only where a margin is the smallest, and where the loop is slowest; with
effects, which take longer, in the one where the phase margin is the smallest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from focgen.arrays import Array, Complex
from focgen.control.controller import Controller
from focgen.control.margins import Curve, Margins, curve, margins
from focgen.control.measures import StepMeasures
from focgen.fractional.transfer import TransferFunction
from focgen.loop.frequency import LOW, any_schedule, chain_transfer, held_response, side_bands, slope_at
from focgen.loop.linear_effects import linear_part
from focgen.plan.plan import Plan
from focgen.plan.response import running_gain, running_response
from focgen.rig.corners import EXACT, corners, moved, transfer_of, without_gain
from focgen.rig.rig import Rig, Uncertainty
from focgen.rig.stages import STAGES

Simulated = Callable[[Rig], Sequence[StepMeasures | None]]
"""The steps to the set points on a rig, None for those that are left out."""

_Measured = tuple[Uncertainty, float, StepMeasures | None]
"""Corner, set point, and what the step to it measures; None beyond reach."""


@dataclass(frozen=True)
class Extreme:
    """The worst ``value`` of something, what it is on the rig as given (``nominal``), by how much the rig is
    ``off`` there, and ``at`` which pressure (a margin) or set point (a step).
    """

    value: float
    nominal: float
    off: Uncertainty
    at: float


@dataclass(frozen=True)
class Worst:
    """The smallest margins of the loop as it will run, and the largest overshoot and settling time of a step.

    ``phase_deg``, ``gain_db``, ``delay_s``: over all ``corners`` and the rig as given. ``overshoot_pct``,
    ``settling_s`` (NaN where a step does not settle): over the rig as given and the corners ``simulated``.
    ``stable``: in every corner. ``beyond``: set points left out in a corner, which the command cannot hold
    there.
    """

    phase_deg: Extreme
    gain_db: Extreme
    delay_s: Extreme
    overshoot_pct: Extreme
    settling_s: Extreme
    stable: bool
    corners: int
    simulated: tuple[Uncertainty, ...]
    beyond: tuple[float, ...]


@dataclass(frozen=True)
class _Seen:
    """Margins in one corner at one pressure."""

    off: Uncertainty
    pressure: float
    margins: Margins


def worst_case(
    rig: Rig,
    controller: Controller,
    plan: Plan,
    delay: int,
    pressures: Sequence[float],
    references: Sequence[float],
    nominal: Sequence[StepMeasures],
    simulated: Simulated,
) -> Worst:
    """Look at every corner of ``rig.uncertainty`` with the controller as it is.

    ``delay``: of the computation, samples; ``pressures``: of the operating points; ``references``: the set
    points, with their ``nominal`` steps; ``simulated``: what simulates them in a corner.
    """
    seen = _margins(rig, controller, plan, delay, pressures)
    telling = _telling(seen)[:1] if rig.effects else _telling(seen)
    chosen = tuple(off for off in dict.fromkeys(telling) if off != EXACT)
    steps = [(EXACT, nominal), *((off, simulated(moved(rig, off))) for off in chosen)]
    flat = [(off, at, m) for off, each in steps for at, m in zip(references, each, strict=True)]
    over = {name: _largest(flat, name) for name in ("overshoot_pct", "settling_s")}
    return Worst(
        **{name: _smallest(seen, name) for name in ("phase_deg", "gain_db", "delay_s")},
        **over,
        stable=all(s.margins.stable for s in seen),
        corners=len({s.off for s in seen} - {EXACT}),
        simulated=chosen,
        beyond=tuple(dict.fromkeys(at for _, at, measured in flat if measured is None)),
    )


def _margins(
    rig: Rig, controller: Controller, plan: Plan, delay: int, pressures: Sequence[float]
) -> list[_Seen]:
    """The margins of the running loop in every corner, at every pressure."""
    loops = _Loops(rig, controller, plan, delay)
    seen = []
    for off in corners(rig):
        factor, dynamics = without_gain(off)  # gains only multiply
        loop = loops.in_corner(dynamics)
        for pressure in dict.fromkeys(pressures):
            gain = running_gain(plan, pressure if controller.scheduled else None) * slope_at(rig, pressure)
            seen.append(_Seen(off, pressure, margins(loop.times(factor * gain))))
    return seen


class _Loops:
    """The running loop but for its gain, in any corner, on the grid that the rig as given asks for."""

    def __init__(self, rig: Rig, controller: Controller, plan: Plan, delay: int) -> None:
        self.rig, self.h = rig, controller.sample_time
        at = any_schedule(controller)
        unit = running_gain(plan, at)
        self.effects, _, _ = linear_part(rig)

        def ahead(omega: Array) -> Complex:
            made: Complex = running_response(plan, omega, at) / unit * np.exp(-1j * omega * self.h * delay)
            return made

        def nominal(omega: Array) -> Complex:
            held = held_response(chain_transfer(rig), self.h, omega, self.effects, rig.delays.total)
            return ahead(omega) * held

        given = curve(nominal, LOW * 2.0 * math.pi / self.h, math.pi / self.h)
        self.omega, self.ahead = given.omega, ahead(given.omega)
        self.bands = side_bands(self.h, self.omega)
        self.stages: dict[TransferFunction, Array] = {}
        self.found = {EXACT: given}

    def in_corner(self, dynamics: Uncertainty) -> Curve:
        """The loop where all but gains is off by ``dynamics``."""
        if dynamics not in self.found:
            one = moved(self.rig, dynamics)
            parts = [transfer_of(one, stage) for stage in STAGES]
            known: Any = math.prod(self._at_bands(part) for part in parts if part is not None)
            transfer, late = chain_transfer(one), one.delays.total
            held = held_response(transfer, self.h, self.omega, self.effects, late, known)
            self.found[dynamics] = Curve(self.omega, self.ahead * held)
        return self.found[dynamics]

    def _at_bands(self, part: TransferFunction) -> Array:
        if part not in self.stages:
            self.stages[part] = part.frequency_response(self.bands)
        return self.stages[part]


def _telling(seen: list[_Seen]) -> list[Uncertainty]:
    """The corners worth a simulation, the most telling first.

    Where the crossover is lowest the loop is slow. But what settles last is what is left where the controller
    no longer cancels the actuator, and whether that comes from above or below depends on T: so that corner is
    looked at with T off the other way, too.
    """
    crossing = [s for s in seen if math.isfinite(s.margins.crossover_rad_s)]
    slow = min(crossing or seen, key=lambda s: s.margins.crossover_rad_s).off
    other = replace(slow, actuator=replace(slow.actuator, time=-slow.actuator.time))
    return [*(min(seen, key=lambda s: _order(s, name)).off for name in ("phase_deg", "gain_db")), slow, other]


def _order(seen: _Seen, name: str) -> float:
    """What a margin counts: where the loop is unstable its gain may not grow at all, but has to fall."""
    if name == "gain_db" and not seen.margins.stable:
        return -seen.margins.gain_reduction_db
    made: float = getattr(seen.margins, name)
    return made


def _smallest(seen: list[_Seen], name: str) -> Extreme:
    worst = min(seen, key=lambda s: _order(s, name))
    nominal = min(_order(s, name) for s in seen if s.off == EXACT)
    return Extreme(_order(worst, name), nominal, worst.off, worst.pressure)


def _largest(flat: Sequence[_Measured], name: str) -> Extreme:
    """The largest of all steps; one that does not settle is beyond all others."""

    def size(found: _Measured) -> float:
        value = getattr(found[2], name)
        return math.inf if math.isnan(value) else value

    measured = [one for one in flat if one[2] is not None]
    off, at, worst = max(measured, key=size)
    nominal = max((one for one in measured if one[0] == EXACT), key=size)[2]
    return Extreme(getattr(worst, name), getattr(nominal, name), off, at)
