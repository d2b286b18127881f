"""The account in float or double, and of the double reference that it is compared with.

The type's own rounding is counted operation by operation, each with the last place of the largest result that
it can have (:mod:`focgen.plan.rounding`); the reference's, 2^29 times as fine beside a float's, as γ_n of all
magnitudes.
"""

from __future__ import annotations

import numpy as np

from focgen.arrays import Array
from focgen.fractional.elementary import exact_sum, l1
from focgen.plan.account import Account, FilteredError, Span
from focgen.plan.canonical import Table, Tables
from focgen.plan.gain_errors import Piece, floating_pieces
from focgen.plan.plan import Bank, Plan, Sum
from focgen.plan.rounding import gamma, half_place, half_places, taps_error
from focgen.plan.setpoint import set_point_error
from focgen.present import present

_UNIT = {"f64": 2.0**-53, "f32": 2.0**-24}
_DOUBLE = 2.0**-53
_TINY = {"f64": 2.0**-1022, "f32": 2.0**-126}
_UP = 1.0 + 2.0**-40  # over the rounding of the account itself


class Floating(Account):
    """Of a floating plan; notation of :mod:`focgen.plan.bounds`."""

    def __init__(self, plan: Plan, tables: Tables, early: bool = False) -> None:
        self.u, self.tiny = _UNIT[plan.arithmetic], _TINY[plan.arithmetic]
        super().__init__(plan, tables, early)

    def last(self, largest: float) -> float:
        """The rounding of a number that the inner integral takes part in: early it has to be linear."""
        return self.u * largest if self.early else half_place(largest * _UP, self.u)

    @property
    def input_error(self) -> float:
        """Both inputs' rounding to the type, that of their difference, and the reference's of it."""
        (r0, r1), (m0, m1) = self.plan.controller.ranges.reference, self.plan.controller.ranges.measurement
        ref, meas = max(abs(r0), abs(r1)), max(abs(m0), abs(m1))
        own = 0.0 if self.plan.arithmetic == "f64" else half_place(ref, self.u) + half_place(meas, self.u)
        own += set_point_error(self.plan)
        difference = (max(abs(r0 - m1), abs(r1 - m0)) + own) * _UP
        return own + half_place(difference, self.u) + _DOUBLE * (ref + meas) * 1.01

    def sum_error(self, made: Sum | None, table: Table | None, span: Span) -> float:
        """Of the taps and of every bank in turn, here and in the reference; and what underflow can take."""
        if made is None:
            return 0.0
        count, largest = made.taps + 2, span.largest
        here = taps_error(made.weights, (span.low, span.high), self.u)
        there = gamma(count, _DOUBLE) * l1(present(table).weights) * largest
        taps = here + 1.01 * there + count * self.tiny * (1.0 + largest)
        before = l1(made.weights) * largest * (1.0 + gamma(count, self.u))
        banks = 0.0
        for bank in made.banks:
            error, reach = self.bank_error(bank, span)
            before += reach
            banks += error + half_place(before * _UP, self.u) + gamma(2, _DOUBLE) * before
        return taps + banks

    def bank_error(self, bank: Bank, span: Span) -> tuple[float, float]:
        """Of what a bank gives, here and in the reference, which has no compensation; and how far that
        reaches.

        Each mode's D is off by what :func:`drive_error` says; each product and each partial sum is rounded.
        u and L lie in the same range, so D is at most its width.
        """
        c, rates, m = np.abs(bank.values), np.array(bank.real_rates), bank.differences
        wide = span if m == 1 else Span(-2.0 * span.radius, 2.0 * span.radius)
        drives = drive_error(rates, wide, m, self.u, self.tiny, bank.compensated)
        there = drive_error(rates, wide, m, _DOUBLE, _TINY["f64"], False)
        products = c * (2.0 * wide.radius + drives) * _UP
        partial = np.add.accumulate(products) * (1.0 + gamma(bank.modes + 2, self.u))
        here = exact_sum(c * drives + half_places(products, self.u)) + exact_sum(
            half_places(partial[1:], self.u)
        )
        reference = exact_sum(c * there) + gamma(bank.modes + 2, _DOUBLE) * float(partial[-1])
        return here + 1.01 * reference + bank.modes * self.tiny, float(partial[-1])

    def inner_given(self) -> float:
        """In counts: the float that is nearest."""
        return 0.0 if present(self.plan.inner).state.floating else self.last(self.Z)

    def inner_rounding(self) -> float:
        """r + r_prev, z + that, each rounded, here and in the reference; in counts r alone, twice half a
        count."""
        r, state = 2.0 * present(self.tables.rest).l1 * self.E, present(self.plan.inner).state
        made = _DOUBLE * (self.clamp + 2.0 * r) * 1.01 + 2.0 * self.tiny
        if not state.floating:
            return made + state.lsb
        return made + half_place(r * 1.01, self.u) + half_place((self.clamp + r) * 1.01, self.u)

    def filtered(self) -> FilteredError:
        """With every rounding of a step that is not the feedback's."""
        plan, tables = self.plan, self.tables
        inner = self.inner()
        rounding = self.sum_error(plan.direct, tables.direct, self.machine_e)
        if plan.inner and plan.direct:  # p + z
            rounding += self.last((present(tables.direct).l1 * self.E * 1.01 + self.Z) * 1.01)
        rounding += _DOUBLE * 1.01 * (self.Z + self.reach) * bool(plan.inner or plan.feedback)
        static = {
            "inputs": self.N * self.input_error,
            "weights": self.weight_error(plan.direct, tables.direct, self.machine_e),
            "inner": self.M * exact_sum([*inner.static.values()]),
        }
        if plan.feedback is None:
            static["rounding"] = rounding
        else:
            self.recursive(static, rounding)
        return FilteredError(static, inner.growth, inner.ceiling)

    def recursive(self, static: dict[str, float], rounding: float) -> None:
        """Add what feedback does. The machine's own v is needed for that, and bounded first with every
        rounding as a part of v.

        In the constant past before a reset the recursion does not step; v is as far from its rest as
        :meth:`reset_residual` says. Both are residuals of the recursion, one up to the reset and one from
        there on, so that v is off by M times the larger one.
        """
        plan, tables = self.plan, self.tables
        back, unit = present(plan.feedback).table, Span(-1.0, 1.0)
        share = self.weight_error(back, tables.feedback, unit, 1) / self.M
        share += self._relative(back, tables) + (self.u + _DOUBLE) * 4.0
        if self.M * share >= 0.5:
            static["rounding"] = np.inf
            return
        known = self.reach + static["weights"] + static["inner"]
        reach = (known + self.M * (rounding + self.reset_residual())) / (1.0 - self.M * share)
        span = Span(-reach, reach)
        static["weights"] += self.weight_error(back, tables.feedback, span, 1)
        step = rounding + self.last(reach) + 4.0 * _DOUBLE * reach + 4.0 * back.taps * self.tiny
        linear = self._relative(back, tables) * reach
        step += linear if self.early else self.sum_error(back, tables.feedback, span)
        static["rounding"] = self.M * max(step, self.reset_residual())

    def _relative(self, back: Sum, tables: Tables) -> float:
        """The rounding in the recursion's sum as a share of the history: at most twice that for 1, whose last
        places are those of its powers of two."""
        return 2.0 * self.sum_error(back, tables.feedback, Span(-1.0, 1.0))

    def reset_residual(self) -> float:
        """What Â(1) v − B̂(1) e is for v = steady · e as a reset makes it: its rounding, that of the steady
        gain, and the sums' in double."""
        direct, back = self.plan.direct, present(self.plan.feedback)
        rest = 1.0 + exact_sum(back.table.values)
        still = exact_sum(direct.values) if direct else 0.0
        off = abs(rest * back.steady - still)
        size = abs(rest) * (1.0 + abs(back.steady)) + abs(still)
        made = off * self.E + abs(rest) * half_place(abs(back.steady) * self.E * _UP, self.u)
        return made + 16.0 * _DOUBLE * size * self.E + self.tiny + self.reference_residual()

    def reference_residual(self) -> float:
        """The same of the reference, whose sums of weights have an order of their own."""
        direct, back = self.tables.direct, present(self.tables.feedback)
        if direct is None:
            return 0.0
        count = len(direct.weights) + len(back.weights) + 8
        sums = direct.l1 + abs(direct.total / back.total) * back.l1
        return 2.0 * gamma(count, _DOUBLE) * sums * self.E

    def pieces(self) -> list[Piece]:
        """Those of the schedule."""
        return floating_pieces(self.plan, self.half_step, self.u)

    def product_error(self, reach: float) -> float:
        """Its rounding, and an integral's to half a count."""
        made = self.last(reach * self.half_step * 1.01) + self.tiny
        increment = self.plan.increment
        counts = 0.0 if increment.floating else 0.5 * increment.lsb
        return (made + counts) / self.half_step + 2.0 * _DOUBLE * reach

    def output(self, static: float, operator: float) -> float:
        """An integral in counts rounds each increment to half a count, and what it gives, a limit and an
        output that is set once."""
        plan, here = self.plan, self.u * 1.01
        largest = max(map(abs, plan.controller.ranges.output))
        edge = (here + _DOUBLE * 1.01) * largest
        if not plan.integrator:
            return static + edge
        d = 2.0 * self.half_step * self.largest_gain * self.reach + plan.sample_time * operator
        state, each = plan.integrator.state, _DOUBLE * 1.01 * (largest + 2.0 * d)
        each += here * (largest + 2.0 * d) if state.floating else here * largest + 3.0 * state.lsb
        if plan.integrator.slew is not None:  # rounded, here and in the reference
            most = present(plan.controller.slew_limit) * plan.sample_time
            each += (here * most if state.floating else 0.5 * state.lsb) + _DOUBLE * 1.01 * most
        made: float = plan.sample_time * operator + each + 2.0 * edge + 4.0 * self.tiny
        return made


def drive_error(
    rates: Array, span: Span, differences: int, unit: float, tiny: float, compensated: bool
) -> Array:
    """How far a mode's D can be off where u, and with it L, is within ``span``; shape of ``rates``.

    With two differences u itself is rounded, once, and as much in L. A sample adds to L's error what D is
    rounded by, q times, what q D is, and what the sum is; and it forgets q of the error. D is rounded once
    more. Compensated, with r ≤ u |L| and t = r + q D: D is rounded twice, q D and t once, and r loses 3 u |t|
    more where |t| > |L|, which is where |D| is at most |u| + |t| (Dekker 1971 is exact otherwise).
    """
    far, largest = 2.0 * span.radius * (1.0 + 2.0**-10), span.largest * (1.0 + 2.0**-10)
    own = half_place(far, unit)
    twice = 2.0 * half_place(largest, unit) * (differences > 1)
    step = half_places(rates * far, unit)
    if not compensated:
        return twice + 2.0 * own + (step + half_place(largest, unit) + 3.0 * tiny) / rates
    taken = rates * far + unit * largest
    lost = 3.0 * unit * (1.1 * rates * largest + unit * largest)
    return twice + 4.0 * own + (step + half_places(taken, unit) + lost + 6.0 * tiny) / rates
