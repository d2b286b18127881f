"""A Functional Mock-up Unit for co-simulation: the controller as a block of any simulator that takes FMUs."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from focgen.codegen.packages.context import Made, licence, release, rendered
from focgen.codegen.texts import UserText, shown
from focgen.plan.plan import Plan


@dataclass(frozen=True)
class Variable:
    """A variable in physical units: ``number`` is its value reference."""

    number: int
    name: str
    about: str
    unit: UserText
    start: str


@dataclass(frozen=True)
class Parameter:
    """A variable that may be set between steps, from ``low`` to ``high``; ``member`` of the C's parameters,
    ``lsb`` the macro with the size of its count."""

    variable: Variable
    low: str
    high: str
    member: str
    lsb: str


@dataclass(frozen=True)
class FmuContext:
    """Everything the templates of an FMU ask for; times in s."""

    name: str
    title: UserText
    version: str
    token: str
    fmi: int
    step: str
    fixed: bool
    bits: int
    integral: bool
    inputs: list[Variable]
    output: Variable
    low: str
    high: str
    units: list[UserText]
    parameters: list[Parameter]


def fmu_files(made: Made) -> dict[str, str | bytes]:
    """The description, the C of the interface, the licence, and a section of the README."""
    context = _context(made)
    names = [
        ("fmu/modelDescription.xml", f"modelDescription{made.fmi}.xml.jinja"),
        (f"fmu/{made.plan.name}_fmi{made.fmi}.c", f"fmi{made.fmi}.c.jinja"),
        ("README.md", "README.md.jinja"),
    ]
    if made.fmi == 3:
        names.append(("fmu/buildDescription.xml", "buildDescription.xml.jinja"))
    return {**rendered("fmu", context, *names), "LICENSE": licence()}


def _context(made: Made) -> FmuContext:
    plan = made.plan
    inputs, output = _variables(plan)
    return FmuContext(
        name=plan.name,
        title=UserText(plan.controller.name),
        version=release(),
        token=_token(made),
        fmi=made.fmi or 3,
        step=repr(float(plan.sample_time)),
        fixed=not plan.floating,
        bits=plan.output.bits,
        integral=plan.integrator is not None,
        inputs=inputs,
        output=output,
        low=_value(plan, plan.output.low),
        high=_value(plan, plan.output.high),
        units=[UserText(text) for text in dict.fromkeys(v.unit.text for v in (*inputs, output) if v.unit)],
        parameters=_parameters(plan),
    )


def _unit(text: str) -> UserText:
    """As the description shows it: units that look alike are one, and what shows nothing is none."""
    return UserText(shown(text))


def _value(plan: Plan, count: int | float) -> str:
    """A count of the output in its unit."""
    return repr(float(count) * (1.0 if plan.output.floating else plan.output.lsb))


def _variables(plan: Plan) -> tuple[list[Variable], Variable]:
    ranges, units = plan.controller.ranges, plan.controller.units
    rows = [
        ("ref", "reference", ranges.reference, units.measurement),
        ("meas", "measurement", ranges.measurement, units.measurement),
    ]
    if plan.schedule and ranges.schedule:
        rows.append(("sched", "scheduling signal", ranges.schedule, units.schedule))
    inputs = [
        Variable(i, name, about, _unit(unit), repr(min(max(0.0, span[0]), span[1])))
        for i, (name, about, span, unit) in enumerate(rows, 1)
    ]
    return inputs, Variable(4, "u", "output", _unit(units.output), "0.0")


def _parameters(plan: Plan) -> list[Parameter]:
    """Of a tunable plan: the limits of the output, and a factor for each gain."""
    box, unit = plan.tuning, _unit(plan.controller.units.output)
    if box is None:
        return []
    name, one = plan.name.upper(), 1.0 if plan.output.floating else box.factor.lsb
    limits = ("u_min", "lower", plan.output.low, box.low), ("u_max", "upper", plan.output.high, box.high)
    found = [
        Parameter(
            Variable(number, member, f"{which} limit of the output", unit, _value(plan, start)),
            _value(plan, ends[0]),
            _value(plan, ends[1]),
            member,
            f"{name}_U_LSB",
        )
        for number, (member, which, start, ends) in enumerate(limits, 8)
    ]
    low, high = (repr(float(end) * one) for end in (box.factor.low, box.factor.high))
    for i in range(len(box.nominal)):
        gain = Variable(10 + i, f"gain_{i + 1}", "factor on a gain of the schedule", UserText(""), "1.0")
        found.append(Parameter(gain, low, high, f"gain[{i}]", f"{name}_GAIN_LSB"))
    return found


def _token(made: Made) -> str:
    """What ties a binary to its description: of the C, in the form that the interface asks for."""
    digest = hashlib.sha256()
    for name in sorted(made.files):
        content = made.files[name]
        digest.update(content if isinstance(content, bytes) else content.encode("utf-8"))
    text = digest.hexdigest()
    return f"{{{text[:8]}-{text[8:12]}-{text[12:16]}-{text[16:20]}-{text[20:32]}}}"
