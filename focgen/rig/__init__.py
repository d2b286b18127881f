"""The rig: regulator → actuator → sensor, its file, and its simulation."""

from focgen.rig.files import read_rig, write_rig
from focgen.rig.model import Actuator, LinearActuator, Ranges, Rig, Signals

__all__ = ["Actuator", "LinearActuator", "Ranges", "Rig", "Signals", "read_rig", "write_rig"]
