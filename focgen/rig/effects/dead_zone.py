"""Nothing moves below a threshold: slack, a seal, static friction overcome only once."""

from dataclasses import replace

import numpy as np

from focgen.arrays import Array
from focgen.rig.dynamics import Dynamics
from focgen.rig.effects._curves import softly_beyond
from focgen.rig.effects._effect import Effect, Form, Parameter, Run, Values
from focgen.rig.effects._sizes import own

_LEVEL = Parameter("threshold", level=1, lower=0.0, upper=0.9, starts=(0.05, 0.25), zero=0.0)


def _hard(x: Array, values: Values, run: Run) -> Array:
    return np.sign(x) * np.maximum(np.abs(x) - values[0], 0.0)


def _soft(x: Array, values: Values, run: Run) -> Array:
    return np.sign(x) * softly_beyond(np.abs(x), *values)


def _slack(x: Array, values: Values, run: Run) -> Array:
    return _hard(x, values, run)


def _preloaded(x: Dynamics, values: Values, run: None) -> Dynamics:
    return replace(x, preload=x.preload + values[0])


# what drives the actuator is below it at first: K(p) p, or the input of a num/den actuator
_PRELOAD = Parameter("preload", level=1, lower=0.0, upper=0.9, starts=(0.05, 0.25), zero=0.0, at="drive")

EFFECT = Effect(
    name="dead_zone",
    stage="actuator",
    meaning="nothing moves below a threshold",
    reveals="slow ramps from zero, low levels",
    confused_with=("gain_nonlinearity", "hysteresis", "valve_stiction"),
    needs=lambda e: None if e.lowest < 0.35 else "no level below a third of the range was visited",
    also=("regulator",),
    static=True,
    sizes=(own("threshold", "threshold", "preload"),),
    forms=[
        Form("hard", "load", (_LEVEL,), _hard),
        Form(
            "soft",
            "load",
            (
                _LEVEL,
                Parameter("width", level=1, lower=3e-3, upper=0.2, starts=(0.02, 0.05), log=True),
            ),
            _soft,
        ),
        # the spring itself is pressed against a seat, and stops there as it comes back
        Form("preloaded", "dynamics", (_PRELOAD,), _preloaded),
        # what is seen is taken along by what moves, which comes through the slack first
        Form("slack", "response", (_LEVEL,), _slack),
    ],
)
