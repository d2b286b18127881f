"""A sensor slower than nominal: a filter, exposure, a slow front end."""

from focgen.rig import kernels
from focgen.rig.effects._effect import Effect, Form, Parameter

_LAG = (Parameter("lag", time=1, lower=0.0, upper=20.0, starts=(0.02, 0.2), zero=0.0),)


def _one(x, values, run):
    return kernels.lag(x, run.rest, run.h, values[0], values[0])


def _two(x, values, run):
    return _one(_one(x, values, run), values, run)


EFFECT = Effect(
    name="sensor_lag",
    stage="sensor",
    meaning="slower than nominal",
    reveals="steps and fast sines with the curvature logged",
    confused_with=("slow_regulator", "transport_delay", "sensor_relaxation", "creep"),
    needs=lambda e: None if e.fastest < 1.0 else "no change of the input is fast beside the rig's response",
    forms=[
        Form("one_lag", "strain", _LAG, _one),
        Form("two_lags", "strain", _LAG, _two),
    ],
)
