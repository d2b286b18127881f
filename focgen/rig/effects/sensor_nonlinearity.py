"""A bent calibration curve."""

import numpy as np

from focgen.arrays import Array
from focgen.fractional.transfer import Polynomial
from focgen.rig.effects import _curves
from focgen.rig.effects._effect import Effect, Form, Parameter, Run, Values
from focgen.rig.effects._sizes import BOW


def _folded(x: Array, values: Values, run: Run) -> Array:
    """Turned over below ``centre``, and zero at rest: a bridge that crosses its balance, read without its
    sign."""
    share, centre = values
    made: Array = x + 2.0 * share * (np.maximum(centre - x, 0.0) - max(centre, 0.0))
    return made


def _turns(values: Values, den: Polynomial) -> bool:
    """Whether the reading goes back below the fold: one that is but flat there is no fold, and a dead zone
    ahead of the dynamics makes as flat a one."""
    return values[0] > 0.5


EFFECT = Effect(
    name="sensor_nonlinearity",
    stage="sensor",
    meaning="the static calibration curve is bent",
    reveals="six or more levels with the curvature logged beside the reading",
    confused_with=("gain_nonlinearity", "contact", "sensor_saturation"),
    needs=lambda e: None if e.levels >= 3 else "needs three or more levels",
    bends=True,
    static=True,
    sizes=(BOW,),
    forms=[
        *_curves.calibration("strain"),
        Form(
            "folded",
            "strain",
            (
                Parameter("share", lower=0.0, upper=1.0, starts=(0.5, 0.7, 0.7), zero=0.0),
                Parameter("centre", level=1, lower=-0.5, upper=1.0, starts=(0.0, 0.3, 0.6)),
            ),
            _folded,
            itself=_turns,
        ),
    ],
)
