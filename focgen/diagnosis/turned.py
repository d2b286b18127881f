"""A diagnosis of turned signals, told in those that were logged."""

from __future__ import annotations

from dataclasses import replace

from focgen.diagnosis.drawn import Drawn, Mean, Residual, Trace
from focgen.diagnosis.model import Diagnosis
from focgen.rig.turned import Turn

_WAYS = {"rising": "falling", "falling": "rising"}
_COUNTED = "the {} below 0, or against the input: sizes of effects count magnitudes there"


def turned_back(diagnosis: Diagnosis, turn: Turn) -> Diagnosis:
    """The diagnosis with its rigs, and what its figures draw, in the signals as logged, and a note on how
    effects are counted."""
    refitted, augmented, drawn = diagnosis.refitted, diagnosis.augmented, diagnosis.drawn
    return replace(
        diagnosis,
        refitted=None if refitted is None else turn.rig(refitted),
        augmented=None if augmented is None else turn.rig(augmented),
        drawn=None if drawn is None else _drawn(drawn, turn),
        notes=(*diagnosis.notes, *([_said(turn)] if diagnosis.causes else [])),
    )


def _said(turn: Turn) -> str:
    roles = [r for r in ("command", "pressure", "curvature", "output") if r in turn.roles]
    goes = f"{' and '.join([', '.join(roles[:-1]), roles[-1]] if len(roles) > 1 else roles)}"
    return _COUNTED.format(f"{goes} {'go' if len(roles) > 1 else 'goes'}")


def _drawn(drawn: Drawn, turn: Turn) -> Drawn:
    entry, exit = (turn.signs[role] for role in drawn.worst)
    of_input, of_output = turn.signs[drawn.entry], turn.signs["output"]
    residual = drawn.residual
    return replace(
        drawn,
        traces=tuple(_trace(trace, of_input, of_output) for trace in drawn.traces),
        means=tuple(_mean(mean, entry, exit) for mean in drawn.means),
        residual=None if residual is None else _residual(residual, entry, exit),
    )


def _trace(trace: Trace, entry: int, exit: int) -> Trace:
    made = {name: exit * getattr(trace, name) for name in ("measured", "as_given", "refitted", "explained")}
    return replace(trace, input=entry * trace.input, **made)


def _mean(mean: Mean, entry: int, exit: int) -> Mean:
    if entry > 0 or mean.over == "time":
        return replace(mean, mean=exit * mean.mean)
    way = _WAYS.get(mean.way, mean.way)
    return replace(mean, way=way, place=-mean.place[::-1], mean=exit * mean.mean[::-1])


def _residual(residual: Residual, entry: int, exit: int) -> Residual:
    found = {name: entry * getattr(residual, name) for name in ("level", "rate", "way")}
    return replace(residual, **found, refitted=exit * residual.refitted, explained=exit * residual.explained)
