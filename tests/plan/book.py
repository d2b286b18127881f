"""Everything that a controller can do, by the book: modes, set-point filter, slew limit, tuning, and what
becomes of inputs and states that cannot be used. One sample at a time, in whole numbers or scalars.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from focgen.plan.plan import Bank, Plan, Sum
from focgen.plan.scenario import Scenario
from tests.plan.test_execute import Interpreter

HIGH, LOW, INVALID = 1, 2, 16


class Machine(Interpreter):
    """One controller with all of its state."""

    def __init__(self, plan: Plan):
        self.plan, self.number = plan, {"float": np.float32, "double": np.float64}.get(plan.error.ctype, int)
        self.limits = {p.node: p.worst for p in plan.proofs}
        self.low, self.high, self.kept = self.number(plan.output.low), self.number(plan.output.high), 0
        self.own, self.constant = plan.schedule, plan.constant_gain
        if plan.tuning:
            one = 1.0 if plan.floating else round(1.0 / plan.tuning.factor.lsb)
            self.take([one] * len(plan.tuning.nominal), self.low, self.high)
        self.aim_at(self.nearest_to_0())
        self.start(self.number(0), self.within(self.number(0)))

    # ---------------------------------------------------------------------------------- single values

    def usable(self, x) -> bool:
        most = {np.float32: 2.0**48, np.float64: 2.0**512}.get(self.number)
        return most is None or bool(np.abs(self.number(x)) < most)

    def within(self, u):
        return max(min(u, self.high), self.low)

    def nearest_to_0(self):
        return max(
            min(self.number(0), self.number(self.plan.reference.high)), self.number(self.plan.reference.low)
        )

    # -------------------------------------------------------------------------------------- set point

    def aim_at(self, ref) -> None:
        made = self.plan.set_point
        if made:
            self.lag, self.latest = self.number(0), self.number(ref)
            self.F = 0 if self.plan.floating else int(ref) * 2**made.up

    def aim(self, r):
        made = self.plan.set_point
        if made is None:
            return r
        if not self.plan.floating:
            self.F = self.F + made.rate * (r - self.shift(self.F, made.up))
            assert made.low <= self.F <= made.high
            return self.shift(self.F, made.up)
        x = self.lag + (r - self.latest)
        lag = x - self.number(made.rate) * x
        self.lag = self.number(0) if abs(lag) <= self.number(made.drop) else lag
        self.latest = r
        return r - self.lag

    # ------------------------------------------------------------------------------------------ modes

    def start(self, e, u0) -> None:
        self.banks = {}
        for table in self.plan.sums:
            self.banks[table.name] = [
                ([self.number(0)] * b.modes, [self.number(0)] * b.modes) for b in table.banks
            ]
        super().start(e, u0)
        self.filtered = [self.v] * max(2, len(self.filtered))
        self.errors = [e] * max(3, len(self.errors))
        for table in self.plan.sums:
            past = e if table.history == "error" else self.v
            for bank, (means, _) in zip(table.banks, self.banks[table.name]):
                still = past if bank.differences == 1 else self.number(0)
                means[:] = [still if self.plan.floating else still * 2**bank.up] * bank.modes
        self.kept = self.within(self.number(0))

    def total(self, table: Sum, past: list):
        """Taps, then each bank, driven by what was before this sample."""
        made = super().total(table, past) if not table.banks else self.taps(table, past)
        for bank, state in zip(table.banks, self.banks[table.name]):
            if self.running:
                u = past[1] if bank.differences == 1 else past[1] - past[2]
                made = made + self.shift(self.modes(bank, state, u), bank.align)
        return made

    def taps(self, table: Sum, past: list):
        return super().total(replace(table, banks=(), name="taps of " + table.name), past)

    def seen(self, node, value, spare=0):
        return value if node.startswith("taps of") else super().seen(node, value, spare)

    running = False

    def modes(self, bank: Bank, state, u):
        means, rests = state
        sum_ = self.number(0)
        for i, (a, c) in enumerate(zip(bank.rates, bank.weights)):
            if not self.plan.floating:
                d = self.shift(u * 2**bank.up - means[i], bank.to_drive)
                assert bank.drive.low <= d <= bank.drive.high
                means[i] = means[i] + self.shift(int(a) * d, bank.rate_shift)
                assert bank.state.low <= means[i] <= bank.state.high
                sum_ = sum_ + int(c) * d
                continue
            q, d = self.number(a), u - means[i]
            if bank.compensated:
                d = d - rests[i]
                t = rests[i] + q * d
                mean = means[i] + t
                rests[i], means[i] = t - (mean - means[i]), mean
            else:
                means[i] = means[i] + q * d
            sum_ = sum_ + self.number(c) * d
        return sum_

    # ----------------------------------------------------------------------------------------- tuning

    def take(self, factors, low, high) -> None:
        """Gains, slopes and limits of parameters in the box."""
        box, whole = self.plan.tuning, not self.plan.floating
        gains = [
            self.shift(self.number(f) * self.number(n), box.to_gain) for f, n in zip(factors, box.nominal)
        ]
        pairs = zip(gains, gains[1:], box.reciprocals, box.to_slopes)
        slopes = [self.shift((b - a) * self.number(per), by) for a, b, per, by in pairs]
        self.constant, (self.low, self.high) = gains[0], (self.number(low), self.number(high))
        if self.plan.schedule:
            plain = (lambda x: x) if whole else float
            self.own = replace(
                self.plan.schedule, gains=tuple(map(plain, gains)), slopes=tuple(map(plain, slopes))
            )

    def tune(self, params) -> None:
        box = self.plan.tuning
        good = all(box.factor.low <= f <= box.factor.high for f in params.gain)
        good = (
            good and box.low[0] <= params.u_min <= box.low[1] and box.high[0] <= params.u_max <= box.high[1]
        )
        if good:
            self.take(params.gain, params.u_min, params.u_max)
            self.limit()

    def limit(self) -> None:
        """The integral, or the output that is kept, within the limits."""
        self.kept = self.within(self.kept)
        if self.plan.integrator:
            low, high = self.ends()
            self.total_i = max(min(self.total_i, high), low)

    def ends(self):
        return tuple(self.wide(u) for u in (self.low, self.high))

    def wide(self, u):
        integrator = self.plan.integrator
        return self.taken_in(u if self.plan.floating else u * 2**integrator.to_output, integrator.state)

    # ----------------------------------------------------------------------------------------- calls

    def reset(self, ref, meas, u0, e=None) -> None:
        good = self.usable(ref) and self.usable(meas)
        ref_in, meas_in = (
            self.input(x, f) if good else 0
            for x, f in ((ref, self.plan.reference), (meas, self.plan.measurement))
        )
        self.running = False
        u0 = u0 if self.usable(u0) else 0
        self.start(self.number(ref_in) - self.number(meas_in), self.within(self.number(u0)))
        self.aim_at(ref_in if good else self.nearest_to_0())

    def track(self, u) -> None:
        if self.plan.integrator and self.usable(u):
            self.set(self.within(self.number(u)))

    def stands(self):
        """The output without a step."""
        integrator = self.plan.integrator
        if integrator is None:
            return self.kept
        return self.within(self.given(self.total_i, integrator.state, integrator.to_output))

    def left_out(self):
        u = self.stands()
        return u, 0, INVALID | HIGH * (u >= self.high) | LOW * (u <= self.low)

    def step(self, ref, meas, sched):
        if not all(self.usable(x) for x in (ref, meas, sched) if x is not None):
            return self.left_out()
        plan, flags = self.plan, 0
        given = [(ref, plan.reference), (meas, plan.measurement)]
        given += [(sched, plan.schedule.signal)] if plan.schedule else []
        r, m, *s = (self.input(x, form) for x, form in given)
        flags |= 0 if plan.floating else 8 * any(x != y for (x, _), y in zip(given, (r, m, *s)))
        if s:
            points = plan.schedule.breakpoints
            flags |= 4 * (s[0] < points[0] or s[0] > points[-1])
        e = self.seen("error", self.aim(r) - m)
        self.errors = [e, *self.errors[:-1]]
        before, self.v = self.v, self.filter()
        self.kept, d = self.actuate(self.gain(s[0] if s else None), before)
        return self.kept, d, flags | HIGH * (self.kept >= self.high) | LOW * (self.kept <= self.low)

    def damaged(self, what: str, ref, meas):
        """A step that finds a state no step has left: the past is this sample's from here on."""
        untuned = self.plan.tuning is not None and what in ("all", "limits", "gains")
        if untuned:
            one = [1.0] * len(self.plan.tuning.nominal)
            self.take(one, self.number(self.plan.output.low), self.number(self.plan.output.high))
        u = self.within(self.number(0) if what in ("integral", "all") else self.stands())
        self.reset(ref, meas, u)
        self.kept = u
        return u, 0, INVALID | HIGH * (u >= self.high) | LOW * (u <= self.low)

    # ------------------------------------------------------------------- what the simpler one leaves out

    def gain(self, s):
        if s is None:
            return self.number(self.constant)
        kept, self.plan = self.plan, replace(self.plan, schedule=self.own)
        try:
            return super().gain(s)
        finally:
            self.plan = kept

    def filter(self):
        self.running = True
        made = super().filter()
        if self.plan.feedback:
            self.filtered = [*self.filtered[: max(2, self.plan.filtered_lags)]]
        return made

    def actuate(self, g, before):
        plan = self.plan
        d = self.shift(self.seen("gain product", g * self.v), plan.gain_shift)
        if plan.integrator is None:
            return self.within(d), d
        d = self.taken_in(d, plan.increment)
        first = self.taken_in(self.shift(g * before, plan.gain_shift), plan.increment)
        change = d + (first if self.fresh else self.d)
        self.fresh, self.d = False, d
        if plan.integrator.slew is not None:
            slew = type(change)(plan.integrator.slew)
            change = max(min(change, slew), -slew)
        low, high = self.ends()
        self.total_i = max(min(self.total_i + change, high), low)
        return self.stands(), d


