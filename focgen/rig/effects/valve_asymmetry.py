"""A valve that vents more slowly, or faster, than it fills."""

from dataclasses import replace

import numpy as np

from focgen.arrays import Array
from focgen.rig import kernels
from focgen.rig.dynamics import Dynamics, Flow, Throat
from focgen.rig.effects._effect import Effect, Form, Parameter, Run, Values
from focgen.rig.effects._lags import PACE, RATE, THROAT, rising, two_paced
from focgen.rig.effects._pumps import given
from focgen.rig.effects._sizes import DOWN_OVER_UP

_SPEED = Parameter("venting_speed", lower=0.05, upper=20.0, starts=(0.7, 2.0), zero=1.0, log=True)


def _time(name: str, *starts: float) -> Parameter:
    return Parameter(name, time=1, lower=0.0, upper=20.0, starts=starts, zero=0.0)


def _lags(x: Array, values: Values, run: Run) -> Array:
    fill, vent = values
    return kernels.lag(x, run.rest, run.h, fill, vent)


def _orifice(x: Array, values: Values, run: Run) -> Array:
    fill, vent, scale = values
    return kernels.orifice(x, run.rest, run.h, fill, vent, scale)


def _throat(x: Dynamics, values: Values, run: None) -> Dynamics:
    speed, scale = values
    return replace(x, unloading=x.unloading * speed, throat=Throat(vent=scale))


def _throats(x: Dynamics, values: Values, run: None) -> Dynamics:
    pace, speed, scale = values
    return replace(x, unloading=x.unloading * speed, throat=Throat(scale, scale, pace))


def _fill(x: Dynamics, values: Values, run: None) -> Dynamics:
    return replace(x, flow=Flow(fill=values[0], vent=x.flow.vent))


def _vent(x: Dynamics, values: Values, run: None) -> Dynamics:
    return replace(x, flow=Flow(fill=x.flow.fill, vent=values[0]))


def _back(x: Array, values: Values, run: Run) -> Array:
    """A pump that moves another share of what it is told on the way back."""
    return given(x, run, lambda steps: np.where(steps < 0.0, values[0] * steps, steps))


EFFECT = Effect(
    name="valve_asymmetry",
    stage="regulator",
    meaning="vents more slowly (or faster) than it fills",
    reveals="steps up and down between the same levels, with the pressure logged",
    confused_with=("slow_regulator", "flow_limit", "unloading_asymmetry", "transport_delay"),
    needs=lambda e: None if e.unloads else "the input never falls: release it as well",
    sizes=(DOWN_OVER_UP,),
    forms=[
        # the lag that fills and vents is the regulator's own
        two_paced("chamber", "venting_speed"),
        rising("filling", "chamber", "filling_speed"),
        # it vents through a throat: pipes and silencers are laminar at small differences, turbulent at large
        Form("throat", "chamber", (_SPEED, THROAT), _throat),
        Form("throats", "chamber", (PACE, replace(_SPEED, starts=(0.7, 0.7)), THROAT), _throats),
        # one of its ways is too narrow
        Form("choked_supply", "chamber", (RATE,), _fill),
        Form("choked_exhaust", "chamber", (RATE,), _vent),
        Form("back", "supply", (replace(_SPEED, starts=(0.95, 1.05)),), _back, adds_up=True),
        Form("two_lags", "supply", (_time("fill", 0.02, 0.02), _time("vent", 0.2, 1.0)), _lags),
        Form(
            "orifice",
            "supply",
            (
                _time("fill", 0.02, 0.1),
                _time("vent", 0.2, 0.5),
                Parameter("scale", level=1, lower=0.02, upper=50.0, starts=(1.0, 0.5), log=True),
            ),
            _orifice,
        ),
    ],
)
