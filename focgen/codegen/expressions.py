"""C expressions: conversions, shifts, bounds. Each keeps the value exactly or as the plan says."""

from __future__ import annotations

from focgen.codegen.literals import power_of_two
from focgen.errors import PlanError
from focgen.plan.counts import up_of
from focgen.plan.plan import Format

CLAMP = {
    "int16_t": "foc_clamp16",
    "int32_t": "foc_clamp32",
    "int64_t": "foc_clamp64",
    "float": "foc_clamp_f32",
    "double": "foc_clamp_f64",
}
LONGEST_SHIFT = {"int32_t": 30, "int64_t": 62}


def shifted(expression: str, ctype: str, by: int) -> str:
    """A rounding right shift of an expression of type ``ctype``; the expression itself where ``by`` is 0.

    Raises PlanError where the shift is longer than the type.
    """
    if by == 0:
        return expression
    if by > LONGEST_SHIFT[ctype]:
        what = f"a shift by {by} bits would leave nothing of {ctype}"
        raise PlanError("generate", what, "give [ranges] in units that are nearer to 1")
    return f"foc_shift{ctype[3:5]}({expression}, {by})"


def converted(expression: str, from_: str, to: str) -> str:
    """A conversion that keeps the value (proved); the expression itself where the types are equal."""
    return expression if from_ == to else f"({to}){expression}"


def saturated(expression: str, from_: str, to: str) -> str:
    """A conversion to a narrower type that saturates; the expression itself where the types are equal."""
    if from_ == to:
        return expression
    return {
        ("int32_t", "int16_t"): f"foc_sat16({expression})",
        ("int64_t", "int32_t"): f"foc_sat32({expression})",
        ("int64_t", "int16_t"): f"foc_sat16(foc_sat32({expression}))",
    }[from_, to]


def counts(expression: str, state: Format) -> str:
    """A floating expression as an integral holds it: in counts where that is in counts."""
    return expression if state.floating else f"foc_counts_f32({expression}, {up_of(state)})"


def value(expression: str, state: Format) -> str:
    """A floating plan's integral as a floating value."""
    return expression if state.floating else f"foc_value_f32({expression}, {power_of_two(state.lsb)})"


def scaled_up(ctype: str, by: int) -> str:
    """The factor 2^``by`` with its operator; nothing where ``by`` is 0."""
    return f" * (({ctype})1 << {by})" if by else ""


def bound(form: Format, of: str) -> str:
    """The proven range of a node, for a comment; empty for floating point."""
    if form.floating:
        return ""
    return f"|{of}| <= {max(abs(int(form.low)), abs(int(form.high)))} < 2^{form.bits - 1}"
