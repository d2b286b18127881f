"""The context of ``controller.c.jinja``: expressions and tables of NAME.c, ready to be laid out."""

from __future__ import annotations

from dataclasses import dataclass

import focgen
from focgen.codegen.banks import ring_of
from focgen.codegen.expressions import (
    CLAMP,
    LONGEST_SHIFT,
    bound,
    converted,
    counts,
    saturated,
    scaled_up,
    shifted,
    value,
)
from focgen.codegen.formulas import memory_about, step_formulas, transfer_text, weights_about
from focgen.codegen.guard import GuardText, guard_text, output_of
from focgen.codegen.kernels import PORTABLE, Kernels, runtime_files
from focgen.codegen.literals import constant, literal, quantity, scale
from focgen.codegen.saved import SavedText, saved_text
from focgen.codegen.setpoint import SetPointText, set_point_text
from focgen.codegen.state import carries, inner_input, starts
from focgen.codegen.tables import ScheduleText, SumText, schedule_text, sum_text
from focgen.codegen.texts import UserText, comment
from focgen.codegen.tuned import Limits, TunedText, integral_ends, limits, tuned_gain, tuned_text
from focgen.plan.canonical import realise
from focgen.plan.plan import Plan, Sum
from focgen.present import present


@dataclass(frozen=True)
class InnerText:
    """The integral of the terms of negative order; ``taken``: the sum as it takes it in; ``counted``: it is
    in counts though the plan is floating."""

    sum: SumText
    ctype: str
    taken: str
    zero: str
    counted: bool
    clamp: str
    to_wide: str
    about: str


@dataclass(frozen=True)
class FeedbackText:
    """The recursion v = x − Σ; ``steady``: v for a constant e."""

    sum: SumText
    about: str
    rounded: str
    carries: bool
    scaled_up: str
    saturated: str
    steady: str
    steady_about: str


@dataclass(frozen=True)
class IntegralText:
    """The controller's integrator; ``within`` is ``u_applied`` between the limits,
    ``from_output`` the integral that follows it."""

    ctype: str
    clamp: str
    about: str
    start: str
    start_about: str
    zero: str
    within: str
    from_output: str
    starting: bool


@dataclass(frozen=True)
class GainText:
    """The constant gain."""

    value: str
    about: str


@dataclass(frozen=True)
class SourceContext:
    """Everything ``controller.c.jinja`` asks for. None and empty strings leave their part of the text out.

    Types: ``signal`` of inputs and output, ``filtered`` of v, ``wide`` of x, ``gain_type`` of g,
    ``increment`` of d.
    """

    name: str
    title: UserText
    version: str
    arithmetic: str
    sha256: str
    transfer: str
    formulas: list[str]
    exponential: bool
    counted: bool
    memory_about: list[str]
    fixed: bool
    signal: str
    clamp: str
    zero: str
    error: str
    filtered: str
    filtered_about: str
    wide: str
    wide_about: str
    numerator: SumText | None
    inner: InnerText | None
    feedback: FeedbackText | None
    narrowed: str
    at_rest: str
    schedule: ScheduleText | None
    gain: GainText | None
    gain_type: str
    increment: str
    increment_about: str
    product: str
    kernels: tuple[str, ...]
    runtime: tuple[str, ...]
    target: str
    error_start: str
    filtered_start: str
    integral: IntegralText | None
    guard: GuardText | None
    saved: SavedText
    output: str
    set_point: SetPointText | None
    limits: Limits
    gain_call: str
    tuned: TunedText | None


def source_context(plan: Plan, title: str, sha256: str, kernels: Kernels = PORTABLE) -> SourceContext:
    """Prepare NAME.c; ``sha256`` is of the controller's file. Raises PlanError for what C cannot express."""
    signal = plan.output.ctype
    return SourceContext(
        name=plan.name,
        title=UserText(title),
        version=focgen.__version__,
        arithmetic=plan.arithmetic,
        sha256=sha256,
        transfer=comment(transfer_text(plan)),
        formulas=step_formulas(plan),
        exponential=plan.states > 0,
        counted=plan.counted,
        memory_about=memory_about(plan),
        fixed=not plan.floating,
        signal=signal,
        clamp=CLAMP[signal],
        zero=literal(0, signal),
        error="r - m" if signal == "int32_t" else "(int16_t)(r - m)" if signal == "int16_t" else "ref - meas",
        filtered=plan.filtered.ctype,
        filtered_about="" if plan.floating else f"counts of {scale(plan.filtered.lsb)}",
        wide=plan.wide.ctype,
        wide_about=bound(plan.wide, "x"),
        numerator=_numerator(plan, kernels),
        inner=_inner(plan, kernels),
        feedback=_feedback(plan, kernels),
        narrowed=_narrowed(plan, "x"),
        at_rest=_at_rest(plan),
        schedule=schedule_text(plan) if plan.schedule else None,
        gain=None if plan.schedule or plan.tuning else _gain(plan),
        gain_type=plan.gain.ctype,
        increment=plan.increment.ctype,
        increment_about=_increment_about(plan),
        product=_product(plan),
        kernels=kernels.headers(plan)[:-1],
        runtime=runtime_files(plan, kernels),
        target=kernels.target or "",
        error_start=_start(plan, kernels, "error"),
        filtered_start=_start(plan, kernels, "filtered"),
        integral=_integral(plan),
        guard=guard_text(plan),
        saved=saved_text(plan, sha256, kernels),
        output=_output(plan),
        set_point=set_point_text(plan),
        limits=limits(plan),
        gain_call=_gain_call(plan),
        tuned=tuned_text(plan),
    )


