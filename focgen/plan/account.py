"""What the accounts of rounding in integers and in floating point share; notation of
:mod:`focgen.plan.bounds`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from focgen.arrays import Array, Ints
from focgen.fractional.elementary import exact_sum, l1
from focgen.plan.canonical import Table, Tables, inner_limits
from focgen.plan.gain_errors import Piece
from focgen.plan.gains import largest_gain
from focgen.plan.plan import Plan, Sum
from focgen.plan.stability import inverse_of
from focgen.plan.truncation import largest_error
from focgen.present import present

_DOUBLE = 2.0**-53


@dataclass(frozen=True)
class FilteredError:
    """The error of v: ``static`` by cause in any sample; ``growth`` a sample and ``ceiling`` of the inner
    integral's."""

    static: dict[str, float]
    growth: float = 0.0
    ceiling: float = 0.0

    @property
    def settled(self) -> float:
        """All of it that does not grow."""
        return exact_sum([*self.static.values()])


@dataclass(frozen=True)
class Span:
    """Between which ends a history is, 0 among them: the past before ``init``."""

    low: float
    high: float

    @property
    def largest(self) -> float:
        """In magnitude."""
        return max(-self.low, self.high)

    @property
    def radius(self) -> float:
        """Half of its width."""
        return 0.5 * (self.high - self.low)

    def swing(self, size: float, at_rest: float) -> float:
        """How large Σ w x can be, given Σ|w| and Σ w: the middle is a constant, and x is its radius off."""
        return self.radius * size + abs(0.5 * (self.high + self.low) * at_rest)

    def widened(self, by: float) -> Span:
        """By an error of the history."""
        return Span(self.low - by, self.high + by)


