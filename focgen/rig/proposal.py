"""A first ``rig.toml`` for logs that have none: roles, sample time, units, ranges, and what is unsure."""

from __future__ import annotations

import shlex
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from focgen.arguments import checked
from focgen.arrays import Array
from focgen.errors import FocgenError, LogError
from focgen.logs import clock
from focgen.logs.columns import SIGNALS, Column, Guess, columns_of, guessed, is_dated, run_of, time_of
from focgen.logs.read import Logs, each_of, tables_of
from focgen.logs.scales import unit_of_time
from focgen.logs.table import LogTable, stem
from focgen.logs.together import check_one_unit
from focgen.logs.units import time_unit_named
from focgen.output import check_apart, write_file
from focgen.rig.files import check_replaces_rig, read_rig
from focgen.rig.replay import experiments
from focgen.rig.rig import Rig
from focgen.shown import Shown

_MEANING = {
    "time": "s",
    "run": "splits a file into experiments",
    "command": "into the regulator",
    "pressure": "between regulator and actuator",
    "curvature": "between actuator and sensor: the camera's truth",
    "output": "what the controller reads",
    "reference": "in closed-loop logs",
}
_USUAL = 5e-4, 20.0  # s between samples: of other clocks without a unit it is said that seconds are a guess
_NICE = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
_MILLI = 0.9, 1e4  # s between samples: a clock this slow, with whole numbers, counts milliseconds
_NOISE = 0.02  # of the span: so far below 0 a signal that starts there strays
_COLUMN = 40  # where comments begin

Ask = Callable[[str, str, Sequence[str]], str]


@dataclass(frozen=True, repr=False)
class Proposal(Shown):
    """``rig`` without models; ``text``: its file, with comments; ``doubts``: what to check; ``next``: the
    command that identifies the models, of logs in memory the call."""

    rig: Rig
    text: str
    doubts: tuple[str, ...]
    next: str

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class _Time:
    """The column of time, or a name for the log's own clock; the time between samples in s."""

    column: str
    unit: str
    step: float
    doubts: tuple[str, ...] = ()


@checked
def init(
    logs: Logs, out: str | Path | None = None, ask: Ask | None = None, name: str | None = None
) -> Proposal:
    """Propose a rig for logs of one rig; written to ``out`` where given.

    Roles go by the columns' names and units, and by their shape where those do not tell. ``ask(role, likely,
    columns)`` returns the column of a role that is unsure, "" for none. Raises LogError where the logs hold
    no time, input or output, InputError where ``out`` is one of them, or something else than a rig without a
    model.
    """
    given = each_of(logs)
    if not given:
        raise LogError("logs", "none is given", "name at least one log")
    if out is not None:
        check_apart([out], given)
        check_replaces_rig(out, proposed=True)
    tables = tables_of(given)
    run = run_of(tables[0])
    time = _time(tables[0], run)
    every, left = columns_of(tables)
    columns = [c for c in every if c.name not in (time.column, run)]
    guesses = _asked(guessed(columns), columns, ask)
    _check(tables[0], guesses, left)
    by_name = {c.name: c for c in columns}
    check_one_unit(tables, [guess.column for guess in guesses.values()], "give those of one unit")
    roles = {role: by_name[guess.column] for role, guess in guesses.items()}
    said = [f"left out: {name!r} {why}" for name, why in left.items() if name not in (time.column, run)]
    marks = _marks(tables, [guess.column for guess in guesses.values()])
    doubts = (*time.doubts, *_doubts(guesses, roles, [c.name for c in columns]), *marks, *said)
    label = name or (stem(tables[0].path) if isinstance(given[0], str | Path) else "rig")
    files = [str(log) for log in given if isinstance(log, str | Path)]
    told = _next(files, roles, out)
    text = _text(label, run, time, roles, guesses, doubts, told)
    rig = read_rig(tomllib.loads(text))
    if refusal := _refusal(rig, given):
        doubts = (refusal, *doubts)
        text = _text(label, run, time, roles, guesses, doubts, told)
    if out is not None:
        write_file(out, text, given)
    return Proposal(rig, text, doubts, told)


