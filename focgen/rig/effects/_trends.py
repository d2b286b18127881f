"""Slow functions of the session's time, shared by the families that drift."""

import numpy as np
from scipy.interpolate import CubicSpline

from focgen.rig.effects._effect import Form, Parameter


def _linear(x, values, run):
    return values[0] * run.clock


def _settling(x, values, run):
    size, tau = values
    return -size * np.expm1(-run.clock / tau)


def _bending(x, values, run):
    first, second = values
    t = run.clock
    return t * (first + second * t)


def _wandering(x, values, run):
    *sizes, spacing = values
    knots = spacing * np.arange(len(sizes) + 1)
    return CubicSpline(knots, [0.0, *sizes], bc_type="natural")(np.minimum(run.clock, knots[-1]))


def forms(slot, level, onto):
    """The forms of a trend; ``onto(x, trend)`` applies it, ``level`` is the power of the level in its
    unit."""

    def act(trend):
        return lambda x, values, run: onto(x, trend(x, values, run))

    size = dict(level=level, lower=-2.0, upper=2.0, zero=0.0, clock="session")
    return [
        Form("linear", slot, (Parameter("rate", time=-1, starts=(0.1,), **size),), act(_linear)),
        Form(
            "settling",
            slot,
            (
                Parameter("size", starts=(0.1, 0.1), **size),
                Parameter(
                    "time", time=1, clock="session", lower=0.08, upper=5.0, starts=(0.1, 0.5), log=True
                ),
            ),
            act(_settling),
        ),
        Form(
            "bending",
            slot,
            (
                Parameter("rate", time=-1, starts=(0.1,), **size),
                Parameter("acceleration", time=-2, starts=(0.05,), **size),
            ),
            act(_bending),
        ),
        Form(
            "wandering",
            slot,
            (  # a spline through values at equal times; the last, within the session, is kept
                *(Parameter(name, starts=(0.01,), **size) for name in ("first", "second", "third", "fourth")),
                Parameter(
                    "spacing", time=1, clock="session", lower=0.2, upper=0.25, starts=(0.24,), log=True
                ),
            ),
            act(_wandering),
        ),
    ]
