"""What a stage makes of a signal on its way."""

from __future__ import annotations

from typing import Literal

import numpy as np

from focgen.arrays import Array
from focgen.errors import FitError
from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Course, course_of
from focgen.rig.rig import UNITY


def run_stage(
    name: str, stage: TransferFunction, step: float, hold: Literal["zero", "linear"], signal: Array
) -> Array:
    """What the stage of that ``name`` makes of its input (n,), from rest. Raises FitError where it cannot be
    simulated."""
    try:
        return Convolution(stage, step, hold).run(signal)
    except ArithmeticError as reason:
        raise FitError(name, f"cannot be simulated ({reason})", "check its num and den") from None


def through(sensor: TransferFunction, course: Course, step: float) -> Course:
    """The course of what the sensor makes of ``course``.

    A bend of coefficient c holds c/6 of a sample less than the straight line; what lies at both its ends is
    lowered by c/12 instead, which a stage that is slow against the samples answers alike.
    """
    if sensor == UNITY:
        return course
    less = np.zeros_like(course.values)
    if course.bends is not None:
        less += course.bends / 12.0
        less[:, :-1] += course.bends[:, 1:] / 12.0
    jumped = np.cumsum(course.jumps, axis=1)
    rows = [
        run_stage("sensor", sensor, step, "zero", up) + run_stage("sensor", sensor, step, "linear", rest)
        for up, rest in zip(jumped, course.values - jumped - less)
    ]
    at_once = np.any(course.jumps != 0.0, axis=0) & _feeds_through(sensor)
    return course_of(np.array(rows), at_once)


def _feeds_through(stage: TransferFunction) -> bool:
    return stage.num[0].order == stage.den[0].order
