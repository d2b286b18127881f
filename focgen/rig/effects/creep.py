"""A slow further deformation under constant load."""

import numpy as np
from focgen.rig import kernels
from focgen.rig.effects._effect import Effect, Form, Parameter

_SHARE = Parameter("share", lower=0.0, upper=3.0, starts=(0.1, 0.1), zero=0.0)


def _tau(*starts):
    return Parameter("time", time=1, clock="record", lower=0.02, upper=10.0, starts=starts, log=True)


def _pole(x, values, run):
    share, tau = values
    return x + share * kernels.lag(x, run.rest, run.h, tau, tau)


def _logarithmic(x, values, run):
    share, tau = values
    times = tau * np.geomspace(0.03, 30.0, 7)
    return x + share / 7.0 * sum(kernels.lag(x, run.rest, run.h, t, t) for t in times)


def _two(x, values, run):
    quick, slow, tau = values
    return x + quick * kernels.lag(x, run.rest, run.h, tau / 5, tau / 5) + slow * kernels.lag(x, run.rest, run.h, tau, tau)


EFFECT = Effect(
    name="creep",
    stage="actuator",
    meaning="a slow further deformation under constant load, over tens of seconds to minutes",
    reveals="holds of a hundred seconds and recoveries as long",
    confused_with=("sensor_relaxation", "sensor_lag", "sensor_drift", "gain_drift", "softening"),
    needs=lambda e: None if e.hold > 8 else "no hold is long beside the rig's response: hold a level longer",
    forms=[
        Form("pole", "response", (_SHARE, _tau(0.1, 0.5)), _pole),
        Form("logarithmic", "response", (_SHARE, _tau(0.2, 1.0)), _logarithmic),
        Form("two_poles", "response", (
            Parameter("quick", lower=0.0, upper=3.0, starts=(0.05, 0.05), zero=0.0),
            Parameter("slow", lower=0.0, upper=3.0, starts=(0.05, 0.05), zero=0.0), _tau(0.2, 0.5),
        ), _two),
    ],
)
