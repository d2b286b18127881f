"""An Arduino library: the plain C seen through ``src/``, an example, and what the editor colours."""

from __future__ import annotations

import re
from dataclasses import dataclass

from focgen.codegen.conversions import period_us
from focgen.codegen.literals import literal
from focgen.codegen.packages.context import BuildContext, Made, build_context, licence, rendered
from focgen.codegen.state import state_bytes
from focgen.errors import InputError
from focgen.plan.plan import Format, Plan

_PERIODS = 1.0, 4e9  # us: micros() counts in 32 bits, and what runs beside has to leave time to look at it


@dataclass(frozen=True)
class SketchContext:
    """What the example asks for. Values are in physical units, as C has them; of a fixed-point controller
    there are none, for its sketch computes in counts."""

    name: str
    fixed: bool
    scheduled: bool
    state_bytes: int
    period: str
    measurement: tuple[str, str]
    reference: str
    schedule: str


def arduino_files(made: Made) -> dict[str, str | bytes]:
    """library.properties, keywords.txt, src/, a sketch, the licence, and a section of the README.

    Raises InputError for a name that Arduino keeps for its own libraries, and for a sample time that its
    clock cannot count.
    """
    name = made.plan.name
    if "arduino" in name.lower():
        what = f"the name {name!r} is kept for Arduino's own libraries"
        raise InputError("--for arduino", what, "give another by --name")
    context = build_context(made, _keywords(made))
    names = [(file, f"{file}.jinja") for file in ("library.properties", "keywords.txt", "README.md")]
    return {
        **rendered("arduino", context, *names),
        **_through_src(made, context),
        **rendered("arduino", _sketch(made), (f"examples/{name}/{name}.ino", "sketch.ino.jinja")),
        "LICENSE": licence(),
    }


def _through_src(made: Made, context: BuildContext) -> dict[str, str]:
    """Arduino compiles what is in src/ and nothing else: each file there takes in the one beside it."""
    files = {}
    for name in (*context.headers, *context.sources):
        guard = _EXACT if name.endswith(".c") else ""
        files[f"src/{name}"] = (
            f'/* {name} as it lies in the library\'s folder. */\n{guard}#include "../{name}"\n'
        )
    return files


# A library cannot set the compiler's flags. Clang knows the first, GCC the second.
_EXACT = """#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off") /* a*b + c in one rounding would give other bits */
#endif
"""


def _keywords(made: Made) -> list[str]:
    """Lines of keywords.txt: types, functions and constants of the header."""
    name = made.plan.name
    header = made.files[f"{name}.h"]
    text = header if isinstance(header, str) else header.decode("utf-8")
    types = re.findall(rf"\b({name}_\w+);", text)
    functions = re.findall(rf"\b({name}_\w+)\(", text)
    constants = re.findall(rf"#define ({name.upper()}_\w+)", text)
    kinds = (types, "KEYWORD1"), (functions, "KEYWORD2"), (constants, "LITERAL1")
    return [f"{word}\t{kind}" for words, kind in kinds for word in sorted(set(words))]


def _sketch(made: Made) -> SketchContext:
    plan = made.plan
    ranges, form = plan.controller.ranges, plan.output
    at = sum(ranges.schedule) / 2.0 if ranges.schedule else 0.0
    return SketchContext(
        name=plan.name,
        fixed=not form.floating,
        scheduled=plan.schedule is not None,
        state_bytes=state_bytes(plan),
        period=_period(plan),
        measurement=(_number(ranges.measurement[0], form), _number(ranges.measurement[1], form)),
        reference=_number(sum(ranges.reference) / 2.0, form),
        schedule=_number(at, form) if plan.schedule else "",
    )


def _period(plan: Plan) -> str:
    """The sample time in microseconds as C has it. Raises InputError where micros() cannot count it."""
    if not _PERIODS[0] <= plan.sample_time * 1e6 <= _PERIODS[1]:
        what = f"cannot be called every {plan.sample_time:g} s by the board's count of microseconds"
        remedy = "leave --for out, and call the C by a timer or a clock of your own"
        raise InputError("--for arduino", what, remedy)
    if period_us(plan) is not None:
        return f"{plan.name.upper()}_PERIOD_US"
    return f"{round(plan.sample_time * 1e6)}UL"


def _number(value: float, form: Format) -> str:
    return literal(value, form.ctype) if form.floating else ""
