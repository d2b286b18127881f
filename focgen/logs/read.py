"""From files to the experiments of one session."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np

from focgen.errors import LogError
from focgen.logs import clock
from focgen.logs.experiment import Experiment
from focgen.logs.table import LogTable, read_table, stem

_FEWEST = 8  # samples: less shows neither a rate nor a response
_TOO_LARGE = 10.0  # times the range
_TOO_SMALL = 0.02  # of the range, in a whole session

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
    _check_limits(found, dict(limits or {}))
    return in_session_order(_with_own_names(found))


def _experiments(path, signals: Roles, sample_time: float, window) -> Iterator[tuple[str, Experiment]]:
    """Yield (path, experiment) for each run of a file."""
    table = read_table(path)
    columns, notes = _present(table, signals)
    for name, rows in _runs(table, signals.run):
        yield str(path), _experiment(table, columns, name, rows, signals.time, sample_time, window, notes)


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


def _experiment(table, columns, name, rows, time_column, sample_time, window, notes) -> Experiment:
    where = f"{table.path}" if len(rows) == len(table) else f"{table.path} run {name}"
    time = table.numbers(time_column)[rows]
    if len(time) < _FEWEST:
        raise LogError(where, f"has {len(time)} samples", f"give at least {_FEWEST}")
    clock.check_increasing(time, f"{where} [{time_column}]", lambda row: table.line(int(rows[row])))
    clock.check_unit(time, sample_time, f"{where} [{time_column}]")
    kept = _windowed(time, window, where)
    time, rows = time[kept], rows[kept]
    values = _complete(table, columns, rows, where)
    step, even, more = clock.on_grid(time, values, sample_time, where)
    resampled = any(even[role] is not values[role] for role in values)
    return Experiment(name, step, even, float(time[0]), time, notes + more, values if resampled else None)


def _windowed(time: np.ndarray, window: tuple[float | None, float | None], where: str) -> np.ndarray:
    first, last = (edge if edge is not None else way * np.inf for edge, way in zip(window, (-1, 1)))
    since = time - time[0]
    kept = (since >= first - 1e-9) & (since <= last + 1e-9)
    if kept.sum() < _FEWEST:
        span = f"from {max(first, 0):g} to {min(last, since[-1]):g} s"
        raise LogError(
            where, f"has {kept.sum()} samples {span}", f"it lasts {since[-1]:g} s: widen --from and --to"
        )
    return kept


def _complete(table: LogTable, columns, rows: np.ndarray, where: str) -> dict[str, np.ndarray]:
    """The rows of each role; a role with no value at all is left out, one with some missing is refused."""
    values = {}
    for role, column in columns.items():
        part = column[rows]
        gaps = np.isnan(part)
        if (
            gaps.all()
            and role != "output"
            and (role not in ("command", "pressure") or _other(columns, role, rows))
        ):
            continue
        if gaps.any():
            row, others = table.line(int(rows[np.argmax(gaps)])), int(gaps.sum()) - 1
            what = f"{role} is empty or not a number in {row}" + (f" and {others} more" if others else "")
            raise LogError(where, what, "fill the gaps, or cut them off with --from and --to")
        values[role] = part
    return values


def _other(columns, role: str, rows: np.ndarray) -> bool:
    other = columns.get("pressure" if role == "command" else "command")
    return other is not None and not np.isnan(other[rows]).all()


def _check_limits(found: list[tuple[str, Experiment]], limits: Limits) -> None:
    """Raise LogError where a signal leaves its range by an order of magnitude, or uses next to
    nothing of it.
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
            raise LogError(path, what, "log it in the rig's unit, or correct [ranges]")


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
    as if no time had passed between them.
    """
    by_time = sorted(experiments, key=lambda e: e.start)
    if all(earlier.start + earlier.time[-1] < later.start for earlier, later in zip(by_time, by_time[1:])):
        return tuple(by_time)
    placed, now = [], 0.0
    for experiment in experiments:
        placed.append(replace(experiment, start=now))
        now += len(experiment) * experiment.sample_time
    return tuple(placed)
