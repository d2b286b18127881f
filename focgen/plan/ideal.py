"""The controller as the paper's mathematics has it: float64, with infinite memory or the same memory.

Eq. (10)–(14) as they stand, unfolded, with weights of its own; nothing of the plan is used but its two
conventions: terms of negative order are a trapezoidal integral of a Grünwald–Letnikov sum, and where that
integral is clamped (:mod:`focgen.plan.canonical`).

Before a reset the error has been e0 for ever. The response to that is known in closed form (with infinite
memory D^β of a constant is 0 for β > 0), and the sums run over e − e0, which starts from zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import fftconvolve, lfilter

from focgen.arrays import Array
from focgen.control.controller import Controller, GainSchedule
from focgen.fractional.transfer import Polynomial
from focgen.plan.canonical import Realisation, inner_limits, realise
from focgen.plan.memory import Memory
from focgen.plan.scenario import Reset, Scenario, Trace, Track
from focgen.present import present

_DIRECT = 4096  # taps up to which sums are taken one by one, not by transforms


def ideal(
    controller: Controller,
    scenario: Scenario,
    length: int | None = None,
    memories: Sequence[Memory] = (),
) -> Trace:
    """Run a controller on physical inputs; returns physical u and d (ahead of the integrator), no flags.

    ``length``: the memory length L; None for infinite memory, all that has been. ``memories``: exponential
    ones that stand for the orders they are of, instead; with them ``length`` only has to cover whole orders.
    Raises PlanError where the transfer function cannot be realised.
    """
    count = scenario.samples if length is None else length
    operator = _Operator(realise(controller), controller, count, {m.order: m for m in memories})
    v, rest = operator.run(scenario, endless=length is None)
    gain: Any = controller.gain_at(scenario.sched)
    low, high = (np.full(scenario.ref.shape, end) for end in controller.ranges.output)
    if scenario.tunes:
        gain = np.broadcast_to(gain, scenario.ref.shape).copy()
        _tuned(controller, scenario, gain, low, high)
    d = gain * v
    if not controller.integrator:
        return Trace(np.clip(d, low, high), d)
    first = {place: _gain_there(gain, *place) * value for place, value in rest.items()}
    return Trace(_integrated(controller, scenario, d, first, low, high), d)


def _tuned(controller: Controller, scenario: Scenario, gain: Array, low: Array, high: Array) -> None:
    """Write what physical parameters, none of which is refused, make of gain and limits, shape (lanes,
    samples), in place.
    """
    for tune in sorted(scenario.tunes, key=lambda tune: tune.sample):
        at = tune.lane, slice(tune.sample, None)
        gains = tuple(factor * g for factor, g in zip(tune.params.gain, controller.gains))
        if controller.scheduled:
            gain[at] = GainSchedule(controller.schedule.breakpoints, gains)(present(scenario.sched)[at])
        else:
            gain[at] = gains[0]
        low[at], high[at] = tune.params.u_min, tune.params.u_max


def _gain_there(gain: Any, lane: int, sample: int) -> float:
    return float(gain[lane, sample]) if np.ndim(gain) else float(gain)


def _weights(order: float, count: int) -> Array:
    """Eq. (11)."""
    j = np.arange(1, count + 1)
    return np.concatenate([[1.0], np.cumprod(1.0 - (order + 1.0) / j)])


class _Sum:
    """Σ c h^−β w_j^(β), eq. (10)–(14): taps, without the zeros that whole orders end in, and modes where a
    memory stands for an order: c h^−β ∇^m (w_0 + Σ_i w_i / (z − p_i)).
    """

    def __init__(self, terms: Polynomial, step: float, count: int, memories: dict[float, Memory]) -> None:
        total = np.zeros(max(count, 2) + 1)
        self.modes: list[tuple[float, float, int]] = []
        for t in terms:
            factor, memory = t.coefficient * step**-t.order, memories.get(t.order)
            order = t.order if memory is None else float(memory.differences)
            lead = 1.0 if memory is None else memory.lead
            total[: count + 1] += factor * lead * _weights(order, count)
            if memory is not None:
                modes = zip(memory.poles, memory.weights)
                self.modes.extend((pole, factor * weight, memory.differences) for pole, weight in modes)
        self.taps: Array = np.trim_zeros(total, "b") if total.any() else total[:1]

    @property
    def still(self) -> float:
        """The gain for a constant; a mode's is 0."""
        return float(self.taps.sum())

    def __call__(self, signal: Array) -> Array:
        """Applied to a signal that starts from zero."""
        total = _convolved(self.taps, signal)
        for pole, weight, m in self.modes:
            rise = np.concatenate([[0.0], weight * _weights(float(m), m)])
            total = total + lfilter(rise, [1.0, -pole], signal)
        return total

    def solved(self, forced: Array) -> Array:
        """v of (this) v = forced, from zero."""
        if self.modes:
            return self._recursion(forced)
        alone = len(self.taps) == 1
        solved: Array = forced / self.taps[0] if alone else lfilter([1.0], self.taps, forced)
        return solved

    def _recursion(self, forced: Array) -> Array:
        """Sample by sample: a mode's part at k is S_{k−1}, where S_k = p S_{k−1} + ∇^m v_k."""
        pole, weight, m = (np.array(x) for x in zip(*self.modes))
        state, back = np.zeros(len(pole)), self.taps[1:]
        past, out = np.zeros(len(back) + 2), []  # the newest first
        for target in forced.tolist():
            v = (target - back @ past[: len(back)] - weight @ state) / self.taps[0]
            first, second = v - past[0], v - 2.0 * past[0] + past[1]
            state = pole * state + np.where(m == 1, first, second)
            past[1:] = past[:-1].copy()
            past[0] = v
            out.append(v)
        return np.array(out)


