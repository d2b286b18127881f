"""What goes into a controller and what comes out: counts, or physical units.

A physical value becomes the nearest count, halves away from zero, as everywhere; one beyond the type becomes
the type's end, which the C then takes for the end of its range. In the floating arithmetics a count is 1.
"""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from focgen.arrays import Numbers
from focgen.errors import InputError
from focgen.plan.plan import Format
from focgen.plan.scenario import nearest_raw
from focgen.targets.driver import DTYPES


class Signals(Protocol):
    """How values enter and leave; ``name`` is the argument that an error speaks of."""

    def one(self, name: str, value: Any, form: Format) -> int | float:
        """One value as the C takes it. Raises InputError for what is no such number."""
        ...

    def many(self, name: str, values: Any, form: Format) -> Numbers:
        """The same of an array, in the C's type."""
        ...

    def back(self, raw: Any, form: Format) -> Any:
        """What the C gives, one value or an array."""
        ...


@dataclass(frozen=True)
class Counts:
    """As they are."""

    def one(self, name: str, value: Any, form: Format) -> int | float:
        """A number as its count. Raises ValueError for what is none."""
        if form.floating:
            return _number(name, value)
        try:
            count: int = operator.index(value)
        except TypeError:
            raise _not_whole(name, value, form) from None
        top = 1 << (form.bits - 1)
        if not -top <= count < top:
            raise _not_whole(name, value, form)
        return count

    def many(self, name: str, values: Any, form: Format) -> Numbers:
        """An array, any shape, as counts of the format's type. Raises ValueError likewise."""
        found = _array(name, values)
        kind = DTYPES[form.ctype]
        if form.floating:
            return _floats(name, found, form)
        top = 1 << (form.bits - 1)
        if found.dtype.kind not in "iu" or (found.size and not (-top <= found.min() and found.max() < top)):
            raise _not_whole(name, "an array with others", form)
        return found.astype(kind)

    def back(self, raw: Any, form: Format) -> Any:
        """What the C returned, as it is."""
        return raw


@dataclass(frozen=True)
class Physical:
    """In the units of controller.toml."""

    def one(self, name: str, value: Any, form: Format) -> int | float:
        """The nearest count, halves away from zero, saturated. Raises ValueError for NaN."""
        number = _number(name, value)
        if form.floating:
            return number
        if math.isnan(number):
            raise _no_count(name, form)
        top = 1 << (form.bits - 1)
        scaled = min(max(number / form.lsb, -float(top)), float(top))
        size = abs(scaled)
        whole = math.floor(size)
        nearest = whole + (size - whole >= 0.5)
        return min(nearest if scaled >= 0.0 else -nearest, top - 1)

    def many(self, name: str, values: Any, form: Format) -> Numbers:
        """An array, any shape, likewise."""
        found = _array(name, values)
        if form.floating:
            return _floats(name, found, form)
        found = _as(name, found, float)
        if np.isnan(found).any():
            raise _no_count(name, form)
        with np.errstate(over="ignore"):  # what is beyond all numbers is the type's end, too
            return nearest_raw(found, form).astype(DTYPES[form.ctype])

    def back(self, raw: Any, form: Format) -> Any:
        """What the C returned, in physical units."""
        if form.floating:
            return raw
        return (raw.astype(float) if isinstance(raw, np.ndarray) else raw) * form.lsb


def _number(name: str, value: Any) -> float:
    """Of anything that is a number; text that reads like one is none."""
    try:
        if isinstance(value, (str, bytes, bytearray)) or np.ma.is_masked(value):
            raise TypeError
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(name, f"is {value!r}", "give one number") from None


def _floats(name: str, values: Numbers, form: Format) -> Numbers:
    """In the C's floating type; what is too large for it is infinite there, too."""
    with np.errstate(over="ignore"):
        return _as(name, values, DTYPES[form.ctype])


def _as(name: str, values: Numbers, kind: type) -> Numbers:
    try:
        return values.astype(kind)
    except (TypeError, ValueError, OverflowError):
        raise _no_number(name) from None


def _array(name: str, values: Any) -> Numbers:
    """Numbers as an array. A date, a text, a complex or a masked one would become a number that nobody
    meant."""
    try:
        found = np.asarray(values)
    except (TypeError, ValueError):  # rows of several lengths
        raise _no_number(name) from None
    texts = found.dtype.kind == "O" and any(isinstance(one, (str, bytes, bytearray)) for one in found.flat)
    if found.dtype.kind not in "biufO" or texts:
        raise _no_number(name)
    if np.ma.is_masked(values):
        raise InputError(name, "holds masked samples", "fill them, or leave them out")
    if found.ndim > 1:
        raise InputError(name, f"has {found.ndim} dimensions", "give one value for each sample")
    return found


def _no_number(name: str) -> InputError:
    return InputError(name, "holds what is no number", "give numbers")


def _not_whole(name: str, value: Any, form: Format) -> InputError:
    top = 1 << (form.bits - 1)
    return InputError(name, f"is {value}", f"counts are whole numbers from {-top} to {top - 1}")


def _no_count(name: str, form: Format) -> InputError:
    return InputError(name, f"is NaN, for which {form.ctype} has no count", "give numbers")
