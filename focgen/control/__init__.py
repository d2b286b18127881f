"""The controller: what it is, its file, its design, and the closed loop it makes with a rig."""

from focgen.control.controller import Controller, ControllerRanges, GainSchedule, Source, Units
from focgen.control.files import read_controller, write_controller

__all__ = [
    "Controller",
    "ControllerRanges",
    "GainSchedule",
    "Source",
    "Units",
    "read_controller",
    "write_controller",
]
