"""The gain of a floating plan, operation by operation, at the ends of every stretch of its schedule."""

from __future__ import annotations

import math
from itertools import pairwise

from focgen.plan.plan import Plan

U64 = 2.0**-53


def half_place(largest: float, u: float, beyond: float = 2.0**-40) -> float:
    """Half of the last place of the numbers up to ``largest``, and up to a share ``beyond`` it."""
    if largest <= 0.0:
        return 0.0
    mantissa, exponent = math.frexp(largest * (1.0 + beyond))
    return u * 2.0 ** (exponent - 1 - (mantissa == 0.5))


def gamma(n: float, u: float) -> float:
    return n * u / (1.0 - n * u)


def pieces(plan: Plan, factor: float, u: float) -> list[tuple[float, float]]:
    """(error, largest gain), both physical, of what lies below, in and above the breakpoints."""
    controller, most = plan.controller, plan.controller.factors[1]
    off = _held(plan, factor, u)
    gains = [abs(g) * most for g in controller.gains]
    if plan.schedule is None:
        return [(off[0] / factor + 6.0 * U64 * gains[0], gains[0])]
    (low, high), points = controller.ranges.schedule, controller.schedule.breakpoints
    found = []
    if low < points[0]:
        found.append((off[0] / factor + 6.0 * U64 * gains[0], gains[0]))
    if high >= points[-1]:
        found.append((off[-1] / factor + 6.0 * U64 * gains[-1], gains[-1]))
    for i, (p, q) in enumerate(pairwise(points)):
        a, b = max(p, low), min(q, high)
        if a <= b:
            found.append(_segment(plan, factor, u, i, (a, b), off))
    return found


def _held(plan: Plan, factor: float, u: float) -> list[float]:
    """What the gains at the breakpoints are off by, in machine units, with any factor on them."""
    box, most = plan.tuning, plan.controller.factors[1]
    raw = box.nominal if box else plan.schedule.gains if plan.schedule else (plan.constant_gain,)
    off = [abs(held - g * factor) for held, g in zip(raw, plan.controller.gains)]
    if not box:
        return off
    made = []
    for held, known in zip(map(abs, raw), off):
        made.append(half_place(most, u) * held + most * known + half_place(most * (1.0 + 4.0 * u) * held, u))
    return made


def _segment(plan: Plan, factor: float, u: float, i: int, reached, off) -> tuple[float, float]:
    controller, schedule, box = plan.controller, plan.schedule, plan.tuning
    (p, q), (p_, q_) = controller.schedule.breakpoints[i : i + 2], schedule.breakpoints[i : i + 2]
    g0, g1 = (g * factor for g in controller.gains[i : i + 2])
    least, most = controller.factors
    rise = max(abs(f * g1 - g * g0) for f in (least, most) for g in (least, most)) + off[i] + off[i + 1]
    per = box.reciprocals[i] if box else None
    slope = rise * per * (1.0 + 4.0 * u) if box else abs(schedule.slopes[i])
    steep = max(slope, rise / (q - p))
    a, b = reached

    def line(s):
        share = (s - p) / (q - p)
        return most * (abs(g0) + (abs(g1) - abs(g0)) * share)

    def known(s):
        share = (s - p) / (q - p)
        if box:
            return off[i] + (off[i + 1] - off[i]) * share
        return abs(schedule.gains[i] + schedule.slopes[i] * (s - p) - (g0 + (g1 - g0) * share))

    moved = half_place(max(abs(a), abs(b)), u) + max(abs(p - p_), abs(q - q_))
    along, largest = b - p + moved, max(line(a), line(b))
    error = max(known(a), known(b), off[i + 1] if q - b <= moved else 0.0) + steep * moved
    if box:  # a rise, times a reciprocal
        made = half_place(rise, u) * per + half_place(rise * per * (1.0 + u), u)
        error += along * (made + (abs(per * (q_ - p_) - 1.0) + 4.0 * U64) * rise * per)
    product = half_place(steep * along * (1.0 + 4.0 * u), u)
    last = half_place((largest + error + product) * (1.0 + 4.0 * u), u)
    error += steep * half_place(along, u) + product + last
    error += U64 * (6.0 * largest + 6.0 * rise + 2.0 * steep * max(abs(a), abs(b)))
    return error / factor, largest / factor
