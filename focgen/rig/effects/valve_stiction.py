"""A valve that does nothing until a change of the command has crossed a band."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from focgen.arrays import Array
from focgen.rig import kernels
from focgen.rig.effects._effect import PLACE, Effect, Form, Parameter, Run, Values
from focgen.rig.effects._sizes import LOST_TRAVEL

_BANDS = tuple(0.003 * 1.3**k for k in range(20))  # of the largest command, far above whose swing it may lie
# many slips in a row fit no band but theirs, within a few hundredths
_FINE = tuple(0.003 * 1.1**k for k in range(53))
_LEFTS, _FEW, _PLACES = (0.0, 0.35, 0.7), (0.0, 0.5), (0.0,)


def _parameters(
    bands: Sequence[float], lefts: Sequence[float], *further: Sequence[float]
) -> tuple[Parameter, ...]:
    """Band, what of it is left after a slip, and where the valve lay: every combination to begin with."""
    starts = zip(*product(bands, lefts, *further))
    band = Parameter("band", level=1, lower=0.0, upper=0.5, starts=next(starts), zero=0.0)
    left = Parameter("left", lower=0.0, upper=0.95, starts=next(starts))
    return (band, left, *(Parameter(PLACE, lower=-1.0, upper=1.0, starts=s, zero=0.0) for s in starts))


def _play(x: Array, values: Values, run: Run) -> Array:
    return kernels.play(x, run.rest, values[0])


def _lost_motion(x: Array, values: Values, run: Run) -> Array:
    """A pump's piston, whose spindle lies in its gap as the log before left it. Where the piston stands
    elsewhere by now, the spindle has pushed it there, and is ahead of it, by no more than it has moved. Noisy
    readings tell where it stood."""
    (band,), made = values, np.empty(len(x))
    behind, ended = 0.0, None  # what the piston is behind its spindle; where it was as the log before ended
    for a, b, stood in run.stood_by_span:
        moved = 0.0 if ended is None else stood + x[a] - ended
        behind = min(max(behind + moved, -band), band)
        spindle = x[a:b] - x[a] + behind
        piston = kernels.play(spindle, run.rest[a:b], band)
        made[a:b], behind = x[a] + piston, spindle[-1] - piston[-1]
        ended = stood + made[b - 1]
    return made


def _stick(x: Array, values: Values, run: Run) -> Array:
    return kernels.stick(x, run.rest, values[0], 0.0)


def _slip(x: Array, values: Values, run: Run) -> Array:
    return _slipping(x, values, run, anew=False)


def _slips(x: Array, values: Values, run: Run) -> Array:
    return _slipping(x, values, run, anew=True)


def _slipping(x: Array, values: Values, run: Run, anew: bool) -> Array:
    """A valve whose place is given lies there as a log begins. What went before, if no log shows it, is what
    the plant was fed: the valve's positions, not its commands."""
    band, left, *place = values
    if not place or not run.guessed:
        return kernels.stick(x, run.rest, band, left * band, anew, *(p * band for p in place))
    rest = run.rest.copy()
    rest[[end for _, end in run.guessed]] = kernels.BALANCED
    made = kernels.stick(x, rest, band, left * band, anew, place[0] * band)
    for first, end in run.guessed:
        made[first:end] = x[first:end]
    return made


_BAND = Parameter("band", level=1, lower=0.0, upper=0.5, starts=_BANDS, zero=0.0)
_LOST = replace(_BAND, starts=(0.003, 0.02, 0.1))

EFFECT = Effect(
    name="valve_stiction",
    stage="regulator",
    meaning="small command changes or reversals do nothing until a band is crossed",
    reveals="slow ramps with reversals and small steps about an offset, with the pressure logged",
    confused_with=("hysteresis", "dead_zone", "valve_asymmetry", "sensor_quantization"),
    needs=lambda e: None if e.reversals else "the input never turns round above zero",
    remembers=True,
    sizes=(LOST_TRAVEL,),
    forms=[
        Form("play", "command", (_BAND,), _play),
        # a pump's spindle or gear lies behind what it adds up
        Form("lost_motion", "supply", (_LOST,), _lost_motion, adds_up=True),
        Form("stick", "command", (_BAND,), _stick, jumps=True),
        # after a slip it follows until the command turns round, or is held anew at once
        Form("stick_slip", "command", _parameters(_BANDS, _LEFTS), _slip, jumps=True),
        Form("slips", "command", _parameters(_FINE, _FEW), _slips, jumps=True),
        # a valve that is in use lies anywhere in its band
        Form("stick_slip_begun", "command", _parameters(_BANDS, _LEFTS, _PLACES), _slip, jumps=True),
        Form("slips_begun", "command", _parameters(_FINE, _FEW, _PLACES), _slips, jumps=True),
    ],
)
