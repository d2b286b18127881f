"""A supply or valve that cannot move the pressure faster than a rate, up or down."""

from focgen.arrays import Array
from focgen.rig import kernels
from focgen.rig.effects._effect import Effect, Form, Parameter, Run, Values

_RATE = Parameter(
    "rate", level=1, time=-1, lower=1e-3, upper=1e3, starts=(10.0, 2.0, 0.5), zero=1e3, log=True
)


def _hard(x: Array, values: Values, run: Run) -> Array:
    return kernels.rate_limit(x, run.rest, run.h, values[0])


def _soft(x: Array, values: Values, run: Run) -> Array:
    return kernels.rate_limit(x, run.rest, run.h, values[0], tau=values[1], soft=True)


EFFECT = Effect(
    name="flow_limit",
    stage="regulator",
    meaning="the rate of pressure is bounded in both directions",
    reveals="steps of several sizes: the slope stays the same while the step grows",
    confused_with=("slow_regulator", "valve_asymmetry"),
    needs=lambda e: None if e.levels >= 3 and e.fastest < 1.0 else "needs fast steps of several sizes",
    forms=[
        Form("hard", "supply", (_RATE,), _hard),
        Form(
            "saturating",
            "supply",
            (
                _RATE,
                Parameter("lag", time=1, lower=0.0, upper=5.0, starts=(0.05, 0.05, 0.1), zero=0.0),
            ),
            _soft,
        ),
    ],
)
