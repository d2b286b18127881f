"""A rig, effects included, run on logged inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from focgen.arguments import checked
from focgen.arrays import Array
from focgen.errors import LogError, RigError
from focgen.jsontext import UNWRITTEN
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment, check_output
from focgen.logs.feedback import answers_reading
from focgen.logs.notes import notes_of
from focgen.logs.rates import at_one_rate
from focgen.logs.read import Logs, read_logs
from focgen.logs.still import check_moving
from focgen.logs.table import LARGEST
from focgen.present import present
from focgen.rig.arguments import RigLike, rig_of, rig_then_logs
from focgen.rig.effects import Parameter, library
from focgen.rig.engine import Chain, between_of
from focgen.rig.initial import begun, in_windows
from focgen.rig.placed import Placed
from focgen.rig.plausibility import doubts
from focgen.rig.recalled import with_earlier
from focgen.rig.response import check_bounded, longest
from focgen.rig.rig import Rig
from focgen.rig.session import entering, entry_of, jumps_and_rests, run_of
from focgen.rig.stages import LEAVES, STAGES
from focgen.rig.turned import turn_of
from focgen.shown import Shown

_CLOSER = 0.05  # of the mean square that the usual way of a command leaves: less, and another one is right
_LEFT_OUT = "the command is left out, which other logs of the session lack: the pressure drives all of them"
_HELD = 0.5  # the same of a pressure in lines that only jumps and rests: less, and it is held
_ALIKE = 1.2  # of what effects leave: another way that leaves less may be there instead
_BESIDES = ("name", "form", "stage", "clock", "carried", "promise", "learned")


@dataclass(frozen=True)
class Replayed:
    """One experiment: ``gof`` of the output, eq. (4) of the paper; ``rmse`` of the output and of every
    signal simulated and logged, in their units."""

    gof: float
    rmse: float
    rmse_by_signal: dict[str, float]


@dataclass(frozen=True, repr=False)
class Replay(Shown):
    """``logs``: every experiment by its name. ``simulated``: its signals, shape (n,), by role. ``notes``:
    what was done to the logs. ``warnings``: what in them is implausible. ``rig`` and ``experiments``: what
    was run, on what."""

    logs: dict[str, Replayed]
    simulated: dict[str, dict[str, Array]]
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    rig: Rig | None = field(default=None, metadata=UNWRITTEN, compare=False)
    experiments: tuple[Experiment, ...] = field(default=(), metadata=UNWRITTEN, compare=False)


@rig_then_logs
@checked
def replay(rig: RigLike, logs: Logs, from_: float | None = None, to: float | None = None) -> Replay:
    """Run the rig on each experiment's ``command`` where it is logged, else on its ``pressure``.

    The experiments are one session and follow the one the rig's effects were found in. ``from_``, ``to``:
    s within each experiment. Raises RigError for effects unknown, LogError for logs that cannot be used.
    """
    given = rig_of(rig)
    session = experiments(given, logs, from_, to)
    for log in session:
        check_output(log)
    turn = turn_of(given)
    if given.effects and turn:
        turned = _replayed(turn.rig(given), [turn.log(log, given) for log in session])
        made = {name: turn.back.signals(made) for name, made in turned.simulated.items()}
        told = turn.back.rig(present(turned.rig))
        back = (turn.back.log(log, given) for log in turned.experiments)
        session = tuple(replace(log, signals=was.signals, rows=was.rows) for log, was in zip(back, session))
        said = doubts(told, session)
        return replace(turned, simulated=made, rig=told, experiments=session, warnings=said)
    return _replayed(given, session)


def _replayed(given: Rig, session: Sequence[Experiment]) -> Replay:
    """The replay of a rig whose effects count as its signals are."""
    told = told_between(given, session)
    session = _lasting(told, _with_past(told, session))
    simulated = simulate_session(told, session)
    results = {log.name: _compared(log, made) for log, made in zip(session, simulated)}
    made = {log.name: made for log, made in zip(session, simulated)}
    notes = notes_of(session) + between_doubted(given, session)
    return Replay(results, made, notes, doubts(told, session), told, tuple(session))


def _with_past(rig: Rig, logs: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The experiments with what was before them: by their own beginnings, or by the logs of those before,
    where that brings the output closer."""
    placed = placed_in(rig)
    found = begun(rig, logs, placed)
    if not all("output" in log for log in logs):
        return found
    found = with_earlier(rig, found, lambda session: _left(rig, session), placed)
    return in_windows(rig, found, placed)


def _lasting(rig: Rig, logs: tuple[Experiment, ...]) -> tuple[Experiment, ...]:
    """The experiments with what remembers left where the one before left it, where that brings the output
    closer."""
    remembers = any(library()[p.effect].remembers for p in placed_in(rig))
    if not remembers or len(logs) < 2 or not all("output" in log for log in logs):
        return logs
    lasting = tuple(replace(log, lasts=True) for log in logs)
    return lasting if _left(rig, lasting) < _left(rig, logs) else logs


