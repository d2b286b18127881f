"""A static gain that departs smoothly from the line K(p): stiffening, ballooning."""

from dataclasses import replace

import numpy as np

from focgen.arrays import Array
from focgen.rig.dynamics import Bend, Dynamics, Lever, Power, Spring
from focgen.rig.effects import _curves
from focgen.rig.effects._effect import LARGEST, Effect, Form, Parameter, Run, Values
from focgen.rig.effects._sizes import BOW


def _cubic(x: Array, values: Values, run: Run) -> Array:
    size, scale = values
    return x * (1.0 + size * (x / scale) ** 2)


def _gent(x: Array, values: Values, run: Run) -> Array:
    made: Array = x / (1.0 + np.maximum(values[0] * np.abs(x), -0.95) * np.abs(values[0] * x))
    return made


def _stiffening(x: Dynamics, values: Values, run: None) -> Dynamics:
    size, scale = values
    return replace(x, bend=Bend(0.0, size, scale))


def _bent_spring(x: Dynamics, values: Values, run: None) -> Dynamics:
    return replace(x, bend=Bend(*values))


def _yielding(x: Dynamics, values: Values, run: None) -> Dynamics:
    """Bouc and Wen's spring without its memory: it lets go along the way on which it was wound."""
    share, yielding, power, scale = values
    return replace(x, spring=Spring(share, yielding / scale, -yielding / scale, power, scale))


def _power(x: Dynamics, values: Values, run: None) -> Dynamics:
    return replace(x, loss=Power(*values))


def _force_factor(x: Dynamics, values: Values, run: None) -> Dynamics:
    return replace(x, lever=Lever(*values))


_FIRST = Parameter("first", lower=-0.45, upper=20.0, starts=(0.2, -0.1, 1.0), zero=0.0)
_SECOND = Parameter("second", lower=-0.3, upper=50.0, starts=(0.0, 0.0, 1.0), zero=0.0)
# a share of the stiffness, and what of it a spring wound to the largest displacement has lost
_SHARE = Parameter("share", lower=0.0, upper=1.0, starts=(0.5, 0.8), zero=0.0)
_YIELDING = Parameter("yielding", lower=-3.0, upper=30.0, starts=(0.5, 2.0))
_POWER = Parameter("power", lower=0.5, upper=4.0, starts=(1.0, 1.0))
# of what flows out, or pulls back; through an orifice it goes with the root
_LOST = Parameter("share", lower=0.0, upper=1.0, starts=(0.3, 0.8), zero=0.0)
_POWER_OF = Parameter("power", lower=0.25, upper=4.0, starts=(0.5, 0.5))

_SKEW = Parameter("first", lower=-0.9, upper=2.0, starts=(0.1, -0.1, 0.0), zero=0.0)
_FALL = Parameter("second", lower=-0.9, upper=2.0, starts=(0.0, 0.0, -0.2), zero=0.0)

EFFECT = Effect(
    name="gain_nonlinearity",
    stage="actuator",
    meaning="the static gain departs smoothly from the line K(p): stiffening, ballooning, "
    "whether on the way to the spring, in it, or in what drives it",
    reveals="six or more levels, up and down, in mixed order: the residual depends on level only",
    confused_with=("dead_zone", "contact", "softening", "sensor_nonlinearity", "supply_saturation"),
    needs=lambda e: None if e.levels >= 4 else "needs four or more levels",
    also=("regulator",),
    bends=True,
    static=True,
    sizes=(BOW,),
    forms=[
        Form(
            "cubic",
            "drive",
            (Parameter("size", lower=-0.9, upper=5.0, starts=(0.1, -0.1), zero=0.0), LARGEST),
            _cubic,
        ),
        Form(
            "exponential",
            "drive",
            (Parameter("bend", level=-1, lower=-5.0, upper=5.0, starts=(0.2, -0.2), zero=0.0),),
            _curves.exponential,
        ),
        Form(
            "locking",
            "drive",
            (Parameter("bend", level=-1, lower=-0.97, upper=3.0, starts=(0.3, -0.3), zero=0.0),),
            _gent,
        ),
        _curves.limited("drive"),
        # of the actuator's own spring, which is the quicker where it is the stiffer
        Form(
            "stiffening",
            "dynamics",
            (Parameter("size", lower=-0.3, upper=50.0, starts=(0.2, -0.1, 1.0), zero=0.0), LARGEST),
            _stiffening,
        ),
        Form("bent_spring", "dynamics", (_FIRST, _SECOND, LARGEST), _bent_spring),
        Form("yielding", "dynamics", (_SHARE, _YIELDING, _POWER, LARGEST), _yielding),
        # of a lag: the less there is, the slower it moves on
        Form("power", "dynamics", (_LOST, _POWER_OF, LARGEST), _power),
        # of what drives it, where it is: coils, tendons' arms, muscles
        Form("force_factor", "dynamics", (_SKEW, _FALL, LARGEST), _force_factor),
        _curves.quartic("drive"),
        _curves.spline("drive"),
        *_curves.behind("place"),
    ],
)
