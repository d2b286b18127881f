"""Gain, phase and delay margin of a loop from its frequency response, however it was obtained."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from focgen.arrays import Array, Bools, Complex

_PER_DECADE = 40
_STEP = 0.03  # largest turn (rad) and largest change of log|L| between neighbours of the refined grid
_ROUNDS = 14
SMALL = 1e-4  # |L| below which nothing is refined
DELAYED = 1e-2  # the same where a nominal delay turns it without end


@dataclass(frozen=True)
class Margins:
    """How far a loop is from instability.

    ``gain_db``: by which the gain may grow, dB. ``gain_reduction_db``: by which it may fall, dB.
    ``phase_deg``: smallest over the gain crossovers, degrees, negative where it is lost. ``delay_s``:
    additional delay that would bring the loop to the edge, s. ``crossover_rad_s``: highest frequency of
    unit gain. Infinite where nothing is crossed. ``stable``: Nyquist's criterion, for a loop that is
    stable when open but for integrators.
    """

    gain_db: float
    gain_reduction_db: float
    phase_deg: float
    delay_s: float
    crossover_rad_s: float
    stable: bool


@dataclass(frozen=True, eq=False)
class Curve:
    """An open loop L on a grid fine enough to be taken as straight between: ``omega`` (n,) in rad/s,
    ``values`` (n,).
    """

    omega: Array
    values: Complex

    def times(self, factor: float) -> Curve:
        """The loop with its gain multiplied."""
        return replace(self, values=self.values * factor)


def curve(response: Callable[[Array], Complex], low: float, high: float, small: float = SMALL) -> Curve:
    """Sample ``response(omega)`` from ``low`` to ``high`` rad/s, refined where it turns or changes fast and
    is not ``small``.
    """
    count = max(2, math.ceil(_PER_DECADE * math.log10(high / low)))
    omega = np.geomspace(low, high, count)
    values = response(omega)
    for _ in range(_ROUNDS):
        coarse = _coarse(values, small) & (np.diff(omega) > 1e-12 * omega[1:])
        if not coarse.any():
            break
        middle = np.sqrt(omega[:-1][coarse] * omega[1:][coarse])
        order = np.argsort(np.concatenate([omega, middle]), kind="stable")
        values = np.concatenate([values, response(middle)])[order]
        omega = np.concatenate([omega, middle])[order]
    return Curve(omega, values)


def _coarse(values: Complex, least: float) -> Bools:
    """Where neighbours differ by too much to interpolate; what is below ``least`` matters no more."""
    small = np.maximum(np.abs(values[1:]), np.abs(values[:-1])) < least
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.log(values[1:] / values[:-1])
    return (np.abs(ratio) > _STEP) & ~small & np.isfinite(ratio)


def margins(loop: Curve) -> Margins:
    """Return the margins of the open loop ``loop`` under negative feedback."""
    with np.errstate(divide="ignore"):
        level = np.log(np.abs(loop.values))
    phase = np.unwrap(np.angle(loop.values))
    crossings = _crossings(level, 0.0)
    omega, angle = _at(np.log(loop.omega), crossings), _at(phase, crossings)
    lead = np.mod(angle + math.pi, 2.0 * math.pi)  # 0 … 2π: what a delay may still turn
    signed = np.where(lead > math.pi, lead - 2.0 * math.pi, lead)
    above, below = _gain_margins(level, phase)
    stable = _is_stable(loop)
    worst = float(np.degrees(signed[np.argmin(np.abs(signed))])) if len(signed) else math.inf
    return Margins(
        gain_db=above,
        gain_reduction_db=below,
        phase_deg=worst if stable else -abs(worst),
        delay_s=float(np.min(lead / np.exp(omega), initial=math.inf)) if stable else 0.0,
        crossover_rad_s=float(np.exp(omega.max())) if len(omega) else math.nan,
        stable=stable,
    )


def _crossings(values: Array, level: float) -> Array:
    """Return the fractional indices where ``values`` passes ``level``."""
    side = values > level
    index = np.flatnonzero(side[1:] != side[:-1])
    return index + (level - values[index]) / (values[index + 1] - values[index])


def _at(values: Array, places: Array) -> Array:
    return np.interp(places, np.arange(len(values)), values)


def _gain_margins(level: Array, phase: Array) -> tuple[float, float]:
    """Return by how many dB the gain may grow, and fall, at the crossings of −180° and its repetitions."""
    turns = range(math.floor(phase.min() / (2 * math.pi)) - 1, math.ceil(phase.max() / (2 * math.pi)) + 1)
    places = [_crossings(phase, math.pi * (2 * turn + 1)) for turn in turns]
    decibels = _at(level, np.concatenate(places)) * 20.0 / math.log(10.0)
    return (
        float(np.min(-decibels[decibels < 0], initial=math.inf)),
        float(np.min(decibels[decibels >= 0], initial=math.inf)),
    )


def _is_stable(loop: Curve) -> bool:
    """Nyquist: 1 + L turns back by just what its integrators turned it at low frequency, and no further."""
    turn = np.unwrap(np.angle(1.0 + loop.values))
    sizes = np.abs(loop.values[:2])
    kind = -np.log(sizes[1] / sizes[0]) / np.log(loop.omega[1] / loop.omega[0])  # of the loop: L ~ s^−kind
    begin = -0.5 * math.pi * kind if sizes[0] > 2.0 else 0.0
    turn = turn - 2.0 * math.pi * round((turn[0] - begin) / (2.0 * math.pi))
    return bool(abs(turn[0] - begin) < math.pi / 2 and abs(turn[-1]) < math.pi / 2)
