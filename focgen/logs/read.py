"""From files to the experiments of one session."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import numpy as np

from focgen.arrays import Array, Ints
from focgen.errors import LogError
from focgen.logs.cells import Levels
from focgen.logs.columns import run_instead, runs_without_name
from focgen.logs.dialect import MISSING
from focgen.logs.experiment import Experiment
from focgen.logs.frames import Frame, is_frame, table_of
from focgen.logs.given import checked_in_memory, with_names_apart
from focgen.logs.parts import Raw, experiments_of
from focgen.logs.plausibility import hint
from focgen.logs.roles import Roles, columns_named, scaled, taken_columns, without_unit
from focgen.logs.scales import known
from focgen.logs.stacked import check_one_row_a_moment
from focgen.logs.table import LogTable, read_table, stem
from focgen.logs.timed import reading_of, time_of
from focgen.logs.together import alike, check_one_unit, check_own_columns, check_zones
from focgen.logs.units import unit_of

_TOO_LARGE = 30.0  # times the range: beyond doubt a wrong unit; of less ``plausibility`` warns
_TOO_SMALL = 0.002  # of the range, in a whole session
_DATED = 1e8  # s: a clock this far on counts from 1970, no other one does
_MOVED = "placed by its time stamps, not in the order given"
_GIVE = "give a path, a frame, a dictionary of arrays, or a list of these"

Limits = Mapping[str, tuple[float, float]]
Log = str | Path | Mapping[str, Any] | Frame | Experiment
"""A file, a dictionary of arrays (m,) by column, a pandas or polars frame, or what was read before."""
Logs = Log | Iterable[Log]


def read_logs(
    paths: Logs,
    signals: Roles,
    sample_time: float,
    first: float | None = None,
    last: float | None = None,
    limits: Limits | None = None,
    ranged: Collection[str] = (),
) -> tuple[Experiment, ...]:
    """Read the experiments of one session, in the order of their time stamps, or as given where those
    overlap.

    ``paths`` are files, or logs in memory: a pandas or polars frame, a dictionary of arrays (m,), or a list
    of these. Experiments that were read before are only cut, and put in order where their clocks overlap.

    ``sample_time`` (s) is the rig's: what is not uniformly sampled is resampled to it. ``first`` and ``last``
    cut each experiment (s since its first sample). ``limits`` are each role's (low, high) in its unit, which
    reveal a wrong unit; roles that are ``ranged`` have one that is not asked for here. Raises LogError naming
    file, column, line and remedy.
    """
    logs = each_of(paths)
    read = [log for log in logs if isinstance(log, Experiment)]
    if logs and len(read) == len(logs):
        cut = with_names_apart([checked_in_memory(log).between(first, last) for log in read])
        return in_session_order(cut) if _overlap(cut) else cut
    tables = tables_of(logs)
    if not tables:
        raise LogError("logs", "none is given", "name at least one log")
    check_zones(tables, signals.time)
    check_one_unit(tables, without_unit(signals), "name the true one in the rig's [units]")
    for table in tables:
        check_own_columns(table, columns_named(signals))
        _check_marks(table, signals, {*(limits or {}), *ranged})
    found = [part for table in tables for part in _experiments(table, signals, sample_time, (first, last))]
    _check_limits(found, dict(limits or {}), signals.columns())
    return _with_twins(in_session_order(_with_own_names(found)))


def _check_marks(table: LogTable, signals: Roles, ranged: Collection[str]) -> None:
    """Raise LogError where the columns of all roles show numbers like 1.200 only, which may be thousands: the
    rig tells by the range of one of them, or by its scale."""
    unsure = {role: name for role, name in signals.columns().items() if table.is_unsure(name)}
    if not unsure or unsure.keys() & {*ranged, *signals.scales}:
        return
    role, name = next(iter(unsure.items()))
    what = "has nothing but numbers like 1.200, whose point may stand between thousands"
    scaled = f"write {role} = {{ column = {name!r}, scale = 1 }} in the rig's [signals]"
    remedy = f"write one of them as 1.2 or 1200, or, where the point is a decimal one, {scaled}"
    raise LogError(f"{table.path} [{name}]", what, remedy)


def each_of(logs: Logs) -> list[Log]:
    """One log, or several, as a list. Raises LogError for what is neither."""
    if isinstance(logs, str | Path | Experiment) or is_frame(logs):
        return [cast(Log, logs)]
    try:
        return list(cast(Iterable[Log], logs))
    except TypeError:
        raise LogError("logs", f"is {type(logs).__name__}", _GIVE) from None


def tables_of(logs: Sequence[Log]) -> list[LogTable]:
    """Logs as tables. Raises LogError where one cannot be read, or was read before as others were not."""
    names = ["log"] if len(logs) == 1 else [f"log {k}" for k in range(1, len(logs) + 1)]
    return [_table(log, name) for log, name in zip(logs, names)]


def _table(log: Log, name: str) -> LogTable:
    if isinstance(log, (str, Path)):
        return read_table(log)
    if isinstance(log, Experiment) or not is_frame(log):
        raise LogError(name, f"is {type(log).__name__}, among others that are not", _GIVE)
    return table_of(log, name)


def _experiments(
    table: LogTable, signals: Roles, sample_time: float, window: tuple[float | None, float | None]
) -> Iterator[tuple[str, Experiment]]:
    """Yield (path, experiment) for each run of a log, or part of one."""
    columns, notes = _present(table, signals)
    time, said = time_of(table, signals)
    reading, column = reading_of(table, signals), signals.time if signals.time in table else None
    notes = (*table.notes, *said, *notes, *_no_run(table, signals, time))
    for name, rows in _runs(table, signals.run):
        run = Raw(name, table.path, "", time, columns, table.line, notes, reading, column).part(rows)
        where = table.path if len(run) == len(table) else f"{table.path} run {name}"
        run = replace(run, where=where, stamps=f"{where} [{signals.time}]")
        check_one_row_a_moment(table, run, rows, taken_columns(signals))
        if column is not None and (table.is_dated(column) or run.time[0] > _DATED):
            run = run.carried_on()
        for experiment in experiments_of(run, sample_time, window):
            yield table.path, experiment


def _present(table: LogTable, signals: Roles) -> tuple[dict[str, Array], tuple[str, ...]]:
    """The signals that are there, by role, and notes on those that are not, or in another unit."""
    wanted = signals.columns()
    taken = taken_columns(signals)
    inputs = [role for role in ("command", "pressure") if role in wanted]
    there = [role for role, name in wanted.items() if name in table]
    for role in ["output", *inputs[: 0 if any(role in there for role in inputs) else 1]]:
        if role not in there:
            raise table.missing(role, wanted[role], taken)
    columns = {role: scaled(table, role, table.numbers(wanted[role]), signals) for role in there}
    absent = [(role, name) for role, name in wanted.items() if role not in columns and role != "reference"]
    notes = [_absence(table, role, name, taken) for role, name in absent]
    return columns, (*notes, *filter(None, (_unit_note(table, role, signals) for role in columns)))


def _unit_note(table: LogTable, role: str, signals: Roles) -> str | None:
    """What the file or the column's name says of its unit, where the rig takes it for another."""
    column = signals.columns()[role]
    given, own, scale = table.unit(column), signals.units.get(role), signals.scales.get(role)
    given = given or (unit_of(column) or (None, None))[1]
    taken = own if scale is None else scale.unit
    if given is None or taken is None or given == taken or alike(given, taken):
        return None
    spelled = given if known(given) else (unit_of(given) or ("", ""))[1]
    hint = f": is it {{ unit = {spelled!r} }}?" if spelled and known(taken) else ""
    return f"the log gives {column!r} in {given}, {role} is taken as {taken}{hint}"


