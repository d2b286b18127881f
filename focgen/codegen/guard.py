"""Floating inputs that cannot be computed with, in C: what is asked of them, and what stands instead."""

from __future__ import annotations

from dataclasses import dataclass

from focgen.codegen.expressions import counts, value
from focgen.codegen.literals import constant, literal
from focgen.plan.counts import values_of
from focgen.plan.model import Format, Plan
from focgen.plan.usable import EXPONENT


@dataclass(frozen=True)
class GuardText:
    """Conditions on the arguments of reset, step and track; ``within``: whether ``now``, what is ``kept`` of
    the output that stands, ``held``, can be; ``keep``: what puts u in its place; ``start``: the output before
    any step. ``damaged``: what tells a step that the state is none that a step has left; ``unsound``: the
    same of integrals in counts, before the step adds to them.
    """

    error_usable: str
    step_unusable: str
    track_usable: str
    kept: str
    kept_type: str
    within: str
    held: str
    keep: str
    start: str
    damaged: str
    unsound: list[str]


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
        kept="s->integral" if plan.integrator else "s->output",
        kept_type=plan.integrator.state.ctype if plan.integrator else plan.output.ctype,
        within=_within(plan),
        held=_held(plan),
        keep=_keep(plan),
        damaged=_damaged(plan),
        unsound=_unsound(plan),
        start=literal(min(max(0.0, plan.output.low), plan.output.high), plan.output.ctype),
    )


def _damaged(plan: Plan) -> str:
    """What the integral is about to be, or the increment, is no number, or the integral beyond its limits."""
    ask = f"foc_finite_{plan.arithmetic}"
    if plan.integrator is None:
        return f"!{ask}(d)"
    if not plan.integrator.state.floating:
        return "!foc_held(d) || !foc_held(s->increment)"
    return f"!{ask}(s->integral + (d + s->increment)) || !{plan.name}_within(s)"


def _within(plan: Plan) -> str:
    """A flag, in counts with the ring's slot: memory that is 0xff everywhere has a good count."""
    NAME = plan.name.upper()
    if plan.integrator and not plan.integrator.state.floating:
        return f"s->error_now < {NAME}_ERRORS && {_between('now', plan.integrator.state)}"
    return f"foc_finite_{plan.arithmetic}(now) && now >= {NAME}_U_MIN && now <= {NAME}_U_MAX"


def _between(value: str, state: Format) -> str:
    low, high = constant(state.low, state.ctype), constant(state.high, state.ctype)
    return f"{value} >= {low} && {value} <= {high}"


def _held(plan: Plan) -> str:
    return output_of(plan) if plan.integrator else "s->output"


def output_of(plan: Plan) -> str:
    """u from a floating plan's integral."""
    state = plan.integrator.state
    if state.floating:
        return "s->integral"
    found = value("s->integral", state)
    exact = all(
        float(values_of(end, state)) == limit
        for end, limit in ((state.low, plan.output.low), (state.high, plan.output.high))
    )
    NAME = plan.name.upper()
    return found if exact else f"foc_clamp_f32({found}, {NAME}_U_MIN, {NAME}_U_MAX)"


def _keep(plan: Plan) -> str:
    if plan.integrator is None:
        return "s->output = u"
    return f"s->integral = {counts('u', plan.integrator.state)}"


def _unsound(plan: Plan) -> list[str]:
    """Of what is in counts, a line each; empty where nothing is."""
    asked = []
    if plan.integrator and not plan.integrator.state.floating:
        asked += [f"!{plan.name}_within(s)"]
    elif plan.counted:
        asked += [f"s->error_now >= {plan.name.upper()}_ERRORS"]
    if plan.inner and not plan.inner.state.floating:
        asked += ["!foc_held(s->inner_input)", f"!({_between('s->inner', plan.inner.state)})"]
    return asked


def unusable_text(plan: Plan) -> str:
    """Which inputs a floating plan leaves out."""
    return f"NaN, infinite or beyond 2^{EXPONENT[plan.output.ctype]}"
