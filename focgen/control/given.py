"""A controller that is given as an object, as the table that its file would be: one reads it as the other.

An object may hold anything. What a table cannot say of it is refused here, and what it says wrongly where
files are read.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from focgen.control.controller import (
    NOTHING,
    Controller,
    ControllerRanges,
    GainSchedule,
    Source,
    Tunable,
    Units,
)
from focgen.errors import ControllerError
from focgen.fractional.terms import terms_of
from focgen.fractional.transfer import TransferFunction

_PLAIN = ("name", "sample_time", "integrator", "length", "memory", "arithmetic", "tolerance", "operator")
_OPTIONAL = ("slew_limit", "setpoint_filter", "band")
_PARTS: dict[str, tuple[type, ...]] = {
    "transfer": (TransferFunction,),
    "ranges": (ControllerRanges,),
    "units": (Units,),
    "tunable": (Tunable, type(None)),
    "designed_from": (Source, type(None)),
}


def table_of(controller: Controller, where: str) -> dict[str, Any]:
    """What the object says, in lists, numbers and texts, not yet judged; also what its memory has no use for,
    but a horizon of the operator "continuous".

    Raises ControllerError, at ``where``, for a part that is of another kind.
    """
    for key, kinds in _PARTS.items():
        value = getattr(controller, key)
        if not isinstance(value, kinds):
            what, remedy = f"is of the type {type(value).__name__}", f"give a {kinds[0].__name__}"
            raise ControllerError(f"{where} [{key}]", what, remedy)
    given = {key: getattr(controller, key) for key in _OPTIONAL}
    table = {key: plain(getattr(controller, key)) for key in _PLAIN}
    table |= {key: plain(value) for key, value in given.items() if value is not None}
    table |= {} if controller.operator == "continuous" else {"horizon": plain(controller.horizon)}
    transfer = controller.transfer
    table["transfer"] = {"num": terms_of(transfer.num) or [[0.0, 0.0]], "den": terms_of(transfer.den)}
    table["gain"], table["ranges"] = _gain(controller.gain), _ranges(controller.ranges)
    table["units"] = {key: unit for key, unit in vars(controller.units).items() if unit != ""}
    if controller.tunable is not None:
        table["tunable"] = _box(controller.tunable, table["ranges"]["output"])
    if controller.designed_from is not None:
        table["designed_from"] = _source(controller.designed_from, where)
    return table


def plain(value: Any) -> Any:
    """A number of numpy's as Python's, and what stands in rows as a list; anything else as it is."""
    if isinstance(value, (np.generic, np.ndarray)):
        value = value.tolist()
    return [plain(one) for one in value] if isinstance(value, (list, tuple)) else value


def _gain(gain: Any) -> Any:
    return (
        {key: plain(row) for key, row in vars(gain).items()}
        if isinstance(gain, GainSchedule)
        else plain(gain)
    )


def _ranges(ranges: ControllerRanges) -> dict[str, Any]:
    spans = {key: plain(span) for key, span in vars(ranges).items()}
    left_out = {"measurement": list(NOTHING), "schedule": None}  # where a file does not name them
    return {key: span for key, span in spans.items() if key not in left_out or span != left_out[key]}


def _box(box: Tunable, output: Any) -> dict[str, Any]:
    """A span of one value is left out in a file, where it is the one that the controller has anyway."""
    low, high = output if isinstance(output, list) and len(output) == 2 else (None, None)
    own = {"gain": [1.0, 1.0], "output_low": [low, low], "output_high": [high, high]}
    spans = {key: plain(span) for key, span in vars(box).items()}
    return {key: span for key, span in spans.items() if span != own[key]}


def _source(source: Source, where: str) -> dict[str, Any]:
    try:
        options = {name: plain(value) for name, value in source.options}
    except (TypeError, ValueError):
        what, remedy = f"are {source.options!r}", "give pairs of a name and a value"
        raise ControllerError(f"{where} [designed_from] [options]", what, remedy) from None
    return {"file": source.file, "sha256": source.sha256, **({"options": options} if options else {})}
