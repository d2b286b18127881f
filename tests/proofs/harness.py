"""C that puts a controller into any state it can be in, calls it once with any arguments, and asks whether
the state is again one it can be in.

What is shown so is shown for every run: of any length, in any order of calls, with any inputs. "Any state" is
one interval a member, from the plan's proofs (:func:`reachable`); that step, reset and track stay within is
part of what is proved.
"""

from __future__ import annotations

import re

from focgen.codegen.banks import means
from focgen.codegen.kernels import PORTABLE, Kernels
from focgen.codegen.literals import literal
from focgen.codegen.state import Member, members
from focgen.plan.counts import MOST
from focgen.plan.formats import Interval, limit, span
from focgen.plan.plan import Plan


def reachable(plan: Plan, kernels: Kernels = PORTABLE) -> dict[str, Interval | None]:
    """The interval of every member of the state; of sums that look ahead :mod:`tests.proofs.lookahead` tells.
    Raises KeyError for a member that is not known here.
    """
    kept = [m.name for m in members(plan, kernels) if not m.name.endswith("_ahead")]
    known = {"flags": None, "starting": Interval(0, 1)}
    if plan.tuning:
        known |= _parameters(plan)
    known |= {f"{ring}_now": Interval(0, kernels.slots(plan, ring) - 1) for ring in ("error", "filtered")}
    if plan.floating:
        known |= _counted(plan)
        return {name: known.get(name) for name in kept}
    half = (1 << plan.narrow) >> 1
    worst = {proof.node: proof.worst for proof in plan.proofs}
    for table in plan.sums:
        each = {means(table, i): worst[f"{table.name} bank {i} mean"] for i in range(len(table.banks))}
        known |= {name: _around(most) for name, most in each.items()}
    remembered = plan.feedback and plan.feedback.table.banks
    known |= {
        "set_point": None,  # a step clamps it before it uses it
        "error": span(plan.error).hull(0),
        "filtered": _around(worst["v"]) if remembered else None,
        "carry": Interval(-half, half),
        "integral": span(plan.integrator.state) if plan.integrator else None,
        "increment": _around(_room(plan)) if plan.integrator else None,
        "resting": None if plan.feedback else _around(worst["v"]),
        "inner": span(plan.inner.state).hull(0) if plan.inner else None,
        "inner_input": _around(worst["rest total"]) if plan.inner else None,
    }
    return {name: known[name] for name in kept}


def _counted(plan: Plan) -> dict[str, Interval]:
    """Of a floating plan's integrals in counts."""
    found = {}
    for name, last, integral in (
        ("integral", "increment", plan.integrator),
        ("inner", "inner_input", plan.inner),
    ):
        if integral and not integral.state.floating:
            found |= {name: span(integral.state).hull(0), last: _around(MOST)}
    return found


def _parameters(plan: Plan) -> dict[str, Interval | None]:
    """Of what NAME_tune has taken over; a floating state may hold anything, and mends itself."""
    names = ("gains", "slopes", "u_min", "u_max")
    if plan.floating:
        return dict.fromkeys((*names, "low", "high"))
    worst = {proof.node: proof.worst for proof in plan.proofs}
    slopes = _around(worst["tuned slope"]) if plan.schedule else None
    ends = (Interval(*map(int, box)) for box in (plan.tuning.low, plan.tuning.high))
    return dict(zip(names, (_around(worst["tuned gain"]), slopes, *ends)))