def experiments(
    rig: Rig, logs: Logs, first: float | None = None, last: float | None = None
) -> tuple[Experiment, ...]:
    """The logs read, cut to ``first`` … ``last`` s, and at one rate. Raises RigError for a rig that cannot
    be run on them, LogError where a measured signal stands still throughout."""
    found = at_one_rate(
        read_logs(logs, rig.signals, rig.sample_time, first, last, ranged=rig.ranges.stated())
    )
    check_moving(found)
    check_bounded(rig, longest(found))
    return _of_one_input(found)


def _of_one_input(logs: tuple[Experiment, ...]) -> tuple[Experiment, ...]:
    """The experiments without a command that other ones lack, where the pressure is in all of them."""
    if all("command" in log for log in logs) or not all("pressure" in log for log in logs):
        return logs
    return tuple(log.without("command", _LEFT_OUT) if "command" in log else log for log in logs)


def simulate_session(
    rig: Rig, logs: Sequence[Experiment], placed: Sequence[Placed] | None = None, continues: bool = True
) -> list[dict[str, Array]]:
    """The signals that each experiment should show, by role; ``continues``: after the session the rig's
    effects left. Raises LogError for logs without an input in common."""
    entry = entry_of(logs)
    if not all(entry in log for log in logs):
        raise LogError(
            logs[0].name, "has neither command nor pressure throughout", "name an input in [signals]"
        )
    run = run_of(after_session(rig, logs) if continues else logs, entry)
    tap: dict[str, Array] = {}
    x = entering(logs, entry)
    first = "regulator" if entry == "command" else "actuator"
    chain = Chain(rig, tuple(placed_in(rig) if placed is None else placed))
    chain.run(x, first, "sensor", run, between_of(rig, entry), tap)
    return [{LEAVES[stage]: y[a:b] for stage, y in tap.items()} for a, b in run.spans]


def held_by_a_controller(rig: Rig, logs: Sequence[Experiment]) -> Rig:
    """The rig with its command held between samples, where it does not say what that does, a log shows a
    controller and no other way leaves far less: what is made of a reading cannot have moved there ahead of
    it."""
    commanded = entry_of(logs) == "command" and all("command" in log and "output" in log for log in logs)
    if rig.between is not None or not commanded or not any(answers_reading(log) for log in logs):
        return rig
    held, *others = (replace(rig, between=way) for way in (Between.HELD, Between.STRAIGHT, Between.SMOOTH))
    contradicted = min(_left(other, logs) for other in others) < _HELD * _left(held, logs)
    return rig if contradicted else held


def told_between(rig: Rig, logs: Sequence[Experiment]) -> Rig:
    """The rig with what its first input does between its samples, where the rig does not say it and the logs
    do: what :func:`between_of` says, unless the output comes much closer to another way. A pressure runs in
    lines, and may be held where it only jumps and rests."""
    rig, entry = held_by_a_controller(rig, logs), entry_of(logs)
    if rig.between is not None or not all(entry in log and "output" in log for log in logs):
        return rig
    usual, likely, closer = between_of(rig, entry), list(Between), _CLOSER
    if entry == "pressure":
        likely, closer = [Between.STRAIGHT, Between.HELD][: 1 + jumps_and_rests(logs, entry)], _HELD
    if len(likely) == 1:
        return rig
    ways = [replace(rig, between=way) for way in sorted(likely, key=lambda way: way != usual)]
    left = [_left(way, logs) for way in ways]
    closest = int(np.argmin(left))
    return ways[closest] if left[closest] < closer * left[0] else rig


def between_doubted(rig: Rig, logs: Sequence[Experiment], found: float | None = None) -> tuple[str, ...]:
    """A note where a rig says what its command does between samples, and another way leaves far less of the
    output, or as little as effects do that were ``found`` (the mean square that they leave). What the rig
    says is kept: whatever is late by half a sample looks alike.
    """
    said = rig.between
    if said is None or not all("command" in log and "output" in log for log in logs):
        return ()
    left = {way: _left(replace(rig, between=way), logs) for way in {Between.HELD, Between.STRAIGHT, said}}
    closest = min(left, key=lambda way: left[way])
    if closest == said or left[closest] >= (_HELD * left[said] if found is None else _ALIKE * found):
        return ()
    what = f"{closest.name.lower()!r} leaves {left[closest] / left[said]:.0%} of the mean square that it does"
    remedy = "leave it out where the command of these logs runs otherwise"
    instead = " without any effect" if found is not None else ""
    return (f"between = {said.name.lower()!r} in [signals], but{instead} {what}; {remedy}",)


