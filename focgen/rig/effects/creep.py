"""A slow further deformation under constant load."""

import numpy as np

from focgen.arrays import Array, Complex
from focgen.rig import kernels
from focgen.rig.effects._effect import LARGEST, Effect, Form, Parameter, Run, Values
from focgen.rig.effects._lags import lag_response
from focgen.rig.effects._sizes import FURTHER_CREEP

_DECADES = np.geomspace(0.03, 30.0, 7)
_SHARE = Parameter("share", lower=0.0, upper=3.0, starts=(0.1, 0.1), zero=0.0)


def _tau(lower: float, *starts: float) -> Parameter:
    """A time constant long beside the rig's response: what is quicker is no creep."""
    return Parameter("time", time=1, lower=lower, upper=3000.0, starts=starts, log=True)


def _pole(x: Array, values: Values, run: Run) -> Array:
    share, tau = values
    return x + share * kernels.lag(x, run.rest, run.h, tau, tau)


def _logarithmic(x: Array, values: Values, run: Run) -> Array:
    share, tau = values
    return x + share / 7.0 * sum(kernels.lag(x, run.rest, run.h, t, t) for t in tau * _DECADES)


def _two(x: Array, values: Values, run: Run) -> Array:
    quick, slow, tau = values
    made: Array = (
        x
        + quick * kernels.lag(x, run.rest, run.h, tau / 5, tau / 5)
        + slow * kernels.lag(x, run.rest, run.h, tau, tau)
    )
    return made


def _power(x: Array, values: Values, run: Run) -> Array:
    share, tau, power, scale = values
    return x + share * kernels.power_creep(x, run.rest, run.h, tau, scale, power)


def _pole_response(values: Values, s: Complex) -> Complex:
    share, tau = values
    return 1.0 + share * lag_response(tau, s)


def _logarithmic_response(values: Values, s: Complex) -> Complex:
    share, tau = values
    made: Complex = 1.0 + share / 7.0 * np.sum([lag_response(t, s) for t in tau * _DECADES], axis=0)
    return made


def _two_response(values: Values, s: Complex) -> Complex:
    quick, slow, tau = values
    return 1.0 + quick * lag_response(tau / 5, s) + slow * lag_response(tau, s)


EFFECT = Effect(
    name="creep",
    stage="actuator",
    meaning="a slow further deformation under constant load, over tens of seconds to minutes",
    reveals="holds of a hundred seconds and recoveries as long",
    confused_with=("sensor_relaxation", "sensor_lag", "sensor_drift", "gain_drift", "softening"),
    slow=True,
    needs=lambda e: None if e.hold > 8 else "no hold is long beside the rig's response: hold a level longer",
    sizes=(FURTHER_CREEP,),
    forms=[
        Form("pole", "response", (_SHARE, _tau(6.0, 12.0, 60.0)), _pole, response=_pole_response),
        Form(
            "logarithmic",
            "response",
            (_SHARE, _tau(15.0, 30.0, 150.0)),
            _logarithmic,
            response=_logarithmic_response,
        ),
        Form(
            "two_poles",
            "response",
            (
                Parameter("quick", lower=0.0, upper=3.0, starts=(0.05, 0.05), zero=0.0),
                Parameter("slow", lower=0.0, upper=3.0, starts=(0.05, 0.05), zero=0.0),
                _tau(30.0, 40.0, 80.0),
            ),
            _two,
            response=_two_response,
        ),
        Form(  # quick at first, ever slower: Norton and Bailey's law
            "power",
            "response",
            (
                _SHARE,
                _tau(6.0, 12.0, 40.0),
                Parameter("power", lower=1.05, upper=8.0, starts=(2.0, 2.0)),
                LARGEST,
            ),
            _power,
        ),
    ],
)
