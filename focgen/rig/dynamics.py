"""What effects change of an actuator's own equation, as plain numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from focgen.arrays import Array

FAR, LEAST = 1.1, 0.05  # of a lever: as in ``lever.c``


@dataclass(frozen=True)
class Friction:
    """Coulomb's, in units of the input: ``slide`` against the motion, ``stick`` before it."""

    slide: float = 0.0
    stick: float = 0.0

    @property
    def held(self) -> tuple[float, float]:
        """Both, as the compiled loops take them."""
        return self.slide, max(self.stick, self.slide)

    def __add__(self, other: Friction) -> Friction:
        return Friction(self.slide + other.slide, self.stick + other.stick)

    def __mul__(self, factor: float) -> Friction:
        return Friction(factor * self.slide, factor * self.stick)


@dataclass(frozen=True)
class Spring:
    """A hysteretic spring: its ``share`` of the stiffness; ``loading`` and ``unloading`` in 1/output, for a
    ``power`` other than 1 at displacements of ``scale``, in units of the output. Where it is ``added``, it
    bears so much of the stiffness beside all of that, instead of a part of it."""

    share: float = 0.0
    loading: float = 0.0
    unloading: float = 0.0
    power: float = 1.0
    scale: float = 1.0
    added: bool = False


@dataclass(frozen=True)
class Bend:
    """A spring whose stiffness changes with y: 1 + ``first`` q + ``second`` q² times that at rest,
    q = |y|/``scale``; what gives beside it, mass or damper, stays as it is."""

    first: float = 0.0
    second: float = 0.0
    scale: float = 1.0


@dataclass(frozen=True)
class Power:
    """A ``share`` of what pulls back, or flows out, goes with q to this ``power``, and not with
    q = |y|/``scale`` itself: 1/2 through an orifice, 4 for what radiates. At q = 1 it is the same."""

    share: float = 0.0
    power: float = 1.0
    scale: float = 1.0


@dataclass(frozen=True)
class Lever:
    """What drives y pulls 1 + ``first`` q + ``second`` q² times as strongly, q = y/``scale``, as y goes on:
    the force factor of a voice coil, a tendon's arm, a muscle that has less force the shorter it is. Further
    than :data:`FAR` either way it pulls as there, and never less than :data:`LEAST`."""

    first: float = 0.0
    second: float = 0.0
    scale: float = 1.0

    def strength(self, y: Array) -> Array:
        """How many times as strongly x drives what is at ``y`` (n,)."""
        q = np.clip(y / self.scale, -FAR, FAR)
        made: Array = np.maximum(1.0 + (self.first + self.second * q) * q, LEAST)
        return made


@dataclass(frozen=True)
class Rise:
    """What friction rises by as it moves, ``size`` (1 − exp(−|y'|/``speed``)), in units of the input; below 0
    it falls, as in lubricated bearings (R. Stribeck, Z. VDI 46, 1902)."""

    size: float = 0.0
    speed: float = 1.0


@dataclass(frozen=True)
class Flow:
    """The highest rates of a pressure, units of it per s: while it rises, and while it falls."""

    fill: float = math.inf
    vent: float = math.inf


@dataclass(frozen=True)
class Throat:
    """The difference of pressures above which a flow is rather turbulent, and goes with its root: what fills,
    and what vents. Far below it is laminar, and goes with the difference itself, at ``pace`` times that of
    the lag."""

    fill: float = math.inf
    vent: float = math.inf
    pace: float = 1.0


