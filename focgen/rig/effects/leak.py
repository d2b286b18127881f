"""A leak behind the regulator: the chamber stays below the regulated pressure, the more the higher it is."""

import numpy as np

from focgen.arrays import Array
from focgen.rig.effects._effect import LARGEST, Effect, Form, Parameter, Run, Values


def _laminar(x: Array, values: Values, run: Run) -> Array:
    return x * (1.0 - values[0])


def _turbulent(x: Array, values: Values, run: Run) -> Array:
    return x - np.sign(x) * values[0] * (np.sqrt(np.abs(x) + values[0] ** 2 / 4) - values[0] / 2)


def _growing(x: Array, values: Values, run: Run) -> Array:
    share, scale = values
    return x * (1.0 - share * np.minimum(np.abs(x) / scale, 1.0))


EFFECT = Effect(
    name="leak",
    stage="regulator",
    meaning="chamber pressure stays below the regulated one by an amount that grows with it",
    reveals="holds at several levels, with the pressure logged",
    confused_with=(
        "supply_saturation",
        "gain_nonlinearity",
        "gain_drift",
        "slow_regulator",
        "valve_asymmetry",
    ),
    needs=lambda e: None if e.levels >= 3 else "needs three or more levels",
    forms=[
        Form(
            "laminar",
            "supply",
            (Parameter("share", lower=0.0, upper=0.8, starts=(0.05,), zero=0.0),),
            _laminar,
        ),
        Form(
            "turbulent",
            "supply",
            (Parameter("loss", level=0.5, lower=0.0, upper=0.8, starts=(0.05,), zero=0.0),),
            _turbulent,
        ),
        Form(
            "growing",
            "supply",
            (
                Parameter("share", lower=0.0, upper=0.8, starts=(0.05,), zero=0.0),
                LARGEST,
            ),
            _growing,
        ),
    ],
)
