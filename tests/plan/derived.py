"""Tables, norms and limits of a controller by themselves: from its transfer function, in forty digits, and by
running the recursion. Nothing of the plan is asked but its memory's poles, weights and lengths.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from decimal import Context, Decimal, localcontext
from functools import cache, cached_property

import numpy as np
from scipy.signal import lfilter

from focgen.control.controller import Controller, Tunable
from focgen.errors import PlanError
from focgen.plan.build import build_plan
from focgen.plan.plan import Plan
from tests.controllers import random_controller

LONG = 1 << 12
"""Samples after which a response has to have died away."""


@dataclass(frozen=True)
class Weights:
    """Taps by lag from 0 on, their sizes before they cancel, and modes (m, q, c), all divided alike."""

    taps: np.ndarray
    sizes: np.ndarray
    modes: tuple[tuple[int, float, float], ...] = ()

    def response(self, count: int = LONG) -> np.ndarray:
        """To a unit sample."""
        found = np.zeros(count)
        found[: len(self.taps)] += self.taps
        for m, q, c in self.modes:
            one = np.concatenate([[0.0], (1.0 - q) ** np.arange(count - 1)])
            for _ in range(m):
                one = np.diff(one, prepend=0.0)
            found += c * one
        return found

    @property
    def norm(self) -> float:
        return float(np.abs(self.response()).sum())

    @property
    def total(self) -> float:
        return float(self.taps.sum())


@dataclass(frozen=True)
class Truth:
    """What a plan stands for. ``limits``: of the inner integral, over the normaliser, the lower first."""

    controller: Controller
    direct: Weights | None
    rest: Weights | None
    den: Weights | None
    limits: tuple[float, float]

    @cached_property
    def inverse(self) -> np.ndarray:
        """1/A, as long as ``LONG``, run sample by sample."""
        unit = np.eye(1, LONG)[0]
        if not self.den.modes:
            return lfilter([1.0], self.den.taps, unit)
        m, q, c = (np.array(x, float) for x in zip(*self.den.modes))
        state, past, out = np.zeros(len(q)), np.zeros(len(self.den.taps) + 2), np.zeros(LONG)
        back = self.den.taps[1:]
        for k in range(LONG):
            v = unit[k] - back @ past[: len(back)] - c @ state
            state = (1.0 - q) * state + np.where(m == 1, v - past[0], v - 2.0 * past[0] + past[1])
            past[1:] = past[:-1].copy()
            past[0] = out[k] = v
        return out

    def norm(self, signal) -> float | None:
        """‖signal/A‖₁; None where it has not died away."""
        found = np.abs(np.convolve(np.asarray(signal, float), self.inverse)[:LONG])
        return None if found[-64:].max() > 1e-9 * found.max() else float(found.sum())


def truth(plan: Plan) -> Truth:
    """Of a plan's controller with the plan's memory."""
    controller = plan.controller
    with localcontext(Context(prec=40)):
        return _truth(plan, controller)


def _truth(plan: Plan, controller: Controller) -> Truth:
    h, whole = Decimal(plan.sample_time), lambda x: Decimal(round(x)) if abs(x - round(x)) < 1e-9 else x
    num = [(Decimal(t.coefficient), Decimal(t.order)) for t in controller.transfer.num]
    den = [(Decimal(t.coefficient), Decimal(t.order)) for t in controller.transfer.den]
    lowest = min(order for _, order in den)
    num, den = ([(c, whole(Decimal(float(o - lowest)))) for c, o in terms] for terms in (num, den))
    one = Decimal(1)
    scale = _weights(plan, den, h, one, one)[1]
    direct = [(c, o) for c, o in num if o >= 0]
    rest = [(c, whole(Decimal(float(o + 1)))) for c, o in num if o < 0]
    back = _weights(plan, den, h, scale, one)[0]
    return Truth(
        controller,
        _weights(plan, direct, h, scale, one)[0] if direct else None,
        _weights(plan, rest, h, scale, h / 2)[0] if rest else None,
        back if len(den) > 1 else None,
        _limits(controller, back.total) if rest else (0.0, 0.0),
    )


def _weights(plan: Plan, terms, h: Decimal, scale: Decimal, factor: Decimal) -> tuple[Weights, Decimal]:
    """Σ c h^−β w_j, and the weight at lag 0 ahead of the division."""
    known = {m.order: m for m in plan.memories}
    count = plan.length if not plan.exponential else 9
    taps, sizes, modes = [Decimal(0)] * (count + 1), [Decimal(0)] * (count + 1), []
    for c, order in terms:
        memory = next((m for o, m in known.items() if abs(float(order) - o) < 1e-12), None)
        size = c * h**-order * factor / scale
        weight = size * (Decimal(1) if memory is None else Decimal(memory.lead))
        differences = order if memory is None else Decimal(memory.differences)
        for j in range(count + 1):
            taps[j], sizes[j] = taps[j] + weight, sizes[j] + abs(weight)
            weight *= 1 - (differences + 1) / (j + 1)
        if memory is not None:
            pairs = zip(memory.poles, memory.weights)
            modes += [(memory.differences, 1.0 - float(p), float(size * Decimal(float(w)))) for p, w in pairs]
    return Weights(np.array(taps, float), np.array(sizes, float), tuple(modes)), taps[0]


def _limits(controller: Controller, constant: float) -> tuple[float, float]:
    """What takes the output from one limit to the other at the smallest gain; ahead of an integrator, in one
    sample."""
    factor = controller.tunable.gain[0] if controller.tunable else 1.0
    gains = [g for g in controller.gains if g]
    low, high = controller.ranges.output
    if controller.integrator:
        high = (high - low) / controller.sample_time
        low = -high
    smallest = min(map(abs, gains)) * factor
    ends = [0.0] + [np.sign(g) * x * constant / smallest for g in gains for x in (low, high)]
    return min(ends), max(ends)


def dressed(seed: int, longest: int = 20) -> Controller:
    """A random controller, every third of them with each of the things that one can have besides."""
    rng, controller = np.random.default_rng([seed, 31]), random_controller(seed, longest)
    h, (low, high) = controller.sample_time, controller.ranges.output
    third = (high - low) / 3.0
    if seed % 3 == 0:
        controller = replace(controller, setpoint_filter=float(h * 10.0 ** rng.uniform(-0.5, 2.0)))
    if seed % 3 == 1 and controller.integrator:
        controller = replace(controller, slew_limit=float((high - low) / h * 10.0 ** rng.uniform(-2.0, -0.5)))
    if seed % 3 == 2:
        factors = float(rng.uniform(0.3, 1.0)), float(rng.uniform(1.0, 2.0))
        controller = replace(controller, tunable=Tunable(factors, (low, low + third), (high - third, high)))
    return controller


def planned(controller: Controller, arithmetic: str, **memory) -> Plan | None:
    """None where the arithmetic cannot carry it."""
    try:
        return build_plan(controller, arithmetic, tunable=controller.tunable is not None, **memory)
    except PlanError:
        return None


@cache
def plans(seeds: range, arithmetic: str) -> tuple[Plan, ...]:
    """Of short memory, and one with modes."""
    found = [planned(dressed(seed), arithmetic) for seed in seeds]
    modes = {"memory": "exponential", "tolerance": 0.05, "horizon": 10**5 if seeds.start == 0 else 100}
    found.append(planned(dressed(seeds.start + 1), arithmetic, **modes))
    return tuple(plan for plan in found if plan)
