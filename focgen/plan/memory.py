"""Exponential memories for a controller's fractional terms, as an arithmetic can hold them.

Fixed point: a rate q = 1 − p is an integer count a of 2^−bits, and only rates that are such counts are used,
so the poles are exact; their weights and certificates are found for them. Slow modes, whose rates would lose
digits, stand in a bank of their own with more bits. Floating point: rates are numbers of the type.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from focgen.arrays import Array, Ints
from focgen.control.controller import ARITHMETICS, Controller
from focgen.errors import PlanError
from focgen.fractional.continuous import (
    DEFAULT_BAND,
    OPERATORS,
    ContinuousMemory,
    check_band,
    fit_band,
)
from focgen.fractional.elementary import power, total
from focgen.fractional.exponential import CLOSEST_TO_INTEGER, ExponentialMemory
from focgen.fractional.exponential_rounded import fit_rounded
from focgen.fractional.transfer import Polynomial, Term
from focgen.fractional.weights import gl_weights
from focgen.plan.canonical import Realisation, Table, Tables, realise, tables_by
from focgen.plan.formats import runtime
from focgen.plan.mode_sums import Modes, response_of

_LARGEST_ORDER = 2.0

Memory = ExponentialMemory | ContinuousMemory


@dataclass(frozen=True)
class Speed:
    """How modes with rates below ``below`` are held, as :class:`~focgen.plan.plan.Bank` has it.

    Fixed: ``rate_bits`` of a, which counts 2^−(``to_drive`` + ``rate_shift``), and ``state_bits`` of L.
    Floating: only ``compensated``.
    """

    below: float
    rate_bits: int = 0
    to_drive: int = 0
    rate_shift: int = 0
    state_bits: int = 0
    compensated: bool = False

    def nearest(self, rates: Array) -> Array:
        """The nearest rates, as counts."""
        counts = np.rint(rates * 2.0 ** (self.to_drive + self.rate_shift))
        made: Array = np.clip(counts, 1.0, 2.0 ** (self.rate_bits - 1) - 1.0)
        return made


SPEEDS = {
    "f64": (Speed(2.0),),
    "f32": (Speed(2.0), Speed(2.0**-4, compensated=True)),
    "q31": (Speed(2.0, 32, 31, 0, 64), Speed(2.0**-18, 32, 31, 18, 64)),
    "q15": (Speed(2.0, 16, 15, 0, 32), Speed(2.0**-8, 32, 39, 0, 64)),
}
"""How each arithmetic holds modes, the fastest first."""


def by_speed(arithmetic: str, rates: Array) -> list[tuple[Speed, Ints]]:
    """Which of ``rates`` (falling) are held in which way; ways without any are left out."""
    speeds = SPEEDS[runtime(arithmetic)]
    slower = [np.searchsorted(-rates, -s.below, side="right") for s in speeds] + [len(rates)]
    places = [np.arange(a, b) for a, b in pairwise(slower)]
    return [(speed, place) for speed, place in zip(speeds, places) if len(place)]


def _rounded(arithmetic: str) -> Callable[[Array], Array]:
    """The function that takes rates to those the arithmetic holds; one object for each, so that fits are
    kept."""
    kind = {"f64": np.float64, "f32": np.float32}.get(arithmetic)

    def held(rates: Array) -> Array:
        if kind is not None:
            return rates.astype(kind).astype(float)
        found = np.empty(len(rates))
        for speed, place in by_speed(arithmetic, rates):
            found[place] = speed.nearest(rates[place]) * 2.0 ** -(speed.to_drive + speed.rate_shift)
        return found

    return held


ROUNDED = {arithmetic: _rounded(runtime(arithmetic)) for arithmetic in ARITHMETICS}
"""By arithmetic, what takes rates, falling, to those it holds."""


def memories_of(
    controller: Controller, arithmetic: str, tolerance: float, horizon: int
) -> tuple[ExponentialMemory, ...]:
    """One memory for each fractional order of the transfer function, the lowest order first.

    Raises PlanError where an order is beyond 2, or tolerance and horizon cannot be met.
    """
    orders = _fractional_orders(controller)
    return tuple(_fitted(controller, order, arithmetic, tolerance, horizon) for order in orders)


def checked_band(
    controller: Controller, operator: str, band: tuple[float, float] | None
) -> tuple[float, float] | None:
    """The band in rad/s that a controller's operator is fitted to, None for "gl".

    Raises PlanError for an operator that is unknown or needs another memory, and for a band of "gl".
    """
    where, step = controller.name, controller.sample_time
    if operator not in OPERATORS:
        raise PlanError(where, f"the operator {operator!r} is unknown", f"choose {' or '.join(OPERATORS)}")
    if operator == "gl":
        if band is not None:
            raise PlanError(where, "a band belongs to the operator continuous", "choose that or leave it out")
        return None
    if controller.memory != "exponential":
        raise PlanError(where, "the operator continuous needs exponential memory", "choose that memory")
    low, high = band or (end / step for end in DEFAULT_BAND)
    try:
        check_band(low * step, high * step)
    except ValueError as reason:
        raise PlanError(where, f"has the band {low:g} to {high:g} rad/s: {reason}", "give another") from None
    return float(low), float(high)


def band_memories_of(
    controller: Controller, arithmetic: str, tolerance: float, band: tuple[float, float]
) -> tuple[ContinuousMemory, ...]:
    """The same, fitted to (jω)^β itself in a ``band`` in rad/s.

    Raises PlanError where an order is beyond 2, or the tolerance cannot be met in the band.
    """
    low, high = (end * controller.sample_time for end in band)
    found = []
    for order in _fractional_orders(controller):
        try:
            found.append(fit_band(order, low, high, tolerance, ROUNDED[arithmetic]))
        except ValueError as reason:
            remedy = _whole_remedy(order) or "allow a larger tolerance, another band, or use the operator gl"
            what = f"order {order:g} has no memory that follows it: {reason}"
            raise PlanError(controller.name, what, remedy) from None
    return tuple(found)


def _fractional_orders(controller: Controller) -> list[float]:
    orders = sorted({t.order for t in _terms(realise(controller)) if not t.order.is_integer()})
    if orders and orders[-1] > _LARGEST_ORDER:
        what = f"has the order {orders[-1]!r} over its lowest: exponential memory ends at 2"
        remedy = _whole_remedy(orders[-1]) or "use memory short"
        raise PlanError(f"{controller.name} [transfer]", what, remedy)
    return orders


def _whole_remedy(order: float) -> str:
    """What helps an order that no sum of exponentials tells from a whole one; nothing for any other."""
    whole = round(order)
    return f"write {whole}, or use memory short" if abs(order - whole) < CLOSEST_TO_INTEGER else ""


def _terms(form: Realisation) -> Polynomial:
    return form.direct + form.rest + form.den


def _fitted(
    controller: Controller, order: float, arithmetic: str, tolerance: float, horizon: int
) -> ExponentialMemory:
    try:
        return fit_rounded(order, horizon, tolerance, ROUNDED[arithmetic])
    except ValueError as reason:
        other = "allow a larger tolerance, a shorter horizon, or choose another arithmetic"
        remedy = _whole_remedy(order) or other
        what = f"order {order!r} has no exponential memory: {reason}"
        raise PlanError(controller.name, what, remedy) from None


def exponential_tables(controller: Controller, memories: tuple[Memory, ...]) -> Tables:
    """The controller's terms as taps and modes. Raises PlanError as :func:`focgen.plan.canonical.tables`."""
    by_order = {memory.order: memory for memory in memories}
    return tables_by(controller, lambda terms: _folded(terms, controller.sample_time, by_order))


def _folded(terms: Polynomial, step: float, memories: dict[float, Memory]) -> Table:
    """Whole orders, and lag 0 of the others with their differences, as taps."""
    count = max(math.ceil(t.order) for t in terms)
    leads = [t.coefficient * power(step, -t.order) * _lead(t.order, memories) for t in terms]
    each = [lead * _differences(math.ceil(t.order), count) for lead, t in zip(leads, terms)]
    taps, size = total(each), total(np.abs(each))
    keep = int(np.flatnonzero(size)[-1]) + 1
    modes = tuple(_modes(t, step, memories[t.order]) for t in terms if t.order in memories)
    return Table(taps[:keep], size[:keep], modes, response_of(taps[:keep], 0, modes))


def _lead(order: float, memories: dict[float, Memory]) -> float:
    return memories[order].lead if order in memories else 1.0


def _differences(m: int, count: int) -> Array:
    """The weights of ∇^m at the lags 0 … ``count``."""
    return gl_weights(float(m), count)


def _modes(term: Term, step: float, memory: Memory) -> Modes:
    factor = term.coefficient * power(step, -term.order)
    return Modes(memory.order, 1.0 - np.array(memory.poles), factor * np.array(memory.weights))
