"""What the columns of a log may be: each role's likeliest column, by name, unit and shape."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from focgen.arrays import Array, Numbers
from focgen.errors import LogError
from focgen.logs.scales import known as measures
from focgen.logs.scales import unit_of_time
from focgen.logs.table import LogTable, stem
from focgen.logs.units import TIME_WORDS, time_unit_named, unit_named, unit_of

SIGNALS = ("command", "pressure", "curvature", "output", "reference")
_RUN = frozenset(
    "run runs experiment exp trial test segment session series versuch messung lauf essai prueba "
    "ensayo".split()
)
_WORDS = {
    "command": "u cmd command valve pwm duty input drive pump motor voltage stell control heater",
    "pressure": "p pressure press druck gauge chamber presion",
    "curvature": "cam camera truth true vision mocap optitrack laser",
    "output": "y output out kappa curvature angle sensor flex bend bending theta position pos q "
    "displacement disp deflection strain speed velocity temperature imu height level winkel",
    "reference": "ref reference setpoint set sp target desired des goal w r soll",
}
_EITHER = frozenset("force f torque load".split())  # drives some rigs, and is what others answer with
_ROLE_WORDS = {role: frozenset(words.split()) for role, words in _WORDS.items()}
_KINDS = {  # points for a unit's kind, by role
    "voltage": {"command": 2.0, "output": 0.5},
    "current": {"command": 2.0},
    "pressure": {"pressure": 2.5, "command": 0.5, "reference": 0.2},
    "curvature": {"output": 2.0, "curvature": 1.5, "reference": 0.5},
    "angle": {"output": 2.0, "curvature": 1.5, "reference": 0.5},
}
_NAMELESS = re.compile(r"|index|level_\d+|(Unnamed: |column |_duplicated_|__index_level_)\d+(__)?")
# what pandas, polars and this library call a column, or a level of an index, that has no name
_NAMED, _LETTER, _MAYBE = 3.0, 2.0, 1.6  # points for a word, for a single letter, for a word of two roles
_LEAST = 1.5  # points: less is no role's column
_SURE = 2.0  # points: less is a guess
_CLOSE = 1.0  # points: a column so little behind might be meant as well
_NEAR = 0.75  # of a name's letters: "Run" and "runs" are near to "run", "runtime" is not
_HELD, _LEVELS = 0.8, 60  # share of readings that repeat the last, and levels, of a column set by a program


@dataclass(frozen=True, eq=False)
class Column:
    """A column over all logs: ``values`` (m,), NaN where a reading is missing; ``unit``, "" where unknown."""

    name: str
    unit: str
    values: Array

    @property
    def held(self) -> bool:
        """Whether it looks as if a program had set it: levels, held."""
        known = self.values[~np.isnan(self.values)]
        return len(np.unique(known)) <= _LEVELS and float(np.mean(np.diff(known) == 0.0)) >= _HELD

    @property
    def moves(self) -> bool:
        """Whether it has more than one value."""
        known = self.values[~np.isnan(self.values)]
        return len(known) > 1 and bool(np.ptp(known) > 0.0)

    @property
    def words(self) -> list[str]:
        """The words of its name, without its unit."""
        bare = re.sub(r"[\[(].*?[\])]", "", self.name).replace("per_", "per")
        spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", bare)
        words = [w.lower() for w in re.split(r"[^A-Za-zµκθ]+", spaced) if w]
        return words[:-1] if len(words) > 1 and self.unit else words


def columns_of(tables: Sequence[LogTable]) -> tuple[tuple[Column, ...], dict[str, str]]:
    """The columns of numbers that all logs have; and of each other one why it is left out.

    Raises LogError where there are none.
    """
    found, left = [], {}
    for name in dict.fromkeys(name for table in tables for name in table.columns):
        lacking = next((table.path for table in tables if name not in table), None)
        if lacking is not None:
            left[name] = f"{stem(lacking)} has no such column"
            continue
        try:
            values = np.concatenate([table.numbers(name) for table in tables])
        except LogError as reason:
            left[name] = reason.what  # words, or dates
            continue
        if np.isnan(values).all():
            left[name] = "has no reading"
        else:
            found.append(Column(name, tables[0].unit(name) or unit_named(name), values))
    if not found:
        raise LogError(tables[0].path, "has no column of numbers", "give a log with a header")
    return tuple(found), left


def time_of(table: LogTable) -> str | None:
    """The column of time: one that increases but for new beginnings, best by its unit and its name; None
    where the log has its own clock or no time at all. What has another unit is none."""
    units = {name: table.unit(name) or time_unit_named(name) for name in table.columns}
    of_time = {name: unit is None or unit_of_time(unit) is not None for name, unit in units.items()}
    known = [name for name in table.columns if of_time[name] or not measures(units[name] or "")]
    rising = [name for name in known if _rises(table, name)]
    told = [name for name in rising if units[name] is not None and of_time[name]]
    named = [name for name in rising if is_time_named(name)]
    dated = [name for name in rising if not isinstance(table.column(name), np.ndarray)]
    both = [name for name in named if name in told]
    best = both or told or named or [n for n in dated if is_dated(table, n)] or rising
    return best[0] if best else None


def is_time_named(name: str) -> bool:
    """Whether a column's name says that it is time."""
    return bool(set(Column(name, "s", np.empty(0)).words) & TIME_WORDS)


