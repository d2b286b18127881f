"""Rate-independent memory, shared by the families that have it."""

import numpy as np

from focgen.arrays import Array
from focgen.rig import kernels
from focgen.rig.effects._effect import LARGEST, Form, Parameter, Run, Values

_SHARE = Parameter("share", lower=0.0, upper=0.7, starts=(0.2, 0.2), zero=0.0)
_WIDTH = Parameter("width", level=1, lower=2e-3, upper=0.6, starts=(0.05, 0.2), log=True)

# Bouc and Wen's loop takes four widths to come round by 95 %: one that cannot within the range is but a bent
# line, and a different one each way
_CLOSING = Parameter("width", level=1, lower=2e-3, upper=0.25, starts=(0.05, 0.15), log=True)
# the broad one, four times as wide, must still be reversed: wider than that, it is but a bent line
_NARROW = Parameter("width", level=1, lower=2e-3, upper=0.12, starts=(0.04, 0.1), log=True)


def _prandtl_ishlinskii(x: Array, values: Values, run: Run) -> Array:
    share, width = values
    loops = sum(kernels.play(x, run.rest, width * f) for f in (0.5, 1.0, 1.5)) / 3.0
    return x + share * (loops - x)


def _play(x: Array, values: Values, run: Run) -> Array:
    return kernels.play(x, run.rest, values[0])


def _bouc_wen(x: Array, values: Values, run: Run) -> Array:
    size, width = values
    return x - size * kernels.bouc_wen(x, run.rest, width)


def _loaded(x: Array, values: Values, run: Run) -> Array:
    size, growing, width = values
    return x - (size + growing * np.abs(x)) * kernels.bouc_wen(x, run.rest, width)


def _wide(x: Array, values: Values, run: Run) -> Array:
    narrow, broad, width = values
    return (
        x
        + narrow * (kernels.play(x, run.rest, width) - x)
        + broad * (kernels.play(x, run.rest, 4.0 * width) - x)
    )


def _widening(x: Array, values: Values, run: Run) -> Array:
    even, growing, width, scale = values
    square = x * np.abs(x) / scale
    loops = even * (kernels.play(x, run.rest, width) - x)
    return x + loops + growing * (kernels.play(square, run.rest, width) - square)


def _pressed(x: Array, values: Values, run: Run) -> Array:
    return kernels.pressed(x, run.rest, *values)


def behind(slot: str) -> list[Form]:
    """The same behind dynamics, but for a play: of an alloy that is heated first, of a wall that moves last.
    A sensor has them there as well, and more often."""
    return [form.behind for form in forms(slot) if form.act is not _play]


def forms(slot: str) -> list[Form]:
    """The forms of a hysteresis at ``slot``."""
    return [
        Form("prandtl_ishlinskii", slot, (_SHARE, _WIDTH), _prandtl_ishlinskii),
        Form(
            "play",
            slot,
            (Parameter("width", level=1, lower=0.0, upper=0.6, starts=(0.02, 0.1), zero=0.0),),
            _play,
        ),
        Form(
            "bouc_wen",
            slot,
            (
                Parameter("size", level=1, lower=-1.0, upper=1.0, starts=(0.05, 0.05), zero=0.0),
                _CLOSING,
            ),
            _bouc_wen,
        ),
        Form(
            "loaded",  # friction between parts that the level presses together
            slot,
            (
                Parameter("size", level=1, lower=-1.0, upper=1.0, starts=(0.05, 0.05), zero=0.0),
                Parameter("growing", lower=-1.0, upper=1.0, starts=(0.05, 0.05), zero=0.0),
                _CLOSING,
            ),
            _loaded,
        ),
        Form(
            "two_plays",
            slot,
            (
                Parameter("narrow", lower=-0.5, upper=0.9, starts=(0.1, 0.1), zero=0.0),
                Parameter("broad", lower=-0.5, upper=0.9, starts=(0.1, 0.1), zero=0.0),
                _NARROW,
            ),
            _wide,
        ),
        Form(
            "widening",
            slot,
            (
                Parameter("even", lower=0.0, upper=0.7, starts=(0.1, 0.1), zero=0.0),
                Parameter("growing", lower=-0.5, upper=0.7, starts=(0.1, 0.1), zero=0.0),
                _WIDTH,
                LARGEST,
            ),
            _widening,
        ),
        Form(
            "pressed",  # a play held by dry friction between parts that the level presses together
            slot,
            (
                Parameter("even", level=1, lower=0.0, upper=0.6, starts=(0.01, 0.02), zero=0.0),
                Parameter("growing", lower=0.0, upper=0.6, starts=(0.1, 0.2), zero=0.0),
            ),
            _pressed,
        ),
    ]
