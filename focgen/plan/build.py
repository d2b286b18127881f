"""From a controller to its plan."""

from __future__ import annotations

import math
from dataclasses import replace

from focgen.control.controller import ARITHMETICS, Controller
from focgen.errors import PlanError
from focgen.plan import fixed, floating
from focgen.plan.bounds import error_bound
from focgen.plan.canonical import Tables, realise, tables
from focgen.plan.formats import WORDS
from focgen.plan.model import ErrorBound, Format, Plan
from focgen.plan.proofs import prove
from focgen.plan.stability import check_stable
from focgen.plan.usable import check_room

_LONGEST = 1_000_000


def build_plan(
    controller: Controller, arithmetic: str | None = None, length: int | None = None, name: str | None = None
) -> Plan:
    """Plan a controller in ``arithmetic`` (f64, f32, q31, q15) with memory ``length``; both default to the
    controller's.

    Raises PlanError where the transfer function cannot be realised, its truncated recursion is not stable, a
    range cannot be represented, or a node cannot be proved; the remedy says what would work.
    """
    arithmetic, length = arithmetic or controller.arithmetic, controller.length if length is None else length
    _check(controller, arithmetic, length)
    folded = tables(controller, length)
    check_stable(controller, folded, length)
    draft = _fixed if arithmetic in WORDS else _floating
    plan = draft(controller, arithmetic, length, name or controller.name, folded)
    _check_at_rest(plan, folded)
    check_room(plan)
    plan = replace(plan, proofs=prove(plan))
    return replace(plan, error_bound=error_bound(plan, folded))


def _check(controller: Controller, arithmetic: str, length: int) -> None:
    where = controller.name
    if arithmetic not in ARITHMETICS:
        raise PlanError(
            where, f"the arithmetic {arithmetic!r} is unknown", f"choose one of {', '.join(ARITHMETICS)}"
        )
    if not isinstance(length, int) or not 1 <= length <= _LONGEST:
        raise PlanError(where, f"the memory length is {length!r}", f"give 1 to {_LONGEST} past samples")
    if controller.memory != "short":
        raise PlanError(where, f"the memory form {controller.memory!r} has no plan", 'set memory = "short"')
    if not all(map(math.isfinite, _numbers(controller))) or controller.sample_time <= 0.0:
        raise PlanError(
            where, "has a number that is not finite, or a sample_time that is not positive", "correct it"
        )
    if controller.scheduled and controller.ranges.schedule is None:
        raise PlanError(where, "the scheduling signal has no range", "give ranges.schedule")


def _numbers(controller: Controller) -> list[float]:
    ranges, gain = controller.ranges, controller.gain
    spans = [s for s in (ranges.reference, ranges.measurement, ranges.output, ranges.schedule) if s]
    gains = [*gain.breakpoints, *gain.gains] if controller.scheduled else [gain]
    return [controller.sample_time, *gains, *(x for span in spans for x in span)]


def _check_at_rest(plan: Plan, folded: Tables) -> None:
    """A gain for constants that rounding took away, or turned round, would be the loop's undoing."""
    form, half_step = realise(plan.controller), 0.5 * plan.sample_time
    for made, table, terms, factor in (
        (plan.direct, folded.direct, form.direct, 1.0),
        (plan.inner and plan.inner.rest, folded.rest, form.rest, half_step),
    ):
        meant = sum(abs(t.coefficient) for t in terms if t.order == 0.0) * factor / abs(folded.normaliser)
        if made is not None and abs(math.fsum(made.values) - table.total) > 0.5 * meant > 0.0:
            what = f"the weights of {plan.arithmetic} lose the gain at rest: the highest order outweighs it"
            raise PlanError(plan.name, what, "choose q31, f32 or f64, or a longer sample_time")


_NOTHING_YET = ErrorBound(float("inf"), float("inf"), None)


def _fixed(controller: Controller, arithmetic: str, length: int, name: str, folded: Tables) -> Plan:
    word = WORDS[arithmetic]
    ends = fixed.signals(controller, word)
    made = fixed.filter_of(controller, folded, ends, word)
    out = fixed.actuation(controller, made, ends, word)
    signals = (ends.reference, ends.measurement, ends.error, ends.output)
    return _assembled(controller, arithmetic, length, name, signals, made, out)


def _floating(controller: Controller, arithmetic: str, length: int, name: str, folded: Tables) -> Plan:
    kind, ctype = floating.KINDS[arithmetic]
    ranges, units = controller.ranges, controller.units
    ref = floating.signal(ranges.reference, kind, ctype, units.measurement)
    meas = floating.signal(ranges.measurement, kind, ctype, units.measurement)
    error = Format(
        ctype, 1.0, min(ref.low - meas.high, 0.0), max(ref.high - meas.low, 0.0), units.measurement
    )
    output = floating.signal(ranges.output, kind, ctype, units.output)
    made = floating.filter_of(controller, folded, kind, ctype)
    out = floating.actuation(controller, output, kind, ctype)
    return _assembled(controller, arithmetic, length, name, (ref, meas, error, output), made, out)


def _assembled(
    controller, arithmetic, length, name, signals, made: fixed.Filter, out: fixed.Actuation
) -> Plan:
    reference, measurement, error, output = signals
    return Plan(
        controller=controller,
        name=name,
        arithmetic=arithmetic,
        memory=controller.memory,
        length=length,
        sample_time=controller.sample_time,
        reference=reference,
        measurement=measurement,
        error=error,
        direct=made.direct,
        inner=made.inner,
        wide=made.wide,
        narrow=made.narrow,
        feedback=made.feedback,
        filtered=made.filtered,
        schedule=out.gain.schedule,
        gain=out.gain.format,
        constant_gain=out.gain.constant,
        product=out.product,
        gain_shift=out.gain_shift,
        increment=out.increment,
        integrator=out.integrator,
        output=output,
        proofs=(),
        error_bound=_NOTHING_YET,
    )
