"""The stages of a rig in order, and the signals that enter and leave them."""

from __future__ import annotations

STAGES = ("regulator", "actuator", "sensor")
ENTERS = {"command": "regulator", "pressure": "actuator", "curvature": "sensor"}
LEAVES = {"regulator": "pressure", "actuator": "curvature", "sensor": "output"}
