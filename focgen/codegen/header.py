"""The context of ``controller.h.jinja``: NAME.h, what a program that uses the controller reads."""

from __future__ import annotations

from dataclasses import dataclass

import focgen
from focgen.codegen.conversions import Conversion, Counted, conversions, counted, period_us, to_float
from focgen.codegen.formulas import transfer_text
from focgen.codegen.guard import unusable_text
from focgen.codegen.kernels import PORTABLE, Kernels
from focgen.codegen.literals import constant, literal, power_of_two, quantity
from focgen.codegen.manifest import flags
from focgen.codegen.saved import saved_bytes
from focgen.codegen.state import Member, members, state_bytes
from focgen.codegen.texts import UserText, comment
from focgen.plan.plan import Count, Format, Plan
from focgen.present import present


@dataclass(frozen=True)
class Define:
    """A macro: its name without the prefix, its value, what it is."""

    name: str
    value: str
    about: str


@dataclass(frozen=True)
class HeaderContext:
    """Everything ``controller.h.jinja`` asks for."""

    name: str
    title: UserText
    version: str
    arithmetic: str
    sha256: str
    transfer: str
    fixed: bool
    unusable: str
    signal: str
    times: list[Define]
    scales: list[Define]
    limits: list[Define]
    sizes: list[Define]
    members: tuple[Member, ...]
    state_bytes: int
    integral: bool
    inner: bool
    scheduled: bool
    counted: Counted | None
    conversions: list[Conversion]
    to_float: str
    aliases: list[str]
    tunable: list[Define]


def header_context(
    plan: Plan, title: str, sha256: str, kernels: Kernels = PORTABLE, floats: bool = True
) -> HeaderContext:
    """Prepare NAME.h; ``sha256`` is of the controller's file; ``floats``: with conversions from and to
    physical values.
    """
    return HeaderContext(
        name=plan.name,
        title=UserText(title),
        version=focgen.__version__,
        arithmetic=plan.arithmetic,
        sha256=sha256,
        transfer=comment(transfer_text(plan)),
        fixed=not plan.floating,
        unusable=unusable_text(plan) if plan.floating else "",
        signal=plan.output.ctype,
        times=_times(plan),
        scales=_scales(plan),
        limits=_limits(plan),
        sizes=_sizes(plan, kernels),
        members=members(plan, kernels),
        state_bytes=state_bytes(plan, kernels),
        integral=plan.integrator is not None,
        inner=plan.inner is not None,
        scheduled=plan.schedule is not None,
        counted=None if plan.floating else counted(plan.output),
        conversions=conversions(plan) if floats else [],
        to_float=to_float(plan),
        aliases=_aliases(plan, kernels),
        tunable=_tunable(plan),
    )


def _times(plan: Plan) -> list[Define]:
    found = [Define("SAMPLE_TIME", _sample_time(plan), "s: call step this often")]
    period = period_us(plan)
    return found + [Define("PERIOD_US", f"{period}u", "the same in microseconds")] * (period is not None)


def _aliases(plan: Plan, kernels: Kernels) -> list[str]:
    """The macros that programs may know by the controller's name as it is spelled; none where that is in
    capitals anyway.
    """
    if plan.name == plan.name.upper():
        return []
    listed = (*_times(plan)[:1], *_scales(plan), *_limits(plan), *_sizes(plan, kernels)[:-1])
    return [*(define.name for define in listed), *(f"FLAG_{flag}" for flag in flags(plan))]


def _sample_time(plan: Plan) -> str:
    return literal(plan.sample_time, "double") + ("" if plan.arithmetic == "f64" else "f")


def _scales(plan: Plan) -> list[Define]:
    units = plan.controller.units
    return [
        Define("REF_LSB", _lsb(plan.error), _unit(units.measurement, "of reference and measurement")),
        *(
            [
                Define(
                    "SCHED_LSB", _lsb(plan.schedule.signal), _unit(units.schedule, "of the scheduling signal")
                )
            ]
            if plan.schedule
            else []
        ),
        Define("U_LSB", _lsb(plan.output), _unit(units.output, "of the output")),
    ]


def _lsb(form: Format) -> str:
    return literal(1.0, form.ctype) if form.floating else power_of_two(form.lsb)


def _unit(unit: str, of: str) -> str:
    return f"{comment(unit)}, {of}" if unit else of


def _limits(plan: Plan) -> list[Define]:
    ranges, units = plan.controller.ranges, plan.controller.units
    found = []
    if not plan.floating:
        found += _ends("REF", plan.reference, ranges.reference, units.measurement)
        found += _ends("MEAS", plan.measurement, ranges.measurement, units.measurement)
        if plan.schedule:
            found += _ends("SCHED", plan.schedule.signal, present(ranges.schedule), units.schedule)
    return found + _ends("U", plan.output, ranges.output, units.output)


def _ends(name: str, form: Format, physical: tuple[float, float], unit: str) -> list[Define]:
    return [
        Define(f"{name}_{end}", constant(count, form.ctype), _end_about(form, count, value, unit))
        for end, count, value in (("MIN", form.low, physical[0]), ("MAX", form.high, physical[1]))
    ]


def _end_about(form: Format, count: Count, value: float, unit: str) -> str:
    """The value that was asked for, and whether a count only comes near it."""
    exact = form.floating or count * form.lsb == value
    return quantity(value, unit) if exact else f"the count nearest to {quantity(value, unit)}"


def _tunable(plan: Plan) -> list[Define]:
    """The box of the parameters; empty where there are none."""
    if plan.tuning is None:
        return []
    box, physical, unit = plan.tuning, present(plan.controller.tunable), plan.controller.units.output
    count = len(box.nominal)
    about = "factors: one for each gain of the schedule" if plan.schedule else "factors: one for the gain"
    ends = _ends("GAIN", box.factor, physical.gain, "")
    lowest, highest = (
        Define(f"U_{name}", constant(end, plan.output.ctype), _end_about(plan.output, end, value, unit))
        for name, end, value in (
            ("MIN_HIGHEST", box.low[1], physical.output_low[1]),
            ("MAX_LOWEST", box.high[0], physical.output_high[0]),
        )
    )
    lsb = Define("GAIN_LSB", _lsb(box.factor), "of a factor")
    return [Define("GAINS", f"{count}u", about), lsb, *ends, lowest, highest]


def _sizes(plan: Plan, kernels: Kernels) -> list[Define]:
    saved = Define("SAVED_BYTES", f"{saved_bytes(plan, kernels)}u", f"what {plan.name}_save writes")
    found = [Define("ERRORS", str(kernels.slots(plan, "error")), "the present error and those before it")]
    if plan.feedback:
        about = "the same of the filtered error"
        found.append(Define("FILTERED", str(kernels.slots(plan, "filtered")), about))
    return [*found, saved]
