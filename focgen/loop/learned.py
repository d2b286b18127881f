"""How far a rig's effects can be trusted in a loop: where they were learned, and what they promise there."""

from __future__ import annotations

from collections.abc import Sequence

from focgen.errors import RigError
from focgen.jsontext import fits
from focgen.rig.rig import Rig

_HIGH = 0.8  # of what can be explained: a promise below it is of a rig known in part
_SHAPE = {"promise?": float, "learned?": [float]}


def learned_notes(rig: Rig, setpoints: Sequence[float]) -> list[str]:
    """What the diagnosis that found the rig's effects says of a loop that is run to ``setpoints`` (in the
    output's unit); nothing of effects that somebody wrote by hand. Raises RigError for what says neither."""
    promised, ranges = _told(rig)
    notes = []
    if promised:
        least = min(promised)
        how = "" if least >= _HIGH else ": the loop may differ from this one by the rest"
        notes.append(f"on new logs the rig's effects promise {least:.0%} of what can be explained{how}")
    if ranges:
        low, high = max(low for low, _ in ranges), min(high for _, high in ranges)
        beyond = ", ".join(f"{s:.4g}" for s in setpoints if not low <= s <= high)
        if beyond:
            notes.append(
                f"the rig's effects were learned at outputs from {low:.4g} to {high:.4g}: what they do at "
                f"{beyond} is an extrapolation"
            )
    return notes


def _told(rig: Rig) -> tuple[list[float], list[tuple[float, float]]]:
    """Every effect's promise and range of outputs, where it has them."""
    promised, ranges = [], []
    for table in rig.effects:
        told = {key: table[key] for key in ("promise", "learned") if key in table}
        learned = told.get("learned", [0.0, 0.0])
        if not fits(told, _SHAPE) or len(learned) != 2:
            where = f"{rig.name} [[effects]] {table['name']}"
            raise RigError(where, "needs promise = SHARE and learned = [LOW, HIGH]", "or leave both out")
        if "promise" in told:
            promised.append(float(told["promise"]))
        if "learned" in told:
            ranges.append((float(learned[0]), float(learned[1])))
    return promised, ranges
