"""Units of a rig's signals, as it states them or as its columns' names tell, for comments and labels only."""

from __future__ import annotations

from focgen.control.controller import Units
from focgen.logs.units import unit_named
from focgen.rig.rig import UNITY, Rig, Signals


def unit_of_role(signals: Signals, role: str) -> str:
    """The unit of a role's signal: the rig's own, else as its column's name tells it, "" where neither
    does."""
    return signals.units.get(role) or ("" if role in signals.scales else unit_named(getattr(signals, role)))


def units_of_rig(rig: Rig) -> dict[str, str]:
    """The unit of command, pressure, curvature and output as far as the rig tells it, "" where it does not.

    Where no regulator is given, a pressure without a column is the command; where the sensor has a gain of 1,
    a curvature without one is in the output's unit.
    """
    signals = rig.signals
    units = {role: unit_of_role(signals, role) for role in ("command", "pressure", "curvature", "output")}
    if not units["pressure"] and signals.pressure is None and rig.regulator == UNITY:
        units["pressure"] = units["command"]
    if not units["curvature"] and signals.curvature is None and rig.sensor.dc_gain == 1.0:
        units["curvature"] = units["output"]
    return units


def units_of(rig: Rig, scheduled: bool) -> Units:
    """The controller's units as far as the rig's columns tell them."""
    signals = rig.signals
    command = "command" if signals.command else "pressure"
    roles = "output", command, "pressure"
    output, command, pressure = (unit_of_role(signals, role) for role in roles)
    return Units(output, command, pressure if scheduled else "")
