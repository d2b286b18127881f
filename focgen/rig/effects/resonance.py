"""A lightly damped mode of the actuator: it rings after fast changes."""

from dataclasses import replace
from typing import Any

import numpy as np

from focgen.arrays import Array, Complex
from focgen.fractional.transfer import Polynomial
from focgen.rig.dynamics import Dynamics
from focgen.rig.effects._effect import PERIOD, Effect, Form, Parameter, Run, Values
from focgen.rig.effects._sizes import FREQUENCY, own
from focgen.rig.linear import oscillator


def _series(x: Array, values: Values, run: Run) -> Array:
    period, damping = values
    return oscillator(x, run.rest, run.h, period, damping)


def _beside(x: Array, values: Values, run: Run) -> Array:
    share, quarter, period, damping = values
    place = oscillator(x, run.rest, run.h, period, damping)
    speed = oscillator(x, run.rest, run.h, period, damping, speed=True)
    return x + share * (place - x) + quarter * speed


def _mass(x: Dynamics, values: Values, run: None) -> Dynamics:
    return replace(x, mass=x.mass + (values[0] / (2.0 * np.pi)) ** 2)


def _rings(values: Values, den: Polynomial) -> bool:
    """Whether a mass swings on its spring: where it hardly overshoots it creeps back, and is one lag more.
    Beside a springpot no lag does what it does, unless that is next to a dashpot."""
    if any(abs(t.order - round(t.order)) > _DASHPOT for t in den):
        return True
    others = [t for t in den[:-1] if t.order != 2.0]
    own = sum(t.coefficient for t in den if t.order == 2.0)
    s = 1j / np.sqrt((values[0] / (2.0 * np.pi)) ** 2 + own / den[-1].coefficient)
    damped = sum(t.coefficient * s**t.order for t in others) / den[-1].coefficient
    return bool(abs(np.imag(damped)) < 2.0 * _SWINGS)


def _is_light(values: Values, den: Polynomial) -> bool:
    """Whether a mode is as lightly damped as its family says: where it stops at the most that it may be, it
    only follows what is quick, and stands for something else."""
    return bool(values[-1] < _STOPS * _DAMPING.upper)


def _mode_response(period: float, damping: float, s: Complex) -> Complex:
    w: Any = 2.0 * np.pi / period
    made: Complex = w * w / (s * s + 2.0 * damping * w * s + w * w)
    return made


def _beside_response(values: Values, s: Complex) -> Complex:
    share, quarter, period, damping = values
    mode = _mode_response(period, damping, s)
    return 1.0 + share * (mode - 1.0) + quarter * s * period / (2.0 * np.pi) * mode


_STARTS = tuple(0.02 * 1.16**k for k in range(41))  # a sharp mode is found from close by only
_PERIOD = Parameter(PERIOD, time=1, lower=0.002, upper=30.0, starts=_STARTS, log=True)
_SWINGS = 0.8  # damping from which on a step overshoots by less than 1.5 %
_DAMPING = Parameter("damping", lower=0.005, upper=0.3, starts=(0.1,), log=True)
_STOPS = 0.98  # of that
_DASHPOT = 0.1  # of its order from 1: there a lag comes within 6e-3 of a mass that creeps

EFFECT = Effect(
    name="resonance",
    stage="actuator",
    meaning="a lightly damped mode",
    reveals="fast steps, sines up to the mode: ringing of one frequency",
    confused_with=("sensor_lag", "transport_delay"),
    needs=lambda e: None if e.fastest < 1.0 else "no change of the input is fast beside the rig's response",
    sizes=(FREQUENCY, own("damping")),
    forms=[
        Form(
            "series",
            "response",
            (_PERIOD, _DAMPING),
            _series,
            response=lambda values, s: _mode_response(values[0], values[1], s),
            itself=_is_light,
        ),
        # driven by the pressure, not by the slower motion beside it: larger, and with a phase of its own
        Form(
            "beside",
            "response",
            (
                Parameter("share", lower=-30.0, upper=30.0, starts=(0.1,), zero=0.0),
                Parameter("quarter", lower=-30.0, upper=30.0, starts=(0.0,), zero=0.0),
                _PERIOD,
                _DAMPING,
            ),
            _beside,
            response=_beside_response,
            itself=_is_light,
        ),
        # the actuator's own spring swings a mass, against the damping that it has
        Form(
            "mass",
            "dynamics",
            (Parameter(PERIOD, time=1, lower=0.002, upper=30.0, starts=(1.0, 3.0, 6.0), log=True),),
            _mass,
            itself=_rings,
        ),
    ],
)
