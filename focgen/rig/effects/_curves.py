"""Smooth static curves of any shape, shared by the families that bend."""

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline

from focgen.arrays import Array
from focgen.rig.effects._effect import LARGEST, Form, Parameter, Run, Values

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
    c = np.tensordot(_cardinal().c, np.asarray(sizes), axes=1)
    place = np.minimum(place, _KNOTS[-1])
    # a plant that a fit has driven apart gives NaN, which stays NaN: such a trial is worse than any
    knot = np.nan_to_num(place * (len(_KNOTS) - 1))
    piece = np.clip(knot.astype(int), 0, len(_KNOTS) - 2)
    q = place - _KNOTS[piece]
    a, b, slope, start = (row[piece] for row in c)
    made: Array = ((a * q + b) * q + slope) * q + start
    return made


def spline(
    slot: str,
    place: Callable[[Array, Run], Array] = lambda x, run: np.abs(x),
    leaves: Callable[[Array, Values, Run], dict[str, float]] | None = None,
) -> Form:
    """x (1 + S(q)), S a natural cubic spline from zero, q = ``place(x, run)`` over the largest level."""

    def act(x: Array, values: Values, run: Run) -> Array:
        *sizes, scale = values
        return x * (1.0 + _bend(place(x, run) / scale, sizes))

    sizes = (
        Parameter(n, lower=-2.0, upper=4.0, starts=(0.02,), zero=0.0)
        for n in ("at_20", "at_40", "at_60", "at_80", "at_100")
    )
    return Form("spline", slot, (*sizes, LARGEST), act, leaves=leaves)