def _absence(table: LogTable, role: str, name: str, taken: set[str]) -> str:
    if name in table.skipped:
        why = table.skipped[name]
        return f"no column {name!r} that can be read, for it {why}: {role} taken as not logged"
    near = table.closest(name, taken)
    return f"no column {name!r}: {role} taken as not logged" + (f" (is it {near!r}?)" if near else "")


def _no_run(table: LogTable, signals: Roles, time: Array) -> tuple[str, ...]:
    """A note where the rig's column of runs is not there, and another may be meant. Without one nothing shows
    that a log has several runs: rigs name the column for others."""
    run = signals.run
    if run is None or run in table or table.runs is not None:
        return ()
    if run in table.skipped:
        return (f"no column {run!r} that can be read, for it {table.skipped[run]}: no runs are told apart",)
    near = run_instead(table, run, taken_columns(signals))
    if near is not None:
        return (f"no column {run!r}: no runs are told apart (is it {near!r}?)",)
    found = runs_without_name(table, taken_columns(signals), time)
    if found is None:
        return ()
    name = f"and {found[0]} tells {found[1]} parts apart: name it {run!r} where these are the runs"
    return (f"no column {run!r}: no runs are told apart, {name}",)


def _runs(table: LogTable, run: str | None) -> Iterator[tuple[str, slice | Ints]]:
    """Yield (name, rows) in the order of appearance."""
    if run is not None and run in table:
        labels = table.levels(run)
    elif table.runs is not None:
        labels = Levels.of(table.runs)
    else:
        yield stem(table.path), slice(0, len(table))
        return
    codes, firsts = np.unique(labels.codes, return_index=True)
    for code, first in sorted(zip(codes.tolist(), firsts.tolist()), key=lambda pair: pair[1]):
        if labels.texts[code].lower() in MISSING:
            raise LogError(f"{table.path} [{run}]", f"is empty in {table.line(first)}", "name the run")
        yield labels.texts[code], np.flatnonzero(labels.codes == code)


