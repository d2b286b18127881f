"""Targets selected by their names, and the result of one as JSON carries it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from focgen.errors import check_choice


def selected(target: str | Sequence[str], choices: tuple[str, ...]) -> tuple[str, ...]:
    """The names that ``target`` stands for: itself, several, or with "all" each of ``choices``.

    Raises InputError for a name that is none of them.
    """
    names = choices if target == "all" else (target,) if isinstance(target, str) else tuple(target)
    for name in names:
        check_choice("--target", name, (*choices, "all"))
    return names


def entry_of(result: Any) -> dict[str, Any]:
    """A dataclass as JSON carries it: why it was ``skipped`` and nothing else, or all the rest."""
    if result.skipped is not None:
        return {"skipped": result.skipped}
    entry: dict[str, Any] = asdict(result)
    del entry["skipped"]
    return entry
