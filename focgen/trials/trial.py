"""``focgen trial make|run|score`` as one function."""

from __future__ import annotations

from pathlib import Path

from focgen.errors import InputError
from focgen.trials.make import Made, make
from focgen.trials.run import Ran, run
from focgen.trials.score import Scores, score

ACTIONS = {"make": make, "run": run, "score": score}


def trial(action: str, folder: str | Path, **options) -> Made | Ran | Scores:
    """Make sealed cases in a folder, diagnose them blind, or unseal and score them.

    ``options`` are those of :func:`focgen.trials.make.make`, :func:`focgen.trials.run.run` and
    :func:`focgen.trials.score.score`. Raises InputError for an action that is none of the three, and as those
    do.
    """
    if action not in ACTIONS:
        raise InputError("trial", f"has no action {action!r}", f"choose one of {', '.join(ACTIONS)}")
    return ACTIONS[action](folder, **options)
