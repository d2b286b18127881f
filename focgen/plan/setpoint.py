"""The set-point filter: a lag of first order ahead of e = y − meas, with no dead band.

With the reference r_k, y_k = y_{k−1} + q (r_k − y_{k−1}), q = 1 − exp(−h/T). ``reset`` sets y to its ref
(to init's where an argument cannot be used), ``init`` to what is nearest to 0 in the reference's range.
``track`` leaves it. Nothing is fed back, so margins are those of the loop without it.

* Fixed: F is y in counts of 2^−up of r's. F ← F + a (r − shift(F, up)), then y = shift(F, up); a is q in
  counts of 2^−up. While y is not r, a (r − y) moves F towards it, by at least a ≥ 1; once it is, F stays.
  So a constant is reached and held, in every bit. Let F = y 2^up + ρ. The new F is a mean of y 2^up and r
  2^up, plus the same ρ, which rounds to 0: y stays in the range of r, and F within ``low`` … ``high``. Only
  r − y is rounded, to half a count. F takes up q of that and forgets q of what it has: it is within half a
  count of exact arithmetic for ever.
* Floating: the state is the lag λ = r − y, which is rounded relative to itself, and the latest r. With x =
  λ + (r_k − r_{k−1}): λ ← x − q x, 0 where |λ| ≤ ``drop``, and y = r_k − λ. While r is constant λ falls by
  q a sample until it is 0; y is r then. A sample adds at most u (|r_k − r_{k−1}| + |x| + q |x| + |λ|) to
  the error of λ, and q of that error is forgotten each sample.

A state that is damaged: in fixed point F is clamped before it is used, so e stays in its range and the
damage fades. Floating, a latest r that is not usable, or a λ that is NaN or reaches 4 times as far, is
found by the next step, as other damages are; the memory begins anew with y at this sample's reference.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from focgen.arrays import Kind, Numbers
from focgen.errors import PlanError
from focgen.plan.formats import nearest, shift
from focgen.plan.plan import Plan, SetPoint
from focgen.plan.rounding import half_place
from focgen.plan.scenario import Scenario
from focgen.plan.usable import usable
from focgen.present import present

_UP = 30
_LONGEST = 65_536  # samples of a time constant: a rate has 14 bits then, and a float's lag still shrinks
_DROP = {"float": 2.0**-100, "double": 2.0**-900}
_UNIT = {"float": 2.0**-24, "double": 2.0**-53}


def rate_of(seconds: float, step: float) -> float:
    """q of a time constant and a sample time."""
    return -math.expm1(-step / seconds)


def with_set_point(plan: Plan) -> Plan:
    """A plan that knows its controller's set-point filter, where there is one.

    Raises PlanError where that is too slow to be counted.
    """
    seconds = plan.controller.setpoint_filter
    if seconds is None:
        return plan
    if not 0.0 < seconds <= _LONGEST * plan.sample_time:
        what = f"has a setpoint_filter of {seconds:g} s, not above 0 and at most {_LONGEST} samples"
        raise PlanError(plan.name, what, "choose a shorter one or a longer sample_time")
    form, rate = plan.reference, rate_of(seconds, plan.sample_time)
    if form.floating:
        kind = np.float32 if form.ctype == "float" else np.float64
        return replace(plan, set_point=SetPoint(float(kind(rate)), drop=_DROP[form.ctype]))
    half = 1 << (_UP - 1)
    ends = (int(form.low) << _UP) - half, (int(form.high) << _UP) + half - 1
    return replace(plan, set_point=SetPoint(nearest(rate * 2.0**_UP), _UP, *ends))


def set_point_error(plan: Plan) -> float:
    """How far y can be from exact arithmetic's, in physical units, the rounding of r itself not included."""
    if plan.set_point is None:
        return 0.0
    q, (low, high) = (
        rate_of(present(plan.controller.setpoint_filter), plan.sample_time),
        plan.controller.ranges.reference,
    )
    largest, reach = max(abs(low), abs(high)), max(high, 0.0) - min(low, 0.0)
    double = 4.0 * _UNIT["double"] * largest / q  # the reference's own
    if not plan.reference.floating:
        off = abs(plan.set_point.rate * 2.0**-_UP - q) / q
        return plan.reference.lsb + 1.01 * (off * reach + double)
    return 1.01 * double + _lag_error(plan, q, high - low, largest)