def _refusal(rig: Rig, logs: Sequence[Any]) -> str | None:
    """Why no command that uses the rig takes the logs it was proposed for, in one line; None where each
    does."""
    try:
        experiments(rig, logs)
    except FocgenError as reason:
        return "".join(c if c.isprintable() else " " for c in f"the logs: {reason}")
    return None


def _marks(tables: Sequence[LogTable], names: Sequence[str]) -> list[str]:
    what = "holds nothing but numbers like 1.200, whose point is taken for a decimal one"
    return [f"{name!r} {what}" for name in names if any(table.is_unsure(name) for table in tables)]


def _check(table: LogTable, guesses: Mapping[str, Guess], left: Mapping[str, str]) -> None:
    if "output" not in guesses or not {"command", "pressure"} & set(guesses):
        there = ", ".join(table.columns).replace(";", ",")
        what = f"has no two columns that move, for an input and an output; there are: {there}"
        told = "".join(f" ({name!r} {why})" for name, why in left.items())
        raise LogError(table.path, what + told, "log what drives the rig and what it answers")


def _time(table: LogTable, run: str | None) -> _Time:
    name = time_of(table)
    if name is None and table.clock is None:
        raise table.without_clock()
    stamps: Any = table.clock if name is None else table.seconds(name)
    step, drift = _step(stamps), 0.5 / len(stamps)
    if name is None:
        return _Time("time", "s", _rounded(step, drift))
    given = "s" if is_dated(table, name) else table.unit(name) or time_unit_named(name)
    told = unit_of_time(given or "")
    if told is not None:
        unit, seconds = told
        return _Time(name, unit if seconds != 1.0 else "s", _rounded(seconds * step, drift))
    doubt = f"time: {name!r} has {'no unit' if given is None else f'the unit {given!r}'}, and is taken as "
    if given is None and _MILLI[0] <= step <= _MILLI[1] and step == int(step):
        said = f"{doubt}milliseconds, {step:g} between samples"
        return _Time(name, "ms", _rounded(1e-3 * step, drift), (said,))
    usual = given is None and _USUAL[0] <= step <= _USUAL[1]
    doubts = () if usual else (f"{doubt}seconds, {step:.3g} between samples",)
    return _Time(name, "s", _rounded(step, drift), doubts)


def _step(stamps: Array) -> float:
    """Between samples, in the stamps' unit: of a uniform clock its mean, so that rounding does not count."""
    part = stamps[clock.sittings(stamps)[0]]
    steps = np.diff(part)
    forward = steps[steps > 0]
    if not len(forward):
        return 1.0
    return clock.uniform_step(part) or float(np.median(forward))


def _rounded(step: float, drift: float) -> float:
    """A round number of seconds, or of samples a second, where the step is one up to ``drift`` (relative)."""
    for round_one in (float(f"{step:.2g}"), 1.0 / round(1.0 / step) if step < 0.5 else step):
        if abs(round_one / step - 1.0) < drift:
            return round_one
    return float(f"{step:.6g}")


def _asked(guesses: dict[str, Guess], columns: Sequence[Column], ask: Ask | None) -> dict[str, Guess]:
    """The guesses, the unsure ones as the user says."""
    if ask is None:
        return guesses
    found: dict[str, Guess] = {}
    names = [c.name for c in columns]
    for role in SIGNALS:
        guess = guesses.get(role)
        free = [n for n in names if n not in {g.column for g in found.values()}]
        if guess is not None and not guess.sure:
            chosen = ask(role, guess.column, free)
            guess = Guess(chosen, True) if chosen else None
        if guess is not None:
            found[role] = guess
    return found


