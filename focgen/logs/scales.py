"""From a column's unit to the rig's: a scale and an offset, given or by a library of units."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from typing import Any

from focgen.arrays import Array

_SPELLED = {"Nm": "N*m"}  # where the library would read something else
_LONGEST = 60  # characters of a unit
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

    Raises ValueError, in words, where a unit is not known or measures something else.
    """
    if to is None:
        raise ValueError("the rig does not say its own unit")
    registry = _registry()
    try:
        zero, one = (registry.Quantity(x, _unit(unit)).to(_unit(to)).magnitude for x in (0.0, 1.0))
    except registry.errors.DimensionalityError:
        raise ValueError(f"{unit} cannot be turned into {to}") from None
    except Exception:  # noqa: BLE001 - pint raises whatever its parser meets
        raise ValueError(f"{unit if not known(unit) else to} is no unit") from None
    return float(one - zero), float(zero)


def known(unit: str) -> bool:
    """Whether a text is a unit."""
    try:
        _unit(unit)
        return True
    except Exception:  # noqa: BLE001 - as above
        return False


def same(unit: str, other: str) -> bool:
    """Whether two units that are known mean the same."""
    try:
        return between(unit, other) == (1.0, 0.0)
    except ValueError:
        return False


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
