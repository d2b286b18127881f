"""A pressure that cannot pass a ceiling: an exhausted supply, a relief valve."""

from dataclasses import replace

import numpy as np

from focgen.arrays import Array
from focgen.rig import kernels
from focgen.rig.dynamics import Dynamics
from focgen.rig.effects._curves import softly_beyond
from focgen.rig.effects._effect import Effect, Form, Parameter, Run, Values
from focgen.rig.effects._sizes import own

_CEILING = Parameter("ceiling", level=1, lower=0.1, upper=1.3, starts=(0.95, 0.75), zero=1.3)
_WIDTH = Parameter("width", level=1, lower=1e-3, upper=0.3, starts=(0.03, 0.05), log=True)

# of a rise of the pressure: the chamber's volume over the tank's
_DRAW = Parameter("draw", lower=0.0, upper=2.0, starts=(0.1, 0.1, 0.3, 0.3), zero=0.0)
_REFILL = Parameter(
    "refill", level=1, time=-1, lower=1e-4, upper=1.0, starts=(0.01, 0.05, 0.01, 0.05), log=True
)


def _hard(x: Array, values: Values, run: Run) -> Array:
    return np.minimum(x, values[0])


def _both_ways(x: Array, values: Values, run: Run) -> Array:
    return np.clip(x, -values[0], values[0])


def _soft(x: Array, values: Values, run: Run) -> Array:
    return x - softly_beyond(x, *values)


def _soft_both_ways(x: Array, values: Values, run: Run) -> Array:
    return x - np.sign(x) * softly_beyond(np.abs(x), *values)


def _stops(x: Dynamics, values: Values, run: None) -> Dynamics:
    return replace(x, ceiling=min(x.ceiling, values[0]))


def _fed(x: Dynamics, values: Values, run: None) -> Dynamics:
    return replace(x, supply=min(x.supply, values[0]))


def _spilt(x: Array, values: Values, run: Run) -> Array:
    """What a pump puts in beyond the ceiling is let out for good: x less the most that was beyond so far."""
    made = np.empty(len(x))
    for a, b, stood in run.stood_by_span:
        beyond = np.maximum(x[a:b] + stood - values[0], 0.0)
        made[a:b] = x[a:b] - np.maximum.accumulate(beyond)
    return made


def _drawn(x: Array, values: Values, run: Run) -> Array:
    return kernels.drawn(x, run.rest, run.h, *values)


EFFECT = Effect(
    name="supply_saturation",
    stage="regulator",
    meaning="pressure cannot pass a ceiling",
    reveals="levels above and below the ceiling, with the pressure logged: a flat top",
    confused_with=("gain_nonlinearity", "leak", "contact", "sensor_saturation"),
    needs=lambda e: None if e.levels >= 3 else "needs three or more levels",
    static=True,
    sizes=(own("ceiling"),),
    forms=[
        Form("hard", "supply", (_CEILING,), _hard),
        # a chamber that fills from its supply comes to rest there as slowly as anywhere
        Form("fed", "chamber", (_CEILING,), _fed),
        # a relief valve opens at once, and there is nothing above to come down from
        Form("relieved", "chamber", (_CEILING,), _stops),
        # and so it does beside a pump
        Form("spilt", "supply", (_CEILING,), _spilt, adds_up=True),
        # an amplifier clips what goes either way
        Form("both_ways", "supply", (_CEILING,), _both_ways, both_ways=True),
        # a tank gives what it has, and a pump takes its time to refill it
        Form("drawn", "supply", (replace(_CEILING, starts=(0.95, 0.95, 1.1, 1.1)), _DRAW, _REFILL), _drawn),
        Form("soft", "supply", (_CEILING, _WIDTH), _soft),
        Form("soft_both_ways", "supply", (_CEILING, _WIDTH), _soft_both_ways, both_ways=True),
    ],
)
