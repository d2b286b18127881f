"""Slow functions of the session's time, shared by the families that drift.

A trend of one sense goes on after the session. A wander is followed through the session, and nobody can
foretell its next turn: what remains of it later is its mean.
"""

import numpy as np
from scipy.interpolate import CubicSpline

from focgen.rig.effects._effect import Form, Parameter

_SESSION = Parameter("session", time=1, clock="session", lower=1.0, upper=1.0 + 1e-9, starts=(1.0,))


def _linear(x, values, run):
    return values[0] * run.clock


def _settling(x, values, run):
    size, tau = values
    return -size * np.expm1(-run.clock / tau)


def _bending(x, values, run):
    """From 0 to ``size`` at the session's end, never back; then straight on."""
    size, straight, session = values
    q = run.clock / session
    inside = np.minimum(q, 1.0)
    return size * (inside * (straight + (1.0 - straight) * inside) + (2.0 - straight) * (q - inside))


def _wandering(x, values, run):
    *sizes, session = values
    knots = session / len(sizes) * np.arange(len(sizes) + 1)
    path = CubicSpline(knots, [0.0, *sizes], bc_type="natural")
    return np.where(run.clock <= knots[-1], path(run.clock), path.integrate(0.0, knots[-1]) / knots[-1])


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
                Parameter("size", starts=(0.1, 0.1), **size),
                Parameter("straightness", lower=0.0, upper=2.0, starts=(0.5, 1.5)),
                _SESSION,
            ),
            act(_bending),
        ),
        Form(
            "wandering",
            slot,
            (  # a natural spline through values at the quarters of the session
                *(Parameter(name, starts=(0.01,), **size) for name in ("first", "second", "third", "fourth")),
                _SESSION,
            ),
            act(_wandering),
            wanders=True,
        ),
    ]
