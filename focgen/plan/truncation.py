"""What a memory of L samples leaves out, against an infinite one."""

from __future__ import annotations

from focgen.control.controller import Controller
from focgen.plan.canonical import Realisation, Tables, folded, inner_limits, realise, tail_l1
from focgen.plan.gains import largest_gain
from focgen.plan.model import Plan
from focgen.plan.stability import inverse

_SLACK = 1.0 + 1e-9


def largest_error(controller: Controller) -> float:
    """Largest |reference − measurement|, physical."""
    (r0, r1), (m0, m1) = controller.ranges.reference, controller.ranges.measurement
    return max(abs(r0 - m1), abs(r1 - m0))


def truncation(plan: Plan, tables: Tables) -> float | None:
    """Bound on the operator's error against infinite memory, both in exact arithmetic; None where there is
    none.

    With feedback A∞ (v − v∞) = (B − B∞) e + (A∞ − A) v, and ‖1/A∞‖₁ is bounded through a longer table:
    ‖1/A∞‖₁ ≤ M' / (1 − M' t') with t' what that one still leaves out. An inner integral that misses something
    drifts until its clamp ends it.
    """
    form, h, length = realise(plan.controller), plan.sample_time, plan.length
    scale = abs(tables.normaliser)
    e, gain = largest_error(plan.controller), largest_gain(plan.controller)
    direct = tail_l1(form.direct, h, length) / scale
    rest = 0.5 * h * tail_l1(form.rest, h, length) / scale
    clamp = [x / tables.normaliser for x in inner_limits(plan.controller)] if form.rest else [0.0]
    drift = (max(clamp) - min(clamp)) if rest else 0.0
    if tables.feedback is None:
        return gain * (direct * e + drift) * _SLACK
    return _recursive_truncation(plan, tables, form, direct, drift, max(map(abs, clamp)))


def _recursive_truncation(
    plan: Plan, tables: Tables, form: Realisation, direct: float, drift: float, z: float
) -> float | None:
    h, scale = plan.sample_time, abs(tables.normaliser)
    own = inverse(tables.feedback.weights)
    endless = _endless_norm(plan, form, scale)
    if own is None or endless is None:
        return None
    e, back = largest_error(plan.controller), tail_l1(form.den, h, plan.length) / scale
    v = (own.norm_after(tables.direct.weights) if tables.direct else 0.0) * e + own.norm * z
    return largest_gain(plan.controller) * (endless * (direct * e + back * v) + endless * drift) * _SLACK


def _endless_norm(plan: Plan, form: Realisation, scale: float) -> float | None:
    """Bound on ‖1/A‖₁ with infinite memory."""
    for length in sorted({plan.length, max(plan.length, 4096), max(plan.length, 65536)}):
        table = folded(form.den, plan.sample_time, length).weights
        own = inverse(table / table[0])
        left_out = tail_l1(form.den, plan.sample_time, length) / scale
        if own is not None and own.norm * left_out < 1.0:
            return own.norm / (1.0 - own.norm * left_out)
    return None