@dataclass(frozen=True)
class _Segment:
    lane: int
    start: int
    stop: int
    constant: float
    u0: float


def _segments(scenario: Scenario) -> list[_Segment]:
    """Every lane from init or a reset to the next reset or the end."""
    found = []
    for lane in range(scenario.lanes):
        resets = sorted((r for r in scenario.resets if r.lane == lane), key=lambda r: r.sample)
        if not resets or resets[0].sample > 0:
            resets.insert(0, Reset(lane, 0, 0.0, 0.0, 0.0))
        ends = [r.sample for r in resets[1:]] + [scenario.samples]
        found += [_Segment(lane, r.sample, end, r.ref - r.meas, r.u0) for r, end in zip(resets, ends)]
    return found


class _Operator:
    """The transfer function, from e to v."""

    def __init__(
        self, form: Realisation, controller: Controller, count: int, memories: dict[float, Memory]
    ) -> None:
        h, parts = controller.sample_time, (form.direct, form.rest, form.den)
        self.form, self.controller, self.half_step = form, controller, 0.5 * h
        self.setpoint_filter, self.span = controller.setpoint_filter, controller.ranges.reference
        self.direct, self.rest, self.den = (_Sum(terms, h, count, memories) for terms in parts)

    def run(self, scenario: Scenario, endless: bool) -> tuple[Array, dict[tuple[int, int], float]]:
        """v of every sample, and what it was before each segment (key: lane, start)."""
        e, out, before = self.aimed(scenario) - scenario.meas, np.empty(scenario.ref.shape), {}
        for s in _segments(scenario):
            part = e[s.lane, s.start : s.stop] - s.constant
            still = self.still(endless) * s.constant
            out[s.lane, s.start : s.stop] = still + self.moved(part, s.constant, endless)
            before[s.lane, s.start] = still
        return out, before

    def aimed(self, scenario: Scenario) -> Array:
        """The set point, through its filter where there is one: y = p y z^−1 + (1 − p) ref, p = exp(−h/T).

        It starts from the reset's ref; after init from what is nearest to 0 in the range.
        """
        if self.setpoint_filter is None:
            return scenario.ref
        p, out = np.exp(-2.0 * self.half_step / self.setpoint_filter), np.empty(scenario.ref.shape)
        given = {(r.lane, r.sample): r.ref for r in scenario.resets}
        for s in _segments(scenario):
            start = given.get((s.lane, s.start), min(max(0.0, self.span[0]), self.span[1]))
            part = scenario.ref[s.lane, s.start : s.stop]
            out[s.lane, s.start : s.stop] = lfilter([1.0 - p], [1.0, -p], part, zi=[p * start])[0]
        return out

    def still(self, endless: bool) -> float:
        """The gain for a constant error."""
        if endless:
            return self.form.steady_gain
        return self.direct.still / self.den.still

    def moved(self, part: Array, constant: float, endless: bool) -> Array:
        """What a change of the error from its constant adds to v."""
        forced = self.direct(part)
        if self.form.rest:
            forced = forced + self.integral(part, constant, endless)
        return self.den.solved(forced)

    def integral(self, part: Array, constant: float, endless: bool) -> Array:
        """The clamped trapezoid, from 0."""
        still = sum(t.coefficient for t in self.form.rest if t.order == 0.0) if endless else self.rest.still
        r = np.concatenate([[0.0], self.rest(part)]) + still * constant
        low, high = inner_limits(self.controller, self.form.constant if endless else self.den.still)
        out, z = [], 0.0
        for increment in (self.half_step * (r[1:] + r[:-1])).tolist():
            z = min(max(z + increment, low), high)
            out.append(z)
        return np.array(out)


def _convolved(table: Array, signal: Array) -> Array:
    if len(table) <= _DIRECT:
        made: Array = lfilter(table, [1.0], signal)
    else:
        made = fftconvolve(table, signal)[: len(signal)]
    return made


def _integrated(
    controller: Controller,
    scenario: Scenario,
    d: Array,
    first: dict[tuple[int, int], float],
    low: Array,
    high: Array,
) -> Array:
    """The trapezoidal integral of d, clamped to the output limits of every sample; what is set ahead of one,
    and what stands where they change, likewise.
    """

    def within(u: float, lane: int, k: int) -> float:
        return min(max(u, float(low[lane, k])), float(high[lane, k]))

    most = np.inf if controller.slew_limit is None else controller.slew_limit * controller.sample_time
    starts: dict[int, list[Any]] = {}
    tracks: dict[int, list[Track]] = {}
    for s in _segments(scenario):
        starts.setdefault(s.start, []).append(s)
    for t in scenario.tracks:
        tracks.setdefault(t.sample, []).append(t)
    total: Array = np.zeros(scenario.lanes)
    before: Array = np.zeros(scenario.lanes)
    out = np.empty(d.shape)
    for k in range(scenario.samples):
        total = np.minimum(np.maximum(total, low[:, k]), high[:, k])
        for s in starts.get(k, ()):
            total[s.lane], before[s.lane] = within(s.u0, s.lane, k), first[s.lane, s.start]
        for t in tracks.get(k, ()):
            total[t.lane] = within(t.u, t.lane, k)
        total = total + np.clip(0.5 * controller.sample_time * (d[:, k] + before), -most, most)
        total = np.minimum(np.maximum(total, low[:, k]), high[:, k])
        out[:, k], before = total, d[:, k].copy()
    return out
