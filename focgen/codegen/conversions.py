"""Physical values in single precision, to counts and back, in C; and the period in microseconds."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from focgen.codegen.literals import constant, literal, power_of_two
from focgen.plan.plan import Format, Plan
from focgen.plan.scenario import nearest_raw

_LARGEST = float(np.finfo(np.float32).max)


@dataclass(frozen=True)
class Conversion:
    """NAME_SIGNAL_from_f32; ``expression`` is of ``value``."""

    signal: str
    expression: str


@dataclass(frozen=True)
class Counted:
    """The ends of a signal's type: as it writes them, and as numbers in single precision from which on, and
    down to which, a scaled value is at an end.
    """

    low: str
    high: str
    below: str
    beyond: str


def counted(form: Format) -> Counted:
    """The ends of an integer type."""
    top = 1 << (form.bits - 1)
    beyond = top if form.bits == 32 else top - 1  # as far as floats are dense enough
    low, high = f"INT{form.bits}_MIN", f"INT{form.bits}_MAX"
    return Counted(low, high, literal(-float(top), "float"), literal(float(beyond), "float"))


def inputs_of(plan: Plan) -> dict[str, Format]:
    """The signals that go in, and what parameters are made of, with what says how large a count is."""
    found = {"ref": plan.error, "meas": plan.error}
    if plan.schedule:
        found["sched"] = plan.schedule.signal
    return {**found, "gain": plan.tuning.factor, "u": plan.output} if plan.tuning else found


def conversions(plan: Plan) -> list[Conversion]:
    """One for each input."""
    return [Conversion(name, _from_float(plan, form)) for name, form in inputs_of(plan).items()]


def _from_float(plan: Plan, form: Format) -> str:
    if not form.floating:
        return f"{plan.name}_count(value * {power_of_two(1.0 / form.lsb)})"
    return "value" if form.ctype == "float" else "(double)value"


def to_float(plan: Plan) -> str:
    """The expression of ``u`` in single precision; what is beyond that is its end."""
    form = plan.output
    if not form.floating:
        return f"(float)u * {plan.name.upper()}_U_LSB"
    if form.ctype == "float":
        return "u"
    if max(abs(form.low), abs(form.high)) <= _LARGEST:
        return "(float)u"
    end = literal(_LARGEST, "double")
    return f"(float)(u > {end} ? {end} : u < -{end} ? -{end} : u)"


def period_us(plan: Plan) -> int | None:
    """The sample time in microseconds, where they are whole: of the number as it is written."""
    micros = Fraction(repr(float(plan.sample_time))) * 1_000_000
    return int(micros) if micros.denominator == 1 else None


def tried_conversions(plan: Plan) -> dict[str, tuple[str, float]]:
    """What the conversions are verified with: by a name, the C expression and the value that it must have.

    Halves and what is next to them, ends, and what no count can be.
    """
    found: dict[str, tuple[str, float]] = {}
    for name, form in inputs_of(plan).items():
        for value in _tried(form):
            call = f"{name}_from_f32({constant(value, 'float')})"
            raw = float(np.float32(value) if form.floating else nearest_raw(np.float32(value), form))
            found[call] = f"{plan.name}_{call}", raw
        if not form.floating:
            found[f"{name}_from_f32(NaN)"] = f"{plan.name}_{name}_from_f32(nan)", -float(1 << (form.bits - 1))
    for u in (plan.output.low, plan.output.high):
        number = np.clip(float(u) * plan.output.lsb if plan.output.floating else 0.0, -_LARGEST, _LARGEST)
        if not plan.output.floating:
            number = np.float32(u) * np.float32(plan.output.lsb)
        call = f"u_to_f32({constant(u, plan.output.ctype)})"
        found[call] = f"{plan.name}_{call}", float(np.float32(number))
    return found


def _tried(form: Format) -> list[float]:
    """Values in single precision."""
    if form.floating:
        return [0.3, -1e30]
    halves = [np.float32((n + 0.5) * form.lsb) for n in (0, 1, -1, -2, 1000, -12_345)]
    beside = [np.nextafter(x, np.float32(0.0)) for x in halves]
    top = np.float32((1 << (form.bits - 1)) * form.lsb)
    ends = [top, -top, np.nextafter(top, np.float32(0.0)), np.float32(3.0) * top, np.float32(-3.0) * top]
    return [float(x) for x in (*halves, *beside, *ends, np.float32(0.37) * top)]
