"""A lightly damped mode of the actuator: it rings after fast changes."""

import numpy as np

from focgen.rig.effects._effect import Effect, Form, Parameter
from focgen.rig.linear import oscillator


def _mode(x, period, damping, run):
    return oscillator(x, run.rest, run.h, period, damping)


def _series(x, values, run):
    return _mode(x, *values, run)


def _parallel(x, values, run):
    share, period, damping = values
    return x + share * (_mode(x, period, damping, run) - x)


def _mode_response(period, damping, s):
    w = 2.0 * np.pi / period
    return w * w / (s * s + 2.0 * damping * w * s + w * w)


def _parallel_response(values, s):
    share, period, damping = values
    return 1.0 + share * (_mode_response(period, damping, s) - 1.0)


_PERIOD = Parameter("period", time=1, lower=0.002, upper=30.0, starts=(0.1, 0.5, 2.0), log=True)
_DAMPING = Parameter("damping", lower=0.005, upper=0.5, starts=(0.2, 0.2, 0.2), log=True)

EFFECT = Effect(
    name="resonance",
    stage="actuator",
    meaning="a lightly damped mode",
    reveals="fast steps, sines up to the mode: ringing of one frequency",
    confused_with=("sensor_lag", "transport_delay"),
    needs=lambda e: None if e.fastest < 1.0 else "no change of the input is fast beside the rig's response",
    forms=[
        Form(
            "series",
            "response",
            (_PERIOD, _DAMPING),
            _series,
            response=lambda values, s: _mode_response(*values, s),
        ),
        Form(
            "parallel",
            "response",
            (
                Parameter("share", lower=-1.0, upper=1.0, starts=(0.1, 0.1, 0.1), zero=0.0),
                _PERIOD,
                _DAMPING,
            ),
            _parallel,
            response=_parallel_response,
        ),
    ],
)