def _doubts(
    guesses: Mapping[str, Guess], roles: Mapping[str, Column], names: Sequence[str]
) -> tuple[str, ...]:
    said = []
    for role, guess in guesses.items():
        if not guess.sure:
            also = f"; it might be {' or '.join(map(repr, guess.others))}" if guess.others else ""
            said.append(f"{role}: {guess.column!r} is a guess{also}")
    said += [
        f"{role}: the unit of {column.name!r} is not known, put it into [units]"
        for role, column in roles.items()
        if not column.unit
    ]
    if unused := [name for name in names if name not in {c.name for c in roles.values()}]:
        said.append(f"no role: {', '.join(map(repr, unused))}")
    if "command" not in roles:
        said.append(
            "no command: the regulator cannot be identified, and the controller will set the pressure"
        )
    elif "pressure" not in roles:
        said.append("no pressure: regulator and actuator are told apart only by a [regulator] that you give")
    said.append("ranges: what the logs show, with some room; give what each signal can reach")
    return tuple(said)


def _next(files: Sequence[str], roles: Mapping[str, Column], out: str | Path | None) -> str:
    stages = ["regulator"] * ({"command", "pressure"} <= set(roles)) + ["actuator"]
    stages += ["sensor"] * ("curvature" in roles)
    if not files:
        asked = f", stages={stages}".replace("'", '"') if len(stages) > 1 else ""
        rig = "proposal.rig" if out is None else _quoted(str(out))
        return f"focgen.identify({rig}, logs{asked})"
    asked = f" --stages {','.join(stages)}" if len(stages) > 1 else ""
    named = " ".join(shlex.quote(f"./{file}" if file.startswith("-") else file) for file in files)
    rig = shlex.quote(str(out or "rig.toml"))  # a shell takes what is pasted at its word
    return f"focgen identify {named} --rig {rig}{asked} --out identified.toml"


def _text(
    label: str,
    run: str | None,
    time: _Time,
    roles: Mapping[str, Column],
    guesses: Mapping[str, Guess],
    doubts: Sequence[str],
    told: str,
) -> str:
    """The file, with what each line is and how sure."""
    lines = [f"name = {_quoted(label)}", _line(f"sample_time = {time.step!r}", "s, as logged"), ""]
    lines += ["[signals]"] + ([_line(f"run = {_quoted(run)}", _MEANING["run"])] if run else [])
    of_time = _quoted(time.column)
    converted = f"{{ column = {of_time}, unit = {_quoted(time.unit)} }}"
    lines.append(_line(f"time = {of_time if time.unit == 's' else converted}", "s"))
    for role, column in roles.items():
        unsure = "" if guesses[role].sure else " (a guess)"
        lines.append(_line(f"{role} = {_quoted(column.name)}", _MEANING[role] + unsure))
    if any(c.unit for c in roles.values()):
        lines += ["", "[units]"] + [f"{role} = {_quoted(c.unit)}" for role, c in roles.items() if c.unit]
    lines += ["", "[ranges]" + " " * (_COLUMN - 8) + "# what each signal can reach"]
    for role in ("command", "pressure", "output"):
        if role in roles:
            low, high = float(np.nanmin(roles[role].values)), float(np.nanmax(roles[role].values))
            least = _NOISE * (high - low)
            span = [_outward(low) if low < -least else 0.0, _outward(high) if high > least else 0.0]
            lines.append(_line(f"{role} = {span}", f"seen {low:.4g} to {high:.4g}"))
    lines += ["", *(f"# unsure: {doubt}" for doubt in doubts)]
    lines += ["# The models of the stages come from the logs:", f"#   {_plain(told)}"]
    return "\n".join(_plain(line) for line in lines) + "\n"


def _line(text: str, comment: str) -> str:
    return f"{text:<{_COLUMN}}# {comment}"


def _quoted(text: str) -> str:
    return tomlkit.string(text).as_string()


def _plain(line: str) -> str:
    """Without control characters, which neither a comment nor a line may hold."""
    return "".join(c if c.isprintable() else " " for c in line)


def _outward(value: float) -> float:
    """The next round number away from zero."""
    if value == 0.0:
        return 0.0
    power = 10.0 ** np.floor(np.log10(abs(value)))
    size = next(float(f"{n * power:.3g}") for n in (*_NICE, 12.0) if n * power >= abs(value) * (1 - 1e-9))
    return size if value > 0 else -size
