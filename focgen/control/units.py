"""Units read from the names of a log's columns, for comments and labels only."""

from __future__ import annotations

from focgen.control.controller import Units
from focgen.rig.model import Rig

_KNOWN = (
    "V",
    "mV",
    "A",
    "mA",
    "bar",
    "mbar",
    "kPa",
    "Pa",
    "MPa",
    "psi",
    "mm",
    "cm",
    "m",
    "um",
    "deg",
    "rad",
    "N",
    "mN",
    "s",
    "ms",
    "K",
    "C",
    "pct",
)


def unit_of(column: str | None) -> str:
    """Return the unit that ends a column's name, "1/mm" for ``kappa_per_mm``, "" where none is recognised."""
    words = (column or "").split("_")
    if words[-1] not in _KNOWN or len(words) < 2:
        return ""
    return f"1/{words[-1]}" if words[-2] == "per" else words[-1]


def units_of(rig: Rig, scheduled: bool) -> Units:
    """The controller's units as far as the rig's columns tell them."""
    signals = rig.signals
    command = signals.command or signals.pressure
    return Units(unit_of(signals.output), unit_of(command), unit_of(signals.pressure) if scheduled else "")
