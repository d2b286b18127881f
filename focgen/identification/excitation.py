"""What drives the fit of one experiment, and what is fitted."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import fft

from focgen.errors import FitError, LogError
from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.model import UNITY, Rig

_HELD = 0.1  # share of samples in which a held input changes at most
_JUMPS = 0.5  # share of its way that a held input makes in jumps at least
_AT_REST = 0.02  # of the input's largest value: closer to 0 than this it starts at rest at 0
_AWAY = 0.1  # of a step: nearer to one of its ends the input is at it
_SURELY = 0.8  # of the samples before it is away: the last ones may be its beginning
_SEVERAL = 10  # samples whose mean is a better rest than the first of them
_DRIFT = 3.0  # standard errors of a slope: what is steeper does not rest
_FEWEST = 30  # samples


@dataclass(frozen=True, eq=False)
class Excitation:
    """One experiment made ready: the input's powers as the dynamics see them, and the fitted signal.

    ``pressure`` (n,) is the input of the actuator, measured or through the regulator; ``before`` its constant
    value ahead of the first sample; ``level`` the value it is stepped to. ``drives`` (powers, n) are
    pressure^m − before^m, m = 1, 2, …, through the sensor where its output is fitted. ``hold`` says what they
    do between samples, ``sensor_gain`` is the sensor's at rest (1 where the curvature is fitted).
    ``rest_shown``: whether the log begins before the first step, so that it shows the output's zero.
    """

    name: str
    step: float
    pressure: np.ndarray
    measured: np.ndarray
    drives: np.ndarray
    hold: str
    before: float
    level: float
    input_role: str
    fitted_role: str
    sensor_gain: float
    notes: tuple[str, ...] = ()
    rest_shown: bool = True

    def __len__(self) -> int:
        return len(self.measured)

    @property
    def ends(self) -> tuple[float, float]:
        """The pressures that a step goes from and to."""
        return self.before, self.level

    @property
    def loaded(self) -> float:
        """The end of the step that is farther from 0: what it is stepped to, or released from."""
        return max(self.level, self.before, key=abs)

    @property
    def between(self) -> bool:
        """Whether it is a step between two levels, neither of them 0."""
        return min(map(abs, self.ends)) > _AWAY * abs(self.loaded)

    @property
    def jumps(self) -> bool:
        """Whether the input jumps at the first sample."""
        return bool(np.any(self.drives[:, 0] != 0.0))

    @cached_property
    def _size(self) -> int:
        return fft.next_fast_len(2 * len(self), real=True)

    @cached_property
    def _changes(self) -> np.ndarray:
        return fft.rfft(np.diff(self.drives, axis=1), self._size)

    def respond(self, steps: np.ndarray | None, means: np.ndarray | None) -> np.ndarray:
        """Convolve each drive with each kernel; shape (kernels, powers, n).

        ``steps`` (kernels, ≥ n) are step responses at 0, h, …; ``means`` their means over the sample before
        h, 2h, …. A held input needs ``steps``, a linear one ``means``, and ``steps`` as well where it jumps
        at first.
        """
        n = len(self)
        kernels = (steps if self.hold == "zero" else means)[:, : n - 1]
        moved = fft.irfft(fft.rfft(kernels, self._size)[:, None, :] * self._changes, self._size)[
            :, :, : n - 1
        ]
        out = np.zeros((len(kernels), len(self.drives), n))
        out[:, :, 1:] = moved
        if self.jumps:
            out += steps[:, None, :n] * self.drives[None, :, :1]
        return out


def prepare(experiment: Experiment, rig: Rig, powers: int = 1, before: float | None = None) -> Excitation:
    """Make an experiment ready for fitting.

    Input is the measured pressure where logged, else the command through the regulator; fitted is the
    curvature where logged, else the output through the sensor. ``before`` is the input's value ahead of the
    first sample (None: as at the first sample). Raises LogError where a signal is constant or too short.
    """
    _check(experiment)
    pressure, level_before, hold, role = _input(experiment, rig, before)
    drives = np.array([pressure**m - level_before**m for m in range(1, powers + 1)])
    fitted = "curvature" if "curvature" in experiment else "output"
    gain = 1.0
    if fitted == "output" and rig.sensor != UNITY:
        gain, drives, hold = _through_sensor(rig.sensor, drives, experiment.sample_time, hold)
    return Excitation(
        experiment.name,
        experiment.sample_time,
        pressure,
        experiment[fitted],
        drives,
        hold,
        level_before,
        _level(pressure, level_before),
        role,
        fitted,
        gain,
        experiment.notes,
        before is None,
    )


def possible_rests(experiment: Experiment) -> tuple[float | None, ...]:
    """The values the input may have had before the first sample: that of the first sample, and 0 where it
    differs.

    A log that begins with the step itself starts at rest at 0 with its input already up.
    """
    values = experiment["pressure" if "pressure" in experiment else "command"]
    if np.ptp(values) == 0.0:
        return (0.0,)
    return (None,) if abs(values[0]) <= _AT_REST * np.abs(values).max() else (None, 0.0)


def _check(experiment: Experiment) -> None:
    if len(experiment) < _FEWEST:
        raise LogError(experiment.name, f"has {len(experiment)} samples", f"give at least {_FEWEST}")
    fitted = experiment["curvature" if "curvature" in experiment else "output"]
    if np.ptp(fitted) == 0.0:
        raise LogError(
            experiment.name, f"has an output of {fitted[0]:g} throughout", "check the sensor and the column"
        )
    role = "pressure" if "pressure" in experiment else "command"
    if not np.any(experiment[role]):
        raise LogError(
            experiment.name, f"has a {role} of 0 throughout", "give a log in which the rig is driven"
        )


def _input(experiment: Experiment, rig: Rig, before: float | None) -> tuple[np.ndarray, float, str, str]:
    """The actuator's input: (samples, value before them, hold, role it comes from)."""
    if "pressure" in experiment:
        values, hold = experiment["pressure"], hold_of(experiment["pressure"])
        if before is None:
            values = np.concatenate([[_rest_of(values)], values[1:]])  # the first sample's noise is no step
        return values, _value_before(values, before), hold, "pressure"
    command = experiment["command"]
    rest = _value_before(command, before)
    if rig.regulator == UNITY:
        return command, rest, "zero", "command"
    gain = rig.regulator.dc_gain
    if not np.isfinite(gain):
        raise FitError("regulator", "integrates, so it has no rest to start from", "log the pressure")
    moved = _through("regulator", rig.regulator, experiment.sample_time, "zero")(command - rest)
    return gain * rest + moved, gain * rest, "linear", "command"


