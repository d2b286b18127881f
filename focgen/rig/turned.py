"""Rigs whose signals go below 0, against their inputs, or lie far above 0, run from where they rest, upwards.

A ceiling, an obstacle or a valve that vents is written for signals that rise from 0, and friction for a gain
above 0. A vacuum, a bend the other way and a drive mounted the other way round are the same rigs with another
sign. So they are turned where a session comes in, until every stage has a gain above 0 and the input rises
from 0, and what is found is turned back. The numbers of effects count as in the turned signals, and the rig's
file says which these are.

A curve, a ceiling or a loop is a part of what a signal moves. Of a temperature in kelvin that is little, so
an output that lies further above 0 than it moves is run from where the rig rests.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from focgen.arrays import Array
from focgen.fractional.transfer import TransferFunction
from focgen.jsontext import fits
from focgen.logs.begin import Begin
from focgen.logs.experiment import ROLES, Experiment
from focgen.rig.rig import Actuator, LinearActuator, Origins, Ranges, Rig
from focgen.rig.session import entry_of

_DOWN = 4.0  # times as much below 0 as above, over the session: an input that goes both ways has no sign
_FAR = 1.0  # times what a signal moves: one that rests as far from 0, or farther, is run from there
_AT_0 = Origins()


@dataclass(frozen=True)
class Turn:
    """The ``signs`` by role, 1 or −1, that the signals of a rig are run with, and the ``origins`` that they
    are run from."""

    signs: Mapping[str, int]
    origins: Origins = _AT_0

    def __bool__(self) -> bool:
        return bool(self.roles or self.origins)

    @property
    def back(self) -> Turn:
        """What turns back."""
        k, y = (0.0 - self.signs[role] * getattr(self.origins, role) for role in ("curvature", "output"))
        return Turn(self.signs, Origins(k, y))

    @property
    def roles(self) -> frozenset[str]:
        """The roles that are run with the other sign."""
        return frozenset(role for role, sign in self.signs.items() if sign < 0)

    def rig(self, rig: Rig) -> Rig:
        """The rig in the turned signals."""
        if not self:
            return rig
        u, p, k, y = (self.signs[role] for role in ("command", "pressure", "curvature", "output"))
        spans = {role: self._span(span, role) for role, span in rig.ranges.stated().items()}
        lies = self.origins
        seen = rig.sensor.dc_gain * lies.curvature if lies.curvature and rig.actuator else 0.0
        zero = rig.zero - lies.output + seen
        return replace(
            rig,
            regulator=_times(rig.regulator, u * p),
            actuator=_turned(rig.actuator, p, k, lies.curvature),
            sensor=_times(rig.sensor, k * y),
            zero=y * zero or 0.0,
            ranges=replace(Ranges(), **spans),
            effects=tuple(self._learned(table) for table in rig.effects),
            downwards=rig.turned,
            turned=rig.downwards,
            origins=rig.moved,
            moved=rig.origins,
        )

    def signals(self, signals: Mapping[str, Array]) -> dict[str, Array]:
        """Signals by role, turned; others as they are."""
        return {role: self.signal(x, role) for role, x in signals.items()}

    def signal(self, x: Array, role: str) -> Array:
        """One signal, turned."""
        if lies := self._origin(role):
            x = x - lies
        return -x if self.signs.get(role, 1) < 0 else x

    def _origin(self, role: str) -> float:
        """A reference is run as the output is."""
        return float(getattr(self.origins, "output" if role == "reference" else role, 0.0))

    def log(self, log: Experiment, rig: Rig) -> Experiment:
        """An experiment with ``rig``, turned; what is told of its begin, too."""
        begins = {role: self._began(begin, role) for role, begin in log.begins.items()}
        rows = None if log.rows is None else self.signals(log.rows)
        stands = self.signs["pressure" if rig.integrator == "regulator" else "curvature"] * log.stands
        return replace(log, signals=self.signals(log.signals), rows=rows, begins=begins, stands=stands or 0.0)

    def _span(self, span: tuple[float, float], role: str) -> tuple[float, float]:
        low, high = sorted(float(x) for x in self.signal(np.array(span), role))
        return low + 0.0, high + 0.0  # no −0

    def _learned(self, table: Mapping[str, Any]) -> Mapping[str, Any]:
        """An effect's table with the outputs at which it was learned turned, where it tells them."""
        learned = table.get("learned")
        if not isinstance(learned, list) or not fits(learned, [float, float]):
            return table
        return {**table, "learned": list(self._span((learned[0], learned[1]), "output"))}

    def _began(self, begin: Begin, role: str) -> Begin:
        levels = self.signal(np.array(begin.levels), role)
        return replace(begin, levels=tuple(float(level) + 0.0 for level in levels))


