"""Units of a rig's signals, as it states them or as its columns' names tell, for comments and labels; and
whether a controller's are the same."""

from __future__ import annotations

from focgen.control.controller import Controller, Units
from focgen.errors import ControllerError
from focgen.logs.scales import differ
from focgen.rig.rig import UNITY, Rig


def units_of_rig(rig: Rig) -> dict[str, str]:
    """The unit of command, pressure, curvature and output as far as the rig tells it, "" where it does not.

    Where no regulator is given, a pressure without a column is the command; where the sensor has a gain of 1,
    a curvature without one is in the output's unit.
    """
    signals = rig.signals
    units = {role: signals.unit_of(role) for role in ("command", "pressure", "curvature", "output")}
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
    output, command, pressure = (signals.unit_of(role) for role in roles)
    return Units(output, command, pressure if scheduled else "")


def check_one_unit(rig: Rig, controller: Controller) -> None:
    """Raise ControllerError where rig and controller state a signal in units that differ: numbers of the one
    would go into the other as they stand. What either does not state, or nobody knows, is no matter."""
    theirs, ours = units_of(rig, controller.scheduled), controller.units
    for key, given in vars(theirs).items():
        stated = getattr(ours, key)
        if differ(given, stated):
            what = f"is {stated!r}, the rig has {given!r}"
            remedy = "design the controller from this rig, or give both in the same unit"
            raise ControllerError(f"{controller.name} [units] {key}", what, remedy)


def read_alike(rig: Rig) -> str:
    """How a curvature becomes an output in a rig that has no sensor though both are signals of it, in other
    units; "" for any other rig."""
    if rig.sensor != UNITY or rig.signals.curvature is None:
        return ""
    one, other = (rig.signals.unit_of(role) for role in ("curvature", "output"))
    if not differ(one, other):
        return ""
    return f"the rig has no [sensor], so a curvature in {one} counts as an output in {other}"
