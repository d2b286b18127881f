"""A regulator whose bandwidth is lower than nominal, filling and venting alike."""

from focgen.rig import kernels
from focgen.rig.effects._effect import Effect, Form, Parameter

_LAG = (Parameter("lag", time=1, lower=0.0, upper=20.0, starts=(0.02, 0.2), zero=0.0),)


def _one(x, values, run):
    return kernels.lag(x, run.rest, run.h, values[0], values[0])


def _two(x, values, run):
    return _one(_one(x, values, run), values, run)


EFFECT = Effect(
    name="slow_regulator",
    stage="regulator",
    meaning="a linear bandwidth lower than nominal, up and down alike",
    reveals="steps in both directions: the same extra lag at every size of step",
    confused_with=("transport_delay", "valve_asymmetry", "flow_limit", "sensor_lag"),
    needs=lambda e: None if e.fastest < 1.0 else "no change of the input is fast beside the rig's response",
    forms=[Form("one_lag", "supply", _LAG, _one), Form("two_lags", "supply", _LAG, _two)],
)
