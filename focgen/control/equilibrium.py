"""Where the rig can stand still: the rest, and the pressure and command that hold a given output."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from focgen.control.units import read_alike
from focgen.errors import DesignError
from focgen.present import present
from focgen.rig.rig import UNITY, Actuator, LinearActuator, Ranges, Rig

_COMMAND = (0.0, 10.0)  # V, where the rig does not say
_GRID = 2001
_APART = 2.0  # times: command and pressure whose ranges differ by more are not the same quantity
_WITHIN = "give set points, or [ranges] output, within the rig's reach"
_REGULATOR = "`focgen identify LOG --stages regulator,actuator` fits one"
_SENSOR = "`focgen identify LOG --stages sensor,actuator` fits one"


@dataclass(frozen=True)
class Equilibrium:
    """A state the rig can rest in: ``command``, ``pressure``, ``output``, each in its own unit."""

    command: float
    pressure: float
    output: float


def actuator_of(rig: Rig) -> Actuator | LinearActuator:
    """The rig's actuator; a stage that is absent is 1."""
    return rig.actuator if rig.actuator is not None else LinearActuator(UNITY)


def derived_ranges(rig: Rig) -> tuple[Ranges, tuple[str, ...]]:
    """Return the rig's ranges with what is absent derived, and a sentence for each derived one.

    The command's is 0–10 V (the pressure's, where nothing stands between), the pressure's and the output's
    follow through the stages' static gains. Raises DesignError where a stage has no finite static gain.
    """
    given, notes = rig.ranges, []
    if counts := counted_alike(rig):
        notes.append(f"{counts}; {_REGULATOR}")
    if read := read_alike(rig):
        notes.append(f"{read}; {_SENSOR}")
    if isinstance(rig.actuator, Actuator) and rig.actuator.slip:
        notes.append(rig.actuator.slip)
    command = given.command
    if command is None:
        merged = rig.regulator == UNITY and rig.signals.command is None
        command = given.pressure if merged and given.pressure else _COMMAND
        notes.append(f"the command's range is not given: {_span(command)}")
    pressure = given.pressure
    if pressure is None:
        pressure = _scaled(command, _static_gain(rig, "regulator"))
        notes.append(
            f"the pressure's range is not given: {_span(pressure)}, the command's through the regulator"
        )
    output = given.output
    if output is None:
        output = _output_range(rig, pressure)
        notes.append(
            f"the output's range is not given: {_span(output)}, the pressure's through actuator and sensor"
        )
    return Ranges(command, pressure, output), tuple(notes)


def counted_alike(rig: Rig) -> str:
    """How a command becomes a pressure in a rig that has no regulator though both are signals of it, in other
    units or with other ranges; "" for any other rig.
    """
    signals, ranges = rig.signals, rig.ranges
    if rig.regulator != UNITY or signals.command is None or signals.pressure is None:
        return ""
    units = signals.unit_of("command"), signals.unit_of("pressure")
    tops = [max(map(abs, span)) for span in (ranges.command, ranges.pressure) if span is not None]
    if (units[0] == units[1] or not all(units)) and (len(tops) < 2 or max(tops) <= _APART * min(tops)):
        return ""
    one, other = (f"1 {unit}".rstrip() for unit in units)
    return f"the rig has no [regulator], so {one} of the command counts as {other} of the pressure"


def _span(span: tuple[float, float]) -> str:
    return f"{span[0]:.4g} … {span[1]:.4g}"


def _scaled(span: tuple[float, float], factor: float) -> tuple[float, float]:
    ends = sorted((span[0] * factor, span[1] * factor))
    return ends[0], ends[1]


def _static_gain(rig: Rig, stage: str) -> float:
    transfer = actuator_of(rig).dynamics if stage == "actuator" else getattr(rig, stage)
    gain = transfer.dc_gain
    if not (math.isfinite(gain) and gain != 0.0):
        raise DesignError(
            f"{rig.name} [{stage}]",
            f"has the static gain {gain:g}, so no range follows through it",
            "give [ranges] for command, pressure and output",
        )
    return gain


def _output_range(rig: Rig, pressure: tuple[float, float]) -> tuple[float, float]:
    values = static_output(rig, np.linspace(*pressure, _GRID))
    low, high = float(np.min(values)), float(np.max(values))
    if not low < high:
        raise DesignError(
            f"{rig.name} [actuator]",
            "does not move its output over the pressure's range",
            "check gain and [ranges]",
        )
    return low, high


