"""Floating inputs that cannot be computed with, in C: what is asked of them, and what stands instead."""

from __future__ import annotations

from dataclasses import dataclass

from focgen.codegen.expressions import counts, value
from focgen.codegen.literals import constant, literal
from focgen.codegen.tuned import integral_ends, limits
from focgen.plan.counts import values_of
from focgen.plan.plan import Format, Plan
from focgen.plan.usable import EXPONENT
from focgen.present import present


@dataclass(frozen=True)
class GuardText:
    """Conditions on the arguments of reset, step and track; ``within``: whether ``now``, what is ``kept`` of
    the output that stands, ``held``, can be; ``keep``: what puts u in its place. ``damaged``: what tells a
    step that the state is none that a step has left; ``unsound``: the same of integrals in counts and of
    the set-point filter, before the step adds to them.
    """

    error_usable: str
    step_unusable: str
    track_usable: str
    kept: str
    kept_type: str
    within: str
    held: str
    keep: str
    unset: str
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
        keep=_keep(plan, "u"),
        unset=_unset(plan),
        damaged=_damaged(plan) + _untuned(plan),
        unsound=_unsound(plan),
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
    if plan.integrator and not plan.integrator.state.floating:
        low, high = integral_ends(plan)
        asked = (f"s->error_now < {plan.name.upper()}_ERRORS", f"now >= {low}", f"now <= {high}")
        return ("\n" + 21 * " " + "&& ").join(asked)
    ends = limits(plan)
    return f"foc_finite_{plan.arithmetic}(now) && now >= {ends.low} && now <= {ends.high}"


def _between(value: str, state: Format) -> str:
    low, high = constant(state.low, state.ctype), constant(state.high, state.ctype)
    return f"{value} >= {low} && {value} <= {high}"


def _held(plan: Plan) -> str:
    return output_of(plan) if plan.integrator else "s->output"


def output_of(plan: Plan) -> str:
    """u from a floating plan's integral; clamped where a limit need not be a whole number of counts."""
    state, ends = present(plan.integrator).state, limits(plan)
    if state.floating:
        return "s->integral"
    found = value("s->integral", state)
    pairs = ((state.low, plan.output.low), (state.high, plan.output.high))
    exact = plan.tuning is None and all(float(values_of(end, state)) == limit for end, limit in pairs)
    return found if exact else f"foc_clamp_f32({found}, {ends.low}, {ends.high})"


def _keep(plan: Plan, u: str) -> str:
    """What makes ``u`` the output that stands."""
    if plan.integrator is None:
        return f"s->output = {u}"
    return f"s->integral = {counts(u, plan.integrator.state)}"


def _unset(plan: Plan) -> str:
    """What a reset starts from where its u0 cannot be used."""
    if plan.counted and plan.integrator and plan.tuning is None:
        state = plan.integrator.state
        return f"s->integral = {literal(min(max(0, state.low), state.high), state.ctype)}"
    return _keep(plan, limits(plan).start)


def _unsound(plan: Plan) -> list[str]:
    """Of what is in counts, a line each; empty where nothing is."""
    asked = []
    if plan.set_point:  # a lag reaches twice as far as an input, and the rounding of a few
        ask = f"!foc_usable_{plan.arithmetic}"
        asked += [f"{ask}(s->latest)", f"{ask}({literal(0.25, plan.reference.ctype)} * s->lag)"]
    if plan.integrator and not plan.integrator.state.floating:
        asked += [f"!{plan.name}_within(s)"]
    elif plan.counted:
        asked += [f"s->error_now >= {plan.name.upper()}_ERRORS"]
    if plan.inner and not plan.inner.state.floating:
        asked += ["!foc_held(s->inner_input)", f"!({_between('s->inner', plan.inner.state)})"]
    return asked


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
