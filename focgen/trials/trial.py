"""``focgen trial make|run|score`` as one function."""

from __future__ import annotations

from pathlib import Path

from focgen.errors import InputError
from focgen.trials.make import Made, make
from focgen.trials.run import Ran, run
from focgen.trials.score import Summary, score

ACTIONS = {"make": make, "run": run, "score": score}


def trial(action: str, *folders: str | Path, **options) -> Made | Ran | Summary:
    """Make sealed cases in a folder, diagnose those of one or more folders blind, or unseal and score them.

    ``options`` are those of :func:`focgen.trials.make.make`, :func:`focgen.trials.run.run` and
    :func:`focgen.trials.score.score`. Raises InputError for an action that is none of the three, for a number
    of folders that makes no sense, and as those do.
    """
    if action not in ACTIONS:
        raise InputError("trial", f"has no action {action!r}", f"choose one of {', '.join(ACTIONS)}")
    if not folders or (action == "make" and len(folders) > 1):
        raise InputError(f"trial {action}", f"got {len(folders)} folders", "give one")
    return ACTIONS[action](*folders, **options)
