"""A gain that grows with the largest load seen, or with the work done (Mullins)."""

import numpy as np

from focgen.arrays import Array
from focgen.rig.effects import _curves
from focgen.rig.effects._effect import LARGEST, Act, Effect, Form, Leaves, Parameter, Run, Values
from focgen.rig.effects._sizes import GAIN_AFTER_SESSION

_GROWTH = Parameter("growth", lower=0.0, upper=3.0, starts=(0.1, 0.1), zero=0.0)


def _scale(*starts: float) -> Parameter:
    return Parameter("scale", level=1, lower=0.05, upper=20.0, starts=starts, log=True)


def _peak(x: Array, run: Run) -> Array:
    return np.maximum(np.maximum.accumulate(np.abs(x)), run.carried.get("largest", 0.0))


def _done(x: Array, run: Run) -> Array:
    rises = np.where(run.rest, np.abs(x), np.maximum(np.diff(np.abs(x), prepend=0.0), 0.0))
    return run.carried.get("work", 0.0) + np.cumsum(rises)


def _largest(x: Array, values: Values, run: Run) -> Array:
    growth, scale = values
    return x * (1.0 + growth * _peak(x, run) / scale)


def _saturating(x: Array, values: Values, run: Run) -> Array:
    growth, scale = values
    made: Array = x * (1.0 - growth * np.expm1(-_peak(x, run) / scale))
    return made


def _work(x: Array, values: Values, run: Run) -> Array:
    growth, scale = values
    made: Array = x * (1.0 - growth * np.expm1(-_done(x, run) / scale))
    return made


def _reloading(x: Array, values: Values, run: Run) -> Array:
    growth, scale = values
    made: Array = x * (1.0 - growth * np.expm1((np.abs(x) - _peak(x, run)) / scale))
    return made


def _leaves_peak(x: Array, values: Values, run: Run) -> dict[str, float]:
    return {"largest": float(_peak(x, run)[-1])}


def _leaves_work(x: Array, values: Values, run: Run) -> dict[str, float]:
    return {"work": float(_done(x, run)[-1])}


def _spring(name: str, scale: Parameter, act: Act, leaves: Leaves, wears: str) -> Form:
    return Form(name, "spring", (_GROWTH, scale), act, leaves=leaves, wears=wears)


EFFECT = Effect(
    name="softening",
    stage="actuator",
    meaning="gain grows with the largest load seen or the work done (Mullins)",
    reveals="a level before and after a higher one, steps in mixed order",
    confused_with=("gain_nonlinearity", "gain_drift", "creep"),
    needs=lambda e: None if e.revisits else "no level is reached before and after a higher one",
    sizes=(GAIN_AFTER_SESSION,),
    forms=[
        Form(
            "largest",
            "drive",
            (_GROWTH, LARGEST),
            _largest,
            leaves=_leaves_peak,
        ),
        Form("saturating", "drive", (_GROWTH, _scale(0.3, 1.0)), _saturating, leaves=_leaves_peak),
        Form("reloading", "drive", (_GROWTH, _scale(0.1, 0.5)), _reloading, leaves=_leaves_peak),
        Form("work", "drive", (_GROWTH, _scale(1.0, 5.0)), _work, leaves=_leaves_work),
        # the spring itself gives way, and what it pulls back is the slower
        _spring("worn", _scale(0.3, 1.0), _saturating, _leaves_peak, "largest"),
        # rubber is as stiff as new at strains that it has not seen (Ogden and Roxburgh 1999)
        _spring("pseudo_elastic", _scale(0.1, 0.5), _reloading, _leaves_peak, "retreat"),
        _spring("worn_by_work", _scale(1.0, 5.0), _work, _leaves_work, "work"),
        _curves.spline("drive", _peak, _leaves_peak),
    ],
)
