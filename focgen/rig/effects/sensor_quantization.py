"""A reading in coarse steps."""

import numpy as np
from focgen.rig.effects._effect import Effect, Form, Parameter


def _round(x, values, run):
    step = values[0]
    return step * np.round(x / step) if step > 0 else x


EFFECT = Effect(
    name="sensor_quantization",
    stage="sensor",
    meaning="coarse steps",
    reveals="slow ramps: the reading moves in steps of one size",
    confused_with=("valve_stiction",),
    needs=lambda e: None,
    single=True,
    forms=[Form("rounding", "reading", (
        Parameter("step", level=1, lower=0.0, upper=0.5, starts=tuple(np.geomspace(0.008, 0.3, 12)), zero=0.0),
    ), _round)],
)
