"""How large an effect is, as one would measure it on the rig: the same number whichever form was found.

A size is a parameter that all forms have, as a ceiling, or is read off the stage on a
:class:`~focgen.rig.bench.Bench`, run with the effect and without it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from focgen.arrays import Array

_LEVELS = 25  # of a staircase, from the lowest input to the highest
_FINE, _COARSE = 40, 10  # samples in a response time
_SETTLED = 12  # response times at a level
_LONG = 40  # response times of a step
_RAMP, _TOPS = 2001, 24  # samples of a slow ramp, and heights that it turns round at
_STIRS = 1e-6  # of a ramp's height: an output that moves by more has begun to move
_LOW = 0.03  # of the farthest input: a load that changes nothing by itself
_ALIKE = 0.02  # of the larger: two lags that are no further apart are one
_MOVES = 1e-9  # of the larger: of a stage that moves by less nothing is read off


@dataclass(frozen=True)
class Size:
    """One number that an effect is as large as. ``what`` it is, as a noun, with the times of a hold that it
    is read at; ``unit``: "in" or "out" of the stage, with "/s" behind it where it is a rate, or a plain unit;
    ``read`` off a bench, NaN where this form or this rig has none; ``own``: instead, parameters of which the
    first that a form has is the size. ``signed``: its sign is that of what leaves the stage."""

    what: str
    unit: str = ""
    read: Callable[[Any], float] | None = None
    own: tuple[str, ...] = ()
    signed: bool = False


def own(name: str, what: str = "", *others: str) -> Size:
    """A parameter of the forms, in its own unit."""
    return Size(what or name, own=(name, *others))


def _step(bench: Any, up: bool = True, fine: int = _FINE, long: int = _LONG) -> tuple[Array, float]:
    """A step over the range of the input, and its sample time, s."""
    begin, end = (bench.low, bench.high) if up else (bench.high, bench.low)
    return np.r_[begin, np.full(fine * long, end)], bench.response / fine


def _farthest(y: Array) -> float:
    """What is farthest from 0, with its sign."""
    return float(y[np.argmax(np.abs(y))])


def _to_go(bench: Any, y: Array, h: float, up: bool, effect: bool = True) -> Array:
    """The part of its way that a response to a step has yet to go; it comes to rest where it would have
    rested all along, for a springpot is long in coming there."""
    end = bench.run(np.full(3, bench.high if up else bench.low), h, effect)[-1]
    way = end - y[0]
    made: Array = (end - y) / (way if abs(way) > _MOVES * np.max(np.abs(y)) else np.nan)
    return made


def _of_top(bench: Any, effect: bool = True, at: float | None = None) -> float:
    """How far the input that is farthest from 0 moves the stage from where it rests at 0."""
    y = bench.run(np.r_[0.0, np.full(_SETTLED * _COARSE, bench.top)], bench.response / _COARSE, effect, at)
    return float(y[-1] - y[0]) or np.nan


def _further_lag(bench: Any, up: bool = True) -> float:
    """The area between both responses is the mean time by which one is later."""
    x, h = _step(bench, up)
    with_it, without = (_to_go(bench, bench.run(x, h, effect), h, up, effect) for effect in (True, False))
    return float(np.sum(with_it - without) * h)


def _further_lag_down(bench: Any) -> float:
    """NaN where it is the same on the way up."""
    up, down = (_further_lag(bench, way) for way in (True, False))
    return down if abs(down - up) > _ALIKE * max(abs(down), abs(up)) else np.nan


def _half_way(bench: Any, up: bool) -> float:
    """When a response is half-way, s, of a step whose middle is half a sample behind its begin."""
    x, h = _step(bench, up, _FINE * 5, _SETTLED)
    left = _to_go(bench, bench.run(x, h), h, up)
    there = np.flatnonzero(left <= 0.5)
    if not len(there) or not there[0]:
        return np.nan
    k = int(there[0])
    return h * float(k - 0.5 - (0.5 - left[k]) / (left[k - 1] - left[k]))


def _down_over_up(bench: Any) -> float:
    """Half-way, for a springpot comes to rest nowhere soon."""
    return _half_way(bench, False) / _half_way(bench, True)


def _highest_rate(bench: Any) -> float:
    x, h = _step(bench, fine=_FINE * 5, long=_SETTLED)
    return float(np.max(np.abs(np.diff(bench.run(x, h))))) / h or np.nan


def _staircase(bench: Any, levels: Array) -> tuple[Array, Array]:
    """What the levels come to, with the effect and without."""
    held = _SETTLED * _COARSE
    x, h = np.r_[levels[0], np.repeat(levels, held)], bench.response / _COARSE
    return tuple(bench.run(x, h, effect)[held::held] for effect in (True, False))


def _widest_loop(bench: Any) -> float:
    """Up and down twice: the second way round is a closed loop."""
    way = np.linspace(bench.low, bench.high, _LEVELS)
    made = _staircase(bench, np.r_[way, way[-2::-1], way[1:], way[-2::-1]])
    (with_it, without) = (y[-2 * _LEVELS + 1 :] for y in made)
    wide = [y[: _LEVELS - 1] - y[: _LEVELS - 1 : -1] for y in (with_it, without)]
    return float(np.max(np.abs(wide[0] - wide[1])))


def _bow(bench: Any) -> float:
    """By how much the static curve bends away from the nominal one between the same ends, at most."""
    with_it, without = (y - y[0] for y in _staircase(bench, np.linspace(bench.low, bench.high, _LEVELS)))
    if abs(without[-1]) <= _MOVES * np.max(np.abs(without)):
        return np.nan
    return _farthest(with_it - without * with_it[-1] / without[-1])


def _lost(bench: Any) -> float:
    return 100.0 * (1.0 - _of_top(bench) / _of_top(bench, False))


def _lost_travel(bench: Any) -> float:
    """Of several turns the least: a valve that slips has more or less of its band left as it turns."""
    least = np.inf
    for top in bench.low + (bench.high - bench.low) * np.linspace(0.5, 1.0, _TOPS):
        way = np.linspace(bench.low, top, _RAMP)
        y = bench.alone(np.r_[way, way[-2::-1]])[_RAMP - 1 :]
        stirs = np.flatnonzero(np.abs(y - y[0]) > _STIRS * (bench.high - bench.low))
        least = min(least, float(way[-1] - way[-1 - stirs[0]]) if len(stirs) else np.inf)
    return least if np.isfinite(least) else np.nan


def _further_creep(bench: Any) -> float:
    """In a hold, beyond what the nominal chain does."""
    early, late = bench.hold
    h = early / (3 * _COARSE)
    x = np.r_[bench.low, np.full(round(late / h) + 1, bench.high)]
    ways = [
        (y[-1] - y[3 * _COARSE]) / (y[3 * _COARSE] - y[0]) for y in (bench.run(x, h), bench.run(x, h, False))
    ]
    return 100.0 * float(ways[0] - ways[1])


def _overshoot(bench: Any) -> Array:
    with_it, without = (bench.run(*_step(bench), effect) for effect in (True, False))
    way = with_it[-1] - with_it[0]
    made: Array = 100.0 * (with_it - without * with_it[-1] / (without[-1] or np.nan)) / (way or np.nan)
    return made


def _largest_overshoot(bench: Any) -> float:
    return _farthest(_overshoot(bench))


def _half_gone(bench: Any) -> float:
    over = np.abs(_overshoot(bench))
    top = int(np.argmax(over))
    later = np.flatnonzero(over[top:] < 0.5 * over[top])
    return float(later[0]) * bench.response / _FINE if len(later) else np.nan


def _gain_over_session(bench: Any) -> float:
    return 100.0 * (_of_top(bench, at=bench.end) / _of_top(bench, at=bench.begin) - 1.0)


def _zero_over_session(bench: Any) -> float:
    x, h = np.full(3, bench.low), bench.response / _COARSE
    first, last = (bench.run(x, h, at=at) for at in (bench.begin, bench.end))
    return float(last[-1] - first[-1])


def _gain_after_session(bench: Any) -> float:
    """Of a small load, ahead of all that was done and behind it."""
    h, inputs = bench.step, bench.inputs
    hold = np.full(min(int(_SETTLED * bench.response / h) + 2, len(inputs)), _LOW * bench.top)
    x = np.r_[0.0, hold, inputs, hold]
    ratios = []
    for effect in (True, False):
        y = bench.run(x, h, effect)
        ratios.append((y[-1] - y[0]) / (y[len(hold)] - y[0]))
    return 100.0 * float(ratios[0] / ratios[1] - 1.0)


LATER = Size("further lag", "s", _further_lag)
LATER_DOWN = Size("further lag on the way back", "s", _further_lag_down)
DOWN_OVER_UP = Size("time to unload over time to load", "", _down_over_up)
HIGHEST_RATE = Size("highest rate", "out/s", _highest_rate)
WIDEST_LOOP = Size("widest loop", "out", _widest_loop)
BOW = Size("bend of the static curve", "out", _bow, signed=True)
LOST = Size("share lost at the highest input", "%", _lost)
LOST_TRAVEL = Size("command lost at each reversal", "in", _lost_travel)
FREQUENCY = Size("frequency", "Hz", lambda bench: 1.0 / bench.number("period"))
FURTHER_CREEP = Size("more from {early:g} s to {late:g} s of a hold", "%", _further_creep)
OVERSHOOT = Size("overshoot of a step", "%", _largest_overshoot)
HALF_GONE = Size("overshoot half gone after", "s", _half_gone)
GAIN_OVER_SESSION = Size("change of the gain over the session", "%", _gain_over_session)
ZERO_OVER_SESSION = Size("change of the zero over the session", "out", _zero_over_session, signed=True)
GAIN_AFTER_SESSION = Size("change over the session of the gain for small loads", "%", _gain_after_session)