def _room(plan: Plan) -> int:
    """How large two increments may be, added to an integral at its limit: all that the sum asks of them."""
    state, own = plan.integrator.state, plan.increment
    most = max(abs(int(state.low)), abs(int(state.high)))
    return min((limit(state.bits) - most) // 2, limit(own.bits))


def _around(worst: int) -> Interval:
    return Interval(-worst, worst)


def harness(plan: Plan, asked: set[str]) -> str:
    """The C of a harness: any call from any state; the members ``asked`` are within their intervals again."""
    ranges = reachable(plan)
    anything = [line for m in members(plan) for line in every(m, chosen(m, ranges[m.name]))]
    again = [line for m in members(plan) if m.name in asked for line in every(m, within(m, ranges[m.name]))]
    cases = [f"    case {i}: {one} break;" for i, one in enumerate(calls(plan).values())]
    switch = [f"    switch ({any_of('uint8_t')} & 7) {{", *cases, "    }"]
    given = [*arguments(plan), *parameters(plan)]
    return program(plan, [function("int main", [*anything, *given, *switch, *again])])


def program(plan: Plan, functions: list[str]) -> str:
    """A file that has the controller in it, its arrays :func:`apart`, and a state."""
    head = ['#include "apart.c"', '#include "__fc_builtin.h"', f"static {plan.name}_state s;"]
    return "\n".join([*head, *functions, ""])


def apart(plan: Plan, text: str, kernels: Kernels = PORTABLE) -> str:
    """A controller's C in which every array of its state is an object of its own: beyond the end of an array
    in a struct stands the next member, and a verifier finds nothing wrong with reading that.
    """
    arrays = [m for m in members(plan, kernels) if m.array]
    own = [f"static {m.ctype} own_{m.name}[{m.array}];" for m in arrays]
    names = "|".join(m.name for m in arrays)
    header = f'#include "{plan.name}.h"\n'
    return re.sub(rf"\bs->({names})\b", r"own_\1", text.replace(header, header + "\n".join([*own, ""])))


def function(named: str, lines: list[str], takes: str = "void") -> str:
    """A C function."""
    ends = ["    return 0;"] if named.startswith("int") else []
    return "\n".join([f"{named}({takes})", "{", *lines, *ends, "}"])


def every(member: Member, statement: str) -> list[str]:
    """A statement about a member, for each of its slots."""
    if not member.array:
        return ["    " + statement.replace("$", f"s.{member.name}")]
    loop = f"    for (unsigned i = 0; i < {member.array}; i++) {{"
    return [loop, "        " + statement.replace("$", f"own_{member.name}[i]"), "    }"]


def arguments(plan: Plan) -> list[str]:
    """Declarations of a, b and c: any values of the signals' type."""
    signal = plan.output.ctype
    return [f"    {signal} {argument} = {any_of(signal)};" for argument in "abc"]


def parameters(plan: Plan) -> list[str]:
    """The declaration of p: any parameters; nothing where there are none."""
    if plan.tuning is None:
        return []
    signal = plan.output.ctype
    gains = f"    for (unsigned i = 0; i < {plan.name.upper()}_GAINS; i++) p.gain[i] = {any_of(signal)};"
    ends = [f"    p.{end} = {any_of(signal)};" for end in ("u_min", "u_max")]
    return [f"    {plan.name}_params p;", gains, *ends]


def calls(plan: Plan) -> dict[str, str]:
    """A call of each function that changes a state, by what it does."""
    name = plan.name
    tune = {"tune": f"(void){name}_tune(&s, &p);"} if plan.tuning else {}
    return tune | {
        "init": f"{name}_init(&s);",
        "reset": f"{name}_reset(&s, a, b, c);",
        "track": f"{name}_track(&s, a);",
        "step": f"(void){name}_step(&s, a, b{', c' if plan.schedule else ''});",
    }


def any_of(ctype: str) -> str:
    """Any value of a type."""
    if ctype in ("float", "double"):
        return f"Frama_C_{ctype}_interval({_ends(ctype)})"
    return between(ctype, *_type_range(ctype))


def between(ctype: str, low: int, high: int) -> str:
    """Any value from ``low`` to ``high``."""
    kind = "long_long_" if ctype == "int64_t" else ""
    low, high = (literal(end, ctype) for end in (low, high))
    return f"({ctype})Frama_C_{kind}interval({low}, {high})"


def chosen(member: Member, interval: Interval | None) -> str:
    """``$``, a member or a slot of it, is any value of its interval."""
    value = between(member.ctype, interval.low, interval.high) if interval else any_of(member.ctype)
    return f"$ = {value};"


def within(member: Member, interval: Interval) -> str:
    """``$`` is within its interval."""
    return f"/*@ assert {member.name}: {interval.low} <= $ <= {interval.high}; */"


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
