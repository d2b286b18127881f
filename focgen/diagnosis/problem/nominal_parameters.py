"""The rig's nominal parameters, which a refit may move, as one vector of numbers of order one.

The actuator's, or those of the one stage there is, move freely, the actuator's within three times their
uncertainty: a refit that goes further makes up for an effect as easily as for a number given wrong. What was
given of a regulator or a sensor was measured, or stands in a data sheet: its gain and its times move as a
whole, and have a normal prior as wide as the rig's ``[uncertainty]``, so that what the data do not show stays
where it was.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from focgen.diagnosis.problem.factors import Factor, factors
from focgen.diagnosis.problem.free import Free, GainFreedom
from focgen.present import present
from focgen.rig.rig import Rig


@dataclass(frozen=True)
class NominalParameters:
    """Turns the nominal parameters of a segment's ``stages`` into a vector and back: those of ``freely``, the
    stage that is refitted freely, then a logarithm for each of the others' factors; levels are the segment's
    largest magnitudes. ``wide``: what no effect stands for may go beyond three times its uncertainty,
    ``far``: so may the actuator's own; ``gain``: how far its gain may; ``held``: nothing moves."""

    rig: Rig
    stages: tuple[str, ...]
    freely: str | None
    level_in: float
    level_out: float
    wide: bool = False
    far: bool = False
    gain: GainFreedom = GainFreedom.WITHIN
    held: bool = False

    @cached_property
    def _free(self) -> Free | None:
        return Free(self.rig, self.freely, self.level_in, self.level_out) if self.freely else None

    @cached_property
    def factors(self) -> tuple[Factor, ...]:
        """What moves as a whole."""
        return tuple(factors(self.rig, self.stages, self.freely if len(self._first) else None))

    @cached_property
    def _first(self) -> np.ndarray:
        return self._free.start() if self._free else np.zeros(0)

    @property
    def has_offset(self) -> bool:
        """Whether there is an offset among them."""
        return len(self._first) > 0 and present(self._free).has_offset

    @property
    def has_gain(self) -> bool:
        """Whether there is a gain among them."""
        return len(self._first) > 0 or any(f.kind == "gain" for f in self.factors)

    def gain_way(self, vector: np.ndarray) -> np.ndarray:
        """By what the vector moves where the gain of what is refitted freely grows as a whole."""
        count = len(self._first)
        way = present(self._free).gain_way(vector[:count]) if count else np.zeros(0)
        made: np.ndarray = np.r_[way, np.zeros(len(self.factors))]
        return made

    def start(self) -> np.ndarray:
        """The vector of the rig as given."""
        made: np.ndarray = np.r_[self._first, np.zeros(len(self.factors))]
        return made

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds of the vector."""
        if self.held:
            return self.start(), self.start()
        free = self._free.bounds(self.far, self.gain) if self._free else (np.zeros(0), np.zeros(0))
        ends = np.array([f.bounds(self.wide) for f in self.factors]).reshape(-1, 2).T
        return np.r_[free[0], ends[0]], np.r_[free[1], ends[1]]

    @cached_property
    def precision(self) -> np.ndarray:
        """Of the normal prior about the rig as given: 1/variance of each number, 0 where it is free."""
        known = np.array([f.uncertainty for f in self.factors])
        made: np.ndarray = np.r_[np.zeros(len(self._first)), known**-2.0]
        return made

    def prior_penalty(self, vector: np.ndarray) -> float:
        """Nats against nominal parameters this far from those given."""
        count = len(self._first)
        free = present(self._free).prior_penalty(vector[:count]) if count else 0.0
        logs = vector[count : len(self.precision)]
        return free + 0.5 * float(self.precision[count:] @ logs**2)

    def strained(self, vector: np.ndarray) -> bool:
        """Whether the actuator's own are three times their uncertainty off, or more."""
        count = len(self._first)
        return bool(count) and present(self._free).beyond(vector[:count], self.gain)

    def beyond(self, vector: np.ndarray) -> bool:
        """Whether a factor stands at an end that it could pass if it were ``wide``, or the actuator's own at
        one that they could pass if they were ``far``."""
        if self.strained(vector):
            return True
        usual, wide = (np.array([f.bounds(w) for f in self.factors]).reshape(-1, 2) for w in (False, True))
        logs = vector[len(self._first) : len(self.precision), None]
        return bool(np.any((usual != wide) & (np.abs(logs - usual) < 1e-6)))

    def put(self, rig: Rig, vector: np.ndarray) -> Rig:
        """``rig`` with the nominal parameters of these stages taken from ``vector``."""
        count = len(self._first)
        rig = present(self._free).put(rig, vector[:count]) if count else rig
        for factor, logarithm in zip(self.factors, vector[count:]):
            rig = factor.put(rig, float(logarithm))
        return rig
