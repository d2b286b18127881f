"""A reading in coarse steps."""

import numpy as np

from focgen.arrays import Array
from focgen.rig.effects._effect import STEP, Effect, Form, Parameter, Run, Values
from focgen.rig.effects._levels import seen


def _round(x: Array, values: Values, run: Run) -> Array:
    step, phase = values
    return step * np.round((x - phase) / step) + phase if step > 0 else x


EFFECT = Effect(
    name="sensor_quantization",
    stage="sensor",
    meaning="coarse steps",
    reveals="slow ramps: the reading moves in steps of one size",
    confused_with=("valve_stiction",),
    needs=lambda e: None,
    forms=[
        Form(
            "rounding",
            "reading",
            (
                Parameter(
                    STEP, level=1, lower=0.0, upper=2.0, starts=tuple(np.geomspace(0.008, 0.3, 6)), zero=0.0
                ),
                Parameter("phase", level=1, lower=-0.5, upper=0.5, starts=(0.0,)),
            ),
            _round,
            seen=seen,
        )
    ],
)
