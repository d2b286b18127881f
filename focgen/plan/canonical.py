"""Any transfer function of eq. (8) in the one form that is realised.

Numerator and denominator are divided by the lowest power of s in the denominator, so that its lowest order is
0. Then

    C(s) = ( Σ b s^β  +  1/s · Σ b s^(β+1) ) / Σ a s^α
             direct, β ≥ 0     rest, −1 ≤ β < 0    den, α ≥ 0, one of them 0

Every power of s is a Grünwald–Letnikov sum over the present and L past samples, eq. (10)–(14); terms that
share a history fold into one table. A term of negative order is a trapezoidal integral of a sum of
non-negative order, so that short memory leaves no steady error: s^−0.9 is 1/s (trapezoid) times s^0.1 (sum).

What that means where orders are whole:

* s is the backward difference (1 − 1/z)/h, and 1/s the trapezoid (h/2)(1 + 1/z)/(1 − 1/z). Where a term's
  order and the controller's integrator cancel, s · 1/s, what runs is their product: the average (1 + 1/z)/2
of two samples.
* 1/(T s + 1) is the backward Euler recursion v_k = (e_k + (T/h) v_{k−1}) / (1 + T/h),
  whatever L ≥ 1 is: the weights of a whole order end at the order, and the tables with them.
* An order is the decimal number that is written: 1.6 less 0.6 is 1. A double beside a whole number is not
  that number: it has a past as long as any other.

The integral of a term of negative order is clamped like that of an ordinary PID controller: to what takes the
output, alone and at rest, from one of its limits to the other at the smallest gain that occurs. Ahead of an
integrator it is clamped to what would take the output across its whole range in one sample. At rest means by
the denominator that runs: a short memory adds its bias to it, and quantised weights add their rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from focgen.arrays import Array
from focgen.control.controller import Controller
from focgen.errors import PlanError
from focgen.fractional.elementary import exact_sum, l1, power, total
from focgen.fractional.transfer import Polynomial, polynomial
from focgen.fractional.weights import gl_weights, short_memory_bias
from focgen.plan.mode_sums import Modes, Response

_HIGHEST = 8.0  # of any order: beyond, h^−β leaves no digits


@dataclass(frozen=True)
class Realisation:
    """The three polynomials of the module's formula; ``rest`` holds the orders after its 1/s is split off."""

    direct: Polynomial
    rest: Polynomial
    den: Polynomial

    @property
    def recursive(self) -> bool:
        """Whether the denominator has dynamics."""
        return len(self.den) > 1

    @property
    def constant(self) -> float:
        """The denominator's coefficient of order 0."""
        return self.den[-1].coefficient

    @property
    def steady_gain(self) -> float:
        """What a constant e gives at rest with infinite memory and the inner integral at 0."""
        return exact_sum([t.coefficient for t in self.direct if t.order == 0.0]) / self.constant


@dataclass(frozen=True)
class Table:
    """Weights by lag from 0 on. ``size`` is Σ|terms| of each: the weight is known to 1e-13 of it.

    With an exponential memory they are the taps alone; ``modes`` has the rest, and ``whole`` the response of
    all.
    """

    weights: Array
    size: Array
    modes: tuple[Modes, ...] = ()
    whole: Response | None = None

    @property
    def response(self) -> Response:
        """Taps and modes by lag from 0 on."""
        return self.whole or Response(self.weights)

    @property
    def l1(self) -> float:
        """Σ |w_j|."""
        return self.response.l1

    @property
    def total(self) -> float:
        """Σ w_j: the gain for a constant; a mode's is 0."""
        return exact_sum(self.weights)


@dataclass(frozen=True)
class Tables:
    """The folded weight tables of a controller at its sample time; ``None`` where there is nothing to sum.

    ``direct`` and ``rest`` make p and r of :mod:`focgen.plan.plan` (h/2 inside ``rest``), ``feedback`` is
    the normalised denominator, 1 at lag 0.
    """

    direct: Table | None
    rest: Table | None
    feedback: Table | None
    normaliser: float

    @property
    def at_rest(self) -> float:
        """A(1): what the denominator makes of a constant 1, positive where the recursion is stable."""
        return self.feedback.total if self.feedback else 1.0


def realise(controller: Controller) -> Realisation:
    """Bring the transfer function to the realisable form.

    Raises PlanError where the numerator is zero, an order is out of reach, or more than one integral is left
    over.
    """
    transfer, where = controller.transfer, f"{controller.name} [transfer]"
    if not transfer.num:
        raise PlanError(
            where, "has a zero numerator: the output would never move", "give num at least one term"
        )
    lowest = transfer.den[-1].order
    num, den = _shifted(transfer.num, lowest), _shifted(transfer.den, lowest)
    if max(num[0].order, den[0].order) > _HIGHEST:
        highest = max(num[0].order, den[0].order)
        raise PlanError(
            where, f"has the order {highest:g} over its lowest", f"orders up to {_HIGHEST:g} can be realised"
        )
    if num[-1].order < -1.0:
        raise PlanError(
            where, f"integrates more than once (order {num[-1].order:g})", _split_remedy(controller)
        )
    rest = polynomial((t.coefficient, t.order + 1.0) for t in num if t.order < 0.0)
    return Realisation(tuple(t for t in num if t.order >= 0.0), rest, den)


