"""The scores as tables: of one set for a terminal, of several side by side, and as Markdown."""

from __future__ import annotations

from collections.abc import Sequence

from focgen.trials.rows import BESIDE, Row
from focgen.trials.score import Scores

_NAME = 46  # characters


def table(found: Sequence[Row]) -> str:
    """One set: every row with interval, cases, target, and what others score."""
    others = [name for name in BESIDE if any(name in row.beside for row in found)]
    head = f"{'score':{_NAME}s} {'value':>7s}  {'90 % interval':17s} {'cases':>5s}  {'reach':12s}"
    lines = [head + "".join(f"{name:>13s}" for name in others)]
    for row in found:
        spread = f"[{row.interval[0]:.3f}, {row.interval[1]:.3f}]" if row.interval else ""
        beside = "".join(f"{_number(row.beside.get(name), ''):>13s}" for name in others)
        line = f"{row.name:{_NAME}s} {_number(row.value):>7s}  {spread:17s} {row.cases:5d}  {_reach(row):12s}"
        lines.append((line + beside).rstrip())
    return "\n".join(lines)


def _number(value: float | None, none: str = "–") -> str:
    return none if value is None else f"{value:.3f}"


def _reach(row: Row) -> str:
    return row.target + (" missed" if row.reached is False else "")


def title(scores: Scores) -> str:
    """Which set, and what of it was diagnosed."""
    text = f"signals {scores.signals}, suite {scores.suite}, seed {scores.seed}: {scores.cases} cases"
    text += f", {scores.failed} without a diagnosis" if scores.failed else ""
    return text + (f"; {scores.waiting} more not yet diagnosed, left out" if scores.waiting else "")


def overview(sets: Sequence[Scores]) -> str:
    """The rows that have a target, one column a set; ``!`` marks what is missed."""
    columns = [f"{s.signals} {s.suite}" for s in sets]
    lines = [f"{'score':{_NAME}s}" + "".join(f"{c:>22s}" for c in columns)]
    for rows in zip(*(s.rows for s in sets)):
        if rows[0].target:
            lines.append(f"{rows[0].name:{_NAME}s}" + "".join(f"{_cell(row):>22s}" for row in rows))
    return "\n".join(lines)


def _cell(row: Row) -> str:
    mark = " !" if row.reached is False else "  "
    return f"{_number(row.value)} ({row.target})" + mark if row.value is not None else "–  "


def full_text(sets: Sequence[Scores]) -> str:
    """Everything: the overview where there are several sets, then each."""
    each = [f"{title(s)}\n{table(s.rows)}" for s in sets]
    return "\n\n".join([overview(sets), *each] if len(sets) > 1 else each)


# ---- Markdown ----


def markdown(sets: Sequence[Scores]) -> str:
    """One table for every suite, the signal sets side by side; missed targets are marked by a †."""
    suites = dict.fromkeys(s.suite for s in sets)
    return "\n".join(_suite([s for s in sets if s.suite == suite]) for suite in suites)


def _suite(sets: Sequence[Scores]) -> str:
    lines = [f"### Suite `{sets[0].suite}`", ""]
    lines += [f"- {title(s)}" for s in sets]
    lines += ["", "| score | reach | " + " | ".join(s.signals for s in sets) + " |"]
    lines.append("|---|---|" + "---|" * len(sets))
    for rows in zip(*(s.rows for s in sets)):
        if any(row.value is not None for row in rows):
            lines.append(_line(rows[0].name.strip(), _targets(rows), [_figures(row) for row in rows]))
        for other in BESIDE:
            if any(other in row.beside for row in rows):
                cells = [_number(row.beside.get(other)) for row in rows]
                lines.append(_line(f"… by {_OTHERS[other]}", "", cells))
    return "\n".join([*lines, ""])


_OTHERS = {"correlation": "residual correlation", "best fit": "plain best fit", "oracle": "the oracle"}


def _line(name: str, target: str, cells: Sequence[str]) -> str:
    return f"| {name} | {target} | " + " | ".join(cells) + " |"


def _targets(rows: Sequence[Row]) -> str:
    several = list(dict.fromkeys(row.target for row in rows))
    return several[0] if len(several) == 1 else " / ".join(several)


def _figures(row: Row) -> str:
    if row.value is None:
        return "–"
    spread = f" [{row.interval[0]:.2f}, {row.interval[1]:.2f}]" if row.interval else ""
    mark = " †" if row.reached is False else ""
    return f"**{row.value:.3f}**{mark}{spread} n = {row.cases}"
