"""The rig: regulator → actuator → sensor, its file, and its simulation."""

from focgen.rig.files import read_rig, write_rig
from focgen.rig.rig import (
    Actuator,
    Delays,
    LinearActuator,
    Ranges,
    Relative,
    Rig,
    Signals,
    Uncertainty,
)

__all__ = [
    "Actuator",
    "Delays",
    "LinearActuator",
    "Ranges",
    "Relative",
    "Rig",
    "Signals",
    "Uncertainty",
    "read_rig",
    "write_rig",
]