def _split_remedy(controller: Controller) -> str:
    if controller.integrator:
        return "leave one integral to the transfer function and one to integrator = true, not more"
    return "set integrator = true and multiply the transfer function by s"


def _shifted(terms: Polynomial, by: float) -> Polynomial:
    """Orders less ``by``, as decimal numbers, each to the double that is nearest."""
    less = Fraction(repr(by))
    return polynomial((c, float(Fraction(repr(order)) - less)) for c, order in terms)


def normaliser(controller: Controller, leads: Mapping[float, float]) -> float:
    """The denominator's coefficient of the present sample, which all weights are divided by; ``leads``: what
    each order's memory weighs the present sample with, 1 where none is given."""
    h, den = controller.sample_time, realise(controller).den
    return exact_sum([t.coefficient * power(h, -t.order) * leads.get(t.order, 1.0) for t in den])


def tables(controller: Controller, length: int) -> Tables:
    """Fold the terms into weight tables for memory length ``length``, eq. (10)–(14).

    Raises PlanError where the coefficient of the present sample vanishes.
    """
    return tables_by(controller, lambda terms: folded(terms, controller.sample_time, length))


def tables_by(controller: Controller, fold: Callable[[Polynomial], Table]) -> Tables:
    """The tables of a controller's polynomials, each made by ``fold``, over the coefficient of the present
    sample.

    Raises PlanError where that vanishes.
    """
    form, h = realise(controller), controller.sample_time
    den = fold(form.den)
    scale = float(den.weights[0])
    if abs(scale) <= 1e-9 * den.size[0]:
        raise PlanError(
            f"{controller.name} [transfer]", "den cancels out at this sample time", "change sample_time"
        )
    return Tables(
        direct=_scaled(fold(form.direct), 1.0 / scale) if form.direct else None,
        rest=_scaled(fold(form.rest), 0.5 * h / scale) if form.rest else None,
        feedback=_scaled(den, 1.0 / scale) if form.recursive else None,
        normaliser=scale,
    )


def folded(terms: Polynomial, step: float, length: int) -> Table:
    """Σ c h^−β w_j^(β) for j = 0 … ``length``, cut where all that follows is exactly zero."""
    each = np.array([t.coefficient * power(step, -t.order) * gl_weights(t.order, length) for t in terms])
    weights, size = total(each), total(np.abs(each))
    keep = int(np.flatnonzero(weights)[-1]) + 1
    return Table(weights[:keep], size[:keep])


def _scaled(table: Table, factor: float) -> Table:
    whole = table.whole and Response(table.whole.weights * factor, table.whole.left_out * abs(factor))
    modes = tuple(m.scaled(factor) for m in table.modes)
    return Table(table.weights * factor, table.size * abs(factor), modes, whole)


def tail_l1(terms: Polynomial, step: float, length: int) -> float:
    """Bound on Σ_{j > length} |Σ c h^−β w_j^(β)|: what the memory leaves out.

    The weights of one order have one sign from lag β + 1 on and sum to zero in all (to 1 for order 0), so a
    tail's sum of magnitudes is the magnitude of the partial sum of eq. (11)'s weights before it.
    """
    return exact_sum([abs(t.coefficient) * power(step, -t.order) * _tail(t.order, length) for t in terms])


def _tail(order: float, length: int) -> float:
    if order.is_integer():
        return l1(gl_weights(order, max(length, int(order)))[length + 1 :])
    settled = max(length, int(order) + 1)
    early = l1(gl_weights(order, settled)[length + 1 :])
    return early + abs(short_memory_bias(order, settled))


def memory_bias(controller: Controller, length: int) -> tuple[tuple[float, float, float], ...]:
    """What short memory adds at rest: (coefficient, order, bias) for each term of order > 0.

    ``bias`` is c h^−β Σ_{j ≤ L} w_j, in units of the numerator or denominator with lowest denominator order
    0; it would be 0 with infinite memory. The model's T s^α + 1 reads 1 + bias.
    """
    form, h = realise(controller), controller.sample_time
    terms = [t for t in form.direct + form.rest + form.den if t.order > 0.0]
    return tuple(
        (t.coefficient, t.order, t.coefficient * power(h, -t.order) * short_memory_bias(t.order, length))
        for t in terms
    )


def inner_limits(controller: Controller, at_rest: float) -> tuple[float, float]:
    """The clamp of the integral of the terms of negative order, in units of the denominator's output.

    ``at_rest``: what that denominator makes of a constant 1. At rest the output is gain · z / at_rest; see
    the module's description.
    """
    gains = controller.gains
    smallest = min((abs(g) for g in gains if g != 0.0), default=1.0) * controller.factors[0]
    low, high = controller.ranges.output
    if controller.integrator:
        reach = (high - low) / controller.sample_time
        low, high = -reach, reach
    largest = [x * at_rest / (g * smallest) for x in (low, high) for g in _signs(gains)]
    return min([*largest, 0.0]), max([*largest, 0.0])


def _signs(gains: Iterable[float]) -> set[float]:
    return {float(np.sign(g)) for g in gains if g != 0.0} or {1.0}
