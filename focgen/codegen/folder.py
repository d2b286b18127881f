"""The contexts of the folder's ``README.md`` and of ``example/main.c``."""

from __future__ import annotations

import math
from dataclasses import dataclass

import focgen
from focgen.codegen.banks import time_constant
from focgen.codegen.formulas import transfer_text
from focgen.codegen.guard import unusable_text
from focgen.codegen.kernels import PORTABLE, Kernels, runtime_files
from focgen.codegen.literals import quantity, wrapped
from focgen.codegen.manifest import sizes
from focgen.codegen.texts import UserText, markdown
from focgen.plan.canonical import memory_bias
from focgen.plan.formats import runtime
from focgen.plan.least_error import since_reset, smallest_error
from focgen.plan.plan import Plan
from focgen.plan.remarks import remarks
from focgen.present import present


@dataclass(frozen=True)
class Signal:
    """A row of the table of signals."""

    name: str
    what: str
    low: str
    high: str
    unit: UserText
    lsb: str
    bits: int


@dataclass(frozen=True)
class ReadmeContext:
    """Everything ``README.md.jinja`` asks for."""

    name: str
    title: UserText
    version: str
    arithmetic: str
    fixed: bool
    floats: bool
    unusable: str
    ctype: str
    transfer: str
    sample_time: str
    length: int
    exponential: bool
    memory: str
    horizon: bool
    within_horizon: UserText
    memory_section: str
    against: str
    signals: list[Signal]
    scheduled: bool
    integral: bool
    inner: bool
    state_bytes: int
    table_bytes: int
    multiplies: int
    proofs: int
    tightest: str
    operator: UserText
    output_per_sample: UserText
    smallest: UserText | None
    since_reset: bool
    remarks: list[UserText]
    truncation: UserText | None
    biases: list[str]
    selftest: bool
    files: list[str]
    box: list[str]
    slew: UserText | None
    aim: str


def readme_context(
    plan: Plan, title: str, selftest: bool = False, kernels: Kernels = PORTABLE, floats: bool = True
) -> ReadmeContext:
    """Prepare the folder's README; ``selftest`` and ``floats``: whether it tells of one, of conversions."""
    size, bound, unit = sizes(plan, kernels), plan.error_bound, plan.controller.units.output
    operator_unit = f"{unit}/s" if plan.integrator and unit else unit
    least = smallest_error(plan)
    return ReadmeContext(
        name=plan.name,
        title=UserText(title),
        version=focgen.__version__,
        arithmetic=plan.arithmetic,
        fixed=not plan.floating,
        floats=floats,
        unusable=unusable_text(plan) if plan.floating else "",
        ctype=plan.output.ctype,
        transfer=transfer_text(plan),
        sample_time=f"{plan.sample_time:g}",
        length=plan.length,
        exponential=plan.exponential,
        memory=_memory(plan),
        horizon=plan.horizon is not None,
        within_horizon=_quantity(bound.within_horizon or 0.0, operator_unit),
        memory_section=_memory_section(plan),
        against="s^α itself, for a sine in the band" if plan.band else "an infinite memory",
        signals=_signals(plan),
        scheduled=plan.schedule is not None,
        integral=plan.integrator is not None,
        inner=plan.inner is not None,
        state_bytes=size["state_bytes"],
        table_bytes=size["table_bytes"],
        multiplies=plan.multiplies,
        proofs=len(plan.proofs),
        tightest=_tightest(plan),
        operator=_quantity(bound.operator, operator_unit),
        output_per_sample=_quantity(bound.output_per_sample, unit),
        smallest=None if least is None else _quantity(least, plan.controller.units.measurement),
        since_reset=since_reset(plan),
        remarks=[UserText(remark) for remark in remarks(plan)],
        truncation=None if bound.truncation is None else _quantity(bound.truncation, operator_unit),
        biases=_biases(plan),
        selftest=selftest,
        files=[f"{plan.name}.h", f"{plan.name}.c", *runtime_files(plan, kernels)],
        box=_box(plan),
        slew=None if plan.controller.slew_limit is None else _quantity(plan.controller.slew_limit, unit),
        aim=f"{plan.controller.setpoint_filter:.6g} s" if plan.set_point else "",
    )


def _box(plan: Plan) -> list[str]:
    """What may be tuned, a part each, for Markdown; nothing where nothing may."""
    if plan.tuning is None:
        return []
    box, unit = present(plan.controller.tunable), markdown(UserText(plan.controller.units.output))
    spans = (("factors on the gain", box.gain, ""), ("`u_min`", box.output_low, unit),
             ("`u_max`", box.output_high, unit))  # fmt: skip
    return [f"{what} from {low:g} to {high:g} {of}".rstrip() for what, (low, high), of in spans if low < high]


def _quantity(value: float, unit: str) -> UserText:
    return UserText(f"{value:.3g} {unit}".rstrip())


