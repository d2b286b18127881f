"""Where the gap between a rig and its model lies, which effect causes it, and how far it shrinks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from focgen.arguments import checked
from focgen.control.files import ControllerLike, controller_from
from focgen.control.units import check_one_unit
from focgen.diagnosis.asked import check_asked, usable
from focgen.diagnosis.controller.check import ControllerCheck, check_controller
from focgen.diagnosis.findings import found_in, unhidden, where_it_is_seen
from focgen.diagnosis.hypotheses.initial import (
    begun_as_found,
    begun_session,
)
from focgen.diagnosis.model import Diagnosis
from focgen.diagnosis.problem.decimate import decimated
from focgen.diagnosis.proposals.menu import Choice
from focgen.diagnosis.proposals.next_experiment import NEXT, propose
from focgen.diagnosis.turned import turned_back
from focgen.diagnosis.verdict.compose import Rigs, gap
from focgen.diagnosis.verdict.conclude import conclude
from focgen.diagnosis.verdict.evidence import drawn_of
from focgen.diagnosis.verdict.in_between import with_signals
from focgen.logs.experiment import Experiment
from focgen.logs.feedback import told_of_its_loop
from focgen.logs.filled import with_readings
from focgen.logs.read import Logs, each_of
from focgen.output import check_apart, check_writable
from focgen.replaced import check_own
from focgen.rig.arguments import RigLike, rig_of, rig_then_logs
from focgen.rig.initial import in_windows
from focgen.rig.plausibility import doubts
from focgen.rig.replay import after_session, between_doubted, experiments, replay, with_known
from focgen.rig.response import with_loops
from focgen.rig.rig import Rig
from focgen.rig.stale_zero import with_zero_of
from focgen.rig.turned import turn_of, with_its_way

WRITTEN = ("diagnosis.json", "signals.json", "refitted.toml", "augmented.toml")  # beside the pictures


@rig_then_logs
@checked
def diagnose(
    rig: RigLike,
    logs: Logs,
    out: str | Path | None = None,
    controller: ControllerLike | None = None,
    from_: float | None = None,
    to: float | None = None,
    bootstrap: int = 0,
    only: Sequence[str] | None = None,
    pictures: bool = True,
) -> Diagnosis:
    """Diagnose the gap between the nominal rig and its logs, one session of one rig.

    ``out``: the folder for ``diagnosis.json``, ``refitted.toml``, ``augmented.toml`` and pictures.
    ``controller``: of closed-loop logs; its own departures are then looked for, too. ``from_``, ``to``: s
    within each experiment. ``bootstrap``: sessions simulated from the nominal rig to set the threshold of
    evidence by, at least 2 (0: the built-in one).
    ``only``: the effects to consider, by name; each is then taken for granted, and what is left is how
    strong it is. ``pictures``: whether to draw them.
    Raises RigError, LogError, ControllerError for files that cannot be used, InputError where ``out`` holds
    one of them, or somebody else's file, in the place of a result, FocgenError for an unknown effect.
    """
    check_asked(only, bootstrap)
    each = each_of(logs)
    given = (rig, *each, controller)
    if out is not None:
        _check_place(Path(out), given)
    nominal = with_known(rig_of(rig))
    which = None if controller is None else controller_from(controller)
    if which is not None:
        check_one_unit(nominal, which)
    session = after_session(nominal, usable(experiments(nominal, each, from_, to)))
    ran = None if which is None else check_controller(which, session)
    as_given = nominal
    nominal, stale = with_zero_of(nominal, session)
    nominal = with_its_way(nominal, session)
    turn, logged = turn_of(nominal), session
    if turn:
        session, nominal = tuple(turn.log(log, nominal) for log in session), turn.rig(nominal)
    diagnosis, asked = _diagnosed(nominal, session, ran, only, bootstrap)
    if turn:
        said = doubts(replace(turn.back.rig(nominal), known=()), logged)
        diagnosis = replace(turned_back(diagnosis, turn), warnings=said)
    if stale:
        diagnosis = _with_stale_zero(diagnosis, as_given, logged, stale)
    if out is not None:
        from focgen.diagnosis.write import write

        write(out, diagnosis, asked, pictures, given)
    return diagnosis


def _diagnosed(
    nominal: Rig,
    session: tuple[Experiment, ...],
    ran: ControllerCheck | None,
    only: Sequence[str] | None,
    bootstrap: int,
) -> tuple[Diagnosis, Choice | None]:
    """The diagnosis of a session whose signals rise from 0, and the experiment to make next, None where there
    is none; ``ran``: what the session says of its controller."""
    given = nominal
    nominal, session = decimated(nominal, session)
    session = tuple(told_of_its_loop(log) for log in with_loops(nominal, session))
    session = with_readings(session)
    session = begun_session(nominal, session)
    logged, found = session, found_in(nominal, session, only, bootstrap)
    found = unhidden(found, session, bootstrap) if only is None else found
    nominal, explanations, rigs, session = found.nominal, found.explanations, found.rigs, found.session
    told = begun_as_found(explanations[0].best, rigs.fitted, rigs.placed, session)
    if not explanations[0].best.problem.stood:  # of a pump the fit says what it held
        told = min(told, session, key=lambda logs: gap(rigs.fitted, rigs.placed, logs))
    session = in_windows(rigs.fitted, told, rigs.placed)
    if only is None:
        explanations, rigs = where_it_is_seen(nominal, explanations, rigs, session)
    rigs, diagnosis, evidence = conclude(nominal, session, rigs, explanations, ran, only is not None)
    proposed = propose(nominal, session, explanations, diagnosis.causes)
    diagnosis = replace(
        diagnosis,
        notes=diagnosis.notes + _between_doubted(given, rigs, session, bool(diagnosis.causes)),
        next_experiment=proposed[0] if proposed else None,
        warnings=doubts(nominal, with_signals(session, logged)),
        refitted=rigs.refitted_after(session),
        augmented=rigs.augmented(session, diagnosis.shrink),
        drawn=drawn_of(rigs.refitted, evidence, session),
    )
    return diagnosis, proposed[1] if proposed else None


def _between_doubted(given: Rig, rigs: Rigs, session: tuple[Experiment, ...], named: bool) -> tuple[str, ...]:
    """The note where another way between samples than the rig as ``given`` says does as well as what was
    ``named``, or far better than nothing."""
    if given.between is None:
        return ()
    left = gap(rigs.fitted, rigs.placed, session) if named else None
    return between_doubted(replace(rigs.refitted, between=given.between), session, left)


def _with_stale_zero(
    diagnosis: Diagnosis, rig: Rig, logs: tuple[Experiment, ...], warnings: tuple[str, ...]
) -> Diagnosis:
    """A diagnosis with a zero that the logs bear out, told against the ``rig`` as it was given."""
    replayed = replay(rig, logs).logs.values()
    given = float(np.sqrt(np.mean([found.rmse**2 for found in replayed])))
    gof = diagnosis.gap.gof | {"as given": float(np.mean([found.gof for found in replayed]))}
    return replace(
        diagnosis,
        verdict="parameters" if diagnosis.verdict == "none" else diagnosis.verdict,
        gap=replace(diagnosis.gap, as_given=given, gof=gof),
        warnings=(*warnings, *diagnosis.warnings),
    )


def _check_place(out: Path, given: Sequence[object]) -> None:
    """Raise InputError, before work begins, where a result would take the place of an input or of somebody
    else's file, or cannot be written."""
    from focgen.diagnosis.write import PICTURES

    check_writable(out, folder=True)
    check_apart((out / name for name in (*WRITTEN, NEXT)), given)
    check_own(out / name for name in (*WRITTEN, NEXT, *PICTURES))
