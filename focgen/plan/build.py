"""From a controller to its plan."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from focgen.control.controller import ARITHMETICS, MEMORIES, TOLERANCES, Controller
from focgen.errors import PlanError
from focgen.plan import fixed, floating
from focgen.plan.bounds import error_bound
from focgen.plan.canonical import Tables, realise, tables
from focgen.plan.formats import WORDS
from focgen.plan.gains import within_range
from focgen.plan.integrals import counted
from focgen.plan.memory import Memory, band_memories_of, checked_band, exponential_tables, memories_of
from focgen.plan.plan import ErrorBound, Format, Plan
from focgen.plan.proofs import prove
from focgen.plan.setpoint import with_set_point
from focgen.plan.slewing import with_slew
from focgen.plan.stability import check_stable
from focgen.plan.tuning import with_limits
from focgen.plan.usable import check_room
from focgen.present import present

_LONGEST = 1_000_000


def build_plan(
    controller: Controller,
    arithmetic: str | None = None,
    length: int | None = None,
    name: str | None = None,
    memory: str | None = None,
    tolerance: float | None = None,
    horizon: int | None = None,
    operator: str | None = None,
    band: tuple[float, float] | None = None,
    tunable: bool = False,
) -> Plan:
    """Plan a controller in ``arithmetic`` (f64, f32, q31, q15) with ``memory`` "short", of ``length`` past
    samples, or "exponential", within ``tolerance`` up to ``horizon`` samples; all default to the
    controller's, as do ``operator`` and ``band``.

    ``tolerance``: 1e-8 … 0.1, the largest relative error of the exact memory's weights up to the horizon, 100
    … 1e8 samples (:class:`focgen.fractional.exponential.ExponentialMemory`). ``operator`` "gl", or
    "continuous": then an exponential memory follows (jω)^α itself within ``tolerance``, relative, over
    ``band`` in rad/s, a factor of 10 to 1e6 wide and at most to half of the Nyquist frequency; by default
    four decades up to a tenth of it. It has no horizon, and its ``tolerance`` defaults to 1e-3.
    ``tunable``: with the parameters whose box the controller's ``tunable`` gives.

    Raises PlanError where the transfer function cannot be realised, its truncated recursion is not stable, a
    range cannot be represented, or a node cannot be proved; the remedy says what would work.
    """
    controller = _tunable(controller, tunable)
    given: dict[str, Any] = dict(
        arithmetic=arithmetic, length=length, memory=memory, tolerance=tolerance, horizon=horizon
    )
    wanted = replace(controller, **{key: value for key, value in given.items() if value is not None})
    wanted = _operated(wanted, operator, band, tolerance)
    _check(wanted)
    if wanted.tunable and wanted.scheduled and wanted.arithmetic in WORDS:
        controller, wanted = within_range(controller), within_range(wanted)
    operator, band = wanted.operator, checked_band(wanted, wanted.operator, wanted.band)
    folded, memories = _tables(wanted, band)
    check_stable(controller, folded, wanted.length)
    draft = _fixed if wanted.arithmetic in WORDS else _floating
    with np.errstate(over="ignore"):  # a number beyond the type has no room, and is refused for that below
        plan = draft(controller, wanted.arithmetic, wanted.length, name or controller.name, folded)
    if wanted.memory == "exponential":
        horizon = None if band else wanted.horizon
        asked: dict[str, Any] = dict(
            operator=operator, band=band, tolerance=wanted.tolerance, horizon=horizon
        )
        plan = replace(plan, memory="exponential", memories=memories, **asked)
        plan = replace(plan, length=max(plan.error_lags, plan.filtered_lags))
    _check_at_rest(plan, folded)
    check_room(plan)
    plan = with_set_point(with_slew(with_limits(counted(plan))))
    plan = replace(plan, proofs=prove(plan))
    return replace(plan, error_bound=error_bound(plan, folded))


def _operated(
    controller: Controller, operator: str | None, band: tuple[float, float] | None, tolerance: float | None
) -> Controller:
    """The controller with the operator that is asked for. Its own goes with an exponential memory alone; a
    tolerance is of one operator, so another has its default.
    """
    own = controller.operator if controller.memory == "exponential" else "gl"
    if operator is None or operator == own:
        kept = controller.band if own != "gl" else None
        return replace(controller, operator=own, band=kept if band is None else band)
    if tolerance is None:
        tolerance = TOLERANCES.get(operator, controller.tolerance)
    return replace(controller, operator=operator, band=band, tolerance=tolerance)


def _tunable(controller: Controller, tunable: bool) -> Controller:
    """The controller as it is to be planned: without its box where nothing is to be tuned."""
    if tunable and controller.tunable is None:
        remedy = "add it, with gain, output_low or output_high as [low, high]"
        raise PlanError(controller.name, "has no [tunable], which --tunable needs", remedy)
    return controller if tunable else replace(controller, tunable=None)


def _tables(wanted: Controller, band: tuple[float, float] | None) -> tuple[Tables, tuple[Memory, ...]]:
    if wanted.memory == "short":
        return tables(wanted, wanted.length), ()
    memories: tuple[Memory, ...]
    if band:
        memories = band_memories_of(wanted, wanted.arithmetic, wanted.tolerance, band)
    else:
        memories = memories_of(wanted, wanted.arithmetic, wanted.tolerance, wanted.horizon)
    return exponential_tables(wanted, memories), memories


def _check(controller: Controller) -> None:
    where, arithmetic, length = controller.name, controller.arithmetic, controller.length
    if arithmetic not in ARITHMETICS:
        raise PlanError(
            where, f"the arithmetic {arithmetic!r} is unknown", f"choose one of {', '.join(ARITHMETICS)}"
        )
    if not isinstance(length, int) or not 1 <= length <= _LONGEST:
        raise PlanError(where, f"the memory length is {length!r}", f"give 1 to {_LONGEST} past samples")
    if controller.memory not in MEMORIES:
        choices = " or ".join(MEMORIES)
        raise PlanError(where, f"the memory form {controller.memory!r} is unknown", f"choose {choices}")
    if not isinstance(controller.tolerance, float) or not isinstance(controller.horizon, int):
        remedy = "give a number, and a whole number of samples"
        what = f"has the tolerance {controller.tolerance!r} and the horizon {controller.horizon!r}"
        raise PlanError(where, what, remedy)
    if not all(map(math.isfinite, _numbers(controller))) or controller.sample_time <= 0.0:
        raise PlanError(
            where, "has a number that is not finite, or a sample_time that is not positive", "correct it"
        )
    if controller.scheduled and controller.ranges.schedule is None:
        raise PlanError(where, "the scheduling signal has no range", "give ranges.schedule")


def _numbers(controller: Controller) -> list[float]:
    ranges = controller.ranges
    spans = [s for s in (ranges.reference, ranges.measurement, ranges.output, ranges.schedule) if s]
    points = controller.schedule.breakpoints if controller.scheduled else ()
    return [controller.sample_time, *points, *controller.gains, *(x for span in spans for x in span)]


def _check_at_rest(plan: Plan, folded: Tables) -> None:
    """A gain for constants that rounding took away, or turned round, would be the loop's undoing."""
    form, half_step = realise(plan.controller), 0.5 * plan.sample_time
    for made, table, terms, factor in (
        (plan.direct, folded.direct, form.direct, 1.0),
        (plan.inner.rest if plan.inner else None, folded.rest, form.rest, half_step),
    ):
        constants = [abs(t.coefficient) for t in terms if t.order == 0.0]
        meant = math.fsum(constants) * factor / abs(folded.normaliser)
        if made is not None and abs(math.fsum(made.values) - present(table).total) > 0.5 * meant > 0.0:
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
    controller: Controller,
    arithmetic: str,
    length: int,
    name: str,
    signals: tuple[Format, Format, Format, Format],
    made: fixed.Filter,
    out: fixed.Actuation,
) -> Plan:
    reference, measurement, error, output = signals
    return Plan(
        controller=controller,
        name=name,
        arithmetic=arithmetic,
        memory="short",
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
        tuning=out.gain.tuning,
    )
