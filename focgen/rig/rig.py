"""The nominal chain regulator → actuator → sensor, as plain numbers with units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.logs.scales import Scale
from focgen.logs.units import unit_named

UNITY = TransferFunction([(1.0, 0.0)])


@dataclass(frozen=True)
class Signals:
    """Which log column plays which role; ``None`` where a role is not logged.

    ``time`` in s; ``command`` into the regulator; ``pressure`` between regulator and actuator; ``curvature``
    between actuator and sensor; ``output`` what the controller reads; ``run`` splits a file into experiments.
    ``scales``: how a role's column becomes the role's signal, where it is not the signal itself; ``units``:
    the rig's own unit of each role, where stated.
    """

    time: str
    output: str
    command: str | None = None
    pressure: str | None = None
    curvature: str | None = None
    reference: str | None = None
    run: str | None = None
    scales: Mapping[str, Scale] = field(default_factory=dict, hash=False)
    units: Mapping[str, str] = field(default_factory=dict, hash=False)

    def columns(self) -> dict[str, str]:
        """The logged roles and their columns, without ``time`` and ``run``."""
        roles = ("command", "pressure", "curvature", "output", "reference")
        return {role: getattr(self, role) for role in roles if getattr(self, role) is not None}

    def unit_of(self, role: str) -> str:
        """The unit of a role's signal: the rig's own, else as its column's name tells it, "" where neither
        does."""
        named = "" if role in self.scales else unit_named(getattr(self, role))
        return self.units.get(role) or named


@dataclass(frozen=True)
class Actuator:
    """K(p) p through 1/(T s^alpha + 1), eq. (3) and (5).

    ``T`` in s^alpha; ``gain`` are the coefficients of K(p) = gain[0] + gain[1] p + …, in output units per
    pressure unit, per pressure unit squared, …; ``offset`` is added to the output.
    """

    T: float
    alpha: float
    gain: tuple[float, ...]
    offset: float = 0.0

    def K(self, pressure: Any) -> Any:
        """The static gain K(p) at ``pressure``, any shape."""
        pressure = np.asarray(pressure, float)
        made = np.full_like(pressure, self.gain[-1])
        for coefficient in reversed(self.gain[:-1]):  # Horner's rule
            made = made * pressure + coefficient
        return made[()]

    def drive(self, pressure: Any) -> Any:
        """K(p) p: what the dynamics settle at, any shape."""
        pressure = np.asarray(pressure, float)
        made = self.gain[-1] * pressure
        for coefficient in reversed(self.gain[:-1]):
            made = (made + coefficient) * pressure
        return made[()]

    def T_at(self, alpha: float) -> float:
        """The T, in s^alpha, that has the same time constant T^(1/alpha), s, at another order."""
        made: float = self.T ** (alpha / self.alpha)
        return made

    @property
    def slip(self) -> str:
        """What a ``gain`` whose first coefficient is 0 comes to, which is seldom meant; "" for any other."""
        power, first = next(((i, g) for i, g in enumerate(self.gain) if g), (0, 0.0))
        if power == 0:
            return ""
        given = ", ".join(f"{g:g}" for g in self.gain)
        line = f"K(0) is 0, so that what it settles at begins as {first:g} p^{power + 1}"
        return f"the actuator's gain = [{given}] is K(p) = gain[0] + gain[1] p + …: {line}"

    @cached_property
    def dynamics(self) -> TransferFunction:
        """1/(T s^alpha + 1)."""
        return TransferFunction([(1.0, 0.0)], [(self.T, self.alpha), (1.0, 0.0)])


@dataclass(frozen=True)
class LinearActuator:
    """An actuator given as a transfer function, with an ``offset`` added to its output.

    ``bias`` is what drives it at an input of 0, in the input's unit: a constant force. On a plant that
    integrates no offset stands for it.
    """

    dynamics: TransferFunction
    offset: float = 0.0
    bias: float = 0.0

    @property
    def integrates(self) -> bool:
        """Whether it keeps moving under a constant drive."""
        return not math.isfinite(self.dynamics.dc_gain)

    def drive(self, pressure: Any) -> Any:
        """The input of the dynamics: the pressure with the bias on it."""
        return pressure + self.bias if self.bias else pressure


@dataclass(frozen=True)
class Delays:
    """The nominal dead time of each stage, s: e^(−L s) behind its dynamics."""

    regulator: float = 0.0
    actuator: float = 0.0
    sensor: float = 0.0

    @property
    def total(self) -> float:
        """Of the whole chain, s."""
        return self.regulator + self.actuator + self.sensor


@dataclass(frozen=True)
class Relative:
    """By how much of themselves a stage's ``gain``, its ``time`` (every time constant and the delay) and its
    ``alpha`` (an actuator's only) are, or may be, off. ``form``: by what its equation is off whatever its
    numbers are, root mean square, as a part of the standard deviation of what leaves it.
    """

    gain: float
    time: float
    alpha: float = 0.0
    form: float = 0.0


@dataclass(frozen=True)
class Uncertainty:
    """How well each stage is known; with signs: one way in which the rig may be off."""

    regulator: Relative = Relative(0.02, 0.1)
    actuator: Relative = Relative(0.2, 0.2, 0.1)
    sensor: Relative = Relative(0.02, 0.1)


@dataclass(frozen=True)
class Ranges:
    """What each signal can reach, (low, high) in the log's units; ``None`` where not stated."""

    command: tuple[float, float] | None = None
    pressure: tuple[float, float] | None = None
    output: tuple[float, float] | None = None

    def stated(self) -> dict[str, tuple[float, float]]:
        """Those that are, by role."""
        return {role: span for role, span in vars(self).items() if span is not None}


@dataclass(frozen=True)
class Origins:
    """Where effects count a signal from, in the log's unit."""

    curvature: float = 0.0
    output: float = 0.0

    def __bool__(self) -> bool:
        return bool(self.curvature or self.output)


@dataclass(frozen=True)
class Rig:
    """The nominal rig. ``sample_time`` in s; ``effects`` are the ``[[effects]]`` tables as read; ``between``:
    what its first input does from one sample to the next, None where logs are to tell. ``lead``: by how many
    s a held command was sent ahead of its row in the logs, less than 0 where behind. ``zero``: what is added
    to the sensor's reading, in the output's unit. ``downwards``: the roles whose signals effects count
    downwards, and ``origins``, where they count them from. Of no file are ``known``, effects
    (:class:`focgen.rig.placed.Placed`) that are run wherever the rig is, as its numbers are. Nor are
    ``turned`` and ``moved``: what ``downwards`` and ``origins`` were of a rig whose signals are turned and
    counted from there (:mod:`focgen.rig.turned`)."""

    name: str
    sample_time: float
    signals: Signals
    actuator: Actuator | LinearActuator | None = None
    regulator: TransferFunction = UNITY
    sensor: TransferFunction = UNITY
    ranges: Ranges = Ranges()
    effects: tuple[Mapping[str, Any], ...] = field(default=())
    delays: Delays = Delays()
    uncertainty: Uncertainty = Uncertainty()
    between: Between | None = None
    lead: float = 0.0
    zero: float = 0.0
    downwards: frozenset[str] = frozenset()
    origins: Origins = Origins()
    known: tuple[Any, ...] = field(default=(), repr=False)
    turned: frozenset[str] = field(default=frozenset(), repr=False)
    moved: Origins = field(default=Origins(), repr=False)

    def sign(self, role: str) -> int:
        """What the signal of a role is times, to be as it was logged: 1 or −1."""
        return -1 if role in self.turned else 1

    def as_logged(self, role: str, value: float) -> float:
        """A value of a role's signal, as it was logged."""
        return self.sign(role) * value + float(getattr(self.moved, role, 0.0))

    def own_zero(self, role: str) -> float:
        """Where its offsets put the curvature, or the output: what has no integrator rests there."""
        offset = self.actuator.offset if self.actuator is not None else 0.0
        if role == "curvature":
            return offset
        return self.zero + (self.sensor.dc_gain * offset if offset else 0.0)

    @property
    def integrator(self) -> str | None:
        """The first stage that goes on under a constant input, as a pump's volume or an axis does; None where
        there is none, or only the sensor."""
        if not math.isfinite(self.regulator.dc_gain):
            return "regulator"
        moves = isinstance(self.actuator, LinearActuator) and self.actuator.integrates
        return "actuator" if moves else None
