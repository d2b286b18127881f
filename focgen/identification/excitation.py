"""What drives the fit of one experiment, and what is fitted."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from focgen.arrays import Array, Bools
from focgen.errors import FitError, LogError
from focgen.fractional.transfer import TransferFunction
from focgen.identification.driven import Driven
from focgen.identification.kernel import Kernels
from focgen.identification.passed_on import run_stage, through
from focgen.identification.smoothed import without_noise
from focgen.logs.between import Between, Course, course_of, jumps_of, noise_level
from focgen.logs.experiment import Experiment, check_output
from focgen.logs.feedback import unlogged_reference
from focgen.rig import kernels
from focgen.rig.rig import UNITY, Rig
from focgen.rig.within import by_regulator, course_within, kinks, read_within, scaled_to

_AT_REST = 0.02  # of the input's largest value: closer to 0 than this it starts at rest at 0
_AWAY = 0.1  # of a step: nearer to one of its ends the input is at it
_SURELY = 0.8  # of the samples before it is away: the last ones may be its beginning
_SEVERAL = 10  # samples whose mean is a better rest than the first of them
_DRIFT = 3.0  # standard errors of a slope: what is steeper does not rest
_FEWEST = 30  # samples
_NOISE = 12.0  # standard deviations: white noise alone does not spread so far in ten million samples
_LOOKED_BACK, _FARTHEST = (
    2,
    80_000,
)  # how far before an experiment its past is looked for: its lengths, samples
_FOLLOWED = 8  # first samples of a moving input that a line is drawn through where they are noisy


@dataclass(frozen=True, eq=False)
class Excitation:
    """One experiment made ready: the input's powers as the dynamics see them, and the fitted signal.

    ``pressure`` (n,) is the input of the actuator, measured, but for its noise, or through the regulator;
    ``before`` its constant value ahead of the first sample; ``level`` the value it is stepped to. ``course``
    holds pressure^m − before^m, m = 1, 2, …, through the sensor where its output is fitted; ``sensor`` is 1
    where the curvature is. ``rest_shown``: whether the log begins before the first step, so that it shows the
    output's zero.
    ``jumps`` (n,): where the input jumps, and what it ``runs`` like elsewhere, or how it runs ``within`` each
    sample (7, n), where that is known.
    ``reference`` (n,) where a loop was closed, logged or not. ``late``: the nominal dead time of the stages
    that it is seen through, s. ``begins_up``: whether the input was held away from 0 ahead of the first
    sample.
    """

    name: str
    step: float
    pressure: Array
    measured: Array
    course: Course
    jumps: Bools
    runs: Between
    before: float
    level: float
    input_role: str
    fitted_role: str
    sensor: TransferFunction
    notes: tuple[str, ...] = ()
    rest_shown: bool = True
    reference: Array | None = None
    late: float = 0.0
    begins_up: bool = False
    within: Array | None = None

    def __len__(self) -> int:
        return len(self.measured)

    @property
    def powers(self) -> int:
        """How many powers of the pressure drive it."""
        return len(self.course.values)

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

    @cached_property
    def spread(self) -> float:
        """The measured signal's standard deviation, its units."""
        return float(np.std(self.measured))

    def with_powers(self, count: int) -> Excitation:
        """The same, driven by the first ``count`` powers of the pressure alone."""
        return self if self.powers == count else replace(self, course=self.course.first(count))

    def bare(self) -> Excitation:
        """A copy without what was made along the way, to be sent to another process."""
        return replace(self)

    def respond(self, kernels: Kernels, rows: int = 3) -> Array:
        """Convolve each power with the first ``rows`` kernels; shape (rows, powers, n)."""
        return self._driven.respond(kernels, rows, len(self))

    @cached_property
    def _driven(self) -> Driven:
        return Driven(self.course)

    @cached_property
    def stepped(self) -> Driven:
        """A drive that steps to 1 at the first sample and stays for as long as pasts are looked back to."""
        ones = np.ones((1, len(self) + self.looked_back))
        course = course_of(ones, np.zeros(ones.shape[1], bool), Between.HELD)
        return Driven(through(self.sensor, course, self.step))

    @property
    def looked_back(self) -> int:
        """How far before the first sample a past is looked for, samples."""
        return min(_LOOKED_BACK * len(self), _FARTHEST)

    def beginning(self, count: int) -> Excitation:
        """The first ``count`` samples alone."""
        if count >= len(self):
            return self
        pressure, measured = self.pressure[:count], self.measured[:count]
        course, jumps = self.course.until(count), self.jumps[:count]
        within = None if self.within is None else self.within[:, :count]
        return replace(self, pressure=pressure, measured=measured, course=course, jumps=jumps, within=within)

    def behind(self, play: float) -> Excitation:
        """The same behind a play of the input of half width ``play``, units of it, which lies where the way
        from 0 to the first sample left it."""
        if not play:
            return self
        left = float(-np.copysign(min(play, abs(self.before)), self.before))

        def moved(x: Array) -> Array:
            return self.before + kernels.play(x - self.before, np.zeros(len(x), np.uint8), play, left)

        return self._driven_by(moved, self.before + left)

    def beyond(self, zone: float) -> Excitation:
        """The same, driven by what is more than ``zone`` of the input, units of it, to either side of 0."""

        def more(x: Array) -> Array:
            beyond: Array = np.sign(x) * np.maximum(np.abs(x) - zone, 0.0)
            return beyond

        return self._driven_by(more, float(more(np.array([self.before]))[0]))

    def _driven_by(self, change: Callable[[Array], Array], before: float) -> Excitation:
        """The same, driven by what a ``change`` makes of the input (n,), one moment after the other."""
        within = self.within
        if within is None:
            drive = change(self.pressure)
        else:
            within = change(within.T.ravel()).reshape(within.T.shape).T
            drive = within[-1]
        course = _course(drive, before, self.powers, self.jumps, self.runs, within)
        course = through(self.sensor, course, self.step)
        return replace(self, course=course)

    @property
    def sensor_gain(self) -> float:
        """The sensor's gain at rest."""
        return self.sensor.dc_gain


