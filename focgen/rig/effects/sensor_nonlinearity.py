"""A bent calibration curve."""

import numpy as np

from focgen.arrays import Array
from focgen.rig.effects import _curves
from focgen.rig.effects._effect import Effect, Form, Parameter, Run, Values


def _quadratic(x: Array, values: Values, run: Run) -> Array:
    return x * (1.0 + values[0] * x)


def _exponential(x: Array, values: Values, run: Run) -> Array:
    y = np.clip(values[0] * x, -30.0, 30.0)
    made: Array = x * np.where(np.abs(y) < 1e-6, 1.0 + y / 2, np.expm1(y) / np.where(y == 0, 1.0, y))
    return made


def _cubic(x: Array, values: Values, run: Run) -> Array:
    first, second = values
    return x * (1.0 + first * x + second * x * x)


def _folded(x: Array, values: Values, run: Run) -> Array:
    """Turned over below ``centre``, and zero at rest: a bridge that crosses its balance, read without its
    sign."""
    share, centre = values
    made: Array = x + 2.0 * share * (np.maximum(centre - x, 0.0) - max(centre, 0.0))
    return made


def _bend(name: str, level: int, *starts: float) -> Parameter:
    return Parameter(name, level=level, lower=-2.0, upper=2.0, starts=starts, zero=0.0)


EFFECT = Effect(
    name="sensor_nonlinearity",
    stage="sensor",
    meaning="the static calibration curve is bent",
    reveals="six or more levels with the curvature logged beside the reading",
    confused_with=("gain_nonlinearity", "contact", "sensor_saturation"),
    needs=lambda e: None if e.levels >= 3 else "needs three or more levels",
    bends=True,
    static=True,
    forms=[
        Form("quadratic", "strain", (_bend("bend", -1, 0.1),), _quadratic),
        Form("exponential", "strain", (_bend("bend", -1, 0.1, -0.3),), _exponential),
        Form("cubic", "strain", (_bend("bend", -1, 0.1), _bend("twist", -2, 0.05)), _cubic),
        _curves.quartic("strain"),
        _curves.spline("strain"),
        Form(
            "folded",
            "strain",
            (
                Parameter("share", lower=0.0, upper=1.0, starts=(0.5, 0.7, 0.7), zero=0.0),
                Parameter("centre", level=1, lower=-0.5, upper=1.0, starts=(0.0, 0.3, 0.6)),
            ),
            _folded,
        ),
    ],
)
