"""The set-point filter in C: its constants, and what the step puts in the reference's place."""

from __future__ import annotations

from dataclasses import dataclass

from focgen.codegen.literals import constant, exponent, literal
from focgen.plan.plan import Plan
from focgen.plan.setpoint import start_of


@dataclass(frozen=True)
class SetPointText:
    """``rate`` q, ``about`` it; in fixed point ``up`` bits of the state are below a count and it reaches from
    ``low`` to ``high``; floating, a lag up to ``drop`` is 0. ``start``: the set point after init. ``error``:
    e of a step.
    """

    rate: str
    about: str
    up: int
    low: str
    high: str
    drop: str
    drop_about: str
    start: str
    error: str


def set_point_text(plan: Plan) -> SetPointText | None:
    """The filter of a plan; None where it has none."""
    made = plan.set_point
    if made is None:
        return None
    signal, taken = plan.reference.ctype, f"{plan.name}_aim(s, {'ref' if plan.floating else 'r'})"
    error = f"{taken} - meas" if plan.floating else f"{taken} - m"
    kind = signal if plan.floating else "int64_t"
    seconds = f"time constant {plan.controller.setpoint_filter:.6g} s"
    return SetPointText(
        rate=constant(made.rate, kind),
        about=seconds if plan.floating else f"{seconds}, counts of 2^-{made.up}",
        up=made.up,
        low=constant(made.low, kind),
        high=constant(made.high, kind),
        drop=constant(made.drop, kind),
        drop_about=f"2^{exponent(made.drop)}" if made.drop else "",
        start=literal(start_of(plan), signal),
        error=f"(int16_t)({error})" if signal == "int16_t" else error,
    )
