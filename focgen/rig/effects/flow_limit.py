"""A supply or valve that cannot move the pressure faster than a rate, up or down."""

from dataclasses import replace

import numpy as np

from focgen.arrays import Array
from focgen.rig import kernels
from focgen.rig.dynamics import Dynamics, Flow, Throat
from focgen.rig.effects._effect import Effect, Form, Parameter, Run, Values
from focgen.rig.effects._lags import PACE, RATE, THROAT
from focgen.rig.effects._pumps import given
from focgen.rig.effects._sizes import HIGHEST_RATE


def _hard(x: Array, values: Values, run: Run) -> Array:
    return kernels.rate_limit(x, run.rest, run.h, values[0])


def _soft(x: Array, values: Values, run: Run) -> Array:
    return kernels.rate_limit(x, run.rest, run.h, values[0], tau=values[1], soft=True)


def _own(x: Dynamics, values: Values, run: None) -> Dynamics:
    return replace(x, flow=Flow(values[0], values[0]))


def _throats(x: Dynamics, values: Values, run: None) -> Dynamics:
    pace, scale = values
    return replace(x, throat=Throat(scale, scale, pace))


def _spent(x: Array, values: Values, run: Run) -> Array:
    """What a pump is told beyond its rate never comes."""
    most = values[0] * run.h
    return given(x, run, lambda steps: np.clip(steps, -most, most))


def _driven(x: Array, values: Values, run: Run) -> Array:
    return np.clip(x, -values[0], values[0])


_DRIVEN = Parameter("most", level=1, lower=0.1, upper=1.3, starts=(0.95, 0.75, 0.5), zero=1.3)
# of the largest volume in a response time: a pump takes longer to fill what is behind it
_PUMPED = replace(RATE, starts=(0.5, 0.25, 0.12, 0.06, 0.03))

EFFECT = Effect(
    name="flow_limit",
    stage="regulator",
    meaning="the rate of pressure is bounded in both directions",
    reveals="steps of several sizes: the slope stays the same while the step grows",
    confused_with=("slow_regulator", "valve_asymmetry"),
    needs=lambda e: None if e.levels >= 3 and e.fastest < 1.0 else "needs fast steps of several sizes",
    sizes=(HIGHEST_RATE,),
    forms=[
        Form("hard", "supply", (RATE,), _hard),
        # what flows into the chamber itself
        Form("choked", "chamber", (RATE,), _own),
        Form("throats", "chamber", (PACE, THROAT), _throats),
        # what a pump or a motor does not move in time is not made up for later: its driver ends, or its speed
        Form("driven", "command", (_DRIVEN,), _driven, adds_up=True),
        Form("spent", "supply", (_PUMPED,), _spent, adds_up=True),
        Form(
            "saturating",
            "supply",
            (
                RATE,
                Parameter("lag", time=1, lower=0.0, upper=5.0, starts=(0.05, 0.05, 0.1), zero=0.0),
            ),
            _soft,
        ),
    ],
)