def _left(rig: Rig, logs: Sequence[Experiment]) -> float:
    """The mean square that a rig leaves of the output."""
    made = simulate_session(rig, logs)
    return float(np.mean([np.mean((log["output"] - m["output"]) ** 2) for log, m in zip(logs, made)]))


def placed_in(rig: Rig) -> tuple[Placed, ...]:
    """The rig's ``[[effects]]``. Raises RigError where one is unknown or lacks a parameter."""
    return tuple(_placed(rig, table) for table in rig.effects)


def _placed(rig: Rig, table: Mapping[str, Any]) -> Placed:
    effect = library().get(table["name"]) if isinstance(table["name"], str) else None
    if effect is None:
        raise RigError(
            f"{rig.name} [[effects]]",
            f"names the unknown effect {table['name']!r}",
            f"known: {', '.join(library())}",
        )
    form = next(
        (
            f
            for f in effect.forms
            if f.name == table.get("form", f.name) and all(p.name in table for p in f.parameters)
        ),
        None,
    )
    if form is None:
        known = "; ".join(f"{f.name}: {', '.join(p.name for p in f.parameters)}" for f in effect.forms)
        raise RigError(
            f"{rig.name} [[effects]] {effect.name}",
            "has no form with these parameters",
            f"give one of {known}",
        )
    stage = table.get("stage", effect.stage)
    strange = set(table) - {p.name for p in form.parameters} - set(_BESIDES)
    if stage not in STAGES or strange:
        what = f"has the stage {stage!r}" if stage not in STAGES else f"has the unknown key {min(strange)!r}"
        raise RigError(f"{rig.name} [[effects]] {effect.name}", what, f"stages are {', '.join(STAGES)}")
    where = f"{rig.name} [[effects]] {effect.name}"
    values = tuple(_value(where, p, table[p.name]) for p in form.parameters)
    carried = table.get("carried", {})
    if not isinstance(carried, Mapping):
        raise RigError(where, f"has {carried!r} for carried", "write it as a table of numbers")
    numbers = {k: _finite(f"{where} carried.{k}", v) for k, v in carried.items()}
    return Placed(effect.name, form, stage, values, numbers)


def _value(where: str, parameter: Parameter, value: object) -> float:
    """A parameter's value. Raises RigError for what no fit could have found: what is no number, or has the
    other sign."""
    number = _finite(f"{where} {parameter.name}", value)
    if (
        parameter.lower < 0.0
        or number > 0.0
        or (number == 0.0 and (not parameter.time or parameter.zero == 0.0))
    ):
        return number
    raise RigError(f"{where} {parameter.name}", f"is {number:g}", "give a positive number")


def _finite(where: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST:
        raise RigError(where, f"is {value!r}", "give a number")
    return float(value)


def session_end(rig: Rig) -> float:
    """Where the session that the rig's effects were found in ended, s on its clock. Raises RigError for a
    clock that is no number."""
    clocks = (_finite(f"{rig.name} [[effects]] clock", e.get("clock", 0.0)) for e in rig.effects)
    return max(clocks, default=0.0)


def with_known(rig: Rig) -> Rig:
    """The rig with its ``[[effects]]`` run wherever it is. Raises RigError as :func:`placed_in` does."""
    return replace(rig, known=placed_in(rig)) if rig.effects else rig


def after_session(rig: Rig, logs: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The logs on the clock of the session that the rig's effects were found in, behind it."""
    clock = session_end(rig)
    if not clock or min(log.start for log in logs) >= clock:
        return tuple(logs)
    return tuple(replace(log, start=log.start + clock) for log in logs)


def effect_tables(
    placed: Sequence[Placed], left: Sequence[dict[str, float]], clock: float
) -> tuple[dict[str, Any], ...]:
    """Effects as ``[[effects]]`` tables, with what outlives the session: ``left``, one for each, and its
    ``clock`` in s."""
    tables = []
    for p, carried in zip(placed, left, strict=True):
        table = {
            "name": p.effect,
            "form": p.form.name,
            "stage": p.stage,
            **p.named,
            "clock": float(clock),
        }
        tables.append(table | ({"carried": carried} if carried else {}))
    return tuple(tables)


def goodness(measured: Array, simulated: Array) -> float:
    """1 − |measured − simulated| / |measured − mean|, eq. (4) of the paper; −inf where nothing varies."""
    spread = float(np.linalg.norm(measured - np.mean(measured)))
    return 1.0 - float(np.linalg.norm(measured - simulated)) / spread if spread else -np.inf


def _compared(log: Experiment, made: dict[str, Array]) -> Replayed:
    rmse = {role: float(np.sqrt(np.mean((log[role] - y) ** 2))) for role, y in made.items() if role in log}
    return Replayed(goodness(log["output"], made["output"]), rmse["output"], rmse)