def _check_limits(found: list[tuple[str, Experiment]], limits: Limits, columns: Mapping[str, str]) -> None:
    """Raise LogError where a signal leaves its range so far, or uses so little of it, that its unit must be
    wrong.
    """
    for role, (low, high) in limits.items():
        largest = max(abs(low), abs(high))
        peaks = [(float(np.abs(e[role]).max()), path, e) for path, e in found if role in e]
        if not peaks:
            continue
        peak, path, experiment = max(peaks, key=lambda entry: entry[0])
        if peak > _TOO_LARGE * largest or 0.0 < peak < _TOO_SMALL * largest:
            what = (
                f"{role} reaches {peak:.3g} in {experiment.name} where the rig's range is {low:g} to {high:g}"
            )
            unit = hint(role, columns[role], peak / largest)
            raise LogError(path, what, f"{unit and unit + ' '}log it in the rig's unit, or correct [ranges]")


def _with_own_names(found: list[tuple[str, Experiment]]) -> list[Experiment]:
    """Put the file's name, or its path, before the experiments' where names repeat."""
    ways: tuple[Callable[[str], str], ...]
    ways = (lambda path: "", lambda path: f"{stem(path)}/", lambda path: f"{path}/")
    for prefix in ways:
        named = [replace(experiment, name=prefix(path) + experiment.name) for path, experiment in found]
        if len({experiment.name for experiment in named}) == len(named):
            return named
    raise LogError("logs", "the same file is given twice", "name each log once")


def _with_twins(logs: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """Each with a note where an earlier one holds the same samples, as a copy under another name does: noise
    never comes twice, so that it would count twice."""
    if len(logs) < 2:
        return tuple(logs)
    first: dict[bytes, str] = {}
    made = []
    for log in logs:
        name = first.setdefault(digest_of(log), log.name)
        note = () if name == log.name else (f"holds the same samples as {name}, and counts twice",)
        made.append(replace(log, notes=(*log.notes, *note)) if note else log)
    return tuple(made)


def digest_of(log: Experiment) -> bytes:
    """Of the samples by role, wherever they stand on the session's clock."""
    found = hashlib.sha256()
    for role in sorted(log.signals):
        found.update(role.encode())
        found.update(np.ascontiguousarray(log[role], float).data)  # no copy: a column may be 80 MB
    return found.digest()


def _overlap(experiments: Sequence[Experiment]) -> bool:
    """Whether some begin before others have ended."""
    by_time = sorted((e for e in experiments if len(e)), key=lambda e: e.start)
    return any(a.start + a.time[-1] >= b.start for a, b in pairwise(by_time))


def in_session_order(experiments: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """Order experiments on the session's clock.

    By time stamps where these do not overlap, are of one clock, and do not fall back within a run. Otherwise
    (each starts at 0, say) as given, one after the other, as if no time had passed between them. One that
    continues another keeps its distance from it.
    """
    by_time = sorted(experiments, key=lambda e: e.start)
    fallen = any(later.anew and later.start < earlier.start for earlier, later in pairwise(experiments))
    one = by_time[0].start > _DATED or by_time[-1].start < _DATED
    if one and not fallen and all(a.start + a.time[-1] < b.start for a, b in pairwise(by_time)):
        moved = {id(e) for e, given in zip(by_time, experiments) if e is not given}
        return tuple(replace(e, notes=(*e.notes, _MOVED)) if id(e) in moved else e for e in by_time)
    placed, now, before = [], 0.0, None
    for experiment in experiments:
        paused = before is not None
        if before is not None and experiment.continues and experiment.start > before.start:
            now, paused = placed[-1].start + experiment.start - before.start, False
        placed.append(replace(experiment, start=now, paused=paused))
        now, before = now + len(experiment) * experiment.sample_time, experiment
    return tuple(placed)
