"""Short memory where it hurts: in the denominator, simulating a plant over hours."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from focgen.control.controller import Controller
from focgen.control.equilibrium import actuator_of
from focgen.fractional.exponential import ExponentialMemory, fit_exponential
from focgen.fractional.responses import step_response
from focgen.fractional.simulation import GrunwaldLetnikov, gl_operator
from focgen.fractional.transfer import TransferFunction
from focgen.rig.model import Rig
from focgen.studies.model import PlantRow, Variant

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


def plant_times(sample_time: float) -> np.ndarray:
    """The samples that are drawn, spread evenly in log time; shape (n,), whole numbers."""
    last = plant_samples(sample_time) - 1
    first = max(1, round(_SECONDS_LEAST / sample_time))
    return np.unique(np.rint(np.geomspace(first, last, _DRAWN)).astype(np.int64))


@lru_cache(maxsize=4)
def exact_step(plant: TransferFunction, sample_time: float) -> np.ndarray:
    """The continuous plant's step response at :func:`plant_times`."""
    return step_response(plant, plant_times(sample_time) * sample_time)


def plant_row(plant: TransferFunction, variant: Variant) -> PlantRow:
    """Simulate the plant in float64 with the variant's memory."""
    h, count = variant.sample_time, plant_samples(variant.sample_time)
    if variant.memory == "exponential":
        recursion = ExponentialRecursion(plant, h, variant.horizon, variant.tolerance)
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


class ExponentialRecursion:
    """Eq. (10) with every fractional power as an exponential memory, in float64, from rest at 0.

    ``horizon`` in samples and ``tolerance`` as :func:`focgen.fractional.exponential.fit_exponential` has
    them. Raises ValueError as that does, and for an improper transfer function.
    """

    def __init__(self, transfer: TransferFunction, step: float, horizon: int, tolerance: float):
        if not transfer.is_proper:
            raise ValueError("the transfer function is improper")
        self._num, self._den = (
            _Terms(terms, step, horizon, tolerance) for terms in (transfer.num, transfer.den)
        )
        self.states = self._num.states + self._den.states

    def run(self, u) -> np.ndarray:
        """Return the output for the samples ``u``, both (samples,)."""
        forced = self._num.run(np.asarray(u, dtype=float))
        return self._den.solve(forced)


class _Terms:
    """Σ c s^β as differences of up to second order and exponentials of them."""

    def __init__(self, terms, step: float, horizon: int, tolerance: float):
        self.present = 0.0
        self.whole = np.zeros(max((math.ceil(t.order) for t in terms), default=0) + 1)  # of x, by lag
        self.modes: list[tuple[float, ExponentialMemory]] = []
        for term in terms:
            factor = term.coefficient * step**-term.order
            self.present += factor
            if term.order.is_integer():
                differences = int(term.order)
            else:
                memory = fit_exponential(term.order, horizon, tolerance)
                self.modes.append((factor, memory))
                differences = memory.differences
            self.whole[: differences + 1] += factor * _binomial(differences)
        self.states = sum(memory.states for _, memory in self.modes)

    def run(self, x: np.ndarray) -> np.ndarray:
        y = np.convolve(self.whole, x)[: len(x)]
        for factor, memory in self.modes:
            bare = np.convolve(_binomial(memory.differences), x)[: len(x)]
            y += factor * (memory.run(x) - bare)
        return y

    def solve(self, forced: np.ndarray) -> np.ndarray:
        """x of Σ c D^β x = ``forced``, sample by sample."""
        poles = np.concatenate([np.array(m.poles) for _, m in self.modes] or [np.zeros(0)])
        weights = np.concatenate([f * np.array(m.weights) for f, m in self.modes] or [np.zeros(0)])
        order = np.concatenate([np.full(m.states, m.differences) for _, m in self.modes] or [np.zeros(0)])
        taps = np.array([np.pad(_binomial(int(d)), (0, 8))[: len(self.whole)] for d in order]).reshape(
            len(order), len(self.whole)
        )
        states, past, out = np.zeros(len(poles)), np.zeros(len(self.whole)), np.empty(len(forced))
        lead = self.whole[0]
        for k, value in enumerate(forced.tolist()):
            past[1:] = past[:-1]
            past[0] = 0.0
            past[0] = out[k] = (value - self.whole @ past - weights @ states) / lead
            states = poles * states + taps @ past
        return out


def _binomial(differences: int) -> np.ndarray:
    return np.array([(-1.0) ** j * math.comb(differences, j) for j in range(differences + 1)])
