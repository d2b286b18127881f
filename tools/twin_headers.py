"""Prints what in ``c_runtime/`` is the same but for a type: ``make headers``.

``foc_ahead_q31.h`` is printed from ``foc_ahead_q15.h``, and each function of ``FUNCTIONS`` in the place of
the one that was there. Edit the source of a pair only. Users get both as C, which stays readable without a
preprocessor's help.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

RUNTIME = Path(__file__).resolve().parent.parent / "c_runtime"
WIDTH = 110
Rules = Sequence[tuple[str, str]]

# In this order: what is 32 bits wide already moves on before 16 bits become 32.
WIDER: Rules = (
    (r"\bint32_t\b(?! [ad] = )", "int64_t"),  # weights in registers are of 32 bits in both
    (r"\bint16_t\b", "int32_t"),
    (r"\bfoc_shift32\b", "foc_shift64"),
    (r"\b16-bit\b", "32-bit"),
    (r"Q15", "Q31"),
    (r"q15", "q31"),
    (r"(s\d \+= )(?=[abcd] \*)", r"\1(int64_t)"),  # a product of two words needs the width of both
)
DOUBLE: Rules = ((r"\bfloat\b", "double"), (r"f32", "f64"), (r"\b0\.0f\b", "0.0"))
# Gains and slopes of a tunable controller are in RAM.
TUNED: Rules = ((r"foc_schedule_", "foc_tuned_"), (r"FOC_ROM (\w+ \*(?:gains|slopes)\b)", r"\1"))

HEADERS = {"foc_ahead_q31.h": ("foc_ahead_q15.h", WIDER)}
"""Whole headers by name: which other one each is printed from, and by which rules."""

FUNCTIONS = {
    ("foc_rt.h", "foc_sum_q31"): ("foc_rt.h", "foc_sum_q15", WIDER),
    ("foc_rt.h", "foc_schedule_q31"): ("foc_rt.h", "foc_schedule_q15", WIDER),
    ("foc_rt.h", "foc_dot_f64"): ("foc_rt.h", "foc_dot_f32", DOUBLE),
    ("foc_rt.h", "foc_schedule_f64"): ("foc_rt.h", "foc_schedule_f32", DOUBLE),
    ("foc_memory.h", "foc_modes_f64"): ("foc_memory.h", "foc_modes_f32", DOUBLE),
    **{
        ("foc_tune.h", f"foc_tuned_{form}"): ("foc_rt.h", f"foc_schedule_{form}", TUNED)
        for form in ("q15", "q31", "f32", "f64")
    },
}
"""Functions by header and name, alike. Those that are printed from a printed one come after it."""


def twin(text: str, rules: Rules = WIDER) -> str:
    """C with each rule's pattern replaced."""
    for pattern, other in rules:
        text = re.sub(pattern, other, text)
    return text


def function(text: str, name: str) -> str:
    """The definition of a function within a header, without the comment above it."""
    found = re.search(rf"^static inline \w+ {name}\(.*?^}}\n", text, re.MULTILINE | re.DOTALL)
    if found is None:
        raise LookupError(f"no function {name}")
    return found[0]


def wrapped(definition: str) -> str:
    """The same with as many parameters a line as fit."""
    head, parameters, body = re.fullmatch(r"([^(]*\()([^)]*)(\)\n.*)", definition, re.DOTALL).groups()
    lines = [head]
    for parameter in re.split(r",\s+", parameters):
        if len(f"{lines[-1]}{parameter},") > WIDTH:
            lines.append(" " * len(head))
        lines[-1] += f"{parameter}, "
    return "\n".join(line.rstrip() for line in lines).removesuffix(",") + body


def printed(texts: dict[str, str]) -> dict[str, str]:
    """The headers by name as they should stand, from what ``texts`` has of the sources."""
    made = dict(texts)
    for name, (source, rules) in HEADERS.items():
        made[name] = twin(made[source], rules)
    for (header, name), (source, of, rules) in FUNCTIONS.items():
        new = wrapped(twin(function(made[source], of), rules))
        made[header] = made[header].replace(function(made[header], name), new)
    return made


def headers() -> dict[str, str]:
    """The headers as they stand."""
    return {path.name: path.read_text(encoding="utf-8") for path in sorted(RUNTIME.glob("*.h"))}


if __name__ == "__main__":
    for name, text in printed(headers()).items():
        (RUNTIME / name).write_text(text, encoding="utf-8")
