"""A designed controller, in physical quantities only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from focgen.fractional.continuous import DEFAULT_TOLERANCE
from focgen.fractional.transfer import TransferFunction

ARITHMETICS = ("f64", "f32", "q31", "q15")
MEMORIES = ("short", "exponential")
TOLERANCES = {"gl": 1e-4, "continuous": DEFAULT_TOLERANCE}
"""By operator, an exponential memory's where none is given."""


@dataclass(frozen=True)
class GainSchedule:
    """A gain, linear between ``breakpoints`` of the scheduling signal and held beyond them.

    ``breakpoints`` rise strictly, in the scheduling signal's units; ``gains`` has the same length.
    """

    breakpoints: tuple[float, ...]
    gains: tuple[float, ...]

    def __call__(self, value: ArrayLike) -> Any:
        """The gain at ``value``, any shape."""
        points, gains = np.array(self.breakpoints), np.array(self.gains)
        place = np.clip(np.asarray(value, dtype=float), points[0], points[-1])
        i = np.clip(np.searchsorted(points, place, side="right") - 1, 0, len(points) - 2)
        # not np.interp, which some processors compute with fewer roundings
        slope = (gains[i + 1] - gains[i]) / (points[i + 1] - points[i])
        return np.where(place == points[-1], gains[-1], gains[i] + slope * (place - points[i]))


NOTHING = (0.0, 0.0)
"""The range of a measurement that a pure filter does not have: it is 0 in every sample."""


@dataclass(frozen=True)
class ControllerRanges:
    """What each signal can reach, (low, high) in physical units; ``schedule`` is None without a schedule.

    Reference and measurement are in the same unit; the measurement of a pure filter is ``NOTHING``.
    """

    reference: tuple[float, float]
    measurement: tuple[float, float]
    output: tuple[float, float]
    schedule: tuple[float, float] | None = None


@dataclass(frozen=True)
class Units:
    """Names of the units, for comments and reports only."""

    measurement: str = ""
    output: str = ""
    schedule: str = ""


@dataclass(frozen=True)
class Tunable:
    """The box of what may be changed at run time, each (low, high): the factors on the gains, and the lower
    and the upper output limit in physical units.

    A factor of 1 and the limits of ``ranges.output`` are inside; the limits never cross.
    """

    gain: tuple[float, float] = (1.0, 1.0)
    output_low: tuple[float, float] = (0.0, 0.0)
    output_high: tuple[float, float] = (0.0, 0.0)


Option = str | int | float | tuple[float, ...]
"""A value of an option that a controller was designed with."""


@dataclass(frozen=True)
class Source:
    """What a controller was designed from: file name and SHA-256, and the ``options`` that were given, by
    name."""

    file: str
    sha256: str
    options: tuple[tuple[str, Option], ...] = ()


@dataclass(frozen=True)
class Controller:
    """One step: e = ref − meas → ``transfer`` → × gain(sched) → trapezoidal integrator, clamped → u.

    ``gain`` is a constant or a :class:`GainSchedule`. With ``integrator`` the integral is clamped to
    ``ranges.output``; without, the output itself is. ``length`` is the memory length L: the past samples
    j = 1 … L take part. ``sample_time`` in s. ``arithmetic`` is the one it was designed for.

    ``memory`` is "short" or "exponential"; the latter keeps the weights within the relative ``tolerance`` up
    to ``horizon`` samples and has no use for ``length``. Where ``operator`` is "continuous" it follows (jω)^α
    itself within ``tolerance`` over ``band`` (rad/s; None: the default one), and ``horizon`` has no use.

    ``slew_limit`` is how fast the output may move, in its units a second; it needs the integrator. A reset, a
    track and a limit that changes move it at once.

    ``setpoint_filter`` is the time constant in seconds of a lag of first order between the reference and the
    error; None: none.

    ``tunable`` is what C that is generated for it may change at run time; None: nothing.
    """

    name: str
    sample_time: float
    transfer: TransferFunction
    gain: float | GainSchedule
    integrator: bool
    ranges: ControllerRanges
    length: int = 1000
    memory: str = "short"
    arithmetic: str = "q31"
    units: Units = Units()
    designed_from: Source | None = None
    tolerance: float = 1e-4
    horizon: int = 1_000_000
    operator: str = "gl"
    band: tuple[float, float] | None = None
    tunable: Tunable | None = None
    slew_limit: float | None = None
    setpoint_filter: float | None = None

    @property
    def scheduled(self) -> bool:
        """Whether the gain depends on a scheduling signal."""
        return isinstance(self.gain, GainSchedule)

    @property
    def schedule(self) -> GainSchedule:
        """The gain of a scheduled controller. Raises TypeError for a constant one."""
        if not isinstance(self.gain, GainSchedule):
            raise TypeError("the gain is constant")
        return self.gain

    @property
    def gains(self) -> tuple[float, ...]:
        """The gain at every breakpoint, or the only one."""
        return self.gain.gains if isinstance(self.gain, GainSchedule) else (self.gain,)

    @property
    def factors(self) -> tuple[float, float]:
        """The smallest and the largest factor that a gain can have."""
        return self.tunable.gain if self.tunable else (1.0, 1.0)

    def gain_at(self, value: ArrayLike | None = None) -> Any:
        """The gain at a value of the scheduling signal (ignored where nothing is scheduled)."""
        if not isinstance(self.gain, GainSchedule):
            return self.gain
        if value is None:
            raise TypeError("the gain is scheduled: give a value of the scheduling signal")
        return self.gain(value)
