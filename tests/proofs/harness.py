"""C that puts a controller into any state it can be in, calls it once with any arguments, and asks whether
the state is again one it can be in.

What is shown so is shown for every run: of any length, in any order of calls, with any inputs. "Any state" is
one interval a member, from the plan's proofs (:func:`reachable`); that step, reset and track stay within is
part of what is proved.
"""

from __future__ import annotations

from dataclasses import dataclass

from focgen.codegen.literals import literal
from focgen.codegen.state import Member, members
from focgen.plan.formats import limit
from focgen.plan.model import Format, Plan


@dataclass(frozen=True)
class Interval:
    """What a member can be, both ends included; None: any value of its type."""

    low: int
    high: int


def reachable(plan: Plan) -> dict[str, Interval | None]:
    """The interval of every member of the state. Raises KeyError for a member that is not known here."""
    known = {"error_now": Interval(0, plan.error_lags), "flags": None, "starting": Interval(0, 1)}
    if plan.feedback:
        known["filtered_now"] = Interval(0, plan.filtered_lags)
    if plan.floating:
        return {m.name: known.get(m.name) for m in members(plan)}
    half = (1 << plan.narrow) >> 1
    worst = {proof.node: proof.worst for proof in plan.proofs}
    known |= {
        "error": _hull(plan.error),
        "filtered": None,
        "carry": Interval(-half, half),
        "integral": _hull(plan.integrator.state, zero=False) if plan.integrator else None,
        "increment": _around(_room(plan)) if plan.integrator else None,
        "resting": None if plan.feedback else _around(worst["v"]),
        "inner": _hull(plan.inner.state) if plan.inner else None,
        "inner_input": _around(worst["rest total"]) if plan.inner else None,
    }
    return {m.name: known[m.name] for m in members(plan)}


def _hull(form: Format, zero: bool = True) -> Interval:
    low, high = int(form.low), int(form.high)
    return Interval(min(low, 0), max(high, 0)) if zero else Interval(low, high)


def _room(plan: Plan) -> int:
    """How large two increments may be, added to an integral at its limit: all that the sum asks of them."""
    state, own = plan.integrator.state, plan.increment
    most = max(abs(int(state.low)), abs(int(state.high)))
    return min((limit(state.bits) - most) // 2, limit(own.bits))


def _around(worst: int) -> Interval:
    return Interval(-worst, worst)


def harness(plan: Plan, dialect: str, asked: tuple[str, ...] | None = None, call: str = "any") -> str:
    """The C of a harness. ``dialect``: "eva" or "esbmc". It makes one ``call`` ("init", "reset", "track",
    "step" or any of them) and asks about the members ``asked`` afterwards, by default about all that cannot
    be any value of their type.
    """
    speak = {"eva": _Eva(), "esbmc": _Esbmc()}[dialect]
    ranges = reachable(plan)
    lines = [f'#include "{plan.name}.c"', speak.head, f"static {plan.name}_state s;", "int main(void)\n{"]
    lines += [line for m in members(plan) for line in _every(m, speak.choose(m, ranges[m.name]))]
    lines += _calls(plan, speak, call)
    about = [m for m in members(plan) if ranges[m.name] and (asked is None or m.name in asked)]
    lines += [line for m in about for line in _every(m, speak.ask(m, ranges[m.name]))]
    return "\n".join([*lines, "    return 0;", "}", ""])


def _every(member: Member, statement: str) -> list[str]:
    """A statement about ``s.MEMBER``, for each of its slots."""
    if not member.array:
        return ["    " + statement.replace("$", f"s.{member.name}")]
    loop = f"    for (unsigned i = 0; i < {member.array}; i++) {{"
    return [loop, "        " + statement.replace("$", f"s.{member.name}[i]"), "    }"]


def _calls(plan: Plan, speak, call: str) -> list[str]:
    signal, name = plan.output.ctype, plan.name
    calls = {
        "init": f"{name}_init(&s);",
        "reset": f"{name}_reset(&s, a, b, c);",
        "track": f"{name}_track(&s, a);",
        "step": f"(void){name}_step(&s, a, b{', c' if plan.schedule else ''});",
    }
    lines = [f"    {signal} {argument} = {speak.any(signal)};" for argument in "abc"]
    if call != "any":
        return [*lines, f"    {calls[call]}"]
    cases = [f"    case {i}: {one} break;" for i, one in enumerate(calls.values())]
    return [*lines, f"    switch ({speak.any('uint8_t')} & 3) {{", *cases, "    }"]


class _Eva:
    """Frama-C's abstract interpreter."""

    head = '#include "__fc_builtin.h"'

    def any(self, ctype: str) -> str:
        if ctype in ("float", "double"):
            return f"Frama_C_{ctype}_interval({_ends(ctype)})"
        return self.between(ctype, *_type_range(ctype))

    def between(self, ctype: str, low: int, high: int) -> str:
        kind = "long_long_" if ctype == "int64_t" else ""
        low, high = (literal(end, ctype) for end in (low, high))
        return f"({ctype})Frama_C_{kind}interval({low}, {high})"

    def choose(self, member: Member, interval: Interval | None) -> str:
        ends = interval and (interval.low, interval.high)
        return f"$ = {self.between(member.ctype, *ends) if ends else self.any(member.ctype)};"

    def ask(self, member: Member, interval: Interval) -> str:
        return f"/*@ assert {member.name}: {interval.low} <= $ <= {interval.high}; */"


class _Esbmc:
    """A bounded model checker; the loops of a step have known bounds."""

    head = (
        "\n".join(
            f"{ctype} nondet_{ctype}(void);"
            for ctype in ("uint8_t", "uint16_t", "int16_t", "int32_t", "int64_t", "float", "double")
        )
        + "\nvoid __ESBMC_assume(_Bool);\nvoid __ESBMC_assert(_Bool, const char *);"
    )

    def any(self, ctype: str) -> str:
        return f"nondet_{ctype}()"

    def choose(self, member: Member, interval: Interval | None) -> str:
        chosen = f"$ = {self.any(member.ctype)};"
        return chosen + (f" __ESBMC_assume({inside(member, interval)});" if interval else "")

    def ask(self, member: Member, interval: Interval) -> str:
        return f'__ESBMC_assert({inside(member, interval)}, "{member.name}");'


def inside(member: Member, interval: Interval) -> str:
    """C that asks whether ``$``, a member or a slot of it, is within its interval."""
    low, high = (literal(end, member.ctype) for end in (interval.low, interval.high))
    above = "" if interval.low == 0 and member.ctype.startswith("u") else f"$ >= {low} && "
    return f"{above}$ <= {high}"


def _type_range(ctype: str) -> tuple[int, int]:
    bits = int(ctype.strip("u_int"))
    return (0, (1 << bits) - 1) if ctype[0] == "u" else (-(1 << (bits - 1)), (1 << (bits - 1)) - 1)


def _ends(ctype: str) -> str:
    largest = "3.40282347e+38f" if ctype == "float" else "1.7976931348623157e+308"
    return f"-{largest}, {largest}"