def prepare(experiment: Experiment, rig: Rig, powers: int = 1, before: float | None = None) -> Excitation:
    """Make an experiment ready for fitting.

    Input is the measured pressure where logged, else the command through the regulator; fitted is the
    curvature where logged, else the output through the sensor. ``before`` is the input's value ahead of the
    first sample (None: as at the first sample). Raises LogError where a signal is constant or too short.
    """
    _check(experiment)
    reference = varying_reference(experiment)
    pressure, level_before, jumps, between, role = _input(experiment, rig, before, reference is not None)
    within = _within(experiment, rig, role, pressure, level_before)
    fitted = "curvature" if "curvature" in experiment else "output"
    sensor = rig.sensor if fitted == "output" else UNITY
    if sensor != UNITY:
        _check_rest(sensor)
    course = _course(pressure, level_before, powers, jumps, between, within)
    course = through(sensor, course, experiment.sample_time)
    return Excitation(
        experiment.name,
        experiment.sample_time,
        pressure,
        experiment[fitted],
        course,
        jumps,
        between,
        level_before,
        _level(pressure, level_before),
        role,
        fitted,
        sensor,
        experiment.notes,
        before is None,
        reference,
        rig.delays.regulator * (role == "command") + rig.delays.sensor * (fitted == "output"),
        abs(level_before) > _AT_REST * float(np.abs(pressure).max()),
        within,
    )


def _course(
    drive: Array, before: float, powers: int, jumps: Bools, between: Between, within: Array | None
) -> Course:
    """The course of the powers of a ``drive`` (n,), known ``within`` its samples (7, n) or not."""
    known = drive if within is None else within
    above = np.array([known**m - before**m for m in range(1, powers + 1)])
    return course_of(above, jumps, between) if within is None else course_within(above)


def possible_rests(experiment: Experiment) -> tuple[float | None, ...]:
    """The values the input may have had before the first sample: that of the first sample, and 0 where it
    differs.

    A log that begins with the step itself starts at rest at 0 with its input already up.
    """
    values = experiment["pressure" if "pressure" in experiment else "command"]
    if np.ptp(values) == 0.0:
        return (0.0,)
    return (None,) if abs(values[0]) <= _AT_REST * np.abs(values).max() else (None, 0.0)


def varying_reference(experiment: Experiment) -> Array | None:
    """What a closed loop was asked for, whether it was logged or shows in the command alone."""
    if "reference" in experiment and np.ptp(experiment["reference"]) > 0.0:
        return experiment["reference"]
    return unlogged_reference(experiment)


def _check(experiment: Experiment) -> None:
    if "curvature" not in experiment:
        check_output(experiment)
    if len(experiment) < _FEWEST:
        raise LogError(experiment.name, f"has {len(experiment)} samples", f"give at least {_FEWEST}")
    fitted = experiment["curvature" if "curvature" in experiment else "output"]
    if np.ptp(fitted) == 0.0:
        raise LogError(
            experiment.name, f"has an output of {fitted[0]:g} throughout", "check the sensor and the column"
        )
    if not is_driven(experiment):
        role = "pressure" if "pressure" in experiment else "command"
        what = "of 0 throughout" if not np.any(experiment[role]) else "that only its own noise moves"
        raise LogError(experiment.name, f"has a {role} {what}", "give a log in which the rig is driven")


def is_driven(experiment: Experiment) -> bool:
    """Whether the input does anything: it is not 0 throughout, nor, measured, its own noise about one level.

    What follows from a past alone shows no gain, and with a gain of any size a first reading's noise is a
    step.
    """
    if "pressure" not in experiment:
        return bool(np.any(experiment["command"]))
    values = experiment["pressure"]
    commanded = "command" in experiment and bool(np.ptp(experiment["command"]) > 0.0)
    held_up = abs(float(np.median(values))) > _NOISE * noise_level(values)
    return bool(np.any(values)) and (
        commanded or held_up or float(np.ptp(values)) > _NOISE * noise_level(values)
    )


