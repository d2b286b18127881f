"""What a controller computes, as formulas in comments."""

from __future__ import annotations

from focgen.codegen.literals import comment, quantity, wrapped
from focgen.fractional.transfer import Polynomial, TransferFunction
from focgen.plan.canonical import realise, tables
from focgen.plan.model import Plan, Sum


def polynomial_text(terms: Polynomial) -> str:
    """A polynomial in s, as in ``1.32 s^0.6 + 1``."""
    return str(TransferFunction(terms))


def _gain_text(plan: Plan) -> str:
    return "g(sched)" if plan.schedule else f"{plan.controller.gain:.6g}"


def transfer_text(plan: Plan) -> str:
    """The whole controller as one expression in s."""
    factors = [] if _gain_text(plan) == "1" else [_gain_text(plan)]
    whole = str(plan.controller.transfer)
    factors.append(whole if whole.startswith("(") else f"({whole})")
    return " * ".join(factors + ["1/s"] * plan.controller.integrator)


def step_formulas(plan: Plan) -> list[str]:
    """One step, line by line, in physical quantities."""
    form, lines, terms = realise(plan.controller), ["e = ref - meas"], []
    if plan.inner:
        lines.append(f"z = 1/s ({polynomial_text(form.rest)}) e, a trapezoid, clamped")
    if plan.direct:
        terms.append(f"({polynomial_text(form.direct)}) e")
    if plan.inner:
        terms.append("z")
    p, den = " + ".join(terms), polynomial_text(form.den)
    bracketed = f"({p})" if len(terms) > 1 else p
    lines.append(f"v = {p}" if den == "1" else f"v = {bracketed} / ({den})")
    return lines + _output_formulas(plan)


def _output_formulas(plan: Plan) -> list[str]:
    low, high = plan.controller.ranges.output
    unit = comment(plan.controller.units.output)
    clamp = f"clamped to {low:.6g} ... {high:.6g} {unit}".rstrip()
    if plan.integrator:
        return [f"d = {_gain_text(plan)} v h/2", f"u = u + d + d of the sample before (trapezoid), {clamp}"]
    return [f"u = {_gain_text(plan)} v, {clamp}"]


def weights_about(plan: Plan, terms: Polynomial, table: Sum, what: str, half_step: bool = False) -> list[str]:
    """What a weight table holds: its polynomial, formula and order."""
    factor = " times h/2" if half_step else ""
    normaliser = tables(plan.controller, plan.length).normaliser
    if normaliser != 1.0:
        factor += f" over {normaliser:.6g}, the denominator's weight of lag 0"
    lags = f"lags {table.last} ... {table.first}" if table.last > table.first else f"lag {table.first} only"
    formula = (
        "Each term c s^b gives c h^-b (-1)^j binomial(b, j) (Gruenwald-Letnikov),"
        f" h = {quantity(plan.sample_time, 's')};"
        f" the weight of lag j is their sum{factor}. Oldest first, {lags}."
    )
    return [f"{what}: {polynomial_text(terms)}.", *wrapped(formula.split(" "))]
