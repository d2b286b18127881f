"""The controller: what it is, its file, and the mathematics of its design: inverse, schedule, margins."""

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
