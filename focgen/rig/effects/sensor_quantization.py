"""A reading in coarse steps."""

import numpy as np

from focgen.arrays import Array
from focgen.rig.effects._effect import STEP, Effect, Form, Parameter, Run, Values

_COARSE = 0.006  # of the range: finer steps are the resolution of any converter
_COVERED = 0.6  # of the samples lie on a few levels
_COVERED_BY_TWO = 0.999  # the same of two levels, which may be rests of a finer reading
# of the noise of a reading whose levels are blurred
_OF_NOISE = 0.954  # what half of all steps between neighbours are below, where both are noise
_BIN = 1.5  # a bin of the histogram
_APART = 9.0  # two levels, at least: readings of one then hardly reach half way to the next
_WIDE = 4.5  # a level, either way
_FEW, _SELDOM = 4, 5e-4  # samples, of all, in a bin that is no passage
_LEVELS = 3  # at least: two may be the rests of a rig
_PASSES = 2  # samples between two levels, for each change of level: what resampling leaves there
_EVEN = 0.08  # of a step: what levels may lie off


def _round(x: Array, values: Values, run: Run) -> Array:
    step, phase = values
    return step * np.round((x - phase) / step) + phase if step > 0 else x


def _seen(y: Array) -> Values | None:
    """Step and phase where most samples lie on a few evenly spaced levels, or about them: what is noisy
    behind the converter, as a wire is, blurs its levels."""
    return _exactly(y) or _blurred(y)


def _blurred(y: Array) -> Values | None:
    """The same of levels that noise has widened, wide apart against that, between which the reading jumps."""
    noise = float(np.median(np.abs(np.diff(y)))) / _OF_NOISE
    span = float(np.ptp(y))
    if not 0.0 < _APART * noise < span:
        return None
    count = int(span / (_BIN * noise)) + 1
    where = np.minimum((y - y.min()) / (_BIN * noise), count - 1).astype(int)
    full = np.bincount(where, minlength=count) >= max(_FEW, _SELDOM * len(y))
    clump = np.cumsum(np.diff(np.r_[0, full.astype(int)]) == 1)[where] - 1
    held = full[where]
    centres = np.array([np.mean(y[held & (clump == i)]) for i in range(clump.max() + 1)])
    jumps = np.count_nonzero(np.diff(clump[held]))
    if len(centres) < _LEVELS or np.count_nonzero(~held) > _PASSES * jumps:
        return None
    gaps = np.diff(centres)
    about = np.abs(y[held] - centres[clump[held]]) < _WIDE * noise
    if np.min(gaps) < _APART * noise or np.mean(about) < _COVERED_BY_TWO:
        return None
    step = float(np.median(gaps[gaps < 1.5 * np.min(gaps)]))
    # counted one by one: a step is not known well enough to count many levels by their distance
    number = np.r_[0.0, np.cumsum(np.round(gaps / step))]
    step, phase = np.polyfit(number, centres, 1)
    if np.max(np.abs(centres - step * number - phase)) > _EVEN * step:
        return None
    return float(step), float((phase / step - np.round(phase / step)) * step)


def _exactly(y: Array) -> Values | None:
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
    number = np.round((common - common[0]) / step)
    step, first = np.polyfit(number, common, 1)
    return float(step), float((first / step - np.round(first / step)) * step)


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
                    STEP, level=1, lower=0.0, upper=2.0, starts=tuple(np.geomspace(0.008, 0.3, 6)), zero=0.0
                ),
                Parameter("phase", level=1, lower=-0.5, upper=0.5, starts=(0.0,)),
            ),
            _round,
            seen=_seen,
        )
    ],
)
