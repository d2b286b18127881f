"""Which column plays which role, and how it becomes its signal: what a rig says of its logs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from focgen.arrays import Array
from focgen.errors import LogError
from focgen.logs.scales import Scale
from focgen.logs.table import LogTable


class Roles(Protocol):
    """Which column plays which role, and how it becomes its signal (the rig's ``Signals``)."""

    @property
    def time(self) -> str:
        """The column of the time."""

    @property
    def run(self) -> str | None:
        """The column that splits a file into experiments, or None."""

    @property
    def scales(self) -> Mapping[str, Scale]:
        """What turns a column into its signal, by role."""

    @property
    def units(self) -> Mapping[str, str]:
        """The rig's units, by role."""

    def columns(self) -> dict[str, str]:
        """Role → column, without time and run."""


def taken_columns(signals: Roles) -> set[str]:
    """The columns that have a role."""
    return {name or "" for name in columns_named(signals).values()}


def columns_named(signals: Roles) -> dict[str, str | None]:
    """The column of each role, time and run among them."""
    return {"time": signals.time, "run": signals.run, **signals.columns()}


def without_unit(signals: Roles) -> list[str]:
    """The columns of which the rig does not say what unit they are in."""
    scales, units = signals.scales, signals.units
    return [
        name
        for role, name in signals.columns().items()
        if (units.get(role) if role not in scales else scales[role].unit) is None
    ]


def scaled(table: LogTable, role: str, values: Array, signals: Roles) -> Array:
    """A column's values (m,) as the role's signal. Raises LogError where its unit cannot be converted."""
    scale = signals.scales.get(role)
    if scale is None:
        return values
    try:
        return scale.applied(values, "s" if role == "time" else signals.units.get(role))
    except ValueError as reason:
        name = signals.time if role == "time" else signals.columns()[role]
        remedy = f"correct it, or name the unit of {role} in [units]"
        raise LogError(f"{table.path} [{name}]", f"cannot be converted: {reason}", remedy) from None
