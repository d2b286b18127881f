"""Plants of first and second order with dry friction and hysteresis in their own equation.

m y'' + c y' + k y = u − F − w, or m y' + k y = u − F − w, in units of the input u. Coulomb's friction F is
``slide`` against the velocity; where nothing moves it bears up to ``stick``. w is what a hysteretic spring
takes away from the linear one (R. Bouc, 1967; Y.-K. Wen, J. Eng. Mech. Div. 102, 1976): a ``share`` of the
stiffness k holds by q instead of y, with dq/dy = 1 − K |p|^power, p = q in the direction of motion, K =
``loading`` where the motion winds the spring further, −``unloading`` where it lets it go. With α = share·k,
z = α q, power 1: z' = α y' − β (γ |y'| z + δ y' |z|), loading = β (γ + δ) and unloading = β (γ − δ). An
obstacle pushes back beyond its place, a preload presses the plant against a seat at 0, which catches it, and
the damper may be another while y falls back to 0.

Between two events (a velocity of 0, a friction that gives way) a plant with friction alone is linear, and a
step over a whole sample is exact; events are found by halving it. The hysteretic spring is integrated by
steps so small that its own error is below 1e-6 of its force.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from focgen.arrays import Array, Bytes
from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.rig import kernels
from focgen.rig.courses import course
from focgen.rig.dynamics import UNCHANGED, Dynamics

_HALVED = 10  # times that a step is halved for an event: what is left is run along a line
_TURNED = 6  # times where nothing holds what turns round: what is left is a step like any other,
_TURNED_ROUGHLY = 5  # and where a run is rough
_SHORT = 0.2  # of a radian of the plant's motion: a step of the hysteretic spring
_YIELDS = 0.2  # of the time in which friction that rises stops what moves: a step
_FINER = 16.0  # times as short it may be where the velocity changes quickly
_SWING = 1.0  # of a radian: a step without; between two of them the plant is not to turn round twice
_MOST, _ROUGHLY = 7, 5  # halvings at most of a step before any event, and where a run is rough


@dataclass(frozen=True)
class Plant:
    """m y'' + c y' + k y = u where the ``order`` is 2, m y' + k y = u where it is 1; in units of the input,
    s and the output."""

    order: int
    m: float
    c: float
    k: float

    @property
    def integrates(self) -> bool:
        """Whether nothing pulls it back."""
        return self.k == 0.0


def plant_of(transfer: TransferFunction) -> Plant | None:
    """The plant that a transfer function is: whole orders, of first or second order, without zeros; None
    where it is another, or grows of itself."""
    orders = [t.order for t in transfer.den]
    if not transfer.is_integer or max(orders) not in (1, 2) or [t.order for t in transfer.num] != [0]:
        return None
    gain, den = transfer.num[0].coefficient, {t.order: t.coefficient for t in transfer.den}
    order = int(max(orders))
    m, c, k = den[order] / gain, den.get(1, 0.0) / gain if order == 2 else 0.0, den.get(0, 0.0) / gain
    return Plant(order, m, c, k) if m > 0.0 and c >= 0.0 and k >= 0.0 else None


def respond(
    plant: Plant,
    x: Array,
    rest: Bytes,
    h: float,
    dynamics: Dynamics = UNCHANGED,
    between: Between | bool = Between.STRAIGHT,
    rough: bool = False,
    kept: bool = False,
) -> Array:
    """The output (n,) for the input ``x`` (n,) sampled every ``h`` s, at rest wherever ``rest`` (n,) is not
    0; of ``dynamics`` the drag, the springs and, for order 2, the preload and the damper of
    ``unloading`` count.

    ``between``: what the input does from one sample to the next. In straight lines it comes from 0 within the
    sample ahead of an experiment, as in :func:`~focgen.rig.linear.run`; else it jumps at the first sample.
    ``rough``: steps of a hysteretic or bent spring are twice as long, with an error mostly below 1e-3 of the
    motion, and no step is shorter than a 32nd of a sample before an event. ``kept``: a later experiment
    begins where the one before left the plant, after a rest under 0, or under its first input where that is
    in equilibrium.
    """
    plant, dynamics = _whole(plant, dynamics)
    base, fine, last = _levels(plant, dynamics, h, rough)
    spring, bend = dynamics.spring, dynamics.bend
    numbers = [h, plant.m, plant.c, plant.k, *dynamics.drag.held, spring.share * plant.k]
    numbers += [spring.loading, spring.unloading, spring.power, spring.scale]
    numbers += [dynamics.rise.size, dynamics.rise.speed]
    numbers += [plant.k * bend.first, plant.k * bend.second, bend.scale]
    numbers += [dynamics.place, plant.k * dynamics.stiffness, dynamics.preload, plant.c / dynamics.unloading]
    numbers += [_brisk(plant, dynamics)]
    x = np.ascontiguousarray(x, float)
    moves, levels = course(x, rest, between), (plant.order, base, fine, last)
    return kernels.plant(x, rest, moves, levels, kept and plant.k > 0.0, np.array(numbers))


def _whole(plant: Plant, dynamics: Dynamics) -> tuple[Plant, Dynamics]:
    """An added hysteretic spring as its share of both."""
    spring = dynamics.spring
    if not spring.added:
        return plant, dynamics
    both = 1.0 + spring.share
    share = replace(spring, share=spring.share / both, added=False)
    # an obstacle and a bend are shares of the linear spring
    bend = replace(dynamics.bend, first=dynamics.bend.first / both, second=dynamics.bend.second / both)
    whole = replace(dynamics, spring=share, bend=bend, stiffness=dynamics.stiffness / both)
    return replace(plant, k=plant.k * both), whole


def _levels(plant: Plant, dynamics: Dynamics, h: float, rough: bool = False) -> tuple[int, int, int]:
    """How often a sample is halved: for the motion, for friction that rises steeply, and at most, for an
    event."""
    spring, bend = dynamics.spring, dynamics.bend
    steepest = 1.0 + spring.share * max(abs(spring.loading), abs(spring.unloading)) * spring.scale
    steepest += 2.0 * abs(bend.first) + 3.0 * abs(bend.second) + dynamics.stiffness
    pace = _pace(plant, plant.k * steepest)
    short = _SHORT * (1.0 + rough) if dynamics.changed & {"spring", "bend", "stiffness"} else _SWING
    short *= _evenness(spring.power, rough)
    most = _ROUGHLY if rough else _MOST
    base, fine = (_halved(h * paces, most) for paces in (pace / short, _FINER * _brisk(plant, dynamics)))
    fine = max(base, fine)
    return base, fine, max(fine, base + _halvings(plant, dynamics, rough))


def _halved(steps: float, most: int) -> int:
    """How often a sample is halved for so many steps of it, ``most`` at most."""
    return int(np.clip(np.ceil(np.log2(max(steps, 1e-9))), 0, most))


def _brisk(plant: Plant, dynamics: Dynamics) -> float:
    """Steps in a second about a velocity of 0, where friction rises."""
    return abs(dynamics.rise.size) / dynamics.rise.speed / plant.m / _YIELDS


def _evenness(power: float, rough: bool) -> float:
    """What a step may be of one for a power of 1, for which a spring is run exactly; roughly the nearest
    powers are as even."""
    if power == 1.0:
        return 1.0
    return float(np.clip(1.0 - 2.0 * abs(power - 1.0), 0.5, 1.0)) if rough else 0.5


def _halvings(plant: Plant, dynamics: Dynamics, rough: bool) -> int:
    if plant.order == 1 or dynamics.preload or dynamics.rise.size or any(dynamics.drag.held):
        return _HALVED
    return _TURNED_ROUGHLY if rough else _TURNED


def _pace(plant: Plant, stiffness: float) -> float:
    """Radians a second of the motion on a spring of this stiffness. A strong damper lets it only creep; what
    dies away sooner is in the tables, which are exact."""
    if plant.order == 1:
        return stiffness / plant.m
    swing = float(np.sqrt(stiffness / plant.m))
    return min(swing, stiffness / plant.c) if plant.c > 0.0 else swing
