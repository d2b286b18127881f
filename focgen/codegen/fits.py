"""Whether what a plan counts and scales fits the types that C counts and scales with.

The runtime counts samples, weights, blocks, modes and breakpoints in 16 bits. What turns counts into physical
values and back computes in single precision. A plan has no such ends.
"""

from __future__ import annotations

from collections.abc import Iterator

from focgen.codegen.conversions import inputs_of
from focgen.errors import PlanError
from focgen.plan.plan import LONGEST, Format, Plan, Sum

COUNT = 65_535
"""The largest count: of 16 bits."""
_FINEST, _LARGEST = 2.0**-120, 2.0**126  # of a count, and of what a type holds: far from where floats end
_SHORTEST_STEP, _LONGEST_STEP = 1e-30, 1e30  # s, which the header gives in single precision


def check_fits(plan: Plan) -> None:
    """Raise PlanError where C could not count something, or a float could not hold it."""
    for key, what, count, most in (*_schedule(plan), *(c for s in plan.sums for c in _sum(s))):
        if count > most:
            remedy = f"at most {most} can be counted in C"
            raise PlanError(f"{plan.name} [{key}]", f"has {count} {what}", remedy)
    if plan.arithmetic != "f64" and not _SHORTEST_STEP <= plan.sample_time <= _LONGEST_STEP:
        remedy = f"choose f64, or a sample_time from {_SHORTEST_STEP:g} to {_LONGEST_STEP:g} s"
        raise PlanError(plan.name, f"has a sample_time of {plan.sample_time:g} s", remedy)
    _check_scales(plan)


def _schedule(plan: Plan) -> Iterator[tuple[str, str, int, int]]:
    """Where, of what, how many, and how many there can be."""
    if plan.schedule:
        yield "gain", "breakpoints", len(plan.schedule.gains), COUNT


def _sum(table: Sum) -> Iterator[tuple[str, str, int, int]]:
    yield "transfer", "past samples", table.last, LONGEST
    yield "transfer", "weights", table.taps, COUNT
    yield "transfer", "blocks of weights", len(table.blocks), COUNT
    for bank in table.banks:
        yield "transfer", "modes", bank.modes, COUNT


def _check_scales(plan: Plan) -> None:
    forms = {**inputs_of(plan), "u": plan.output}
    for name, form in forms.items():
        if not form.floating and not (form.lsb >= _FINEST and _end(form) <= _LARGEST):
            what = f"one count of {name} would be {form.lsb:.3g}, and as many as there are {_end(form):.3g}"
            remedy = "give [ranges] in units that are nearer to 1"
            raise PlanError(f"{plan.name} [ranges]", what, f"{remedy}, so that single precision holds both")


def _end(form: Format) -> float:
    return float(2 ** (form.bits - 1)) * form.lsb
