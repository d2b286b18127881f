"""The closed loop of controller and rig: its design in simulation, its margins, its set points."""
