"""The account in integers: every rounding is at most half a count, and none where nothing is shifted out."""

from __future__ import annotations

import numpy as np

from focgen.fractional.elementary import exact_sum
from focgen.plan.account import Account, FilteredError, Span
from focgen.plan.banks import drive_error
from focgen.plan.canonical import Table
from focgen.plan.gain_errors import Piece
from focgen.plan.gains import largest_gain, steepest, table_error, tuned_error
from focgen.plan.plan import Plan, Sum
from focgen.plan.proofs import at_rest, reset_error
from focgen.plan.setpoint import set_point_error
from focgen.present import present


class Fixed(Account):
    """Of a plan in integers; notation of :mod:`focgen.plan.bounds`."""

    @property
    def input_error(self) -> float:
        """Half a count of either input, and the set point's."""
        return self.plan.error.lsb + set_point_error(self.plan)

    def sum_error(self, made: Sum | None, table: Table | None, span: Span) -> float:
        """The alignments' rounding, and that of the modes' drives."""
        if made is None:
            return 0.0
        aligned = sum(bool(b.align) for b in made.blocks) + sum(bool(b.align) for b in made.banks)
        return (0.5 * aligned + drive_error(made)) * made.total.lsb

    def inner_given(self) -> float:
        """Nothing: its alignment is counted with the others."""
        return 0.0

    def inner_rounding(self) -> float:
        """None: counts add up exactly."""
        return 0.0

    def filtered(self) -> FilteredError:
        """With the rounding of each alignment."""
        plan, tables = self.plan, self.tables
        inner = self.inner()
        half_wide = 0.5 * plan.wide.lsb * bool(plan.inner and plan.inner.to_wide)
        rounding = self.M * (self.sum_error(plan.direct, tables.direct, self.machine_e) + half_wide)
        static = {
            "inputs": self.N * self.input_error,
            "weights": self.weight_error(plan.direct, tables.direct, self.machine_e),
            "inner": self.M * exact_sum([*inner.static.values()]),
        }
        if plan.feedback is None:
            static["rounding"] = rounding + 0.5 * plan.filtered.lsb * bool(plan.narrow)
        else:
            back, reach = plan.feedback.table, (plan_reach(plan) + 1) * plan.filtered.lsb
            static["weights"] += self.weight_error(back, tables.feedback, Span(-reach, reach), 1)
            static["rounding"] = (
                rounding + self.M * self.sum_error(back, None, Span(0.0, 0.0)) + self.carried()
            )
        return FilteredError(static, inner.growth, inner.ceiling)

    def carried(self) -> float:
        """The rounding of v, which meets (1 − 1/z)/A, and that of a reset."""
        lsb = self.plan.filtered.lsb
        rounding = 0.5 * present(self.own).norm_after(np.array([1.0, -1.0])) * bool(self.plan.narrow)
        return lsb * (rounding + reset_error(self.plan) * max(1.0, self.M * at_rest(self.plan)))

    def pieces(self) -> list[Piece]:
        """One, for all of the schedule."""
        return [Piece(self.gain_error(), largest_gain(self.plan.controller))]

    def gain_error(self) -> float:
        """In physical units, the h/2 taken out again."""
        plan, lsb = self.plan, self.plan.gain.lsb / self.half_step
        if plan.tuning:
            moved = 0.5 * plan.schedule.signal.lsb * steepest(plan.controller) if plan.schedule else 0.0
            return tuned_error(plan, lsb) + 0.5 * lsb + moved
        if plan.schedule is None:
            return abs(plan.constant_gain * lsb - plan.controller.gains[0])
        inputs = 0.5 * plan.schedule.signal.lsb * steepest(plan.controller)
        return table_error(plan, lsb) + 0.5 * lsb + inputs

    def product_error(self, reach: float) -> float:
        """Half a count, where anything is shifted out."""
        return 0.5 * self.plan.increment.lsb / self.half_step * bool(self.plan.gain_shift)

    def output(self, static: float, operator: float) -> float:
        """An output's own rounding and that of a limit or a reset's u0 are half a count each."""
        if self.plan.integrator:
            slew = 0.5 * self.plan.integrator.state.lsb * (self.plan.integrator.slew is not None)
            return self.plan.sample_time * operator + self.plan.output.lsb + slew
        return max(static, 0.5 * self.plan.output.lsb)


def plan_reach(plan: Plan) -> float:
    """Proven |v| in counts."""
    return next(p.worst for p in plan.proofs if p.node == "v")
