"""Floating inputs that cannot be computed with, in C: what is asked of them, and what stands instead."""

from __future__ import annotations

from dataclasses import dataclass

from focgen.codegen.literals import constant
from focgen.plan.model import Plan
from focgen.plan.usable import EXPONENT


@dataclass(frozen=True)
class GuardText:
    """Conditions on the arguments of reset, step and track; ``held``: the output that stands; ``damaged``:
    what tells a step that the state is none that a step has left.
    """

    error_usable: str
    step_unusable: str
    track_usable: str
    held: str
    damaged: str


def guard_text(plan: Plan) -> GuardText | None:
    """The guard of a floating plan; None where every input can be used."""
    if not plan.floating:
        return None
    ask = f"foc_usable_{plan.arithmetic}"
    inputs = ["ref", "meas", *(["sched"] if plan.schedule else [])]
    return GuardText(
        error_usable=f"{ask}(ref) && {ask}(meas)",
        step_unusable=" || ".join(f"!{ask}({name})" for name in inputs),
        track_usable=f"{ask}(u_applied)",
        held="s->integral" if plan.integrator else "s->output",
        damaged=_damaged(plan) + _untuned(plan),
    )


def _damaged(plan: Plan) -> str:
    """What the integral is about to be, or the increment, is no number, or the integral beyond its limits."""
    ask = f"foc_finite_{plan.arithmetic}"
    if plan.integrator is None:
        return f"!{ask}(d)"
    within = f"{plan.name}_within({'s, ' if plan.tuning else ''}s->integral)"
    return f"!{ask}(s->integral + (d + s->increment)) || !{within}"


def _untuned(plan: Plan) -> str:
    """The gain or the limits are none that parameters in their box give."""
    if plan.tuning is None:
        return ""
    ends = (constant(end, plan.gain.ctype) for end in (plan.gain.low, plan.gain.high))
    within = f"foc_within_{plan.arithmetic}(gain, {', '.join(ends)})"
    return f"\n        || !{within} || !{plan.name}_limits_known(s)"


def unusable_text(plan: Plan) -> str:
    """Which inputs a floating plan leaves out."""
    return f"NaN, infinite or beyond 2^{EXPONENT[plan.output.ctype]}"
