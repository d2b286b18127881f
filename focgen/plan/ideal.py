"""The controller as the paper's mathematics has it: float64, with infinite memory or the same memory.

Eq. (10)–(14) as they stand, unfolded, with weights of its own; nothing of the plan is used but its two
conventions: terms of negative order are a trapezoidal integral of a Grünwald–Letnikov sum, and where that
integral is clamped (:mod:`focgen.plan.canonical`).

Before a reset the error has been e0 for ever. The response to that is known in closed form (with infinite
memory D^β of a constant is 0 for β > 0), and the sums run over e − e0, which starts from zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import fftconvolve, lfilter

from focgen.control.controller import Controller
from focgen.fractional.transfer import Polynomial
from focgen.plan.canonical import Realisation, inner_limits, realise
from focgen.plan.scenario import Reset, Scenario, Trace

_DIRECT = 4096  # taps up to which sums are taken one by one, not by transforms


def ideal(controller: Controller, scenario: Scenario, length: int | None = None) -> Trace:
    """Run a controller on physical inputs; returns physical u and d (ahead of the integrator), no flags.

    ``length``: the memory length L; None for infinite memory, all that has been.
    Raises PlanError where the transfer function cannot be realised.
    """
    operator = _Operator(realise(controller), controller, scenario.samples if length is None else length)
    v, rest = operator.run(scenario, endless=length is None)
    gain = controller.gain_at(scenario.sched) if controller.scheduled else controller.gain
    d = gain * v
    low, high = controller.ranges.output
    if not controller.integrator:
        return Trace(np.clip(d, low, high), d)
    first = {place: _gain_there(gain, *place) * value for place, value in rest.items()}
    return Trace(_integrated(controller, scenario, d, first), d)


def _gain_there(gain, lane: int, sample: int) -> float:
    return float(gain[lane, sample]) if np.ndim(gain) else float(gain)


def _weights(order: float, count: int) -> np.ndarray:
    """Eq. (11)."""
    j = np.arange(1, count + 1)
    return np.concatenate([[1.0], np.cumprod(1.0 - (order + 1.0) / j)])


def _table(terms: Polynomial, step: float, count: int) -> np.ndarray:
    """Σ c h^−β w_j^(β), eq. (10)–(14), without the zeros that whole orders end in."""
    total = sum(
        (t.coefficient * step**-t.order * _weights(t.order, count) for t in terms), np.zeros(count + 1)
    )
    return np.trim_zeros(total, "b") if total.any() else total[:1]


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

    def __init__(self, form: Realisation, controller: Controller, count: int):
        h = controller.sample_time
        self.form, self.limits, self.half_step = form, inner_limits(controller), 0.5 * h
        self.direct, self.rest, self.den = (_table(t, h, count) for t in (form.direct, form.rest, form.den))

    def run(self, scenario: Scenario, endless: bool) -> tuple[np.ndarray, dict]:
        """v of every sample, and what it was before each segment (key: lane, start)."""
        e, out, before = scenario.ref - scenario.meas, np.empty(scenario.ref.shape), {}
        for s in _segments(scenario):
            part = e[s.lane, s.start : s.stop] - s.constant
            still = self.still(endless) * s.constant
            out[s.lane, s.start : s.stop] = still + self.moved(part, s.constant, endless)
            before[s.lane, s.start] = still
        return out, before

    def still(self, endless: bool) -> float:
        """The gain for a constant error."""
        if endless:
            return self.form.steady_gain
        return float(self.direct.sum() / self.den.sum())

    def moved(self, part: np.ndarray, constant: float, endless: bool) -> np.ndarray:
        """What a change of the error from its constant adds to v."""
        forced = _convolved(self.direct, part)
        if self.form.rest:
            forced = forced + self.integral(part, constant, endless)
        return _solved(self.den, forced)

    def integral(self, part: np.ndarray, constant: float, endless: bool) -> np.ndarray:
        """The clamped trapezoid, from 0."""
        still = (
            sum(t.coefficient for t in self.form.rest if t.order == 0.0)
            if endless
            else float(self.rest.sum())
        )
        r = np.concatenate([[0.0], _convolved(self.rest, part)]) + still * constant
        low, high = self.limits
        out, z = [], 0.0
        for increment in (self.half_step * (r[1:] + r[:-1])).tolist():
            z = min(max(z + increment, low), high)
            out.append(z)
        return np.array(out)


def _convolved(table: np.ndarray, signal: np.ndarray) -> np.ndarray:
    if len(table) <= _DIRECT:
        return lfilter(table, [1.0], signal)
    return fftconvolve(table, signal)[: len(signal)]


def _solved(den: np.ndarray, forced: np.ndarray) -> np.ndarray:
    """v of den · v = forced."""
    return lfilter([1.0], den, forced) if len(den) > 1 else forced / den[0]


def _integrated(controller: Controller, scenario: Scenario, d: np.ndarray, first: dict) -> np.ndarray:
    """The trapezoidal integral of d, clamped to the output limits."""
    low, high = controller.ranges.output
    starts, tracks = {}, {}
    for s in _segments(scenario):
        starts.setdefault(s.start, []).append(s)
    for t in scenario.tracks:
        tracks.setdefault(t.sample, []).append(t)
    total, before, out = np.zeros(scenario.lanes), np.zeros(scenario.lanes), np.empty(d.shape)
    for k in range(scenario.samples):
        for s in starts.get(k, ()):
            total[s.lane], before[s.lane] = min(max(s.u0, low), high), first[s.lane, s.start]
        for t in tracks.get(k, ()):
            total[t.lane] = min(max(t.u, low), high)
        total = np.minimum(np.maximum(total + 0.5 * controller.sample_time * (d[:, k] + before), low), high)
        out[:, k], before = total, d[:, k].copy()
    return out
