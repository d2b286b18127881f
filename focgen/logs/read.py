"""From files to the experiments of one session."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np

from focgen.errors import LogError
from focgen.logs.experiment import Experiment
from focgen.logs.parts import Raw, experiments_of
from focgen.logs.plausibility import hint
from focgen.logs.table import LogTable, read_table, stem

_TOO_LARGE = 30.0  # times the range: beyond doubt a wrong unit; of less ``plausibility`` warns
_TOO_SMALL = 0.002  # of the range, in a whole session

Limits = Mapping[str, tuple[float, float]]


class Roles(Protocol):
    """Which column plays which role (the rig's ``Signals``)."""

    time: str
    run: str | None

    def columns(self) -> dict[str, str]:
        """Role → column, without time and run."""


def read_logs(
    paths: Sequence[str | Path],
    signals: Roles,
    sample_time: float,
    first: float | None = None,
    last: float | None = None,
    limits: Limits | None = None,
) -> tuple[Experiment, ...]:
    """Read the experiments of one session, in the order of their time stamps, or as given where those
    overlap.

    ``sample_time`` (s) is the rig's: what is not uniformly sampled is resampled to it. ``first`` and ``last``
    cut each experiment (s since its first sample). ``limits`` are each role's (low, high) in its unit, which
    reveal a wrong unit. Raises LogError naming file, column, line and remedy.
    """
    if not paths:
        raise LogError("logs", "none is given", "name at least one log")
    found = [part for path in paths for part in _experiments(path, signals, sample_time, (first, last))]
    _check_limits(found, dict(limits or {}), signals.columns())
    return in_session_order(_with_own_names(found))


def _experiments(path, signals: Roles, sample_time: float, window) -> Iterator[tuple[str, Experiment]]:
    """Yield (path, experiment) for each run of a file, or part of one."""
    table = read_table(path)
    columns, notes = _present(table, signals)
    time = table.numbers(signals.time)
    for name, rows in _runs(table, signals.run):
        where = f"{table.path}" if len(rows) == len(table) else f"{table.path} run {name}"
        run = Raw(name, where, f"{where} [{signals.time}]", time, columns, table.line, notes).part(rows)
        for experiment in experiments_of(run, sample_time, window):
            yield str(path), experiment


def _present(table: LogTable, signals: Roles) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """The columns that are there, by role, and notes on those that are not."""
    wanted = signals.columns()
    taken = {signals.time, signals.run, *wanted.values()}
    if signals.time not in table.columns:
        raise table.missing("time", signals.time, taken)
    columns = {role: table.numbers(name) for role, name in wanted.items() if name in table.columns}
    inputs = [role for role in ("command", "pressure") if role in wanted]
    for role in ["output"] + inputs[: 0 if any(role in columns for role in inputs) else 1]:
        if role not in columns:
            raise table.missing(role, wanted[role], taken)
    absent = [(role, name) for role, name in wanted.items() if role not in columns and role != "reference"]
    return columns, tuple(_absence(table, role, name, taken) for role, name in absent)


def _absence(table: LogTable, role: str, name: str, taken: set) -> str:
    near = table.closest(name, taken)
    return f"no column {name!r}: {role} taken as not logged" + (f" (is it {near!r}?)" if near else "")


def _runs(table: LogTable, run: str | None) -> Iterator[tuple[str, np.ndarray]]:
    """Yield (name, row numbers) in the order of appearance."""
    if run is None or run not in table.columns:
        yield stem(table.path), np.arange(len(table))
        return
    labels = np.array(table.texts(run))
    names, firsts, codes = np.unique(labels, return_index=True, return_inverse=True)
    for code in np.argsort(firsts):
        if not names[code]:
            raise LogError(
                f"{table.path} [{run}]", f"is empty in {table.line(int(firsts[code]))}", "name the run"
            )
        yield str(names[code]), np.flatnonzero(codes == code)


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
    for prefix in (lambda path: "", lambda path: f"{stem(path)}/", lambda path: f"{path}/"):
        named = [replace(experiment, name=prefix(path) + experiment.name) for path, experiment in found]
        if len({experiment.name for experiment in named}) == len(named):
            return named
    raise LogError("logs", "the same file is given twice", "name each log once")


def in_session_order(experiments: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """Order experiments on the session's clock.

    By time stamps where they do not overlap; otherwise (each starts at 0, say) as given, one after the other,
    as if no time had passed between them. One that continues another keeps its distance from it.
    """
    by_time = sorted(experiments, key=lambda e: e.start)
    if all(earlier.start + earlier.time[-1] < later.start for earlier, later in zip(by_time, by_time[1:])):
        return tuple(by_time)
    placed, now, before = [], 0.0, None
    for experiment in experiments:
        if before is not None and experiment.continues and experiment.start > before.start:
            now = placed[-1].start + experiment.start - before.start
        placed.append(replace(experiment, start=now))
        now, before = now + len(experiment) * experiment.sample_time, experiment
    return tuple(placed)
