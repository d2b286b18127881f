"""A reading in coarse steps."""

import numpy as np

from focgen.arrays import Array
from focgen.rig import kernels
from focgen.rig.effects._effect import STEP, Effect, Form, Parameter, Run, Values
from focgen.rig.effects._levels import seen
from focgen.rig.effects._sizes import own


def _round(x: Array, values: Values, run: Run) -> Array:
    step, phase = values
    return step * np.round((x - phase) / step) + phase if step > 0 else x


def _sluggish(x: Array, values: Values, run: Run) -> Array:
    """A level goes on only once it is passed by ``lag`` of a step more than half a one, as with encoders and
    comparators that are not to chatter: a play ahead of the rounding."""
    step, phase, lag = values
    return _round(kernels.play(x, run.rest, lag * step), (step, phase), run)


def _never(y: Array) -> None:
    """It cannot be read off the levels: with them, a rounding is."""


_STEPS = (
    Parameter(STEP, level=1, lower=0.0, upper=2.0, starts=tuple(np.geomspace(0.008, 0.3, 6)), zero=0.0),
    Parameter("phase", level=1, lower=-0.5, upper=0.5, starts=(0.0,)),
)

EFFECT = Effect(
    name="sensor_quantization",
    stage="sensor",
    meaning="coarse steps",
    reveals="slow ramps: the reading moves in steps of one size",
    confused_with=("valve_stiction",),
    needs=lambda e: None,
    sizes=(own("step"),),
    forms=[
        Form("rounding", "reading", _STEPS, _round, seen=seen),
        Form(
            "sluggish",
            "reading",
            (*_STEPS, Parameter("lag", lower=0.0, upper=0.5, starts=(0.2,))),
            _sluggish,
            seen=_never,
        ),
    ],
)
