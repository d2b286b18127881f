"""What every node of an integer plan can reach, from its description alone: pairs of whole numbers.

Written for the tests of the plan's own proofs, and sharing nothing with them.
"""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import pairwise, product

import numpy as np

from focgen.plan.plan import Plan, Sum

Pair = tuple[int, int]


def shift(x: int, by: int) -> int:
    return (x + 2 ** (by - 1)) // 2**by if by else x


def shifted(pair: Pair, by: int) -> Pair:
    return shift(pair[0], by), shift(pair[1], by)


def plus(*pairs: Pair) -> Pair:
    return sum(a for a, _ in pairs), sum(b for _, b in pairs)


def minus(a: Pair, b: Pair) -> Pair:
    return a[0] - b[1], a[1] - b[0]


def times(a: Pair, b: Pair) -> Pair:
    ends = [x * y for x, y in product(a, b)]
    return min(ends), max(ends)


def hull(*pairs: Pair) -> Pair:
    return min(a for a, _ in pairs), max(b for _, b in pairs)


def worst(pair: Pair) -> int:
    return max(abs(pair[0]), abs(pair[1]))


def half(by: int) -> int:
    return 2**by // 2


def span(form) -> Pair:
    return int(form.low), int(form.high)


def weighted(weights, each: Pair) -> Pair:
    """Each sample at the end that helps."""
    ends = [sorted((int(w) * each[0], int(w) * each[1])) for w in weights]
    return sum(a for a, _ in ends), sum(b for _, b in ends)


def total(table: Sum, each: Pair, past: Pair, found: dict[str, int]) -> Pair:
    """A history sum, and its parts noted in ``found``; ``past``: what drives its modes."""
    parts = []
    for block in table.blocks:
        reach = weighted(block.weights, each)
        found[f"{table.name}[{block.first}..{block.last}]"] = worst(reach) + half(block.align)
        parts.append(shifted(reach, block.align))
    for i, bank in enumerate(table.banks):
        u = hull(past, (0, 0))
        u = u if bank.order < 1 else minus(u, u)
        spare = half(bank.to_drive) + (math.ceil(0.5 / min(bank.real_rates)) if bank.rate_shift else 0)
        scaled = u[0] * 2**bank.up, u[1] * 2**bank.up
        mean = scaled[0] - spare, scaled[1] + spare
        far = max(scaled[1] - mean[0], mean[1] - scaled[0])
        drive = shifted((-far, far), bank.to_drive)
        rates = min(map(int, bank.rates)), max(map(int, bank.rates))
        reach = weighted(bank.weights, drive)
        name = f"{table.name} bank {i} "
        found[name + "mean"] = worst(mean)
        found[name + "departure"] = far + half(bank.to_drive)
        found[name + "drive"] = worst(drive)
        found[name + "rate product"] = worst(times(drive, rates)) + half(bank.rate_shift)
        found[name + "sum"] = worst(reach) + half(bank.align)
        parts.append(shifted(reach, bank.align))
    made = plus(*parts)
    found[f"{table.name} total"] = worst(made)
    return made


def reached(plan: Plan, v: int) -> dict[str, int]:
    """Every node's worst magnitude, its rounding included; ``v``: what the recursion is proved to reach."""
    found: dict[str, int] = {"error": worst(minus(span(plan.reference), span(plan.measurement)))}
    e = hull(span(plan.error), (0, 0))
    p = total(plan.direct, e, e, found) if plan.direct else (0, 0)
    if plan.inner:
        state, by = span(plan.inner.state), plan.inner.to_wide
        r = total(plan.inner.rest, e, e, found)
        found["inner sum"] = worst(plus(state, r, r)) + half(by)
        p = plus(p, shifted(state, by))
    found["p"] = worst(p)
    reach = filtered(plan, p, v, found)
    g = tuned(plan, found) if plan.tuning else scheduled(plan, found)
    made = times(reach, g)
    found["gain product"] = worst(made) + half(plan.gain_shift)
    d = shifted(made, plan.gain_shift)
    found["increment"] = worst(d)
    if plan.integrator:
        state = hull(span(plan.integrator.state), (0, 0))
        found["integrator sum"] = worst(plus(state, d, d)) + half(plan.integrator.to_output)
    found["output"] = worst(span(plan.output))
    return found


