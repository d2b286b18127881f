"""A leak behind the regulator: the chamber stays below the regulated pressure, the more the higher it is."""

import numpy as np
from scipy.signal import lfilter

from focgen.arrays import Array
from focgen.rig.effects._effect import LARGEST, Effect, Form, Parameter, Run, Values
from focgen.rig.effects._sizes import LOST


def _laminar(x: Array, values: Values, run: Run) -> Array:
    return x * (1.0 - values[0])


def _turbulent(x: Array, values: Values, run: Run) -> Array:
    return x - np.sign(x) * values[0] * (np.sqrt(np.abs(x) + values[0] ** 2 / 4) - values[0] / 2)


def _growing(x: Array, values: Values, run: Run) -> Array:
    """A loss that grows with the square of what would be there without it, which may go beyond the ``scale``,
    the largest that was measured. Beyond the crest of that nothing more comes through."""
    share, scale = values
    size = np.minimum(np.abs(x) / scale, 0.5 / max(share, 1e-12))
    return np.sign(x) * scale * size * (1.0 - share * size)


def _running_out(x: Array, values: Values, run: Run) -> Array:
    """What a pump has put in runs out at a rate that goes with what there is: x less what is lost so far."""
    kept, made = np.exp(-values[0] * run.h), np.empty(len(x))
    for a, b, stood in run.stood_by_span:
        put_in = np.sqrt(kept) * np.diff(x[a:b], prepend=x[a])  # which comes evenly from sample to sample
        put_in[0] = x[a] + stood
        made[a:b] = lfilter([1.0], [1.0, -kept], put_in) - stood
    return made


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
    sizes=(LOST,),
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
        Form(
            "running_out",
            "supply",
            (
                Parameter(
                    "rate", time=-1, lower=0.0, upper=100.0, starts=(0.1, 1.0), clock="record", zero=0.0
                ),
            ),
            _running_out,
            adds_up=True,
        ),
    ],
)
