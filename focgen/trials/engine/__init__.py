"""Rigs simulated by a rigid-body physics engine, MuJoCo: hinges and chains of hinges instead of an equation."""
