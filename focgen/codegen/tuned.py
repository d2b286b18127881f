"""Parameters that change at run time, in C: what NAME_tune computes, and where the limits come from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from focgen.codegen.expressions import CLAMP, converted, counts, scaled_up, shifted
from focgen.codegen.literals import constant, literal, rows, scale
from focgen.codegen.state import counts_limits
from focgen.codegen.tables import Group, TableText
from focgen.plan.counts import taken_in
from focgen.plan.formats import runtime
from focgen.plan.plan import Plan
from focgen.plan.tuning import default_params
from focgen.present import present

_WITHIN = {
    "int16_t": "foc_within16",
    "int32_t": "foc_within32",
    "float": "foc_within_f32",
    "double": "foc_within_f64",
}


@dataclass(frozen=True)
class Limits:
    """The output's limits as C expressions, and the output that stands where there is none: 0 within them."""

    low: str
    high: str
    start: str


@dataclass(frozen=True)
class TunedText:
    """How parameters are taken over. ``gain`` and ``slope``: of index i; ``slope`` is empty without a
    schedule. ``one``: the default factor. ``within``: the function that asks for a box. ``least`` and
    ``most``: what a gain in a state can be. ``moved``: the output, or the integral, within the new limits;
    empty where no output is kept. ``kept``: its member. ``counted``: limits that the state holds in counts
    as well.
    """

    tables: list[TableText]
    gain: str
    slope: str
    one: str
    within: str
    least: str
    most: str
    kept: str
    moved: str
    counted: list[CountedEnd]


@dataclass(frozen=True)
class CountedEnd:
    """A limit in counts of the integral: its ``member``, ``taken`` from p; its box."""

    member: str
    taken: str
    low: str
    high: str


def limits(plan: Plan) -> Limits:
    """The limits of the output: macros, or members of the state, which in integers are taken for no more than
    their boxes hold whatever their bits are.
    """
    prefix, zero = plan.name.upper(), literal(0, plan.output.ctype)
    start = literal(min(max(0, plan.output.low), plan.output.high), plan.output.ctype)
    if plan.tuning is None:
        return Limits(f"{prefix}_U_MIN", f"{prefix}_U_MAX", start)
    if plan.floating:
        low, high = "s->u_min", "s->u_max"
    else:
        low, high = f"{plan.name}_low(s)", f"{plan.name}_high(s)"
    return Limits(low, high, f"{CLAMP[plan.output.ctype]}({zero}, {low}, {high})")


def integral_ends(plan: Plan) -> tuple[str, str]:
    """The limits in counts of the integral."""
    state = present(plan.integrator).state
    if plan.tuning is None:
        return constant(state.low, state.ctype), constant(state.high, state.ctype)
    up = scaled_up(state.ctype, present(plan.integrator).to_output)
    ends = limits(plan)
    if counts_limits(plan):
        return "s->low", "s->high"
    if plan.floating:
        return ends.low, ends.high
    low, high = (converted(end, plan.output.ctype, state.ctype) + up for end in (ends.low, ends.high))
    return low, high


def tuned_gain(plan: Plan) -> str:
    """The gain of a step; in integers within its proven range whatever the state's bits are."""
    found = "s->gains[0]"
    if plan.schedule:
        shifts = "" if plan.floating else f"{plan.name}_shifts, "
        signal = "sched" if plan.floating else "at"
        tables = f"{plan.name}_points, s->gains, s->slopes, {shifts}{plan.name.upper()}_GAINS"
        found = f"foc_tuned_{runtime(plan.arithmetic)}({signal}, {tables})"
    if plan.floating:
        return found
    ends = f"{constant(plan.gain.low, plan.gain.ctype)}, {constant(plan.gain.high, plan.gain.ctype)}"
    return f"{CLAMP[plan.gain.ctype]}({found}, {ends})"


def tuned_text(plan: Plan) -> TunedText | None:
    """What the C of a tunable plan needs; None for any other."""
    if plan.tuning is None:
        return None
    signal, name = plan.output.ctype, plan.name
    ends = integral_ends(plan) if plan.integrator else (limits(plan).low, limits(plan).high)
    kept = "s->integral" if plan.integrator else "s->output" if plan.floating else ""
    kind = plan.integrator.state.ctype if plan.integrator else signal
    return TunedText(
        tables=_tables(plan),
        gain=_product(plan, f"p->gain[i] * {name}_nominal[i]", plan.tuning.to_gain),
        slope=_slope(plan),
        one=literal(default_params(plan).gain[0], signal),
        within=_WITHIN[signal],
        least=constant(plan.gain.low, plan.gain.ctype),
        most=constant(plan.gain.high, plan.gain.ctype),
        kept=kept,
        moved=f"{CLAMP[kind]}({kept}, {ends[0]}, {ends[1]})" if kept else "",
        counted=_counted_ends(plan) if counts_limits(plan) else [],
    )


def _counted_ends(plan: Plan) -> list[CountedEnd]:
    state, found = present(plan.integrator).state, []
    for member, of, box in (
        ("low", "u_min", present(plan.tuning).low),
        ("high", "u_max", present(plan.tuning).high),
    ):
        ends = (constant(int(taken_in(np.float32(end), state)), state.ctype) for end in box)
        found.append(CountedEnd(member, counts(f"p->{of}", state), *ends))
    return found


def _product(plan: Plan, product: str, by: int) -> str:
    if plan.floating:
        return product
    return converted(shifted(f"(int64_t){product}", "int64_t", by), "int64_t", plan.gain.ctype)


def _slope(plan: Plan) -> str:
    if plan.schedule is None:
        return ""
    if plan.floating:
        return f"(s->gains[i + 1u] - s->gains[i]) * {plan.name}_reciprocals[i]"
    rise = "((int64_t)s->gains[i + 1u] - s->gains[i])"
    product = f"foc_shift64({rise} * {plan.name}_reciprocals[i], {plan.name}_coarser[i])"
    return converted(product, "int64_t", plan.gain.ctype)


def _tables(plan: Plan) -> list[TableText]:
    """The gains that the factors are on, and what slopes are made with."""
    box, ctype = present(plan.tuning), plan.gain.ctype
    half = " times h/2" if plan.integrator else ""
    held = "" if plan.floating else f", counts of {scale(box.nominal_lsb)}"
    found = [(f"The gains{half} that the factors are on{held}.", ctype, "nominal", box.nominal)]
    if plan.schedule:
        kind = ctype if plan.floating else "int32_t"
        found.append(("1 / the distance of two breakpoints.", kind, "reciprocals", box.reciprocals))
        if not plan.floating:
            about = "By how much a product with it is finer than a slope."
            found.append((about, "uint8_t", "coarser", box.to_slopes))
    return [
        TableText([about], kind, f"{plan.name}_{key}", len(values), [Group("", rows(values, kind))])
        for about, kind, key, values in found
    ]
