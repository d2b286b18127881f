"""``focgen trial make|run|score`` as one function."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, overload

from focgen.errors import InputError
from focgen.trials.make import Made, make
from focgen.trials.run import Ran, run
from focgen.trials.score import Summary, score

ACTIONS: dict[str, Callable[..., Any]] = {"make": make, "run": run, "score": score}


@overload
def trial(
    action: Literal["make"],
    folder: str | Path,
    /,
    *,
    cases: int = 200,
    seed: int = 0,
    signals: str = "C",
    suite: str = "full",
    kinds: tuple[str, ...] | None = None,
) -> Made: ...


@overload
def trial(
    action: Literal["run"],
    /,
    *folders: str | Path,
    jobs: int | None = None,
    limit: float = 900.0,
    minutes: float | None = None,
) -> Ran: ...


@overload
def trial(
    action: Literal["score"],
    /,
    *folders: str | Path,
    oracle: bool = False,
    proposals: bool = False,
    baseline: bool = True,
    partial: bool = False,
    jobs: int | None = None,
) -> Summary: ...


def trial(action: str, *folders: str | Path, **options: Any) -> Made | Ran | Summary:
    """Make sealed cases in a folder, diagnose those of one or more folders blind, or unseal and score them.

    ``options`` are those of :func:`focgen.trials.make.make`, :func:`focgen.trials.run.run` and
    :func:`focgen.trials.score.score`. Raises InputError for an action that is none of the three, for a number
    of folders that makes no sense, and as those do.
    """
    if action not in ACTIONS:
        raise InputError("trial", f"has no action {action!r}", f"choose one of {', '.join(ACTIONS)}")
    if not folders or (action == "make" and len(folders) > 1):
        raise InputError(f"trial {action}", f"got {len(folders)} folders", "give one")
    found: Made | Ran | Summary = ACTIONS[action](*folders, **options)
    return found