def filtered(plan: Plan, p: Pair, v: int, found: dict[str, int]) -> Pair:
    """v: without feedback p itself; with feedback it is saturated to its type."""
    if plan.feedback is None:
        found["v"] = worst(shifted(p, plan.narrow))
        return shifted(p, plan.narrow)
    whole = -(2 ** (plan.filtered.bits - 1)), 2 ** (plan.filtered.bits - 1) - 1
    s = total(plan.feedback.table, whole, (-v, v), found)
    carry = half(plan.narrow)
    found["x"] = worst(plus(minus(p, s), (-carry, carry))) + carry
    steady = abs(int(plan.feedback.steady))
    found["steady product"] = worst(span(plan.error)) * steady + half(plan.feedback.steady_shift)
    found["v"] = v
    return whole


def scheduled(plan: Plan, found: dict[str, int]) -> Pair:
    """g at both ends of every segment."""
    if plan.schedule is None:
        return int(plan.constant_gain), int(plan.constant_gain)
    schedule, gains, products, spare = plan.schedule, [*map(int, plan.schedule.gains)], [0], 0
    for i, (p, q) in enumerate(pairwise(schedule.breakpoints)):
        slope, by = int(schedule.slopes[i]), schedule.slope_shifts[i]
        products.append(slope * (q - 1 - p))
        spare = max(spare, half(by))
        gains.append(int(schedule.gains[i]) + shift(products[-1], by))
    found["slope product"] = worst((min(products), max(products))) + spare
    found["gain"] = worst((min(gains), max(gains)))
    return min(gains), max(gains)


def tuned(plan: Plan, found: dict[str, int]) -> Pair:
    """The same over the corners of the box: a factor for each gain."""
    box, schedule = plan.tuning, plan.schedule
    factors = int(box.factor.low), int(box.factor.high)
    made = [[f * int(n) for f in factors] for n in box.nominal]
    ends = [[shift(x, box.to_gain) for x in both] for both in made]
    found["tuned gain product"] = max(abs(x) for both in made for x in both) + half(box.to_gain)
    found["tuned gain"] = max(abs(x) for both in ends for x in both)
    low, high = min(map(min, ends)), max(map(max, ends))
    if schedule is None:
        found["gain"] = worst((low, high))
        return low, high
    products, slopes, steps, spare, by_slope = [], [], [0], 0, 0
    runs = [int(run) for run in np.diff(schedule.breakpoints)]
    for i, run in enumerate(runs):
        per, to_slope, by = int(box.reciprocals[i]), box.to_slopes[i], schedule.slope_shifts[i]
        rises = [b - a for a, b in product(ends[i], ends[i + 1])]
        products += [rise * per for rise in rises]
        own = [shift(rise * per, to_slope) for rise in rises]
        slopes, steps = slopes + own, steps + [slope * (run - 1) for slope in own]
        spare, by_slope = max(spare, half(to_slope)), max(by_slope, half(by))
        # the reciprocal is off by half a count, the slope by half of its own, the last shift by one half
        steep = Fraction(max(map(abs, rises)) * run, 2 ** (to_slope + by + 1)) + Fraction(run, 2 ** (by + 1))
        beyond = math.ceil(steep + Fraction(1, 2))
        low = min(low, min(ends[i] + ends[i + 1]) - beyond)
        high = max(high, max(ends[i] + ends[i + 1]) + beyond)
    found["tuned slope product"] = worst((min(products), max(products))) + spare
    found["tuned slope"] = worst((min(slopes), max(slopes)))
    found["slope product"] = worst((min(steps), max(steps))) + by_slope
    found["gain"] = worst((low, high))
    return low, high
