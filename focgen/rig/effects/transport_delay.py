"""The response starts later by a fixed time: tubing, a bus, a slow converter."""

import numpy as np

from focgen.arrays import Array
from focgen.rig.delay import delayed
from focgen.rig.effects._effect import DELAY, Effect, Form, Parameter, Run, Values
from focgen.rig.effects._sizes import own


def _shift(x: Array, values: Values, run: Run) -> Array:
    return delayed(x, run.rest, run.h, values[0])


EFFECT = Effect(
    name="transport_delay",
    stage="regulator",
    meaning="the response starts later by a fixed time",
    reveals="steps and fast sines: a phase that falls in proportion to frequency, with no loss of amplitude",
    confused_with=("slow_regulator", "sensor_lag", "valve_asymmetry"),
    needs=lambda e: None if e.fastest < 0.25 else "no change of the input is fast beside the rig's response",
    sizes=(own("delay"),),
    forms=[
        Form(
            "delay",
            "supply",
            (Parameter(DELAY, time=1, lower=0.0, upper=20.0, starts=(0.01, 0.05, 0.3, 1.5, 6.0), zero=0.0),),
            _shift,
            response=lambda values, s: np.exp(-values[0] * s),
        )
    ],
)