def turn_of(rig: Rig) -> Turn:
    """What turns the signals that a rig says go downwards, and moves those that it says lie far from 0."""
    return Turn({role: -1 if role in rig.downwards else 1 for role in ROLES}, rig.origins)


def with_its_way(rig: Rig, logs: Sequence[Experiment]) -> Rig:
    """The rig, told which signals go downwards and which lie far from 0, by the logs, by the signs of its
    gains and by where it rests. One that has effects says by itself how they count; what one without them
    says is of another session."""
    entry = entry_of(logs)
    if rig.effects or any(entry not in log for log in logs):
        return rig
    values = np.concatenate([np.asarray(log[entry], float) for log in logs])
    down, up = -float(values[values < 0.0].sum()), float(values[values > 0.0].sum())
    x, most = (-1 if down > _DOWN * up else 1), float(np.max(np.abs(values)))
    u = x if entry == "command" else x * _sign(rig.regulator)
    p = u * _sign(rig.regulator)
    k = p * _sign_of(rig, p, entry, most)
    y = k * _sign(rig.sensor)
    signs = {"command": u, "pressure": p, "curvature": k, "output": y, "reference": y}
    return replace(rig, downwards=Turn(signs).roles, origins=_origins(rig, logs))


def _origins(rig: Rig, logs: Sequence[Experiment]) -> Origins:
    """The rig's own zeros, of the signals whose zero is farther from 0 than the output moves in ``logs``."""
    gain = rig.sensor.dc_gain
    if any("output" not in log for log in logs) or not np.isfinite(gain):
        return Origins()
    moves = _FAR * float(np.ptp(np.concatenate([np.asarray(log["output"], float) for log in logs])))
    lies, zero = rig.own_zero("curvature"), rig.own_zero("output")
    return Origins(
        _round(lies) if abs(gain * lies) > moves else 0.0, _round(zero) if abs(zero) > moves else 0.0
    )


def _round(zero: float) -> float:
    """A zero as a file shows it well: what it is rounded by stays in the rig."""
    return float(f"{zero:.9g}")


def _sign(transfer: TransferFunction) -> int:
    """The sign of what a stage does slowly: of its gain at rest, or where it integrates of its rate."""
    slowest = [min(terms, key=lambda term: term.order) for terms in (transfer.num, transfer.den)]
    return 1 if slowest[0].coefficient * slowest[1].coefficient >= 0.0 else -1


def _sign_of(rig: Rig, p: int, entry: str, most: float) -> int:
    """The sign of an actuator's gain at the largest pressure, of the sign ``p``, that an ``entry`` of at most
    that magnitude makes."""
    actuator, most = rig.actuator, most or 1.0
    if actuator is None:
        return 1
    if isinstance(actuator, LinearActuator):
        return _sign(actuator.dynamics)
    gain = abs(rig.regulator.dc_gain) if entry == "command" else 1.0
    largest = p * most * gain if np.isfinite(gain) else p * max(map(abs, rig.ranges.pressure or (most,)))
    return -1 if p * float(actuator.drive(largest)) < 0.0 else 1


def _turned(
    actuator: Actuator | LinearActuator | None, p: int, k: int, lies: float
) -> Actuator | LinearActuator | None:
    if actuator is None:
        return None
    offset = k * (actuator.offset - lies) or 0.0
    if isinstance(actuator, LinearActuator):
        dynamics = _times(actuator.dynamics, p * k)
        return replace(actuator, dynamics=dynamics, offset=offset, bias=p * actuator.bias or 0.0)
    gain = tuple(k * p ** (i + 1) * g for i, g in enumerate(actuator.gain))
    return replace(actuator, gain=gain, offset=offset)


def _times(transfer: TransferFunction, sign: int) -> TransferFunction:
    if sign > 0:
        return transfer
    return transfer * -1.0