def is_dated(table: LogTable, name: str) -> bool:
    """Whether a column of time is one of dates or times of day, as texts."""
    try:
        table.numbers(name)
        return False
    except LogError:
        return True


def _rises(table: LogTable, name: str) -> bool:
    try:
        values = table.seconds(name)
    except LogError:
        return False
    steps = np.diff(values)
    return len(steps) > 0 and not np.isnan(steps).any() and float(np.mean(steps > 0)) > 0.98


def run_of(table: LogTable) -> str | None:
    """The column that tells the runs apart: named so, and constant over long parts."""
    return next((name for name in table.columns if _is_of_runs(name) and parts_of(table, name)), None)


def _is_of_runs(name: str) -> bool:
    return not _RUN.isdisjoint(Column(name, "", np.empty(0)).words)


def parts_of(table: LogTable, name: str) -> int:
    """How many different names a column has that is constant over long parts; 0 of any other one."""
    column = table.column(name)
    return _parts(column if isinstance(column, np.ndarray) else np.array(table.texts(name)))


def _parts(labels: Numbers) -> int:
    named = not np.any(np.isnan(labels) if labels.dtype.kind == "f" else labels == "")
    long = len(labels) > 1 and named and np.mean(labels[1:] == labels[:-1]) > 0.9
    return len(np.unique(labels)) if long else 0


def run_instead(table: LogTable, run: str, taken: Collection[str]) -> str | None:
    """The column, not one of those ``taken``, that may be meant by the ``run`` of a rig, where there is no
    such one: it has its name but for case or a letter, or one for runs, and tells several parts apart.
    What has a unit is a reading."""
    near = table.closest(run, taken, _NEAR)
    likely = [near] if near is not None else []
    likely += [name for name in table.columns if name not in taken and _is_of_runs(name)]
    bare = (name for name in likely if not (table.unit(name) or unit_named(name)))
    return next((name for name in bare if parts_of(table, name) > 1), None)


def runs_without_name(table: LogTable, taken: Collection[str], time: Array) -> tuple[str, int] | None:
    """What has no name and tells several parts apart, each in one place, and how many: a level of an index,
    by words for it, or else what became of one where it was kept or read without its name.

    Not one of the columns ``taken``, nor one that counts on with ``time`` (m,). Numbers behind other columns
    of a file are readings, for an index stands first.
    """
    found = {**table.unnamed, **_nameless(table, taken)}
    for words, column in found.items():
        numbers = _numbers(column)
        labels = np.array(column) if numbers is None else numbers
        parts = _parts(labels)
        at_once = parts == 1 + np.count_nonzero(labels[1:] != labels[:-1])
        if parts > 1 and at_once and (numbers is None or not _counts_on(numbers, time)):
            return words, parts
    return None


def _nameless(table: LogTable, taken: Collection[str]) -> dict[str, Sequence[str] | Array]:
    """The columns, not of those ``taken``, that have no name, by words."""
    found: dict[str, Sequence[str] | Array] = {}
    for name in table.columns:
        if name in taken or not _NAMELESS.fullmatch(name):
            continue
        column = table.column(name)
        column = column if isinstance(column, np.ndarray) else table.texts(name)
        behind = name.startswith("column ") and name != "column 1"
        if not behind or _numbers(column) is None:
            found[f"the column {name!r}"] = column
    return found


