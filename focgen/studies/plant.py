"""Short memory where it hurts: in the denominator, simulating a plant over hours."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from focgen.arrays import Array
from focgen.control.controller import Controller
from focgen.control.equilibrium import actuator_of
from focgen.fractional.recursion import ExponentialRecursion
from focgen.fractional.responses import step_response
from focgen.fractional.simulation import GrunwaldLetnikov, gl_operator
from focgen.fractional.transfer import TransferFunction
from focgen.present import present
from focgen.rig.rig import Rig
from focgen.studies.results import PlantRow, Variant

HOURS = 1.0
_MOST = 400_000  # samples
_TIMES = {"1 s": 1.0, "10 s": 10.0, "100 s": 100.0, "1000 s": 1000.0, "1 h": 3600.0}
_DRAWN = 160
_SECONDS_LEAST = 0.1


def plant_of(controller: Controller, rig: Rig | None) -> TransferFunction | None:
    """The rig's actuator, or what the controller inverts, brought to the static gain 1.

    None where that has no fractional denominator, no static gain, or is improper.
    """
    given = actuator_of(rig).dynamics if rig is not None else controller.transfer.inverse()
    gain = given.dc_gain
    fractional = any(not term.order.is_integer() for term in given.den)
    if not (fractional and given.is_proper and math.isfinite(gain) and gain != 0.0):
        return None
    return given * (1.0 / gain)


def plant_samples(sample_time: float) -> int:
    """An hour, or as many samples as can be simulated."""
    return min(math.ceil(HOURS * 3600.0 / sample_time), _MOST) + 1


def plant_times(sample_time: float) -> Array:
    """The samples that are drawn, spread evenly in log time; shape (n,), whole numbers."""
    last = plant_samples(sample_time) - 1
    first = max(1, round(_SECONDS_LEAST / sample_time))
    return np.unique(np.rint(np.geomspace(first, last, _DRAWN)).astype(np.int64))


@lru_cache(maxsize=4)
def exact_step(plant: TransferFunction, sample_time: float) -> Array:
    """The continuous plant's step response at :func:`plant_times`."""
    return step_response(plant, plant_times(sample_time) * sample_time)


def plant_row(plant: TransferFunction, variant: Variant) -> PlantRow:
    """Simulate the plant in float64 with the variant's memory."""
    h, count = variant.sample_time, plant_samples(variant.sample_time)
    if variant.memory == "exponential":
        recursion = ExponentialRecursion(plant, h, present(variant.horizon), present(variant.tolerance))
        output, rest, states = recursion.run(np.ones(count)), 1.0, recursion.states
    else:
        output = GrunwaldLetnikov(plant, h, variant.length).run(np.ones(count))
        rest, states = _at_rest(plant, h, variant.length), None
    places = plant_times(h)
    seconds = {label: round(t / h) for label, t in _TIMES.items() if h <= t and round(t / h) < count}
    exact = step_response(plant, np.array(list(seconds.values())) * h)
    errors = {label: float(output[k] - e) for (label, k), e in zip(seconds.items(), exact)}
    return PlantRow(variant.memory, variant.length, states, rest, errors, tuple(map(float, output[places])))


def _at_rest(plant: TransferFunction, h: float, length: int | None) -> float:
    if length is None:
        return 1.0
    num, den = (math.fsum(gl_operator(terms, h, length)) for terms in (plant.num, plant.den))
    return num / den