def _lag_error(plan: Plan, q: float, width: float, largest: float) -> float:
    """Of λ for ever and of y = r − λ, floating. With w what the reference can move by, |x| ≤ w:

    ε ← (1 − q) (ε + the difference's rounding + x's) + that of q x and of λ, (q̂ − q) x, and the drop.

    The machine's own x is longer by ε at most, which 4 u w / q are more than enough for.
    """
    made, u = present(plan.set_point), _UNIT[plan.reference.ctype]
    width += 4.0 * u * largest  # of the rounded reference
    spare = (4.1 * u * width + made.drop) / q
    far = width + spare
    each = (1.0 - q) * (half_place(width, u) + half_place(far, u))
    each += half_place(float(made.rate) * far, u) + half_place((1.0 - q) * far * (1.0 + 2.0 * u), u)
    each += abs(float(made.rate) - q) * far + made.drop
    return 1.0001 * (each / q + half_place(largest + spare, u))


def start_of(plan: Plan) -> int | float:
    """y after init, raw."""
    return min(max(0, plan.reference.low), plan.reference.high)


class Aim:
    """The filter of several lanes, sample by sample; ``state`` has what C keeps by its members' names,
    each of shape (lanes,). Values are raw, of the numpy type ``kind``.
    """

    def __init__(self, plan: Plan, kind: Kind, lanes: int) -> None:
        self.plan, self.kind = plan, kind
        names = ("lag", "latest") if plan.floating else ("set_point",)
        self.state: dict[str, Numbers] = {name: np.zeros(lanes, kind) for name in names}
        for lane in range(lanes):
            self.settle(lane, start_of(plan))

    def settle(self, lane: int, ref: Any) -> None:
        """As if the reference had been ``ref`` for ever."""
        if self.plan.floating:
            self.state["lag"][lane], self.state["latest"][lane] = 0, ref
        else:
            self.state["set_point"][lane] = int(ref) << present(self.plan.set_point).up

    def step(self, r: Numbers) -> Numbers:
        """y of this sample, shape (lanes,)."""
        made, state = present(self.plan.set_point), self.state
        rate = self.kind(made.rate)
        if not self.plan.floating:
            before = state["set_point"]
            now = before + rate * (r - shift(before, made.up))
            self.state = {"set_point": now}
            y: Numbers = shift(now, made.up)
            return y
        x = state["lag"] + (r - state["latest"])
        lag = x - rate * x
        lag = np.where(np.abs(lag) <= self.kind(made.drop), self.kind(0), lag)
        self.state = {"lag": lag, "latest": r.copy()}
        found: Numbers = r - lag
        return found


def error_of(
    plan: Plan, scenario: Scenario, ref: Numbers, meas: Numbers
) -> tuple[Numbers, dict[str, Numbers]]:
    """e, shape (lanes, samples), and what the last sample leaves of the filter's state.

    ``ref`` and ``meas`` are those of the scenario as they are taken in, clamped.
    """
    if plan.set_point is None:
        return ref - meas, {}
    aim, out = Aim(plan, ref.dtype.type, len(ref)), np.empty_like(ref)
    starts: dict[int, list[Any]] = {}
    for lane, sample, value in set_points(plan, scenario):
        starts.setdefault(sample, []).append((lane, value))
    for k in range(ref.shape[1]):
        for lane, value in starts.get(k, ()):
            aim.settle(lane, value)
        out[:, k] = aim.step(ref[:, k])
    return out - meas, aim.state


def set_points(plan: Plan, scenario: Scenario) -> Iterator[tuple[int, int, object]]:
    """Lane, sample and y of every reset; init's where what it is given cannot be used."""
    for r in scenario.resets:
        known = usable(r.ref, plan.reference) and usable(r.meas, plan.measurement)
        value = r.ref if known else start_of(plan)
        if not plan.floating:
            value = min(max(int(value), int(plan.reference.low)), int(plan.reference.high))
        yield r.lane, r.sample, value


def begun(plan: Plan, scenario: Scenario, kind: Kind, lane: int, sample: int) -> dict[str, np.generic]:
    """The state ahead of a sample at which a lane begins anew, after a reset or init."""
    aim = Aim(plan, kind, 1)
    for at, k, value in set_points(plan, scenario):
        if (at, k) == (lane, sample):
            aim.settle(0, value)
    return {name: values[0] for name, values in aim.state.items()} if plan.set_point else {}