@dataclass(frozen=True)
class Pace:
    """How many times as slow a stage is: exp(``rate`` q + ``curve`` q²), where q is 1 at its highest level,
    at the session's end or at its greatest speed, by ``by``, which is ``level``, ``time`` or ``speed``, and 0
    at none."""

    by: str = "level"
    rate: float = 0.0
    curve: float = 0.0

    def slowness(self, q: Any) -> Any:
        """So many times, any shape."""
        return np.exp((self.rate + self.curve * q) * q)

    def fastest(self) -> float:
        """The least of it from 0 to 1; a level below 0 may be met faster."""
        turn = -0.5 * self.rate / self.curve if self.curve else 0.0
        return float(np.min(self.slowness(np.array([0.0, 1.0, min(max(turn, 0.0), 1.0)]))))

    def farthest(self) -> float:
        """Where from 0 to 1 it is farthest from 1."""
        turn = -0.5 * self.rate / self.curve if self.curve else 0.0
        places = (1.0, min(max(turn, 0.0), 1.0))
        return max(places, key=lambda q: abs(np.log(self.slowness(q))))


STRAIGHT, NO_FRICTION, LINEAR, LEVEL, EVEN = Bend(), Friction(), Spring(), Rise(), Power()
SAME, FREE, WIDE, STEADY = Lever(), Flow(), Throat(), Pace()


@dataclass(frozen=True)
class Dynamics:
    """What effects change of an actuator's own equation.

    Of T D^α y + y = x: every rate is multiplied by ``unloading`` while the load falls short of the response,
    and a mass has a damper weaker by that factor while it falls back to 0;
    beyond y = ``place`` an obstacle pushes back with ``stiffness`` (y − place); a ``place`` below 0 stands
    for one on either side, as far away. Of that and of any other spring y follows ``bend``, and dry friction,
    the ``drag``, takes away from x, in its unit. So does a ``preload``, which presses the spring against a
    seat at 0. A ``mass`` in s² adds mass·D² y. A ``loss`` goes with a power of y, and a ``lever`` changes
    what x does where y is. Of a
    :class:`~focgen.rig.plant.Plant` with a mass: the hysteretic ``spring``, and the ``rise`` of its drag. Of
    a regulator: the pressure of its ``supply``, which it fills from; of one lag, too, ``loading``, by which
    every rate is multiplied while the load exceeds the response, ``unloading``, its highest ``flow``, the
    ``throat`` in its ways, and the ``ceiling`` that it stops at. Of any stage with dynamics: its ``pace``.
    """

    loading: float = 1.0
    unloading: float = 1.0
    place: float = 0.0
    stiffness: float = 0.0
    drag: Friction = NO_FRICTION
    preload: float = 0.0
    mass: float = 0.0
    bend: Bend = STRAIGHT
    loss: Power = EVEN
    lever: Lever = SAME
    spring: Spring = LINEAR
    rise: Rise = LEVEL
    flow: Flow = FREE
    ceiling: float = math.inf
    throat: Throat = WIDE
    supply: float = math.inf
    pace: Pace = STEADY

    @property
    def changed(self) -> frozenset[str]:
        """What of it differs from the nominal equation."""
        return frozenset() if self is UNCHANGED else frozenset(self._changes())

    @property
    def keeps(self) -> bool:
        """Whether what moves may rest elsewhere than at 0 once it was moved."""
        return self.spring != LINEAR or self.drag != NO_FRICTION

    def _changes(self) -> Iterator[str]:
        for name, value in vars(self).items():
            usual = getattr(UNCHANGED, name)
            if value is not usual and value != usual:
                yield name

    def without(self, name: str) -> Dynamics:
        """The same with this number as in the nominal equation: itself where it is so."""
        usual = getattr(UNCHANGED, name)
        return self if getattr(self, name) == usual else replace(self, **{name: usual})

    def bending(self, gain: float = 1.0) -> tuple[float, ...]:
        """What the compiled loops know of spring and obstacle, of a plant that answers 1 with ``gain``, of
        what bears a part of the input, and of a loss: of a plant that answers 1 with 1, and of the scale of
        the bend where there is one, too."""
        bend, loss = self.bend, self.loss
        scale = loss.scale if bend == STRAIGHT else bend.scale
        obstacle = self.place, self.stiffness / gain
        parts = bend.first / gain, bend.second / gain, scale, *obstacle, *self.drag.held, self.preload
        return *parts, loss.share, loss.power


UNCHANGED = Dynamics()
