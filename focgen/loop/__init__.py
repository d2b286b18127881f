"""The closed loop of controller and rig: its design in simulation, its margins, its response to set points."""
