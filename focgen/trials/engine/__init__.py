"""Rigs simulated by a rigid-body physics engine, MuJoCo: hinges instead of an equation."""