def _numbers(column: Sequence[str] | Array) -> Array | None:
    """Labels as numbers, None where one is none."""
    try:
        return np.asarray(column, dtype=float)
    except ValueError:
        return None


def _counts_on(labels: Array, time: Array) -> bool:
    """Whether labels are the time in coarser steps."""
    apart = (labels - labels[0]) - (time - time[0])
    return bool(np.all(np.abs(apart) <= np.max(np.abs(np.diff(labels)), initial=0.0)))


def points(column: Column) -> dict[str, float]:
    """How well a column suits each role."""
    words, kind = column.words, unit_of(column.unit)
    kinds = _KINDS.get(kind[0], {}) if kind else {}
    found = {}
    for role in SIGNALS:
        hits = [_LETTER if len(word) == 1 else _NAMED for word in words if word in _ROLE_WORDS[role]]
        found[role] = max(hits, default=0.0) + 0.5 * (len(hits) > 1) + kinds.get(role, 0.0)
    if set(words) & _EITHER:
        found = found | {role: found[role] + _MAYBE for role in ("command", "output")}
    if found["pressure"] and found["reference"] >= _NAMED:
        found["command"] += 4.0  # a set pressure is what the regulator is told
    if found["output"] and set(words) & _ROLE_WORDS["reference"]:
        found["reference"] += 1.5
    if found["output"] and set(words) & _ROLE_WORDS["curvature"]:
        found["curvature"] += 1.5
    if column.held:
        found["command"] += 1.0
        found["reference"] += 0.5
    else:
        found["command"] -= 1.0
        found["output"] += 0.5
    return found


@dataclass(frozen=True)
class Guess:
    """``column`` for a role; ``sure`` where its name or unit says so and no other column comes near;
    ``others`` that might be meant."""

    column: str
    sure: bool
    others: tuple[str, ...] = ()


def guessed(columns: Sequence[Column]) -> dict[str, Guess]:
    """The likeliest column of each role that has one: the assignment with the most points.

    An output is always found, and an input: without a name or a unit that tells, the held column, or the
    first, is the input, and the last the output.
    """
    from scipy.optimize import linear_sum_assignment  # takes longer to import than a log to read

    moving = [c for c in columns if c.moves]
    scores = np.array([[points(c)[role] for c in moving] for role in SIGNALS]).reshape(len(SIGNALS), -1)
    worth = np.maximum(scores - _LEAST, 0.0)
    taken = dict(zip(*(axis.tolist() for axis in linear_sum_assignment(-worth))))
    chosen = {SIGNALS[i]: j for i, j in taken.items() if worth[i, j] > 0.0}
    sure = {SIGNALS[i] for i, j in taken.items() if scores[i, j] >= _SURE}
    chosen = _completed(chosen, moving, scores)
    return {role: _guess(role, j, role in sure, chosen, moving, scores) for role, j in chosen.items()}


def _completed(chosen: Mapping[str, int], moving: Sequence[Column], scores: Array) -> dict[str, int]:
    """With an output and an input, from columns that have no role."""
    chosen = dict(chosen)
    if "output" not in chosen and "curvature" in chosen:
        chosen["output"] = chosen.pop("curvature")
    free = [j for j in range(len(moving)) if j not in chosen.values()]
    if free and not {"command", "pressure"} & set(chosen):
        held = [j for j in free if moving[j].held]
        chosen["command"] = (held or free)[0]
        free.remove(chosen["command"])
    if free and "output" not in chosen:
        chosen["output"] = max(free, key=lambda j: (scores[SIGNALS.index("output"), j], j))
    if "output" not in chosen and {"command", "pressure"} <= set(chosen):
        chosen["output"] = chosen.pop("pressure")  # the log of a regulator alone
    return {role: chosen[role] for role in SIGNALS if role in chosen}


def _guess(
    role: str, j: int, sure: bool, chosen: Mapping[str, int], moving: Sequence[Column], scores: Array
) -> Guess:
    own = scores[SIGNALS.index(role)]
    near = [
        k for k in range(len(moving)) if k not in chosen.values() and own[k] > max(_LEAST, own[j] - _CLOSE)
    ]
    return Guess(moving[j].name, sure and not near, tuple(moving[k].name for k in near))
