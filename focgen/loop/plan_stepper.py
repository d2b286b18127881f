"""A plan run in a simulated loop: bit for bit what the C computes, one sample at a time, many loops side by
side.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Array, Kind, Numbers
from focgen.plan.counts import taken_in, values_of
from focgen.plan.formats import shift
from focgen.plan.histories import BankRun, Latest
from focgen.plan.plan import Format, Plan, Sum
from focgen.plan.scenario import nearest_raw
from focgen.plan.setpoint import Aim
from focgen.plan.slewing import slewed
from focgen.plan.values import clamp, kind_of, output_of, saturate, scheduled_gain
from focgen.present import present


class PlanStepper:
    """The controller as it will run. Takes and gives physical values; inside they are the plan's counts.

    Starts at rest with error 0 at the output ``start`` and the set point ``reference``, for ``columns``
    loops. Measurement and set point are rounded to the nearest count and, in fixed point, clamped to their
    ranges, as a caller of the C does.
    """

    def __init__(self, plan: Plan, columns: int, start: float = 0.0, reference: float = 0.0) -> None:
        self.plan = plan
        self.kind = kind_of(plan.error)
        self.direct = _Window(plan.direct, self.kind, columns)
        self.rest = _Window(plan.inner.rest if plan.inner else None, self.kind, columns)
        self.feedback = _Window(plan.feedback.table if plan.feedback else None, self.kind, columns)
        zero: Numbers = np.zeros(columns, self.kind)
        self.carry, self.d = zero, zero.astype(kind_of(plan.increment))
        self.z = self.r = zero.astype(kind_of(plan.inner.state)) if plan.inner else zero
        u0 = np.full(columns, clamp(nearest_raw(start, plan.output), plan.output))
        self.total: Numbers = u0.astype(self.kind)
        self.aim = Aim(plan, self.kind, columns) if plan.set_point else None
        for lane in range(columns if self.aim else 0):
            present(self.aim).settle(lane, self._input(reference, plan.reference)[()])
        if plan.integrator and plan.floating:
            self.total = taken_in(self.total, plan.integrator.state)
        elif plan.integrator:
            self.total = self.total << plan.integrator.to_output

    def step(self, reference: Array, measurement: Array, schedule: Array) -> Array:
        """One sample of all loops: physical values in, the outputs out, each of shape (columns,)."""
        plan = self.plan
        r = self._input(reference, plan.reference)
        y = self.aim.step(r) if self.aim else r
        e = y - self._input(measurement, plan.measurement)
        v = self._filtered(e)
        g = self.kind(plan.constant_gain)
        if plan.schedule is not None:
            g = scheduled_gain(plan, nearest_raw(schedule, plan.schedule.signal))
        d = self._shift(g * v, plan.gain_shift)
        return self._output(d).astype(float) * plan.output.lsb

    def _input(self, values: ArrayLike, form: Format) -> Numbers:
        raw: Numbers = np.asarray(nearest_raw(values, form), dtype=self.kind)
        return raw if form.floating else clamp(raw, form)

    def _shift(self, values: Numbers, by: int) -> Numbers:
        """Right shift rounding half up; nothing where floating."""
        return values if self.plan.floating else shift(values, by)

    def _filtered(self, e: Numbers) -> Numbers:
        """v: the sums over e, the inner integral, the recursion."""
        plan = self.plan
        p = self.direct(e)
        if plan.inner:
            inner = self._inner(self.rest(e))
            p = p + inner if plan.direct else inner
        if plan.feedback is None:
            return p if plan.floating else saturate(self._shift(p, plan.narrow), plan.filtered.bits)
        x = p - self.feedback.past()
        if plan.floating:
            v = x
        else:
            x = x + self.carry
            v = self._shift(x, plan.narrow)
            self.carry = x - (v << plan.narrow)
            v = saturate(v, plan.filtered.bits)
        self.feedback.push(v)
        return v

    def _inner(self, r: Numbers) -> Numbers:
        inner = present(self.plan.inner)
        r = taken_in(r, inner.state)
        self.z = clamp(self.z + (r + self.r), inner.state)
        self.r = r
        if self.plan.floating:
            return self.z if inner.state.floating else values_of(self.z, inner.state)
        made: Numbers = shift(self.z, inner.to_wide)
        return made

    def _output(self, d: Numbers) -> Numbers:
        plan = self.plan
        if plan.integrator is None:
            return clamp(d, plan.output)
        d = taken_in(d, plan.increment)
        self.total = clamp(self.total + slewed(plan, d + self.d), plan.integrator.state)
        self.d = d
        return output_of(plan, self.total) if plan.floating else shift(self.total, plan.integrator.to_output)


class _Window:
    """One history sum: the samples it needs, shape (lags, columns), oldest first."""

    def __init__(self, table: Sum | None, kind: Kind, columns: int) -> None:
        self.table, self.kind, self.columns = table, kind, columns
        if table is None:
            return
        self.weights: Numbers = np.array(table.weights[::-1], dtype=kind)[:, None]
        self.samples: Numbers = np.zeros((table.last - table.first + 1, columns), kind)
        self.memory = [BankRun(bank, kind, columns) for bank in table.banks]
        self.latest = Latest(columns, kind)
        self.blocks = [(table.last - b.last, table.last - b.first + 1, b.align) for b in table.blocks]

    def __call__(self, x: Numbers) -> Numbers:
        """Take in x_k and return the sum, x_k in it."""
        remembered = self._remembered()
        self.push(x)
        return sum(remembered, self._of_taps())

    def push(self, x: Numbers) -> None:
        """Take in x_k."""
        if self.table is not None:
            self.samples = np.concatenate([self.samples[1:], x[None]])
            self.latest.push(x)

    def past(self) -> Numbers:
        """Return the sum over what has been taken in; once a sample."""
        return sum(self._remembered(), self._of_taps())

    def _remembered(self) -> list[Numbers]:
        """What each bank adds; its modes take in what is past."""
        return [] if self.table is None else [modes.step(self.latest) for modes in self.memory]

    def _of_taps(self) -> Numbers:
        if self.table is None:
            return np.zeros(self.columns, self.kind)
        products = self.weights * self.samples
        if self.kind is not np.int64:  # accumulate adds in order, as the C does; sum would not
            made: Numbers = np.add.accumulate(products, axis=0)[-1] + self.kind(0)
            return made
        total = np.zeros(self.columns, np.int64)
        for start, stop, align in self.blocks:
            part = products[start:stop].sum(axis=0)
            total = total + shift(part, align)
        return total