def _start(plan: Plan, kernels: Kernels, history: str) -> str:
    """The slot of the latest sample after a reset: before a group where there are groups."""
    _, size = ring_of(plan, history)
    return f"{size} - 1u" if kernels.grouped(plan, history) else "0"


def _narrowed(plan: Plan, x: str) -> str:
    """v from ``x``, without what a recursion carries."""
    return saturated(shifted(x, plan.wide.ctype, plan.narrow), plan.wide.ctype, plan.filtered.ctype)


def _at_rest(plan: Plan) -> str:
    """v for a constant e where there is no recursion."""
    return (
        _narrowed(plan, f"{plan.name}_numerator_sum(s)") if plan.direct else literal(0, plan.filtered.ctype)
    )


def _sum(plan: Plan, table: Sum, name: str, about: list[str], kernels: Kernels) -> SumText:
    prefix = "foc_long" if kernels.long(plan) else "foc"
    return sum_text(plan, table, name, about, kernels.ahead(plan, table), prefix)


def _numerator(plan: Plan, kernels: Kernels) -> SumText | None:
    if plan.direct is None:
        return None
    about = weights_about(plan, realise(plan.controller).direct, plan.direct, "Numerator")
    return _sum(plan, plan.direct, "numerator", about, kernels)


def _inner(plan: Plan, kernels: Kernels) -> InnerText | None:
    if plan.inner is None:
        return None
    state = plan.inner.state
    what = "What 1/s integrates: numerator terms of negative order times s"
    about = weights_about(plan, realise(plan.controller).rest, plan.inner.rest, what, half_step=True)
    ends = f"{constant(state.low, state.ctype)}, {constant(state.high, state.ctype)}"
    made = _sum(plan, plan.inner.rest, "integrand", about, kernels)
    counted = plan.floating and not state.floating
    ctype = inner_input(plan)
    total = f"s->inner + ({converted('r', ctype, state.ctype)} + s->inner_input)"
    there = shifted("s->inner", state.ctype, plan.inner.to_wide)
    return InnerText(
        sum=made,
        ctype=ctype,
        taken=counts(f"{made.function}(s)", state) if counted else f"{made.function}(s)",
        zero=literal(0, state.ctype),
        counted=counted,
        clamp=f"{CLAMP[state.ctype]}({total}, {ends})",
        to_wide=value("s->inner", state) if counted else converted(there, state.ctype, plan.wide.ctype),
        about=_proved(plan, "inner sum", state.bits),
    )


def _proved(plan: Plan, node: str, bits: int) -> str:
    proof = next((p for p in plan.proofs if p.node == node), None)
    return f"|sum| <= {proof.worst} < 2^{bits - 1}" if proof else ""


def _feedback(plan: Plan, kernels: Kernels) -> FeedbackText | None:
    if plan.feedback is None:
        return None
    about = weights_about(plan, realise(plan.controller).den, plan.feedback.table, "Denominator")
    wide, carried = plan.wide.ctype, carries(plan)
    return FeedbackText(
        sum=_sum(plan, plan.feedback.table, "denominator", about, kernels),
        about=bound(plan.wide, "x"),
        rounded=shifted("x", wide, plan.narrow),
        carries=carried,
        scaled_up=scaled_up(wide, plan.narrow),
        saturated=saturated("rounded", wide, plan.filtered.ctype) if carried else _narrowed(plan, "x"),
        steady=_steady(plan),
        steady_about=_steady_about(plan),
    )


def _steady(plan: Plan) -> str:
    """v for a constant ``e``; 0 where the numerator has no gain at rest."""
    if present(plan.feedback).steady == 0:
        return literal(0, plan.filtered.ctype)
    steady, form = constant(present(plan.feedback).steady, plan.filtered.ctype), plan.filtered.ctype
    if plan.floating:
        return f"{steady} * e"
    double = f"int{2 * plan.error.bits}_t"
    return saturated(
        shifted(f"({double}){steady} * e", double, present(plan.feedback).steady_shift), double, form
    )