def _signals(plan: Plan) -> list[Signal]:
    ranges, units = plan.controller.ranges, plan.controller.units
    prefix = plan.name.upper()
    rows = [
        ("ref", "reference", ranges.reference, units.measurement, plan.reference, "REF_LSB"),
        ("meas", "measurement", ranges.measurement, units.measurement, plan.measurement, "REF_LSB"),
        ("u", "output", ranges.output, units.output, plan.output, "U_LSB"),
    ]
    if plan.schedule:
        signal = plan.schedule.signal
        rows.insert(
            2, ("sched", "scheduling signal", present(ranges.schedule), units.schedule, signal, "SCHED_LSB")
        )
    return [
        Signal(name, what, f"{ends[0]:g}", f"{ends[1]:g}", UserText(unit), f"{prefix}_{lsb}", form.bits)
        for name, what, ends, unit, form, lsb in rows
    ]


def _memory(plan: Plan) -> str:
    """What is remembered, in words."""
    if not plan.exponential:
        return f"the present and at most {plan.length} past samples"
    return f"an exponential memory of {plan.states} modes"


def _tightest(plan: Plan) -> str:
    if not plan.proofs:
        return ""
    proof = min(plan.proofs, key=lambda p: p.margin_bits)
    share = math.ceil(1000.0 * proof.worst / proof.limit) / 10.0  # upwards: it is a bound
    return f"`{proof.node}`, at most {share:g} % of its {proof.ctype}"


def _memory_section(plan: Plan) -> str:
    """What an exponential memory is and what holds of it, as a paragraph; empty for a short one."""
    if not plan.states:
        return ""
    words = (
        "The memory is a sum of exponentials. Every fractional power of s keeps a few means of its history,"
        f" each over a time of its own ({_times(plan)}); {_followed(plan)}."
        " Nothing is cut off, so a constant is remembered without an error, and a step costs the same however"
        " far the memory reaches. Means cannot leave the range of what they average: the bounds above hold"
        f" for any number of samples.{_SLOW[runtime(plan.arithmetic)] * _has_slow(plan)}"
    )
    return "\n".join(wrapped(words.split(" "), 116))


def _followed(plan: Plan) -> str:
    """What the memories are close to, and how close."""
    orders = ", ".join(f"s^{m.order:g} to {m.tolerance:.2g} with {m.states} modes" for m in plan.memories)
    if plan.band:
        low, high = plan.band
        return (
            f"with them its response follows (jω)^α itself from {low:.4g} to {high:.4g} rad/s: {orders}"
            " (relative error, proved for every frequency of the band). Above the band it stays within twice"
            " |jω|^α, four times where α > 1"
        )
    return (
        "the weights that the past has through them follow"
        f" the exact ones for {plan.horizon} samples: {orders} (relative error, proved for every lag)"
    )


_SLOW = {
    "f64": "",
    "f32": " The slow means are compensated sums of two floats: one alone would stand still.",
    "q31": " The slow means' rates have more bits than the others'.",
    "q15": " The slow means are 64 bits wide.",
}


def _has_slow(plan: Plan) -> bool:
    return any(b.compensated or b.rate_shift or b.to_drive > b.drive.bits for s in plan.sums for b in s.banks)


def _times(plan: Plan) -> str:
    """The shortest and the longest time constant."""
    rates = [q for table in plan.sums for bank in table.banks for q in bank.real_rates]
    return f"{time_constant(plan, max(rates)):.2g} s to {time_constant(plan, min(rates)):.2g} s"


def _biases(plan: Plan) -> list[str]:
    if plan.exponential:
        return []
    return [
        f"`{coefficient:.6g} s^{order:g}` is {bias:.3g} at rest instead of 0"
        for coefficient, order, bias in memory_bias(plan.controller, plan.length)
        if bias != 0.0
    ]


@dataclass(frozen=True)
class ExampleContext:
    """Everything ``main.c.jinja`` asks for."""

    name: str
    title: UserText
    fixed: bool
    counting: bool
    scheduled: bool
    integral: bool
    real: str
    reference: str
    reference_about: str
    schedule: str
    output_unit: UserText
    suffix: str


def example_context(plan: Plan, title: str, floats: bool = True) -> ExampleContext:
    """Prepare the example: a step of the reference within its range, half way up; without conversions in the
    header (``floats``) it has its own.
    """
    ranges, units = plan.controller.ranges, plan.controller.units
    middle = 0.5 * (ranges.reference[0] + ranges.reference[1])
    at = sum(present(ranges.schedule)) / 2 if plan.schedule else 0.0
    return ExampleContext(
        name=plan.name,
        title=UserText(title),
        fixed=not plan.floating,
        counting=not plan.floating and not floats,
        scheduled=plan.schedule is not None,
        integral=plan.integrator is not None,
        real="double" if plan.arithmetic != "f32" else "float",
        reference=_number(ranges.reference[1] if middle == 0.0 else middle),
        reference_about=quantity(ranges.reference[1] if middle == 0.0 else middle, units.measurement),
        schedule=_number(at),
        output_unit=UserText(units.output),
        suffix="f" if plan.arithmetic == "f32" else "",
    )


def _number(value: float) -> str:
    text = f"{value:.6g}"
    return text if "." in text or "e" in text else f"{text}.0"
