"""The bit-true reference: runs a plan sample for sample, in Python's own arithmetic.

Written from the description in :mod:`focgen.plan.plan`, not from the C: histories are whole signals, not
rings; sums over e are taken tap by tap for all samples at once. Integers are int64, which the plan's proofs
show to suffice; floating values are numpy's float32 and float64, whose every operation rounds once, in the
plan's order.

Several lanes run side by side, so that the steps that have to follow each other are array operations, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Numbers
from focgen.plan.counts import taken_in, values_of
from focgen.plan.damage import mended
from focgen.plan.formats import shift
from focgen.plan.histories import BankRun, Latest, Recursion
from focgen.plan.plan import (
    FLAG_HIGH,
    FLAG_INPUT,
    FLAG_LOW,
    FLAG_SCHEDULE,
    Format,
    Plan,
    Sum,
)
from focgen.plan.scenario import Reset, Scenario, Trace
from focgen.plan.setpoint import error_of
from focgen.plan.slewing import slewed
from focgen.plan.tuning import Applied, courses, tuned
from focgen.plan.usable import holding, invalid_samples, usable
from focgen.plan.values import clamp, interpolated, kind_of, output_of, saturate
from focgen.present import present

_AtRest = dict[tuple[int, int], Any]
"""What a signal was before each segment, by lane and first sample."""


def execute(plan: Plan, scenario: Scenario) -> Trace:
    """Run a plan on raw inputs; returns raw u and d and the flags, shape (lanes, samples)."""
    scenario = mended(plan, scenario, execute)
    invalid = invalid_samples(plan, scenario)
    return holding(plan, scenario, invalid, _executed) if invalid.any() else _executed(plan, scenario)


def _executed(plan: Plan, scenario: Scenario) -> Trace:
    """The same where every input of every step can be used."""
    return Run(plan, scenario).trace


@dataclass(frozen=True)
class _Segment:
    """Samples ``start`` to ``stop`` of a lane, before which e was ``constant`` for ever."""

    lane: int
    start: int
    stop: int
    constant: Any
    u0: Any
    begun: bool  # by a reset, not by init


class Run:
    """One execution; attributes are signals of shape (lanes, samples), but for what the last sample leaves:
    ``carry``, ``inner``, ``integral`` and those in ``aim`` (lanes,), and the modes in ``memory``.
    """

    def __init__(self, plan: Plan, scenario: Scenario) -> None:
        self.plan, self.scenario = plan, scenario
        self.kind = kind_of(plan.error)
        self.shape = scenario.ref.shape
        self.ref = self._input(scenario.ref, plan.reference)
        self.meas = self._input(scenario.meas, plan.measurement)
        self.e, self.aim = error_of(plan, scenario, self.ref, self.meas)
        self.memory: dict[str, list[BankRun]] = {}
        self.carry = self.inner = self.integral = np.zeros(self.shape[0], self.kind)
        self.tuned = courses(plan, scenario) if plan.tuning else {}
        self.low, self.high = self._limits()
        self.segments = self._segments()
        self.starts = {(s.lane, s.start): s for s in self.segments}
        self.starting: dict[int, list[int]] = {}  # lanes by the sample at which a segment of theirs begins
        for s in self.segments:
            self.starting.setdefault(s.start, []).append(s.lane)
        self.sums()
        self.recursion()
        self.gains()
        u, self.d = self.output()
        self.trace = Trace(u, self.d, self.flags(u))

    def _input(self, values: ArrayLike, format_: Format) -> Numbers:
        values = np.asarray(values, dtype=self.kind)
        return values if format_.floating else clamp(values, format_)

    def _segments(self) -> list[_Segment]:
        """Cut every lane at its resets; a lane begins with init, whose error is 0 even where the ranges
        exclude it.
        """
        lanes, samples = self.shape
        starts = {(lane, 0): (self.kind(0), self.kind(0), False) for lane in range(lanes)}
        for r in self.scenario.resets:
            starts[r.lane, r.sample] = *self._start(r), True
        order, found = sorted(starts), []
        for (lane, start), after in zip(order, [*order[1:], (-1, 0)]):
            constant, u0, begun = starts[lane, start]
            stop = after[1] if after[0] == lane else samples
            u0 = self.limited(lane, start, u0) if begun else clamp(u0, self.plan.output)
            found.append(_Segment(lane, start, stop, constant, u0, begun))
        return found

    def _limits(self) -> tuple[Numbers, Numbers]:
        """The output's limits at every sample."""
        ends = (self.plan.output.low, self.plan.output.high)
        low, high = (np.full(self.shape, end, self.kind) for end in ends)
        for lane, course in self.tuned.items():
            for sample, parameters in course:
                low[lane, max(sample, 0) :], high[lane, max(sample, 0) :] = parameters.low, parameters.high
        return low, high

    def limited(self, lane: int, sample: int, u: Any) -> np.generic:
        """Within the output's limits at a sample."""
        made: np.generic = np.minimum(
            np.maximum(self.kind(u), self.low[lane, sample]), self.high[lane, sample]
        )
        return made

    def _start(self, reset: Reset) -> tuple[np.generic, np.generic]:
        """The error and the output that a reset starts from; 0 for what cannot be used."""
        plan = self.plan
        e: Any = 0
        u0: Any = 0
        if usable(reset.ref, plan.reference) and usable(reset.meas, plan.measurement):
            e = self._input(reset.ref, plan.reference) - self._input(reset.meas, plan.measurement)
        if usable(reset.u0, plan.output):
            u0 = reset.u0
        return self.kind(e), self.kind(u0)

    # ------------------------------------------------------------------------------- sums over the error

    def sums(self) -> None:
        """The sum that makes p, and r, each with its value at rest before each segment."""
        plan = self.plan
        self.direct, self.direct_rest = self._over_error(plan.direct)
        if plan.inner:
            self.r, self.r_rest = self._over_error(plan.inner.rest)

    def _over_error(self, table: Sum | None) -> tuple[Numbers, _AtRest]:
        """The sum at every sample, and at rest before each segment (key: lane, start)."""
        if table is None:
            zero = self.kind(0)
            return np.zeros(self.shape, self.kind), dict.fromkeys(self.starts, zero)
        if table.banks:
            return self._remembered(table)
        return self._by_taps(table)

    def _remembered(self, table: Sum) -> tuple[Numbers, _AtRest]:
        """Taps, and modes sample by sample; at rest modes add nothing."""
        total, rest = self._by_taps(table)
        memory = self.memory[table.name] = [BankRun(bank, self.kind, self.shape[0]) for bank in table.banks]
        past = Latest(self.shape[0], self.kind)
        for k in range(self.shape[1]):
            for lane in self.starting.get(k, ()):
                past.settle(lane, self.starts[lane, k].constant)
                for modes in memory:
                    modes.settle(lane, self.starts[lane, k].constant)
            for modes in memory:
                total[:, k] = total[:, k] + modes.step(past)
            past.push(self.e[:, k])
        return total, rest

    def _by_taps(self, table: Sum) -> tuple[Numbers, _AtRest]:
        """The sums of the taps alone."""
        lags, places = table.last, []
        long: list[Numbers] = []
        for s in self.segments:
            places.append(sum(map(len, long)))
            long.append(
                np.concatenate([np.full(lags + 1, s.constant, self.kind), self.e[s.lane, s.start : s.stop]])
            )
        whole = self._filtered(table, np.concatenate(long))
        total: Numbers = np.empty(self.shape, self.kind)
        rest: _AtRest = {}
        for s, place in zip(self.segments, places):
            rest[s.lane, s.start] = whole[place + lags]
            total[s.lane, s.start : s.stop] = whole[place + lags + 1 : place + lags + 1 + s.stop - s.start]
        return total, rest

    def _filtered(self, table: Sum, signal: Numbers) -> Numbers:
        """Σ_j w_j x_{k−j} at every k ≥ ``table.last``; what stands before is not used."""
        total = np.zeros_like(signal)
        for block in table.blocks:
            part = np.zeros_like(signal)
            for lag in range(block.last, block.first - 1, -1):
                weight = self.kind(block.weights[lag - block.first])
                part[lag:] = part[lag:] + weight * signal[: len(signal) - lag]
            total = part if signal.dtype.kind == "f" else total + shift(part, block.align)
        return total

    # ----------------------------------------------------------------------------------------- recursion

    def recursion(self) -> None:
        """v at every sample, and before each segment's first one."""
        plan = self.plan
        p = self.direct
        if plan.inner:
            p = p + self._inner() if plan.direct else self._inner()
        self.v_rest = self._rest()
        if plan.feedback is None:
            self.v = p if plan.floating else saturate(shift(p, plan.narrow), plan.filtered.bits)
        else:
            self.v = self._fed_back(p)

    def _rest(self) -> _AtRest:
        """v of the constant past; the inner integral is 0 then."""
        plan = self.plan
        if plan.feedback is None:
            if plan.floating:
                return self.direct_rest
            narrow = {k: shift(p, plan.narrow) for k, p in self.direct_rest.items()}
            return {k: saturate(v, plan.filtered.bits) for k, v in narrow.items()}
        steady = self.kind(plan.feedback.steady)
        if plan.floating:
            return {k: steady * s.constant for k, s in self.starts.items()}
        by, bits = plan.feedback.steady_shift, plan.filtered.bits
        return {k: saturate(shift(steady * s.constant, by), bits) for k, s in self.starts.items()}

    def _inner(self) -> Numbers:
        """z, aligned to p."""
        inner, kind = present(self.plan.inner), kind_of(present(self.plan.inner).state)
        self.r = taken_in(self.r, inner.state)
        self.r_rest = {place: taken_in(r, inner.state) for place, r in self.r_rest.items()}
        z, before = np.zeros(self.shape[0], kind), np.zeros(self.shape[0], kind)
        out: Numbers = np.empty(self.shape, kind)
        for k in range(self.shape[1]):
            for lane in self.starting.get(k, ()):
                z[lane], before[lane] = 0, self.r_rest[lane, k]
            now = self.r[:, k]
            z = clamp(z + (now + before), inner.state)
            out[:, k], before = z, now.copy()
        self.inner = z
        if inner.state.floating:
            return out
        return values_of(out, inner.state) if self.plan.floating else shift(out, inner.to_wide)

    def _fed_back(self, p: Numbers) -> Numbers:
        """v_k from p_k and the past of v, whose columns are samples, ``lags`` of them ahead of the first."""
        plan, (lanes, samples) = self.plan, self.shape
        lags = present(plan.feedback).table.last
        past = np.zeros((lanes, lags + samples), self.kind)
        carry, out = np.zeros(lanes, self.kind), np.empty(self.shape, self.kind)
        table = Recursion(present(plan.feedback).table, self.kind)
        memory = [BankRun(bank, self.kind, lanes) for bank in present(plan.feedback).table.banks]
        self.memory[present(plan.feedback).table.name] = memory
        latest = Latest(lanes, self.kind)
        for k in range(samples):
            for lane in self.starting.get(k, ()):
                past[lane, k : k + lags] = self.v_rest[lane, k]
                carry[lane] = 0
                latest.settle(lane, self.v_rest[lane, k])
                for modes in memory:
                    modes.settle(lane, self.v_rest[lane, k])
            s = table(past[:, k : k + lags])
            for modes in memory:
                s = s + modes.step(latest)
            x = p[:, k] - s
            if not plan.floating:
                x = x + carry
                v = shift(x, plan.narrow)
                carry = x - (v << plan.narrow)
                x = saturate(v, plan.filtered.bits)
            past[:, k + lags] = out[:, k] = x
            latest.push(x)
        self.carry = carry
        return out

    # -------------------------------------------------------------------------------------- gain, output

    def gains(self) -> None:
        """g at every sample."""
        plan = self.plan
        if plan.schedule:
            self.s = self._input(present(self.scenario.sched), plan.schedule.signal)
            self.g = interpolated(plan.schedule, self.s, self.kind)
        else:
            self.g = np.full(self.shape, plan.constant_gain, self.kind)
        for lane, course in self.tuned.items():
            for start, parameters in course[1:]:
                if plan.schedule:
                    own = tuned(plan.schedule, parameters)
                    self.g[lane, start:] = interpolated(own, self.s[lane, start:], self.kind)
                else:
                    self.g[lane, start:] = self.kind(parameters.gains[0])

    def output(self) -> tuple[Numbers, Numbers]:
        """u and d."""
        plan = self.plan
        d = self.increment(self.g * self.v)
        if plan.integrator is None:
            return np.minimum(np.maximum(d, self.low), self.high), d
        return self._integrated(d), d

    def increment(self, product: Numbers) -> Numbers:
        """d of g·v."""
        if self.plan.floating:
            made: Numbers = taken_in(product, self.plan.increment)
        else:
            made = shift(product, self.plan.gain_shift)
        return made

    def _integrated(self, d: Numbers) -> Numbers:
        plan, lanes = self.plan, self.shape[0]
        kind = kind_of(present(plan.integrator).state)
        total, before, out = np.zeros(lanes, kind), np.zeros(lanes, kind), np.empty(self.shape, kind)
        low, high = self.wide(self.low), self.wide(self.high)
        tracks: dict[int, list[Any]] = {}
        for t in self.scenario.tracks:
            if usable(t.u, plan.output):
                tracks.setdefault(t.sample, []).append(t)
        tunes = self._tunes()
        for lane in range(lanes):
            total[lane] = self.wide(self.starts[lane, 0].u0)
        for k in range(self.shape[1]):
            for lane, parameters in tunes.get(k, ()):
                ends = self.wide(self.kind(parameters.low)), self.wide(self.kind(parameters.high))
                total[lane] = min(max(total[lane], ends[0]), ends[1])
            for lane in self.starting.get(k, ()):
                if self.starts[lane, k].begun:
                    total[lane] = self.wide(self.starts[lane, k].u0)
                before[lane] = self.increment(self.g[lane, k] * self.v_rest[lane, k])
            for t in tracks.get(k, ()):
                total[t.lane] = self.tracked(t.lane, k, t.u)
            total = total + slewed(plan, d[:, k] + before)
            total = np.minimum(np.maximum(total, low[:, k]), high[:, k])
            out[:, k], before = total, d[:, k].copy()
        self.integral = total
        if plan.floating:
            return np.minimum(np.maximum(output_of(plan, out), self.low), self.high)
        return saturate(shift(out, present(plan.integrator).to_output), plan.output.bits)

    def _tunes(self) -> dict[int, list[tuple[int, Applied]]]:
        """By sample, the lanes whose parameters change ahead of it, in their order."""
        found: dict[int, list[tuple[int, Applied]]] = {}
        for lane, course in self.tuned.items():
            for sample, parameters in course[1:]:
                found.setdefault(sample, []).append((lane, parameters))
        return found

    def tracked(self, lane: int, sample: int, u: Any) -> np.generic:
        """The integral that follows the output ``u`` ahead of a sample."""
        made: np.generic = self.wide(self.limited(lane, sample, u))
        return made

    def wide(self, u: Any) -> Any:
        """Output counts as what the integrator holds; as they are without one."""
        integrator = self.plan.integrator
        if integrator is None:
            return u
        return taken_in(u, integrator.state) if self.plan.floating else u << integrator.to_output

    def flags(self, u: Numbers) -> Numbers:
        """The flags after each step."""
        plan, scenario = self.plan, self.scenario
        found = FLAG_HIGH * (u >= self.high) + FLAG_LOW * (u <= self.low)
        outside = np.zeros(self.shape, bool)
        if not plan.floating:
            outside |= (scenario.ref != self.ref) | (scenario.meas != self.meas)
        if plan.schedule is not None:
            first, last = (self.kind(plan.schedule.breakpoints[i]) for i in (0, -1))
            found = found + FLAG_SCHEDULE * ((self.s < first) | (self.s > last))
            outside |= False if plan.floating else np.asarray(scenario.sched) != self.s
        made: Numbers = (found + FLAG_INPUT * outside).astype(np.uint8)
        return made
