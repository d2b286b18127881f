"""A diagnosis of turned signals, told in those that were logged."""

from __future__ import annotations

from dataclasses import replace

from focgen.diagnosis.drawn import Drawn, Mean, Residual, Trace
from focgen.diagnosis.model import Candidate, Diagnosis, Estimate, Found
from focgen.diagnosis.verdict.on_the_bench import seen_as
from focgen.logs.experiment import ROLES
from focgen.logs.notes import listed
from focgen.rig.effects import Form, library
from focgen.rig.placed import EARLY, slot_in
from focgen.rig.rig import Origins, Rig
from focgen.rig.stages import ENTERS, LEAVES
from focgen.rig.turned import Turn

_WAYS = {"rising": "falling", "falling": "rising"}
_COUNTED = "the {} below 0, or against the input: ceilings, widths and places count magnitudes there"
_FROM = "the rig's own zero of the {} is {}, farther from 0 than it moves: effects count from there"


def turned_back(diagnosis: Diagnosis, turn: Turn) -> Diagnosis:
    """The diagnosis with its rigs, and what its figures draw, in the signals as logged, and a note on how
    effects are counted."""
    back = turn.back
    refitted, augmented, drawn = diagnosis.refitted, diagnosis.augmented, diagnosis.drawn
    return replace(
        diagnosis,
        causes=tuple(_signed(found, turn, diagnosis.refitted) for found in diagnosis.causes),
        refitted=None if refitted is None else _rig(refitted, back),
        augmented=None if augmented is None else _rig(augmented, back),
        drawn=None if drawn is None else _drawn(drawn, back),
        notes=(*diagnosis.notes, *_said(diagnosis, turn)),
    )


def _rig(rig: Rig, back: Turn) -> Rig:
    """A rig in the signals as logged, which says how effects count where it has any."""
    logged = back.rig(rig)
    return logged if logged.effects else replace(logged, downwards=frozenset(), origins=Origins())


def _signed(found: Found, turn: Turn, rig: Rig | None) -> Found:
    """A cause whose numbers that may have either sign, and are in a signal's unit, have that of the log."""
    return replace(found, candidates=tuple(_candidate(c, turn, rig) for c in found.candidates))


def _candidate(candidate: Candidate, turn: Turn, rig: Rig | None) -> Candidate:
    family = library().get(candidate.effect)
    form = next((f for f in family.forms if f.name == candidate.form), None) if family else None
    if family is None or form is None:
        return candidate
    parameters, sizes = candidate.parameters, candidate.sizes
    if turn.signs[_role(form, candidate.stage)] < 0:
        parameters = _other(parameters, {p.name for p in form.parameters if p.level == 1 and p.lower < 0.0})
    if turn.signs[seen_as(LEAVES[candidate.stage], rig)] < 0:
        sizes = _other(sizes, {size.what for size in family.sizes if size.signed})
    return replace(candidate, parameters=parameters, sizes=sizes)


def _other(known: dict[str, Estimate], either: set[str]) -> dict[str, Estimate]:
    """What is known, those of ``either`` sign with the other one."""
    return {
        name: replace(e, value=-e.value, ci95=(-e.ci95[1], -e.ci95[0])) if name in either else e
        for name, e in known.items()
    }


def _role(form: Form, stage: str) -> str:
    """The role of the signal that a form acts on in its stage: what enters it, or what leaves it."""
    enters = {stage: role for role, stage in ENTERS.items()}
    return enters[stage] if slot_in(form, stage) in EARLY else LEAVES[stage]


def _said(diagnosis: Diagnosis, turn: Turn) -> list[str]:
    """How effects count, where there are any, with the logged signals that go downwards."""
    refitted = diagnosis.refitted
    if refitted is None or not diagnosis.causes:
        return []
    signals = refitted.signals
    logged = [role for role in ROLES if role in signals.columns() and role != "reference"]
    roles = [role for role in logged if role in turn.roles]
    said = [_COUNTED.format(f"{listed(roles)} {'go' if len(roles) > 1 else 'goes'}")] if roles else []
    for role, lies in vars(turn.origins).items():
        if lies:
            said.append(_FROM.format(role, f"{lies:.6g} {signals.unit_of(role) or ''}".rstrip()))
    return said


def _drawn(drawn: Drawn, back: Turn) -> Drawn:
    entry, exit = drawn.worst
    residual = drawn.residual
    return replace(
        drawn,
        traces=tuple(_trace(trace, drawn.entry, back) for trace in drawn.traces),
        means=tuple(_mean(mean, entry, exit, back) for mean in drawn.means),
        residual=None if residual is None else _residual(residual, entry, exit, back),
    )


def _trace(trace: Trace, entry: str, back: Turn) -> Trace:
    return replace(
        trace,
        input=back.signal(trace.input, entry),
        measured=back.signal(trace.measured, "output"),
        as_given=back.signal(trace.as_given, "output"),
        refitted=back.signal(trace.refitted, "output"),
        explained=back.signal(trace.explained, "output"),
    )


def _mean(mean: Mean, entry: str, exit: str, back: Turn) -> Mean:
    """A mean of residuals, which have no origin, over a signal's level, its rate, or time."""
    sign = back.signs[exit]
    if mean.over == "time":
        return replace(mean, mean=sign * mean.mean)
    place = back.signal(mean.place, entry) if mean.over == "level" else back.signs[entry] * mean.place
    made = replace(mean, place=place, mean=sign * mean.mean)
    if back.signs[entry] > 0:
        return made
    return replace(made, way=_WAYS.get(made.way, made.way), place=made.place[::-1], mean=made.mean[::-1])


def _residual(residual: Residual, entry: str, exit: str, back: Turn) -> Residual:
    into, out = back.signs[entry], back.signs[exit]
    return replace(
        residual,
        level=back.signal(residual.level, entry),
        rate=into * residual.rate,
        way=into * residual.way,
        refitted=out * residual.refitted,
        explained=out * residual.explained,
    )
