"""The closed loop of Fig. 9: set point → controller → hold → regulator → K(p)p → actuator → sensor →
controller.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import oaconvolve

from focgen.arrays import Array
from focgen.control.equilibrium import Equilibrium, actuator_of
from focgen.loop.chain import Chain
from focgen.loop.online import OnlineConvolution
from focgen.loop.stepper import Stepper


@dataclass(frozen=True, eq=False)
class LoopRun:
    """Signals at the controller's samples, each of shape (n, columns); sample k is at k · ``sample_time`` s.

    ``command`` is what acts from that sample on. ``peak_pressure`` (columns,) is that farthest from 0 over
    the whole run, between samples too. ``curvature`` is None where it was not asked for.
    """

    sample_time: float
    reference: Array
    command: Array
    pressure: Array
    curvature: Array | None
    output: Array
    peak_pressure: Array

    @property
    def time(self) -> Array:
        """Seconds, shape (n,)."""
        return np.arange(len(self.output)) * self.sample_time


def run_loop(
    chain: Chain,
    stepper: Stepper,
    reference: Array,
    start: Equilibrium,
    delay: int = 1,
    pressure_known: bool = True,
    curvature: bool = True,
) -> LoopRun:
    """Close the loop from rest at ``start`` and follow ``reference``, shape (n, columns).

    At sample k the controller reads output and pressure; what it computes acts at once (``delay`` 0) or from
    the next sample on (1). Where the rig does not measure the pressure (``pressure_known`` False) the
    controller is scheduled by its latest command through the regulator's static gain.
    """
    loop = _Loop(chain, reference.shape[1], len(reference), start, delay, pressure_known)
    return loop.run(stepper, reference, curvature)


def farthest(pressure: Array) -> Array:
    """Of pressures (n, columns) those farthest from 0 (columns,): a vacuum's peak is its lowest."""
    high, low = pressure.max(axis=0), pressure.min(axis=0)
    found: Array = np.where(high >= -low, high, low)
    return found


class _Loop:
    def __init__(
        self, chain: Chain, columns: int, samples: int, start: Equilibrium, delay: int, known: bool
    ) -> None:
        self.chain, self.start, self.delay, self.known = chain, start, delay, known
        self.actuator = actuator_of(chain.rig)
        self.rest_drive = self.actuator.drive(start.pressure)
        self.regulator = OnlineConvolution(chain.pressure[:samples], columns, samples)
        self.plant = OnlineConvolution(chain.output[:samples], columns, samples)
        self.drive = np.zeros((samples, chain.substeps + 1, columns))
        self.ends = np.full((2, columns), start.pressure)  # the highest pressure, and the lowest

    def run(self, stepper: Stepper, reference: Array, curvature: bool) -> LoopRun:
        command = np.full(reference.shape, self.start.command)
        pressure, output = (
            np.full(reference.shape, self.start.pressure),
            np.full(reference.shape, self.start.output),
        )
        waiting = command[0]
        for k in range(len(reference)):
            schedule = pressure[k] if self.known else waiting * self.chain.rig.regulator.dc_gain
            computed = stepper.step(reference[k], output[k], schedule)
            command[k] = computed if self.delay == 0 else waiting
            waiting = computed
            ahead = self._advance(k, command[k])
            if k + 1 < len(reference):
                pressure[k + 1], output[k + 1] = ahead
        bent = self._curvature() if curvature else None
        return LoopRun(
            self.chain.sample_time, reference, command, pressure, bent, output, farthest(self.ends)
        )

    def _advance(self, k: int, command: Array) -> tuple[Array, Array]:
        """Hold ``command`` over sample k; return pressure and output at its end."""
        pressure = self.start.pressure + self.regulator.step(command[None] - self.start.command)
        np.maximum(self.ends[0], pressure.max(axis=0), out=self.ends[0])
        np.minimum(self.ends[1], pressure.min(axis=0), out=self.ends[1])
        inside = pressure[: self.chain.substeps + 1]  # the last row may be one of what is measured, late
        self.drive[k] = self.actuator.drive(inside) - self.rest_drive
        return pressure[-1], self.start.output + self.plant.step(self.drive[k])[0]

    def _curvature(self) -> Array:
        kernel = self.chain.curvature[: len(self.drive), 0, :, None]
        moved = oaconvolve(kernel, self.drive, axes=0)[: len(self.drive) - 1].sum(axis=1)
        settled = self.rest_drive * self.actuator.dynamics.dc_gain if self.rest_drive else 0.0
        return settled + self.actuator.offset + np.concatenate([np.zeros((1, moved.shape[1])), moved])
