"""A controller in sixty decimal digits: eq. (10)–(14) as they stand, nothing of the plan but its memory."""

from __future__ import annotations

from decimal import Context, Decimal, localcontext
from itertools import pairwise

import numpy as np

from focgen.control.controller import Controller
from focgen.plan.canonical import inner_limits, realise
from focgen.plan.plan import Plan
from focgen.plan.scenario import Scenario

DIGITS = Context(prec=60)


def exact_operator(plan: Plan, scenario: Scenario) -> np.ndarray:
    """The signal ahead of the integrator for physical inputs, shape (lanes, samples): computed in sixty
    digits, then rounded to doubles. Resets are left out; parameters are those of each lane's tune at 0."""
    with localcontext(DIGITS):
        lanes = [_lane(plan, scenario, lane) for lane in range(scenario.lanes)]
    return np.array([[float(d) for d in lane] for lane in lanes])


def _lane(plan: Plan, scenario: Scenario, lane: int) -> list[Decimal]:
    controller = plan.controller
    e = _errors(controller, scenario, lane)
    v = _filtered(plan, e)
    sched = None if scenario.sched is None else scenario.sched[lane].tolist()
    factors = [tune.params.gain for tune in scenario.tunes if tune.lane == lane]
    gains = [Decimal(g) for g in controller.gains]
    if factors:
        gains = [Decimal(f) * g for f, g in zip(factors[0], gains)]
    return [_gain(controller, gains, None if sched is None else sched[k]) * v[k] for k in range(len(v))]


def _errors(controller: Controller, scenario: Scenario, lane: int) -> list[Decimal]:
    ref, meas = ([Decimal(x) for x in signal[lane].tolist()] for signal in (scenario.ref, scenario.meas))
    if controller.setpoint_filter is not None:
        low, high = controller.ranges.reference
        y = Decimal(min(max(0.0, low), high))
        p = (-Decimal(controller.sample_time) / Decimal(controller.setpoint_filter)).exp()
        for k, r in enumerate(ref):
            ref[k] = y = p * y + (1 - p) * r
    return [r - m for r, m in zip(ref, meas)]


class _Sum:
    """Σ c h^−β w_j x_{k−j} over the plan's memory, for a signal that was 0 before."""

    def __init__(self, plan: Plan, terms) -> None:
        h, by_order = Decimal(plan.sample_time), {m.order: m for m in plan.memories}
        self.taps, self.modes = [Decimal(0)] * (max(plan.length, 2) + 1), []
        for term in terms:
            factor = Decimal(term.coefficient) * h ** -Decimal(term.order)
            memory = by_order.get(term.order)
            order = Decimal(term.order) if memory is None else Decimal(memory.differences)
            lead = Decimal(1 if memory is None else memory.lead)
            weight = factor * lead
            for j in range(plan.length + 1):
                self.taps[j] += weight
                weight *= 1 - (order + 1) / (j + 1)
            if memory is not None:
                for pole, share in zip(memory.poles, memory.weights):
                    self.modes.append([Decimal(float(pole)), factor * Decimal(float(share)), int(order)])
        self.states = [Decimal(0)] * len(self.modes)
        self.past: list[Decimal] = []  # the latest first

    def before(self) -> Decimal:
        """What the past adds to the present sample."""
        taps = sum((w * x for w, x in zip(self.taps[1:], self.past)), Decimal(0))
        return taps + sum((mode[1] * s for mode, s in zip(self.modes, self.states)), Decimal(0))

    def push(self, x: Decimal) -> None:
        one, two = [*self.past, Decimal(0), Decimal(0)][:2]
        rise = {1: x - one, 2: x - 2 * one + two}
        self.states = [mode[0] * s + rise[mode[2]] for mode, s in zip(self.modes, self.states)]
        self.past = [x, *self.past][: len(self.taps)]

    def __call__(self, x: Decimal) -> Decimal:
        made = self.taps[0] * x + self.before()
        self.push(x)
        return made


def _filtered(plan: Plan, e: list[Decimal]) -> list[Decimal]:
    form, h = realise(plan.controller), Decimal(plan.sample_time)
    direct, rest, den = (_Sum(plan, terms) for terms in (form.direct, form.rest, form.den))
    low, high = (Decimal(x) for x in inner_limits(plan.controller, float(sum(den.taps))))
    z = r_before = Decimal(0)
    found = []
    for x in e:
        r = rest(x)
        z, r_before = min(max(z + h / 2 * (r + r_before), low), high), r
        v = (direct(x) + z - den.before()) / den.taps[0]
        den.push(v)
        found.append(v)
    return found


def _gain(controller: Controller, gains: list[Decimal], value: float | None) -> Decimal:
    if value is None:
        return gains[0]
    points, s = [Decimal(p) for p in controller.schedule.breakpoints], Decimal(value)
    if s <= points[0]:
        return gains[0]
    for (p, q), (g, k) in zip(pairwise(points), pairwise(gains)):
        if s <= q:
            return g + (k - g) * (s - p) / (q - p)
    return gains[-1]