def _through(name: str, stage: TransferFunction, step: float, hold: str) -> Callable:
    """What a stage makes of its input, as a function."""
    convolution = Convolution(stage, step, hold)

    def run(signal: np.ndarray) -> np.ndarray:
        try:
            return convolution.run(signal)
        except ArithmeticError as reason:
            raise FitError(name, f"cannot be simulated ({reason})", "check its num and den") from None

    return run


def _value_before(values: np.ndarray, before: float | None) -> float:
    return float(values[0]) if before is None else before


def _rest_of(values: np.ndarray) -> float:
    """The mean of the samples before the input moves; the first sample where it moves at once."""
    away = np.abs(values - values[0]) >= _AWAY * np.ptp(values)
    resting = values[: int(_SURELY * np.argmax(away))]
    if len(resting) < _SEVERAL or np.ptp(resting) == 0.0:
        return float(values[0])
    place = np.arange(len(resting)) - 0.5 * (len(resting) - 1)
    slope = float(place @ resting) / float(place @ place)
    steepest = _DRIFT * float(np.std(resting)) / math.sqrt(float(place @ place))
    return float(np.mean(resting)) if abs(slope) <= steepest else float(values[0])


def hold_of(values: np.ndarray) -> str:
    """ "zero" for an input that is held, else "linear".

    A held one changes in few of its samples, and in jumps: not in two samples in a row, as a pressure does on
    its way up that then rests.
    """
    way = np.abs(np.diff(values))
    moves = np.pad(way > 0.0, 1)
    jumps = way[moves[1:-1] & ~moves[:-2] & ~moves[2:]].sum()
    few = np.count_nonzero(way) <= _HELD * len(values)
    return "zero" if few and jumps >= _JUMPS * way.sum() else "linear"


def _through_sensor(sensor: TransferFunction, drives: np.ndarray, step: float, hold: str) -> tuple:
    gain = sensor.dc_gain
    if not np.isfinite(gain):
        raise FitError("sensor", "integrates, so it has no rest to start from", "log the curvature")
    run = _through("sensor", sensor, step, hold)
    return gain, np.array([run(drive) for drive in drives]), "linear"


def _level(pressure: np.ndarray, before: float) -> float:
    """The median of the input where it is more than half-way to its farthest value."""
    away = np.abs(pressure - before)
    return float(np.median(pressure[away >= 0.5 * away.max()]))
