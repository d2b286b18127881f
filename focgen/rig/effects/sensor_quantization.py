"""A reading in coarse steps."""

import numpy as np

from focgen.arrays import Array
from focgen.rig.effects._effect import STEP, Effect, Form, Parameter, Run, Values

_COARSE = 0.006  # of the range: finer steps are the resolution of any converter
_COVERED = 0.6  # of the samples lie on a few levels
_COVERED_BY_TWO = 0.999  # the same of two levels, which may be rests of a finer reading


def _round(x: Array, values: Values, run: Run) -> Array:
    step, phase = values
    return step * np.round((x - phase) / step) + phase if step > 0 else x


def _seen(y: Array) -> Values | None:
    """Step and phase where most samples lie on a few evenly spaced levels."""
    span = float(np.ptp(y))
    values, counts = np.unique(np.round((y - y.min()) / max(span, 1e-300) * 20_000), return_counts=True)
    common = values[counts > 0.002 * len(y)] / 20_000 * span + y.min()
    covered = counts[counts > 0.002 * len(y)].sum() / len(y)
    if len(common) < 2 or covered < (_COVERED_BY_TWO if len(common) == 2 else _COVERED):
        return None
    gaps = np.diff(common)
    gaps = gaps[gaps > 0.25 * np.median(gaps)]
    step = float(np.median(gaps[gaps < 1.5 * gaps.min()]))
    if step < _COARSE * span or np.mean(np.abs(gaps / step - np.round(gaps / step)) < 0.1) < 0.9:
        return None
    turns = np.angle(np.mean(np.exp(2j * np.pi * common / step))) / (2 * np.pi)
    return step, float(turns * step)


EFFECT = Effect(
    name="sensor_quantization",
    stage="sensor",
    meaning="coarse steps",
    reveals="slow ramps: the reading moves in steps of one size",
    confused_with=("valve_stiction",),
    needs=lambda e: None,
    forms=[
        Form(
            "rounding",
            "reading",
            (
                Parameter(
                    STEP, level=1, lower=0.0, upper=0.9, starts=tuple(np.geomspace(0.008, 0.3, 6)), zero=0.0
                ),
                Parameter("phase", level=1, lower=-0.5, upper=0.5, starts=(0.0,)),
            ),
            _round,
            seen=_seen,
        )
    ],
)
