"""A diagnosis of turned signals, told in those that were logged."""

from __future__ import annotations

from dataclasses import replace

from focgen.diagnosis.drawn import Drawn, Mean, Residual, Trace
from focgen.diagnosis.model import Candidate, Diagnosis, Found
from focgen.logs.experiment import ROLES
from focgen.logs.notes import listed
from focgen.rig.effects import Form, library
from focgen.rig.placed import EARLY, slot_in
from focgen.rig.rig import Rig
from focgen.rig.stages import ENTERS, LEAVES
from focgen.rig.turned import Turn

_WAYS = {"rising": "falling", "falling": "rising"}
_COUNTED = "the {} below 0, or against the input: ceilings, widths and places count magnitudes there"


def turned_back(diagnosis: Diagnosis, turn: Turn) -> Diagnosis:
    """The diagnosis with its rigs, and what its figures draw, in the signals as logged, and a note on how
    effects are counted."""
    refitted, augmented, drawn = diagnosis.refitted, diagnosis.augmented, diagnosis.drawn
    return replace(
        diagnosis,
        causes=tuple(_signed(found, turn) for found in diagnosis.causes),
        refitted=None if refitted is None else _rig(refitted, turn),
        augmented=None if augmented is None else _rig(augmented, turn),
        drawn=None if drawn is None else _drawn(drawn, turn),
        notes=(*diagnosis.notes, *_said(diagnosis, turn)),
    )


def _rig(rig: Rig, turn: Turn) -> Rig:
    """A rig in the signals as logged, which says how effects count where it has any."""
    back = turn.rig(rig)
    return back if back.effects else replace(back, downwards=frozenset())


def _signed(found: Found, turn: Turn) -> Found:
    """A cause whose numbers that may have either sign, and are in a signal's unit, have that of the log."""
    return replace(found, candidates=tuple(_candidate(c, turn) for c in found.candidates))


def _candidate(candidate: Candidate, turn: Turn) -> Candidate:
    family = library().get(candidate.effect)
    form = next((f for f in family.forms if f.name == candidate.form), None) if family else None
    if form is None or turn.signs[_role(form, candidate.stage)] > 0:
        return candidate
    either = {p.name for p in form.parameters if p.level == 1 and p.lower < 0.0}
    changed = {
        name: replace(e, value=-e.value, ci95=(-e.ci95[1], -e.ci95[0])) if name in either else e
        for name, e in candidate.parameters.items()
    }
    return replace(candidate, parameters=changed)


def _role(form: Form, stage: str) -> str:
    """The role of the signal that a form acts on in its stage: what enters it, or what leaves it."""
    enters = {stage: role for role, stage in ENTERS.items()}
    return enters[stage] if slot_in(form, stage) in EARLY else LEAVES[stage]


def _said(diagnosis: Diagnosis, turn: Turn) -> list[str]:
    """How effects count, where there are any, with the logged signals that go downwards."""
    refitted = diagnosis.refitted
    logged = {} if refitted is None else refitted.signals.columns()
    roles = [role for role in ROLES if role in turn.roles and role in logged and role != "reference"]
    if not diagnosis.causes or not roles:
        return []
    return [_COUNTED.format(f"{listed(roles)} {'go' if len(roles) > 1 else 'goes'}")]


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
