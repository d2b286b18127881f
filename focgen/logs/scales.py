"""From a column's unit to the rig's: a scale and an offset, given or by a library of units."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cache
from typing import Any

from focgen.arrays import Array

_SPELLED = {"Nm": "N*m"}  # where the library would read something else
_LONGEST = 60  # characters of a unit
_STRAIGHT = 1e-9  # relative: by rounding three points are off a line by so much
_POWER = re.compile(
    r"\*\*\s*(?:\(\s*[-+]?\d{1,2}(?:\.\d+)?\s*\)|[-+]?\d{1,2}(?:\.\d+)?(?![\d.eE]))(?!\s*\*\*)"
)
_FACTOR = re.compile(r"(?<![\w.])[\d.]+(?:[eE][-+]?\d+)?")


@dataclass(frozen=True)
class Scale:
    """What a role has of a column: ``scale`` times it, plus ``offset``. Or a column in ``unit``, converted to
    the rig's."""

    scale: float = 1.0
    offset: float = 0.0
    unit: str | None = None

    def applied(self, values: Array, to: str | None) -> Array:
        """The column's values (m,) in the rig's unit ``to``. Raises ValueError where there is no such
        conversion."""
        scale, offset = (self.scale, self.offset) if self.unit is None else between(self.unit, to)
        return values if (scale, offset) == (1.0, 0.0) else scale * values + offset


def between(unit: str, to: str | None) -> tuple[float, float]:
    """(scale, offset) that turn a value in ``unit`` into one in ``to``.

    Raises ValueError, in words, where a unit is not known, measures something else or goes by no straight
    line, as decibels do, and where turns or frequencies would be counted in radians.
    """
    if to is None:
        raise ValueError("the rig does not say its own unit")
    registry = _registry()
    try:
        zero, one, two = (registry.Quantity(x, _unit(unit)).to(_unit(to)).magnitude for x in (0.0, 1.0, 2.0))
        straight = abs((two - one) - (one - zero)) <= _STRAIGHT * (abs(zero) + abs(one) + abs(two))
        counted = _counted_in_radians(unit, to)
    except registry.errors.DimensionalityError:
        raise ValueError(f"{unit} cannot be turned into {to}") from None
    except Exception:  # noqa: BLE001 - pint raises whatever its parser meets
        raise ValueError(f"{unit if not known(unit) else to} is no unit") from None
    if not straight:
        raise ValueError(
            f"{unit} goes into {to} by no straight line, so the column has to be converted first"
        )
    if counted:
        raise ValueError(f"{unit} cannot be turned into {to}: a turn counts as 1 or as 2π, so give the scale")
    return float(one - zero), float(zero)


def _counted_in_radians(unit: str, to: str) -> bool:
    """Whether the library takes an angle for a number where a turn might be meant: Hz as rad/s."""
    roots = [_registry().Quantity(1.0, _unit(text)).to_root_units() for text in (unit, to)]
    if len({root.units._units.get("radian", 0) for root in roots}) == 1:
        return False
    parts = [part for text in (unit, to) for part in _unit(text)._units]
    sizes = [_registry().Quantity(1.0, part).to_root_units().magnitude for part in parts]
    return "[time]" in roots[0].dimensionality or any(abs(size - 2.0 * math.pi) < 1e-9 for size in sizes)


def known(unit: str) -> bool:
    """Whether a text is a unit."""
    try:
        _unit(unit)
        return True
    except Exception:  # noqa: BLE001 - as above
        return False


def unit_of_time(unit: str) -> tuple[str, float] | None:
    """A unit of time as the library spells it ("Min" is "min"), and its seconds; None of others."""
    for text in (unit.strip(), unit.strip().lower()):
        try:
            return text, between(text, "s")[0]
        except ValueError:
            continue
    return None


def same(unit: str, other: str) -> bool:
    """Whether two units that are known mean the same."""
    try:
        return between(unit, other) == (1.0, 0.0)
    except ValueError:
        return False


def differ(unit: str, other: str) -> bool:
    """Whether two units are both told and known, and do not mean the same."""
    return all(text and known(text) for text in (unit, other)) and not same(unit, other)


@cache
def _registry() -> Any:
    import pint  # takes a moment, and only conversions need it

    registry: Any = pint.UnitRegistry()
    registry.errors = pint
    return registry


def _unit(unit: str) -> Any:
    text = _SPELLED.get(unit.strip(), unit.strip())
    _check_small(text)
    return _registry().Unit(text)


def _check_small(text: str) -> None:
    """Raise ValueError for what is no unit and would take long to find out: the library computes
    "9**9**9"."""
    from pint.util import string_preprocessor

    if len(text) > _LONGEST:
        raise ValueError(text)
    without = _POWER.sub(" ", string_preprocessor(text))
    if "**" in without or any(float(factor) != 1.0 for factor in _FACTOR.findall(without)):
        raise ValueError(text)
