"""Smooth static curves of any shape, shared by the families that bend."""

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline

from focgen.arrays import Array
from focgen.rig import kernels
from focgen.rig.effects._effect import LARGEST, Act, Form, Parameter, Run, Values

_BEYOND = 1.2  # of the largest level seen: the bend grows no further there
_KNOTS = np.linspace(0.0, 1.0, 6)  # of the largest level seen


def softly_beyond(x: Array, place: float, width: float) -> Array:
    """What of ``x`` (n,) is beyond ``place`` > 0, 0 at 0, with the knee rounded over ``width``."""
    made: Array = width * (np.logaddexp(0.0, (x - place) / width) - np.logaddexp(0.0, -place / width))
    return made


def _limited(x: Array, values: Values, run: Run) -> Array:
    share, place, width = values
    return x - share * softly_beyond(x, place, width)


def limited(slot: str) -> Form:
    """What runs out of length, as folds and fibres do: beyond a load it gives way less, or no more."""
    share = Parameter("share", lower=0.0, upper=1.0, starts=(0.5, 0.9, 0.9), zero=0.0)
    load = Parameter("load", level=1, lower=0.2, upper=1.5, starts=(0.6, 0.8, 0.5))
    width = Parameter("width", level=1, lower=0.05, upper=0.5, starts=(0.1, 0.1, 0.2), log=True)
    return Form("limited", slot, (share, load, width), _limited)


def _quartic(x: Array, values: Values, run: Run) -> Array:
    *sizes, scale = values
    place = np.minimum(np.abs(x) / scale, _BEYOND)
    return x * (1.0 + sum(size * place ** (i + 1) for i, size in enumerate(sizes)))


def quartic(slot: str) -> Form:
    """x (1 + a q + b q² + c q³), q = |x| over the largest level."""
    sizes = (
        Parameter(n, lower=-2.0, upper=2.0, starts=(0.02,), zero=0.0) for n in ("first", "second", "third")
    )
    return Form("quartic", slot, (*sizes, LARGEST), _quartic)


@lru_cache
def _cardinal() -> CubicSpline:
    """The natural splines that are 1 at one knot beyond zero and 0 at the others."""
    return CubicSpline(_KNOTS, np.eye(len(_KNOTS))[:, 1:], bc_type="natural")


def _bend(place: Array, sizes: Sequence[float]) -> Array:
    """The spline through ``sizes`` at the knots beyond zero; level beyond the last."""
    # a plant that a fit has driven apart gives NaN, which stays NaN: such a trial is worse than any
    return kernels.spline(place, np.tensordot(_cardinal().c, np.asarray(sizes), axes=1))


def _level(x: Array, run: Run) -> Array:
    return np.abs(x)


@lru_cache
def _along(place: Callable[[Array, Run], Array]) -> Act:
    """x (1 + S(q)): one function for every family that bends along the same place."""

    def act(x: Array, values: Values, run: Run) -> Array:
        *sizes, scale = values
        made: Array = x * (1.0 + _bend(place(x, run) / scale, sizes))
        return made

    return act


def spline(
    slot: str,
    place: Callable[[Array, Run], Array] = _level,
    leaves: Callable[[Array, Values, Run], dict[str, float]] | None = None,
) -> Form:
    """x (1 + S(q)), S a natural cubic spline from zero, q = ``place(x, run)`` over the largest level."""
    sizes = (
        Parameter(n, lower=-2.0, upper=4.0, starts=(0.02,), zero=0.0)
        for n in ("at_20", "at_40", "at_60", "at_80", "at_100")
    )
    return Form("spline", slot, (*sizes, LARGEST), _along(place), leaves=leaves)


def _quadratic(x: Array, values: Values, run: Run) -> Array:
    return x * (1.0 + values[0] * x)


def exponential(x: Array, values: Values, run: Run) -> Array:
    """(exp(b x) − 1)/b."""
    y = np.clip(values[0] * x, -30.0, 30.0)
    made: Array = x * np.where(np.abs(y) < 1e-6, 1.0 + y / 2, np.expm1(y) / np.where(y == 0, 1.0, y))
    return made


def _cubic(x: Array, values: Values, run: Run) -> Array:
    first, second = values
    return x * (1.0 + first * x + second * x * x)


def _bent(name: str, level: int, *starts: float) -> Parameter:
    return Parameter(name, level=level, lower=-2.0, upper=2.0, starts=starts, zero=0.0)


def calibration(slot: str) -> list[Form]:
    """The curves of a reading at ``slot``, behind all dynamics."""
    return [
        Form("quadratic", slot, (_bent("bend", -1, 0.1),), _quadratic),
        Form("exponential", slot, (_bent("bend", -1, 0.1, -0.3),), exponential),
        Form("cubic", slot, (_bent("bend", -1, 0.1), _bent("twist", -2, 0.05)), _cubic),
        quartic(slot),
        spline(slot),
    ]


def behind(slot: str) -> list[Form]:
    """The same of what moves: of a linkage, of a finger that points elsewhere the further it bends. A reading
    is bent more often."""
    return [form.behind for form in calibration(slot)]
