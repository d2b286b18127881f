"""What a memory leaves out, against an infinite one.

Short memory leaves out its tail. An exponential one is wrong by what its certificate bounds, once up to its
horizon and once for ever: Σ |∇^m (h_j − g_j)| for each term.
"""

from __future__ import annotations

from focgen.control.controller import Controller
from focgen.fractional.elementary import exact_sum, power
from focgen.fractional.exponential import ExponentialMemory
from focgen.fractional.transfer import Polynomial
from focgen.plan.canonical import Realisation, Tables, folded, inner_limits, realise, tail_l1
from focgen.plan.gains import largest_gain
from focgen.plan.plan import Plan
from focgen.plan.stability import inverse, inverse_of
from focgen.present import present

_SLACK = 1.0 + 1e-9


def largest_error(controller: Controller) -> float:
    """Largest |reference − measurement|, physical."""
    (r0, r1), (m0, m1) = controller.ranges.reference, controller.ranges.measurement
    return max(abs(r0 - m1), abs(r1 - m0))


def truncation(plan: Plan, tables: Tables, past_horizon: bool = True) -> float | None:
    """Bound on the operator's error against infinite memory, both in exact arithmetic; None where there is
    none. ``past_horizon``: for runs of any length, not only up to an exponential memory's horizon.

    With feedback A∞ (v − v∞) = (B − B∞) e + (A∞ − A) v, and ‖1/A∞‖₁ is bounded through a longer table:
    ‖1/A∞‖₁ ≤ M' / (1 − M' t') with t' what that one still leaves out. An inner integral that misses something
    drifts until its clamp ends it.
    """
    form, h = realise(plan.controller), plan.sample_time
    scale = abs(tables.normaliser)
    e, gain = largest_error(plan.controller), largest_gain(plan.controller)
    direct = _left_out(plan, form.direct, past_horizon) / scale
    rest = 0.5 * h * _left_out(plan, form.rest, past_horizon) / scale
    back = _left_out(plan, form.den, past_horizon) / scale if tables.feedback else 0.0
    clamp, endless = _clamps(plan, tables, form, bool(back))
    drift = max(clamp[1] - endless[0], endless[1] - clamp[0]) if rest else _apart(clamp, endless)
    if tables.feedback is None:
        return gain * (direct * e + drift) * _SLACK
    return _recursive_truncation(plan, tables, form, (direct, back), drift, max(map(abs, clamp)))


def _clamps(
    plan: Plan, tables: Tables, form: Realisation, differ: bool
) -> tuple[tuple[float, float], tuple[float, float]]:
    """The clamp of the inner integral, and with infinite memory; they differ where den's memory does."""
    if not form.rest:
        return (0.0, 0.0), (0.0, 0.0)
    clamp = inner_limits(plan.controller, tables.at_rest)
    return clamp, inner_limits(plan.controller, form.constant / tables.normaliser) if differ else clamp


def _apart(one: tuple[float, float], other: tuple[float, float]) -> float:
    """How far two integrals of the same can be apart, one clamped here, one there: as far as their ends are,
    since the middle of three numbers moves no further than the farthest of them."""
    return max(abs(a - b) for a, b in zip(one, other))


def _left_out(plan: Plan, terms: Polynomial, past_horizon: bool) -> float:
    """Bound on Σ |w − w∞| of Σ c s^β."""
    if not plan.exponential:
        return tail_l1(terms, plan.sample_time, plan.length)
    proved = {m.order: m.certificate for m in plan.memories if isinstance(m, ExponentialMemory)}
    h, own = plan.sample_time, [t for t in terms if t.order in proved]
    errors = [proved[t.order].output_error(1.0, past_horizon) for t in own]
    return exact_sum([abs(t.coefficient) * power(h, -t.order) * error for t, error in zip(own, errors)])


def _recursive_truncation(
    plan: Plan, tables: Tables, form: Realisation, missed: tuple[float, float], drift: float, z: float
) -> float | None:
    """``missed``: what numerator and denominator leave out."""
    scale, (direct, back) = abs(tables.normaliser), missed
    own = inverse_of(present(tables.feedback))
    endless = _endless_norm(plan, form, scale)
    if own is None or endless is None:
        return None
    e = largest_error(plan.controller)
    b = tables.direct and tables.direct.response
    v = (own.norm_after(b.weights, b.left_out) if b else 0.0) * e + own.norm * z
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
