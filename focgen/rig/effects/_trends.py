"""Slow functions of the session's time, shared by the families that drift.

A trend of one sense goes on after the session. A wander is followed through the session, and nobody can
predict its next turn: what remains of it later is its mean.
"""

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.interpolate import CubicSpline

from focgen.arrays import Array
from focgen.rig.effects._effect import Act, Form, Parameter, Run, Values

_SESSION = Parameter("session", time=1, clock="session", lower=1.0, upper=1.0 + 1e-9, starts=(1.0,))


def _linear(x: Array, values: Values, run: Run) -> Array:
    return values[0] * run.clock


def _settling(x: Array, values: Values, run: Run) -> Array:
    size, tau = values
    made: Array = -size * np.expm1(-run.clock / tau)
    return made


def _bending(x: Array, values: Values, run: Run) -> Array:
    """From 0 to ``size`` at the session's end, never back; then straight on."""
    size, straight, session = values
    q = run.clock / session
    inside = np.minimum(q, 1.0)
    made: Array = size * (inside * (straight + (1.0 - straight) * inside) + (2.0 - straight) * (q - inside))
    return made


def _wandering(x: Array, values: Values, run: Run) -> Array:
    *sizes, session = values
    knots = session / len(sizes) * np.arange(len(sizes) + 1)
    path = CubicSpline(knots, [0.0, *sizes], bc_type="natural")
    made: Array = np.where(
        run.clock <= knots[-1], path(run.clock), path.integrate(0.0, knots[-1]) / knots[-1]
    )
    return made


def forms(slot: str, level: int, onto: Callable[[Array, Array], Array]) -> list[Form]:
    """The forms of a trend; ``onto(x, trend)`` applies it, ``level`` is the power of the level in its
    unit."""

    def act(trend: Act) -> Act:
        return lambda x, values, run: onto(x, trend(x, values, run))

    size = partial(Parameter, level=level, lower=-2.0, upper=2.0, zero=0.0, clock="session")
    return [
        Form("linear", slot, (size("rate", time=-1, starts=(0.1,)),), act(_linear)),
        Form(
            "settling",
            slot,
            (
                size("size", starts=(0.1, 0.1)),
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
                size("size", starts=(0.1, 0.1)),
                Parameter("straightness", lower=0.0, upper=2.0, starts=(0.5, 1.5)),
                _SESSION,
            ),
            act(_bending),
        ),
        Form(
            "wandering",
            slot,
            (  # a natural spline through values at the quarters of the session
                *(size(name, starts=(0.01,)) for name in ("first", "second", "third", "fourth")),
                _SESSION,
            ),
            act(_wandering),
            wanders=True,
        ),
    ]