def _steady_about(plan: Plan) -> str:
    if present(plan.feedback).steady == 0:
        return ""
    counts = present(plan.feedback).steady * 2.0 ** -present(plan.feedback).steady_shift
    return f"{counts * plan.filtered.lsb / plan.error.lsb:.6g}"


def _gain(plan: Plan) -> GainText:
    value = constant(plan.constant_gain, plan.gain.ctype)
    about = f"{plan.controller.gain:.6g}{' times h/2' if plan.integrator else ''}"
    return GainText(value, about if plan.floating else f"{about}, counts of {scale(plan.gain.lsb)}")


def _gain_call(plan: Plan) -> str:
    """What a step's gain is; empty where it is a constant."""
    if plan.tuning:
        return tuned_gain(plan)
    return schedule_text(plan).call if plan.schedule else ""


def _increment_about(plan: Plan) -> str:
    unit = plan.controller.units.output
    if plan.increment.floating:
        return quantity_unit(unit)
    if plan.floating:
        return f"counts of {scale(plan.increment.lsb, unit)}"
    return f"{bound(plan.increment, 'd')}, counts of {scale(plan.increment.lsb, unit)}"


def quantity_unit(unit: str) -> str:
    """``in UNIT``, or nothing."""
    return f"in {comment(unit)}" if unit else ""


def _product(plan: Plan) -> str:
    """d from ``gain`` and ``v``, by the cheapest product that is exact."""
    gain = "gain" if plan.schedule or plan.tuning else f"{plan.name.upper()}_GAIN"
    if plan.floating:
        return counts(f"{gain} * v", plan.increment)
    if plan.gain.ctype == "int16_t" and plan.filtered.ctype == "int32_t":
        wide, product = "int64_t", f"foc_mul32x16(v, {gain})"
    else:
        small = plan.gain.ctype == "int16_t" and plan.gain_shift <= LONGEST_SHIFT["int32_t"]
        wide = "int32_t" if small else "int64_t"
        product = f"({wide}){gain} * v"
    return converted(shifted(product, wide, plan.gain_shift), wide, plan.increment.ctype)


def _integral(plan: Plan) -> IntegralText | None:
    if plan.integrator is None:
        return None
    state, by, u = plan.integrator.state, plan.integrator.to_output, plan.output
    ends = ", ".join(integral_ends(plan))
    total = f"s->integral + {_change(plan)}"
    start = min(max(0, state.low), state.high)
    clamped = f"{CLAMP[u.ctype]}(u_applied, {limits(plan).low}, {limits(plan).high})"
    return IntegralText(
        ctype=state.ctype,
        clamp=f"{CLAMP[state.ctype]}({total}, {ends})",
        about="; ".join(filter(None, (_proved(plan, "integrator sum", state.bits), _ends_about(plan)))),
        start=literal(start, state.ctype),
        start_about=quantity(start * state.lsb, plan.controller.units.output),
        zero=literal(0, plan.increment.ctype),
        within=clamped,
        from_output=counts(clamped, state)
        if plan.floating
        else converted("u", u.ctype, state.ctype) + scaled_up(state.ctype, by),
        starting=starts(plan),
    )


def _ends_about(plan: Plan) -> str:
    """What the integral's ends stand for, where they are written as counts."""
    state = present(plan.integrator).state
    if state.floating or plan.tuning:
        return ""
    span = quantity(state.high * state.lsb, plan.controller.units.output)
    return f"clamped to {state.low * state.lsb:g} ... {span}, in counts of {scale(state.lsb, state.unit)}"


def _change(plan: Plan) -> str:
    """By how much the integral moves ahead of its limits: two half trapezoids, within the slew limit."""
    state, slew = present(plan.integrator).state, present(plan.integrator).slew
    both = f"{converted('d', plan.increment.ctype, state.ctype)} + s->increment"
    if slew is None:
        return f"({both})"
    return f"{CLAMP[state.ctype]}({both}, {constant(-slew, state.ctype)}, {literal(slew, state.ctype)})"


def _output(plan: Plan) -> str:
    """u from the integral, or from ``d`` without one."""
    u = plan.output.ctype
    if plan.integrator and plan.floating:
        return output_of(plan)
    if plan.integrator:
        state = plan.integrator.state.ctype
        return saturated(shifted("s->integral", state, plan.integrator.to_output), state, u)
    d, ends = plan.increment.ctype, limits(plan)
    return converted(f"{CLAMP[d]}(d, {ends.low}, {ends.high})", d, u)
