"""Controllers that run in a simulated loop, one sample at a time, many loops side by side."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from focgen.arrays import Array
from focgen.control.controller import Controller
from focgen.loop.online import OnlineConvolution
from focgen.plan.canonical import Table, Tables, inner_limits, realise, tables
from focgen.plan.setpoint import rate_of


class Stepper(Protocol):
    """What the loop asks of a controller: one sample of every column, arrays of shape (columns,)."""

    def step(self, reference: Array, measurement: Array, schedule: Array) -> Array:
        """Return the output u, physical."""


class FloatStepper:
    """The controller in float64: Grünwald–Letnikov sums of memory ``length`` (None: infinite), no rounding
    planned.

    Starts at rest with error 0 at the output ``start`` and the set point ``reference``, for up to ``samples``
    samples of ``columns`` loops.
    ``gain`` replaces the controller's gain: it takes the scheduling signal (columns,) and returns gains.
    Raises PlanError where the transfer function cannot be realised.
    """

    def __init__(
        self,
        controller: Controller,
        samples: int,
        columns: int,
        start: float = 0.0,
        length: int | None = None,
        gain: Callable[..., Any] | None = None,
        reference: float = 0.0,
    ) -> None:
        memory = samples if length is None else min(length, samples)
        parts = tables(controller, max(1, memory))
        limits = inner_limits(controller, _at_rest(controller, parts, length))
        self._sums = _Sums(parts, columns, samples, limits)
        self._gain = gain or controller.gain_at
        self._limits = controller.ranges.output
        self._half = 0.5 * controller.sample_time if controller.integrator else None
        slew = controller.slew_limit
        self._slew = np.inf if slew is None else slew * controller.sample_time
        seconds = controller.setpoint_filter
        self._rate = 1.0 if seconds is None else rate_of(seconds, controller.sample_time)
        self._aim = np.full(columns, float(reference))
        self._integral = np.full(columns, float(start))
        self._previous = np.zeros(columns)

    def step(self, reference: Array, measurement: Array, schedule: Array) -> Array:
        """One sample of all loops: physical signals (columns,) in, the outputs (columns,) out."""
        self._aim = self._aim + self._rate * (reference - self._aim)
        filtered = self._sums.step(self._aim - measurement)
        if self._half is None:
            made: Array = np.clip(self._gain(schedule) * filtered, *self._limits)
            return made
        increment = self._half * self._gain(schedule) * filtered
        change = np.clip(increment + self._previous, -self._slew, self._slew)
        self._integral = np.clip(self._integral + change, *self._limits)
        self._previous = increment
        return self._integral


def _at_rest(controller: Controller, parts: Tables, length: int | None) -> float:
    """A(1) of a memory of ``length`` (None: infinite), also where a run is shorter."""
    if length is None:
        return realise(controller).constant / parts.normaliser
    return tables(controller, max(1, length)).at_rest


class _Sums:
    """The transfer function: direct and inner sums of the error, and the recursion of the filtered signal."""

    def __init__(self, parts: Tables, columns: int, samples: int, limits: tuple[float, float]) -> None:
        def convolution(table: Table | None) -> OnlineConvolution | None:
            return (
                None if table is None else OnlineConvolution(table.weights[:, None, None], columns, samples)
            )

        self._direct, self._rest = convolution(parts.direct), convolution(parts.rest)
        self._feedback = convolution(parts.feedback)
        self._low, self._high = limits
        self._inner, self._previous = np.zeros(columns), np.zeros(columns)

    def step(self, error: Array) -> Array:
        total = np.zeros_like(error) if self._direct is None else self._direct.step(error[None])[0]
        if self._rest is not None:
            increment = self._rest.step(error[None])[0]
            self._inner = np.clip(self._inner + increment + self._previous, self._low, self._high)
            self._previous = increment
            total = total + self._inner
        if self._feedback is not None:
            total = total - self._feedback.past()[0]
            self._feedback.push(total[None])
        return total
