"""Numbers as C text."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence

import numpy as np

from focgen.codegen.texts import comment

_WIDTH = 106  # of a line


def literal(value: int | float, ctype: str) -> str:
    """A constant of type ``ctype`` that reads back as exactly ``value``.

    Integers stand as they are: C99 gives a decimal constant the first of int, long and long long that holds
    it.
    """
    if ctype == "double":
        return _pointed(f"{value:.17g}", value)
    if ctype == "float":
        return _pointed(f"{value:.9g}", float(np.float32(value))) + "f"
    _check_held(value, ctype)
    if value == -(1 << 63):  # its magnitude alone fits no type
        return f"({value + 1} - 1)"
    return str(int(value))


def _check_held(value: int | float, ctype: str) -> None:
    if bits := re.fullmatch(r"int(\d+)_t", ctype):
        end = 1 << (int(bits[1]) - 1)
        if not -end <= value < end:
            raise ValueError(f"{value} is no {ctype}")


def _pointed(text: str, value: float) -> str:
    if not math.isfinite(value):
        raise ValueError(f"{value} has no C literal")
    return text if re.search(r"[.e]", text) else text + ".0"


def constant(value: int | float, ctype: str) -> str:
    """A literal safe anywhere in an expression: a negative one stands in brackets."""
    text = literal(value, ctype)
    return f"({text})" if text.startswith("-") else text


def power_of_two(value: float) -> str:
    """A positive power of two, such as an lsb, as a float literal that is exact as a double, too."""
    return _pointed(f"{value:.17g}", value) + "f"


def rows(values: Sequence[int | float], ctype: str) -> list[str]:
    """A table's values in aligned rows, eight to a line where they fit, each followed by a comma."""
    texts = [literal(v, ctype) for v in values]
    width = max(map(len, texts))
    per_row = 8 if 8 * (width + 2) <= _WIDTH else 4
    lines = [texts[i : i + per_row] for i in range(0, len(texts), per_row)]
    return [" ".join(f"{text:>{width}}," for text in line) for line in lines]


def quantity(value: float, unit: str = "") -> str:
    """A physical value for a comment."""
    return f"{value:.6g} {comment(unit)}".rstrip()


def exponent(lsb: float) -> int:
    """log2 of an lsb, which is a power of two."""
    mantissa, power = math.frexp(lsb)
    if mantissa != 0.5:
        raise ValueError(f"{lsb} is no power of two")
    return power - 1


def scale(lsb: float, unit: str = "") -> str:
    """What one count is, for a comment."""
    return f"2^{exponent(lsb)} {comment(unit)}".rstrip()


def wrapped(words: Iterable[str], width: int = _WIDTH - 3, separator: str = " ") -> list[str]:
    """Words filled into lines."""
    lines, line = [], ""
    for word in words:
        longer = f"{line}{separator}{word}" if line else word
        if line and len(longer) > width:
            lines.append(line)
            longer = word
        line = longer
    return [*lines, line] if line else lines
