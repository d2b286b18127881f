"""From a column's unit to the rig's: a scale and an offset, given or by a library of units."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

_SPELLED = {"Nm": "N*m"}  # where the library would read something else


@dataclass(frozen=True)
class Scale:
    """What a role has of a column: ``scale`` times it, plus ``offset``. Or a column in ``unit``, converted to
    the rig's."""

    scale: float = 1.0
    offset: float = 0.0
    unit: str | None = None

    def applied(self, values: np.ndarray, to: str | None) -> np.ndarray:
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
    except Exception:  # pint raises whatever its parser meets
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
def _registry():
    import pint  # takes a moment, and only conversions need it

    registry = pint.UnitRegistry()
    registry.errors = pint
    return registry


def _unit(unit: str):
    return _registry().Unit(_SPELLED.get(unit.strip(), unit.strip()))
