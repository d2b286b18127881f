"""Floating inputs that cannot be computed with, in C: what is asked of them, and what stands instead."""

from __future__ import annotations

from dataclasses import dataclass

from focgen.codegen.literals import literal
from focgen.plan.model import Plan
from focgen.plan.usable import EXPONENT


@dataclass(frozen=True)
class GuardText:
    """Conditions on the arguments of reset, step and track; ``held``: the output that stands; ``start``: the
    one before any step; ``damaged``: what tells a step that the state is none that a step has left.
    """

    error_usable: str
    step_unusable: str
    track_usable: str
    held: str
    start: str
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
        damaged=_damaged(plan),
        start=literal(min(max(0.0, plan.output.low), plan.output.high), plan.output.ctype),
    )


def _damaged(plan: Plan) -> str:
    """What the integral is about to be, or the increment, is no number, or the integral beyond its limits."""
    ask = f"foc_finite_{plan.arithmetic}"
    if plan.integrator is None:
        return f"!{ask}(d)"
    return f"!{ask}(s->integral + (d + s->increment)) || !{plan.name}_within(s->integral)"


def unusable_text(plan: Plan) -> str:
    """Which inputs a floating plan leaves out."""
    return f"NaN, infinite or beyond 2^{EXPONENT[plan.output.ctype]}"
