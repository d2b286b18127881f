"""Dynamics that are faster or slower when unloading."""

from focgen.arrays import Array
from focgen.rig import kernels
from focgen.rig.effects._effect import Effect, Form, Parameter, Run, Values
from focgen.rig.effects._lags import two_paced


def _lag(x: Array, values: Values, run: Run) -> Array:
    up, down = max(-values[0], 0.0), max(values[0], 0.0)
    return kernels.lag(x, run.rest, run.h, up, down)


EFFECT = Effect(
    name="unloading_asymmetry",
    stage="actuator",
    meaning="the dynamics are faster or slower when unloading",
    reveals="steps up and down between the same pressures, sines: a mean shift that grows with frequency",
    confused_with=("valve_asymmetry", "hysteresis", "sensor_hysteresis", "gain_nonlinearity"),
    needs=lambda e: None if e.unloads else "the input never falls: release it as well",
    forms=[
        two_paced("dynamics", "unloading_speed"),
        Form(
            "lag",
            "response",
            (Parameter("lag", time=1, lower=-5.0, upper=5.0, starts=(0.2, -0.2), zero=0.0),),
            _lag,
        ),
    ],
)
