"""A reading that overshoots with the rate of strain, then relaxes."""

import numpy as np

from focgen.arrays import Array, Complex
from focgen.rig import kernels
from focgen.rig.effects._effect import Effect, Form, Parameter, Run, Values
from focgen.rig.effects._lags import lag_response
from focgen.rig.effects._sizes import HALF_GONE, OVERSHOOT

_SHARE = Parameter("share", lower=0.0, upper=3.0, starts=(0.1, 0.1, 0.1), zero=0.0)
# of a reading right at once, which is too low at rest: the gain that is given may be either
_LOST = Parameter("share", lower=0.0, upper=0.9, starts=(0.1, 0.1, 0.1), zero=0.0)
_TIME = Parameter("time", time=1, lower=0.02, upper=100.0, starts=(0.3, 2.0, 10.0), log=True)


def _followed(x: Array, taus: tuple[float, ...], run: Run) -> Array:
    """The mean of lags of x."""
    made: Array = np.sum([kernels.lag(x, run.rest, run.h, t, t) for t in taus], axis=0) / len(taus)
    return made


def _followed_response(taus: tuple[float, ...], s: Complex) -> Complex:
    made: Complex = np.sum([lag_response(t, s) for t in taus], axis=0) / len(taus)
    return made


def _around(tau: float) -> tuple[float, float, float]:
    return tau / 4, tau, 4 * tau


def _one(x: Array, values: Values, run: Run) -> Array:
    share, tau = values
    return x + share * (x - _followed(x, (tau,), run))


def _spread(x: Array, values: Values, run: Run) -> Array:
    share, tau = values
    return x + share * (x - _followed(x, _around(tau), run))


def _fading(x: Array, values: Values, run: Run) -> Array:
    share, tau = values
    return x - share * _followed(x, (tau,), run)


def _fading_spread(x: Array, values: Values, run: Run) -> Array:
    share, tau = values
    return x - share * _followed(x, _around(tau), run)


def _one_response(values: Values, s: Complex) -> Complex:
    share, tau = values
    return 1.0 + share * (1.0 - _followed_response((tau,), s))


def _spread_response(values: Values, s: Complex) -> Complex:
    share, tau = values
    return 1.0 + share * (1.0 - _followed_response(_around(tau), s))


def _fading_response(values: Values, s: Complex) -> Complex:
    share, tau = values
    return 1.0 - share * _followed_response((tau,), s)


def _fading_spread_response(values: Values, s: Complex) -> Complex:
    share, tau = values
    return 1.0 - share * _followed_response(_around(tau), s)


EFFECT = Effect(
    name="sensor_relaxation",
    stage="sensor",
    meaning="the reading overshoots with strain rate, then relaxes",
    reveals="a step and a hold with the curvature logged: the reading falls while the curvature rests",
    confused_with=("creep", "sensor_lag", "sensor_drift", "sensor_hysteresis"),
    slow=True,
    needs=lambda e: None if e.hold > 3 else "no hold is long beside the rig's response",
    sizes=(OVERSHOOT, HALF_GONE),
    forms=[
        Form("one_time", "strain", (_SHARE, _TIME), _one, response=_one_response),
        Form("spread", "strain", (_SHARE, _TIME), _spread, response=_spread_response),
        Form("fading", "strain", (_LOST, _TIME), _fading, response=_fading_response),
        Form("fading_spread", "strain", (_LOST, _TIME), _fading_spread, response=_fading_spread_response),
    ],
)
