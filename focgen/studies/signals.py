"""The four inputs of the open-loop comparison, and what infinite memory makes of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import fftconvolve

from focgen.arrays import Array
from focgen.control.controller import Controller
from focgen.fractional.weights import gl_weights
from focgen.plan.scenario import Scenario
from focgen.studies.results import INPUTS

_PERIOD = 500  # samples of the sine's period at the controller's own sample time: 0.2 Hz at 10 ms
_SEED = 20


@dataclass(frozen=True, eq=False)
class Inputs:
    """``error`` (4, samples): step, ramp, sine and white noise within ±``amplitude``, physical, from rest."""

    sample_time: float
    amplitude: float
    error: Array
    scenario: Scenario


def signed(controller: Controller) -> Controller:
    """The controller; where its ranges hold errors of one sign only, with ranges that hold both."""
    (r0, r1), (m0, m1) = controller.ranges.reference, controller.ranges.measurement
    if min(r1 - m0, m1 - r0) > 0.0:
        return controller
    half = 0.5 * max(r1 - m0, m1 - r0)
    ranges = replace(controller.ranges, reference=(-half, half), measurement=(-half, half))
    return replace(controller, ranges=ranges)


def inputs(controller: Controller, own: float, samples: int) -> Inputs:
    """The inputs at the controller's sample time: ``samples`` at ``own`` s, as many seconds at another.

    The amplitude is the largest error of either sign, and where the ramp ends. ``controller`` is a signed one
    (:func:`signed`). Set point and measurement share the error so that each stays in its range;
    the schedule, where there is one, stands where the gain is largest.
    """
    count = max(2, round(samples * own / controller.sample_time))
    k = np.arange(count)
    turn = 2.0 * np.pi * k * controller.sample_time / (_PERIOD * own)
    noise = np.random.default_rng(_SEED).uniform(-1.0, 1.0, count)
    shape = {"step": np.ones(count), "ramp": k / (count - 1.0), "sine": np.sin(turn), "noise": noise}
    unit = np.array([shape[name] for name in INPUTS])
    (r0, r1), (m0, m1) = controller.ranges.reference, controller.ranges.measurement
    amplitude = min(r1 - m0, m1 - r0)
    error = amplitude * unit
    return Inputs(controller.sample_time, amplitude, error, _scenario(controller, error))


def _scenario(controller: Controller, error: Array) -> Scenario:
    (r0, r1), (m0, m1) = controller.ranges.reference, controller.ranges.measurement
    reference = np.clip(0.5 * (m0 + m1) + error, r0, r1)  # the measurement takes what is left: in its range
    sched = None
    if controller.scheduled:
        points, gains = controller.schedule.breakpoints, np.abs(controller.gains)
        sched = np.full(error.shape, points[int(np.argmax(gains))])
    return Scenario(reference, reference - error, sched)


def exact_power(order: float, sample_time: float, x: Array) -> Array:
    """D^``order`` of the rows of ``x``, at rest before: the whole sum of eq. (10), shape (rows, samples)."""
    weights = sample_time**-order * gl_weights(order, x.shape[1] - 1)
    return np.array([fftconvolve(row, weights)[: x.shape[1]] for row in x])


def relative_errors(found: Array, exact: Array) -> dict[str, float]:
    """For each input the largest error relative to the largest exact output, both (4, samples); without those
    whose exact output is 0 throughout.
    """
    off, sizes = np.abs(found - exact).max(axis=1), np.abs(exact).max(axis=1)
    return {name: float(error / size) for name, error, size in zip(INPUTS, off, sizes) if size > 0.0}
