"""The stage that a refit moves freely: the actuator, or the one stage of a rig, as numbers of order one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from focgen.diagnosis.problem.factors import LEAST, WITHIN
from focgen.fractional.transfer import TransferFunction
from focgen.present import present
from focgen.rig.effects import Effect
from focgen.rig.rig import Actuator, LinearActuator, Rig

_SLACK = 1e-6  # what stands as close to an end stands there
_USUAL = 0.2  # relative deviation of nominal parameters from those given that surprises nobody
_PLACES = 50  # of the input's range where the slope of a drive is looked at


class GainFreedom(Enum):
    """How far a refit may move the gain of the actuator, where that is not known exactly."""

    WITHIN = "within three times its uncertainty"
    STRAIGHT = "to a straight line as well, within what is usual: its curve may be that of an effect"
    ANY = "anywhere"


def gain_freedom(families: Sequence[Effect]) -> GainFreedom:
    """How far the gain may go beside effects. A curve is as steep at zero as before, whatever it does further
    on, so that the gain makes up for it. Whatever else is static may have been there when the gain's curve
    was fitted, and be part of it."""
    if any(family.bends for family in families):
        return GainFreedom.ANY
    return GainFreedom.STRAIGHT if any(family.static for family in families) else GainFreedom.WITHIN


@dataclass(frozen=True)
class Free:
    """Turns T, alpha, gain or num and den, and the offset, of ``stage`` into a vector and back; levels are
    the segment's largest magnitudes. Of T in s^alpha no per cent can be told while alpha moves: it counts in
    the actuator's own time constant, so that nothing depends on the unit of time."""

    rig: Rig
    stage: str
    level_in: float
    level_out: float

    @property
    def has_offset(self) -> bool:
        """Whether its last number is an offset."""
        return self.stage == "actuator" and self.rig.actuator is not None

    def start(self) -> np.ndarray:
        """The vector of the rig as given: logarithms of coefficients or T, α and the gain's numbers, then the
        bias where the actuator integrates, and the offset last."""
        if self.stage != "actuator":
            return self._from_transfer(getattr(self.rig, self.stage))
        a = self.rig.actuator
        if isinstance(a, Actuator):
            gains = [g * self.level_in ** (i + 1) / self.level_out for i, g in enumerate(a.gain)]
            return np.array([np.log(a.T), a.alpha, *gains, a.offset / self.level_out])
        if isinstance(a, LinearActuator):
            bias = [a.bias / self.level_in] if a.integrates else []
            made: np.ndarray = np.r_[self._from_transfer(a.dynamics), bias, a.offset / self.level_out]
            return made
        return np.zeros(0)

    def gain_way(self, vector: np.ndarray) -> np.ndarray:
        """By what the vector moves where the gain as a whole grows, a unit for each e-fold."""
        way = np.zeros(len(vector))
        if self.stage == "actuator" and isinstance(self.rig.actuator, Actuator):
            way[2:-1] = vector[2:-1]
        elif len(vector):
            way[: len(self._transfer_of().num)] = 1.0
        return way

    def bounds(
        self, far: bool = True, gain: GainFreedom = GainFreedom.WITHIN
    ) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds of the vector; not ``far``: of an actuator, three times its uncertainty, and
        what ``gain`` says.

        A gain that is positive at no load stays so: one that is negative there is no other K(p), but a dead
        zone.
        """
        low, high = self._utmost()
        if not self.has_offset:
            return low, high
        near = self._usual(gain)
        kept = np.logical_not(far) | (near[0] == near[1])  # what is known exactly does not move
        return np.where(kept, np.maximum(low, near[0]), low), np.where(kept, np.minimum(high, near[1]), high)

    def beyond(self, vector: np.ndarray, gain: GainFreedom = GainFreedom.WITHIN) -> bool:
        """Whether a number stands at an end of what is usual, or further off."""
        if not self.has_offset:
            return False
        low, high = self._usual(gain)
        ends = (vector < low + _SLACK) | (vector > high - _SLACK)
        return bool(np.any(ends & (low < high)))

    def _usual(self, freedom: GainFreedom) -> tuple[np.ndarray, np.ndarray]:
        """Three times the actuator's uncertainty about what was given; any offset, and any gain or what is
        straighter than the one given, as ``freedom`` says, where it is not known exactly."""
        known, start, a = self.rig.uncertainty.actuator, self.start(), self.rig.actuator
        time = factor_ends(known.time)
        moves: list[Any]
        if isinstance(a, Actuator):
            order = WITHIN * known.alpha * start[1]
            moves = [time, (-order, order), *_coefficients(start[2:-1], known.gain, freedom)]
        else:
            free = freedom is GainFreedom.ANY and known.gain
            gain = np.array([-np.inf, np.inf]) if free else factor_ends(known.gain)
            linear, orders = present(a), self._orders()
            drive = [(-np.inf, np.inf)] * linear.integrates  # its zero
            moves = [*(gain + k * time for k in orders[0]), *(k * time for k in orders[1]), *drive]
        ends = np.array([*moves, (-np.inf, np.inf)]).T
        return start + ends[0], start + ends[1]

    def _utmost(self) -> tuple[np.ndarray, np.ndarray]:
        start = self.start()
        low, high = start - 50.0, start + 50.0
        if self.stage == "actuator" and isinstance(self.rig.actuator, Actuator):
            low[0], high[0] = start[0] - 5.0, start[0] + 5.0
            low[1], high[1] = 0.08, 1.9
            if start[2] > 0.0:
                low[2] = 0.0
        elif len(start):
            count = len(self._logs(self._transfer_of()))
            low[:count], high[:count] = start[:count] - 8.0, start[:count] + 8.0
        return low, high

    def prior_penalty(self, vector: np.ndarray) -> float:
        """Nats against nominal parameters this far from those given. The owner identified them once: a tenth
        off is usual, a factor is not. The tails are heavy (Cauchy's), for a rig may well have been given at a
        guess; an offset and a bias are free. Of a transfer function the gain and the times as a whole are one
        number each, and what its coefficients are off beside these.
        """
        start = self.start()
        if not len(start):
            return 0.0
        away = vector - start
        if self.stage == "actuator" and isinstance(self.rig.actuator, Actuator):
            gains = np.abs(start[2:-1])
            scale = _USUAL * np.r_[1.0, 0.5 * start[1], gains + 0.1 * gains.sum() + 1e-12]
            return _surprise(away[:-1] / scale)
        orders = np.concatenate(self._orders())
        ways = np.stack([np.arange(len(orders)) < len(self._orders()[0]), orders], axis=1)
        times = np.maximum(np.abs(orders), 1.0)  # of the uncertainty of one time
        off = away[: len(orders)] / times
        whole = np.linalg.lstsq(ways / times[:, None], off, rcond=None)[0]
        return _surprise(np.r_[whole, off - ways @ whole / times] / _USUAL)

    def _orders(self) -> tuple[np.ndarray, np.ndarray]:
        """How often the time is in each coefficient of the numerator, and in each but the last of the
        denominator."""
        found = self._transfer_of()
        last = found.den[-1].order
        return np.array([t.order for t in found.num]), np.array([t.order - last for t in found.den[:-1]])

    def put(self, rig: Rig, vector: np.ndarray) -> Rig:
        """``rig`` with these parameters taken from ``vector``."""
        if not len(vector):
            return rig
        if self.stage != "actuator":
            changes: dict[str, Any] = {self.stage: self._to_transfer(getattr(self.rig, self.stage), vector)}
            return replace(rig, **changes)
        a, v = self.rig.actuator, [float(value) for value in vector]
        if isinstance(a, Actuator):
            gains = tuple(g * self.level_out / self.level_in ** (i + 1) for i, g in enumerate(v[2:-1]))
            T = float(np.exp(v[0] - np.log(a.T))) * a.T_at(v[1])
            moved: Actuator | LinearActuator = Actuator(T, v[1], gains, v[-1] * self.level_out)
        else:
            linear = present(a)
            bias = v[-2] * self.level_in if linear.integrates else linear.bias
            moved = LinearActuator(self._to_transfer(linear.dynamics, vector), v[-1] * self.level_out, bias)
        return replace(rig, actuator=moved)

    def _transfer_of(self) -> TransferFunction:
        found = getattr(self.rig, self.stage)
        made: TransferFunction = found.dynamics if self.stage == "actuator" else found
        return made

    @staticmethod
    def _logs(transfer: TransferFunction) -> list[float]:
        """Coefficients but the denominator's last, which only scales the others."""
        return [t.coefficient for t in (*transfer.num, *transfer.den[:-1])]

    def _from_transfer(self, transfer: TransferFunction) -> np.ndarray:
        return np.log(np.abs(self._logs(transfer)))

    def _to_transfer(self, transfer: TransferFunction, vector: np.ndarray) -> TransferFunction:
        moved = [np.sign(c) * np.exp(v) for c, v in zip(self._logs(transfer), vector)]
        count = len(transfer.num)
        num = [(float(c), t.order) for c, t in zip(moved, transfer.num)]
        den = [(float(c), t.order) for c, t in zip(moved[count:], transfer.den)]
        return TransferFunction(num, [*den, (transfer.den[-1].coefficient, transfer.den[-1].order)])


def _surprise(off: np.ndarray) -> float:
    """Nats against numbers that are so many times off what is usual."""
    return float(np.sum(np.log1p(off**2)))


def _coefficients(gains: np.ndarray, known: float, freedom: GainFreedom) -> np.ndarray:
    """By what the coefficients (k,) of a gain, as parts of what it makes of the largest input, may move
    (k, 2). A straighter gain has less of all but the first, and for that one a slope of what was given."""
    if freedom is GainFreedom.ANY and known:
        return np.tile([-np.inf, np.inf], (len(gains), 1))
    straight = freedom is GainFreedom.STRAIGHT and known > 0.0 and bool(np.any(gains[1:]))
    within = WITHIN * (max(known, _USUAL) if straight else known) * np.abs(gains).sum()
    ends = np.tile([-within, within], (len(gains), 1))
    if not straight:
        return ends
    rising = gains * np.arange(1, len(gains) + 1)
    slopes = np.polynomial.polynomial.polyval(np.linspace(0.0, 1.0, _PLACES), rising)
    straighter = np.sort(np.stack([np.zeros(len(gains)), -gains], axis=1), axis=1)
    straighter[0] = slopes.min() - gains[0], slopes.max() - gains[0]
    made: np.ndarray = straighter + ends
    return made


def factor_ends(known: float) -> np.ndarray:
    """The logarithms of the factors (2,) that three times an uncertainty lets a number have."""
    return np.log([max(1.0 - WITHIN * known, LEAST), 1.0 + WITHIN * known])
