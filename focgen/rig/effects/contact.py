"""Stiffer beyond a curvature: an obstacle, a wall, the finger's own other side."""

from dataclasses import replace

import numpy as np

from focgen.arrays import Array
from focgen.rig.dynamics import Dynamics
from focgen.rig.effects._curves import softly_beyond
from focgen.rig.effects._effect import Effect, Form, Parameter, Run, Values
from focgen.rig.effects._sizes import own

_PLACE = Parameter("curvature", level=1, lower=0.1, upper=1.3, starts=(0.8, 0.5, 0.95), zero=1.3)


def _knee(x: Array, values: Values, run: Run) -> Array:
    place, slope = values
    made: Array = np.minimum(x, place) + slope * np.maximum(x - place, 0.0)
    return made


def _gradual(x: Array, values: Values, run: Run) -> Array:
    place, stiffness = values
    beyond = np.maximum(x - place, 0.0) * stiffness
    made: Array = np.minimum(x, place) + np.log1p(beyond) / stiffness
    return made


def _soft(x: Array, values: Values, run: Run) -> Array:
    place, slope, width = values
    beyond = softly_beyond(x, place, width)
    made: Array = x - (1.0 - slope) * beyond
    return made


def _hertz(x: Array, values: Values, run: Run) -> Array:
    place, stiffness = values
    beyond = np.maximum(x - place, 0.0)
    made: Array = x - beyond + beyond / (1.0 + np.sqrt(stiffness * beyond))
    return made


def _spring(x: Dynamics, values: Values, run: None) -> Dynamics:
    place, stiffness = values
    return replace(x, place=place, stiffness=stiffness)


def _both_ways(x: Dynamics, values: Values, run: None) -> Dynamics:
    place, stiffness = values
    return replace(x, place=-place, stiffness=stiffness)


_WALL = Parameter("stiffness", lower=0.02, upper=200.0, starts=(1.0, 1.0, 10.0), log=True)
_STIFFNESS = Parameter("stiffness", level=-1, lower=0.1, upper=1e3, starts=(5.0, 5.0), log=True)

EFFECT = Effect(
    name="contact",
    stage="actuator",
    meaning="stiffer beyond a curvature: an obstacle",
    reveals="levels on both sides of the obstacle, fast and slow: a knee at a fixed curvature",
    confused_with=("gain_nonlinearity", "sensor_saturation", "sensor_nonlinearity", "supply_saturation"),
    needs=lambda e: None if e.levels >= 4 else "needs four or more levels",
    static=True,
    sizes=(own("curvature", "obstacle at"),),
    forms=[
        Form(
            "knee",
            "response",
            (
                _PLACE,
                Parameter("slope", lower=0.0, upper=0.95, starts=(0.4, 0.4)),
            ),
            _knee,
        ),
        Form(
            "soft_knee",
            "response",
            (
                _PLACE,
                Parameter("slope", lower=0.0, upper=0.95, starts=(0.4, 0.4)),
                Parameter("width", level=1, lower=3e-3, upper=0.2, starts=(0.02, 0.05), log=True),
            ),
            _soft,
        ),
        Form(
            "early_knee",
            "drive",
            (
                _PLACE,
                Parameter("slope", lower=0.0, upper=0.95, starts=(0.4, 0.4)),
            ),
            _knee,
        ),
        # it pushes the actuator itself, which comes to rest the sooner; a wall is as stiff as it likes
        Form("spring", "dynamics", (_PLACE, _WALL), _spring),
        # stops at both ends of a stroke
        Form("both_ways", "dynamics", (_PLACE, _WALL), _both_ways, both_ways=True),
        Form("gradual", "response", (_PLACE, _STIFFNESS), _gradual),
        Form("hertz", "response", (_PLACE, _STIFFNESS), _hertz),
    ],
)