def _input(
    experiment: Experiment, rig: Rig, before: float | None, closed: bool
) -> tuple[Array, float, Bools, Between, str]:
    """The actuator's input: (samples, value before them, where it jumps, what it does between, its role);
    ``closed``: in a loop."""
    if "pressure" in experiment:
        values, jumps = _measured(experiment, rig, closed)
        rest = _rest_of(experiment["pressure"]) if before is None else before
        if before is None:
            values = np.concatenate([[rest], values[1:]])  # the first sample's noise is no step
        return values, rest, jumps, Between.SMOOTH, "pressure"
    command, between = experiment["command"], Between.HELD if rig.between is None else rig.between
    rest = float(command[0]) if before is None else before
    none = np.zeros(len(command), bool)
    if rig.regulator == UNITY:
        return command, rest, none, between, "command"
    gain = rig.regulator.dc_gain
    if not np.isfinite(gain):
        raise FitError("regulator", "integrates, so it has no rest to start from", "log the pressure")
    moved = run_stage("regulator", rig.regulator, experiment.sample_time, hold_of(rig), command - rest)
    return gain * rest + moved, gain * rest, none, Between.SMOOTH, "command"


def _within(experiment: Experiment, rig: Rig, role: str, pressure: Array, before: float) -> Array | None:
    """The pressure (n,) within each sample (7, n), as a quick regulator makes it of a held command, from rest
    at ``before``; None where that is not known."""
    step, regulator = experiment.sample_time, rig.regulator
    if "command" not in experiment or not is_held(rig) or not kinks(rig, ("regulator",), step):
        return None
    command = experiment["command"]
    if role == "command":
        return before + by_regulator(regulator, step, command - before / regulator.dc_gain, 0.0)
    late = rig.delays.regulator - rig.lead
    made = scaled_to(pressure, by_regulator(regulator, step, command - command[0], late))
    return read_within(pressure, made, np.arange(len(command)) == 0)


def _measured(experiment: Experiment, rig: Rig, closed: bool) -> tuple[Array, Bools]:
    """The measured pressure without its noise, and where it jumps. What a controller makes of noise moves the
    rig: in a closed loop it is as it was measured."""
    values = experiment["pressure"]
    jumps = jumps_of(values)
    if closed:
        return values, jumps
    known = _by_regulator(experiment, rig)
    smooth = without_noise(values, jumps, known)
    return smooth, jumps if known is None or smooth is values else jumps_of(smooth)


def _by_regulator(experiment: Experiment, rig: Rig) -> Array | None:
    """What the regulator makes of the command (n,), from rest; None where either is not known."""
    if "command" not in experiment or rig.regulator == UNITY or not np.isfinite(rig.regulator.dc_gain):
        return None
    command, places = experiment["command"], np.arange(len(experiment["command"]))
    moved = run_stage("regulator", rig.regulator, experiment.sample_time, hold_of(rig), command - command[0])
    made: Array = np.interp(places - rig.delays.regulator / experiment.sample_time, places, moved)
    return made


def is_held(rig: Rig) -> bool:
    """Whether a command is held between its samples: so it is taken where the rig does not say."""
    return rig.between in (None, Between.HELD)


def hold_of(rig: Rig) -> Literal["zero", "linear"]:
    """What a command does between its samples, in front of a regulator."""
    return "zero" if is_held(rig) else "linear"


def _check_rest(sensor: TransferFunction) -> None:
    if not np.isfinite(sensor.dc_gain):
        raise FitError("sensor", "integrates, so it has no rest to start from", "log the curvature")


def _rest_of(values: Array) -> float:
    """The input at the first sample, without its noise.

    The mean of the samples before the input moves; where it moves at once, the begin of a line through the
    first few, if they are noise about one.
    """
    away = np.abs(values - values[0]) >= _AWAY * np.ptp(values)
    resting = values[: int(_SURELY * np.argmax(away))]
    if len(resting) < _SEVERAL or np.ptp(resting) == 0.0:
        return _line_at_first(values)
    place = np.arange(len(resting)) - 0.5 * (len(resting) - 1)
    slope = float(place @ resting) / float(place @ place)
    steepest = _DRIFT * float(np.std(resting)) / math.sqrt(float(place @ place))
    return float(np.mean(resting)) if abs(slope) <= steepest else _line_at_first(values)


def _line_at_first(values: Array) -> float:
    noise, first = noise_level(values), values[:_FOLLOWED]
    if noise == 0.0 or np.any(jumps_of(values)[:_FOLLOWED]):
        return float(values[0])
    slope, begin = np.polyfit(np.arange(len(first)), first, 1)
    off = first - begin - slope * np.arange(len(first))
    return float(begin) if np.abs(off).max() <= _DRIFT * noise else float(values[0])


def _level(pressure: Array, before: float) -> float:
    """The median of the input where it is more than half-way to its farthest value."""
    away = np.abs(pressure - before)
    return float(np.median(pressure[away >= 0.5 * away.max()]))