class Account(ABC):
    """``M``, ``N``, ``reach`` (V), ``E`` and ``Z`` as in the module's notation. ``early``: of the first
    samples after a reset. There the inner integral has had so many samples to get anywhere, and ``Z`` is how
    far one takes it. What follows from that is linear in it, so that it is n times as much after n.
    """

    @property
    @abstractmethod
    def input_error(self) -> float:
        """Of e, beyond its inputs' own rounding."""

    @abstractmethod
    def sum_error(self, made: Sum | None, table: Table | None, span: Span) -> float:
        """The rounding in a sum over a history within ``span``."""

    @abstractmethod
    def inner_given(self) -> float:
        """Of what the inner integral gives, beside the error of its own."""

    @abstractmethod
    def inner_rounding(self) -> float:
        """Of the inner integral in one sample."""

    @abstractmethod
    def filtered(self) -> FilteredError:
        """The error of v."""

    @abstractmethod
    def pieces(self) -> list[Piece]:
        """The gain, in physical units, the h/2 taken out again."""

    @abstractmethod
    def product_error(self, reach: float) -> float:
        """Of g v, which reaches ``reach``, in physical units."""

    @abstractmethod
    def output(self, static: float, operator: float) -> float:
        """The output's error in one sample, given the operator's in the first one and in any."""

    def __init__(self, plan: Plan, tables: Tables, early: bool = False) -> None:
        self.plan, self.tables, controller = plan, tables, plan.controller
        self.half_step = 0.5 * plan.sample_time if plan.integrator else 1.0
        self.largest_gain = largest_gain(controller)
        (r0, r1), (m0, m1) = controller.ranges.reference, controller.ranges.measurement
        self.e = Span(min(r0 - m1, 0.0), max(r1 - m0, 0.0))
        self.machine_e = self.e.widened(self.input_error)
        self.E = self.input_error + largest_error(controller)
        self.own = inverse_of(tables.feedback) if tables.feedback else None
        self.M = self.own.norm if self.own else 1.0
        self.N = self.norm_after(tables.direct)
        self.ends = inner_limits(controller, tables.at_rest) if tables.rest else (0.0, 0.0)
        self.Z, self.width = max(map(abs, self.ends)), self.ends[1] - self.ends[0]
        self.clamp, self.early = self.Z, early and tables.rest is not None
        if self.early:
            self.Z = min(self.Z, 2.0 * present(tables.rest).l1 * self.E + self.inner_growth())
        still = tables.direct.total / tables.at_rest if tables.direct else 0.0
        self.reach = self.machine_e.swing(self.N, still) + self.M * self.Z

    def norm_after(self, table: Table | None) -> float:
        """‖table/A‖₁."""
        if table is None:
            return 0.0
        whole = table.response
        return self.own.norm_after(whole.weights, whole.left_out) if self.own else whole.l1

    def weight_error(
        self, made: Sum | None, table: Table | None, span: Span, first: int = 0, inverted: bool = True
    ) -> float:
        """|Σ (ŵ − w) x| for x within ``span``, over A where ``inverted``, with what the exact weights
        themselves are uncertain by.

        What a mode answers to a unit sample, ∇^(m−1) of (0, 1, −q, −q p, …), has magnitudes whose sum is 2
        for m = 1 and 2 + 2 q for m = 2; a constant is 0 there.
        """
        if made is None:
            return 0.0
        exact, size = present(table).weights[first:], present(table).size[first:]
        lags, off = np.arange(first, first + len(exact)), np.array(made.values) - exact
        uncertain = exact_sum(self.recursion(lags) * size)
        held, wanted = np.array(_mode_weights(made)), np.array(_exact_weights(present(table)))
        answers = np.array([2.0 + 2.0 * q * (b.differences - 1) for b in made.banks for q in b.real_rates])
        modes = exact_sum(answers * (np.abs(held - wanted) + 16.0 * _DOUBLE * np.abs(wanted)))
        after, still = (self.M, self.tables.at_rest) if inverted else (1.0, 1.0)
        taps = min(self.own.norm_after(off), after * l1(off)) if self.own and inverted else l1(off)
        known = span.swing(taps, exact_sum(off) / still)
        return known + after * (uncertain * span.largest + modes * span.radius)

    def recursion(self, lags: Ints) -> Array:
        """Relative error of a double's weights by the recursion of eq. (11), the reference's, in 4 roundings
        a lag."""
        return (4.0 * lags + 20.0) * _DOUBLE

    def inner_growth(self) -> float:
        """The inner integral's error in one sample: r is added twice."""
        made, table = self.plan.inner, self.tables.rest
        if made is None:
            return 0.0
        each = present(table).l1 * self.input_error
        each += self.weight_error(made.rest, table, self.machine_e, inverted=False)
        each += self.sum_error(made.rest, table, self.machine_e)
        return 2.0 * each + self.inner_rounding()

    def inner_edge(self) -> float:
        """Of a limit of the inner integral, by the quantised weights behind it and its own rounding; early,
        of as much of the clamp as there is."""
        state = present(self.plan.inner).state
        off = max(abs(held * state.lsb - x) for held, x in zip((state.low, state.high), self.ends))
        part = self.Z / self.clamp if self.clamp else 0.0
        return (off + (4.0 * _DOUBLE + self.rest_uncertain()) * self.clamp) * part

    def rest_uncertain(self) -> float:
        """A(1), relative, by the double's weights that it is a sum of."""
        table = self.tables.feedback
        if table is None:
            return 0.0
        return exact_sum(self.recursion(np.arange(len(table.size))) * table.size) / self.tables.at_rest

    def inner(self) -> FilteredError:
        """The inner integral alone, as if it were all there is of v."""
        if self.plan.inner is None:
            return FilteredError({})
        edge = self.inner_edge() + self.inner_given()
        growth = self.inner_growth()
        return FilteredError({"inner": edge}, self.M * growth, self.M * (self.width + edge))


def _mode_weights(made: Sum) -> list[float]:
    return [c for bank in made.banks for c in bank.values]


def _exact_weights(table: Table) -> list[float]:
    return [w for modes in table.modes for w in modes.weights.tolist()]
