"""What a controller computes, as formulas in comments."""

from __future__ import annotations

from focgen.codegen.literals import quantity, wrapped
from focgen.codegen.texts import comment
from focgen.fractional.transfer import Polynomial, TransferFunction
from focgen.plan.canonical import normaliser, realise
from focgen.plan.plan import Plan, Sum


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
    if plan.set_point:
        lag = f"y = y + (1 - exp(-h/T)) (ref - y), T = {plan.controller.setpoint_filter:.6g} s"
        lines = [lag, "e = y - meas"]
    if plan.inner:
        lines.append(f"z = 1/s {_of_error(form.rest)}, a trapezoid, clamped")
    if plan.direct:
        terms.append(_of_error(form.direct))
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
        slew = plan.controller.slew_limit
        held = "" if slew is None else f", by at most {f'{slew:.6g} {unit}'.rstrip()} a second"
        found = f"u = u + d + d of the sample before (trapezoid){held}, {clamp}"
        return [f"d = {_times_gain(plan)}v h/2", found]
    return [f"u = {_times_gain(plan)}v, {clamp}"]


def _times_gain(plan: Plan) -> str:
    """The gain as a factor; nothing where it is 1."""
    gain = _gain_text(plan)
    return "" if gain == "1" else f"{gain} "


def _of_error(terms: Polynomial) -> str:
    """A polynomial times e."""
    text = polynomial_text(terms)
    return "e" if text == "1" else f"({text}) e"


def weights_about(plan: Plan, terms: Polynomial, table: Sum, what: str, half_step: bool = False) -> list[str]:
    """What a weight table holds: its polynomial, formula and order."""
    factor = " times h/2" if half_step else ""
    over = normaliser(plan.controller, {memory.order: memory.lead for memory in plan.memories})
    if over != 1.0:
        factor += f" over {over:.6g}, the denominator's weight of lag 0"
    lags = f"lags {table.last} ... {table.first}" if table.last > table.first else f"lag {table.first} only"
    formula = (
        "Each term c s^b gives c h^-b (-1)^j binomial(b, j) (Gruenwald-Letnikov),"
        f" h = {quantity(plan.sample_time, 's')};"
        f" the weight of lag j is their sum{factor}. Oldest first, {lags}."
    )
    if table.banks:
        led = f", times {_leads(plan)}" if plan.band else ""
        formula = (
            "Here is lag 0 of each term c s^b, c h^-b (1 - 1/z)^n with n = b rounded up"
            f"{led}, h = {quantity(plan.sample_time, 's')}; the modes below remember the rest."
            f" The weight of lag j is their sum{factor}. Oldest first, {lags}."
        )
    return [f"{what}: {polynomial_text(terms)}.", *wrapped(formula.split(" "))]


def memory_about(plan: Plan) -> list[str]:
    """What the exponential memory is, for the head of the file; nothing with a short one."""
    if not plan.exponential:
        return []
    proved = max((memory.tolerance for memory in plan.memories), default=0.0)
    if plan.band:
        head = f"Memory: exponential, {plan.states} modes with a mean each, fitted to (jw)^b itself: within"
        span = "from {:.4g} to {:.4g} rad/s".format(*plan.band)
        return [head, f"{proved:.2g} of it {span}, and the gain at rest is exact."]
    head = f"Memory: exponential, {plan.states} modes with a mean each. The weights of every s^b are within"
    rest = f"{proved:.2g} of the exact ones up to {plan.horizon} samples back, and the gain at rest is exact."
    return [head, rest]


def _leads(plan: Plan) -> str:
    return ", ".join(f"{memory.lead:.6g} for s^{memory.order:g}" for memory in plan.memories)
