"""Time stamps: checked, recognised as uniform, or resampled."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from focgen.errors import LogError

HELD = ("command", "reference")  # set by a controller and held until the next sample
_JITTER = 0.1  # of a sample: time stamps this close to a uniform grid are rounding, not jitter
_SAME_RATE = 1e-4  # relative
_PLAUSIBLE = 99.0  # a log is recorded at a rate within this factor of the rig's
_LONGEST = 5_000_000  # samples


def check_increasing(time: np.ndarray, where: str, line) -> None:
    """Raise LogError where a time stamp is missing or not later than the one before it."""
    if np.isnan(time).any():
        raise LogError(
            where, f"has no time stamp in {line(int(np.argmax(np.isnan(time))))}", "complete the column"
        )
    steps = np.diff(time)
    if (steps <= 0).any():
        row = int(np.argmax(steps <= 0)) + 1
        what = f"goes from {time[row - 1]:g} to {time[row]:g} s in {line(row)}: time has to increase"
        raise LogError(
            where, what, "sort the rows, or name the column that tells the runs apart as run in [signals]"
        )


def uniform_step(time: np.ndarray) -> float | None:
    """The sample time in s where the stamps are uniform up to rounding, else None."""
    step = (time[-1] - time[0]) / (len(time) - 1)
    off = np.abs(time - time[0] - step * np.arange(len(time))).max()
    return step if off <= _JITTER * step else None


def check_unit(time: np.ndarray, sample_time: float, where: str) -> None:
    """Raise LogError where samples lie so far apart, or so close, that the unit of time must be wrong."""
    ratio = float(np.median(np.diff(time))) / sample_time
    if 1.0 / _PLAUSIBLE < ratio < _PLAUSIBLE:
        return
    unit = " (milliseconds?)" if 500 < ratio < 2000 else " (microseconds?)" if 5e5 < ratio < 2e6 else ""
    what = (
        f"has samples {ratio * sample_time:g} s apart{unit} where the rig's sample_time is {sample_time:g} s"
    )
    raise LogError(where, what, "give time in seconds, or correct sample_time")


def on_grid(
    time: np.ndarray, signals: Mapping[str, np.ndarray], sample_time: float, where: str
) -> tuple[float, dict[str, np.ndarray], tuple[str, ...]]:
    """Return (sample time in s, signals on a uniform grid, notes).

    Uniform logs keep their own rate, whatever the rig's; others are resampled at ``sample_time`` (s):
    command and reference as held, everything else linear between the stamps.
    """
    step = uniform_step(time)
    if step is not None:
        same = abs(step / sample_time - 1.0) < max(
            _SAME_RATE, 2.0 * _JITTER / (len(time) - 1)
        )  # jitter of both ends
        step = sample_time if same else float(f"{step:.6g}")
        notes = (
            ()
            if same
            else (f"sampled every {step:g} s and kept so, though the rig runs at {sample_time:g} s",)
        )
        return step, dict(signals), notes
    count = int((time[-1] - time[0]) / sample_time + 1e-6) + 1
    if count > _LONGEST:
        raise LogError(
            where, f"would take {count} samples of {sample_time:g} s", "shorten the log or set sample_time"
        )
    grid = time[0] + sample_time * np.arange(count)
    resampled = {
        role: _held(grid, time, values) if role in HELD else np.interp(grid, time, values)
        for role, values in signals.items()
    }
    steps = np.diff(time)
    note = (
        f"time stamps not uniform ({steps.min():.3g} to {steps.max():.3g} s apart): "
        f"resampled every {sample_time:g} s"
    )
    return sample_time, resampled, (note,)


def _held(grid: np.ndarray, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    return values[np.maximum(np.searchsorted(time, grid + 1e-9 * (time[-1] - time[0]), side="right") - 1, 0)]