def static_output(rig: Rig, pressure: Any) -> Any:
    """What the sensor reads at rest at ``pressure``, any shape."""
    actuator = actuator_of(rig)
    curvature = actuator.drive(pressure) * _static_gain(rig, "actuator") + actuator.offset
    return curvature * _static_gain(rig, "sensor") + rig.zero


def rest(rig: Rig, command: tuple[float, float]) -> Equilibrium:
    """Return the rig's rest: no command, or what the ``command`` range has nearest to none. Raises
    DesignError where the rig goes on moving there.
    """
    actuator = actuator_of(rig)
    idle = min(max(0.0, command[0]), command[1])
    pressure = idle * rig.regulator.dc_gain if idle else 0.0
    drive = float(actuator.drive(pressure))
    settled = drive * actuator.dynamics.dc_gain if drive else 0.0
    level = settled + actuator.offset
    output = (level * rig.sensor.dc_gain if level else 0.0) + rig.zero
    if not math.isfinite(output):
        raise DesignError(
            rig.name, f"never rests at the command {idle:g}", "give a command range that holds 0"
        )
    return Equilibrium(idle, pressure, output)


def holding(rig: Rig, output: float, ranges: Ranges) -> Equilibrium:
    """Return the equilibrium at ``output``. Raises DesignError where the ranges do not reach it."""
    actuator = actuator_of(rig)
    if math.isinf(actuator.dynamics.dc_gain):  # it integrates: it rests at any output, without pressure
        return Equilibrium(0.0, 0.0, output)
    level = (output - rig.zero) / _static_gain(rig, "sensor") - actuator.offset
    pressure = _pressure_for(rig, level / _static_gain(rig, "actuator"), output, ranges)
    command = pressure / _static_gain(rig, "regulator")
    slack = 1e-9 * (present(ranges.command)[1] - present(ranges.command)[0])
    if not present(ranges.command)[0] - slack <= command <= present(ranges.command)[1] + slack:
        raise _unreachable(
            rig, output, f"needs the command {command:.4g}", f"[{_span(present(ranges.command))}]"
        )
    return Equilibrium(command, pressure, output)


def within_reach(rig: Rig, outputs: Sequence[float], command: tuple[float, float]) -> list[bool]:
    """Whether the rig, which rests elsewhere, is held at each of the ``outputs`` by a ``command`` in that
    range.
    """
    start = rest(rig, command).output
    return [output != start and _is_held(rig, output, Ranges(command=command)) for output in outputs]


def _is_held(rig: Rig, output: float, ranges: Ranges) -> bool:
    try:
        holding(rig, output, ranges)
    except DesignError:
        return False
    return True


def _pressure_for(rig: Rig, drive: float, output: float, ranges: Ranges) -> float:
    """Return the pressure nearest to rest at which K(p) p is ``drive``, within what the command can hold."""
    actuator = actuator_of(rig)
    if isinstance(actuator, LinearActuator):
        return drive
    start = rest(rig, present(ranges.command)).pressure
    reach = _scaled(present(ranges.command), _static_gain(rig, "regulator"))
    for end in (reach[1], reach[0]):
        pressure = np.linspace(start, end, _GRID)
        off = actuator.drive(pressure) - drive
        hit = np.flatnonzero((off[1:] == 0.0) | (np.sign(off[1:]) * np.sign(off[:-1]) < 0))
        if len(hit):
            return _root(actuator, drive, pressure[hit[0]], pressure[hit[0] + 1])
    if actuator.drive(start) == drive:
        return start
    top = static_output(rig, np.linspace(*reach, _GRID))
    raise _unreachable(rig, output, "is out of reach", f"{_span((float(top.min()), float(top.max())))}")


def _root(actuator: Actuator, drive: float, low: float, high: float) -> float:
    from scipy.optimize import brentq

    if actuator.drive(high) == drive:
        return float(high)
    return float(brentq(lambda p: actuator.drive(p) - drive, low, high, xtol=1e-15, rtol=1e-14, maxiter=5000))


def _unreachable(rig: Rig, output: float, what: str, within: str) -> DesignError:
    told, remedy = f"the output {output:.4g} {what}; reachable is {within}", _WITHIN
    if counts := counted_alike(rig):
        told, remedy = f"{told}, for {counts}", f"{_REGULATOR}; design from the rig that it writes"
    return DesignError(rig.name, told, remedy)