def by_the_book(plan: Plan, raw: Scenario) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[Machine]]:
    """u, d and flags of every lane, shape (lanes, samples), and the machines as they end."""
    rows, machines = [], []
    for lane in range(raw.lanes):
        machine, row = Machine(plan), []
        for k in range(raw.samples):
            row.append(_sample(machine, raw, lane, k))
        rows.append(row)
        machines.append(machine)
    u, d, flags = (np.array([[s[i] for s in row] for row in rows]) for i in range(3))
    return u, d, flags, machines


def _sample(machine: Machine, raw: Scenario, lane: int, k: int):
    """Tunes, a reset, tracks; then a step, or what a damaged state makes of it."""
    here = lambda events: (e for e in events if (e.lane, e.sample) == (lane, k))
    for t in here(raw.tunes):
        machine.tune(t.params)
    for r in here(raw.resets):
        machine.reset(r.ref, r.meas, r.u0)
    for t in here(raw.tracks):
        machine.track(t.u)
    each: list[Any] = [x[lane, k] if machine.plan.floating else int(x[lane, k]) for x in (raw.ref, raw.meas)]
    for damage in here(raw.damages):
        return machine.damaged(damage.what, *each)
    sched = None
    if raw.sched is not None:
        sched = raw.sched[lane, k] if machine.plan.floating else int(raw.sched[lane, k])
    return machine.step(*each, sched)
