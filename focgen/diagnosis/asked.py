"""Whether a diagnosis can be made of what was asked for: its options, and its experiments."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.diagnosis.controller.check import CONTROLLER_EFFECTS
from focgen.errors import FocgenError, InputError, LogError
from focgen.logs.experiment import Experiment, check_output
from focgen.rig.effects import library

EFFECTS = {*library(), *CONTROLLER_EFFECTS}


def usable(logs: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The experiments. Raises LogError where they lack a signal or samples, or have gaps."""
    for log in logs:
        check_output(log)
        if not any(role in log for role in ("command", "pressure")):
            raise LogError(
                log.name, "has neither command nor pressure", "name the column of the input in [signals]"
            )
        bad = [role for role, values in log.signals.items() if not np.all(np.isfinite(values))]
        if bad and bad[0] != "reference":
            raise LogError(log.name, f"has gaps in {bad[0]}", "cut them out with --from and --to")
    _check_one_input(logs)
    if sum(map(len, logs)) < 40:
        raise LogError(logs[0].name, "has too few samples to diagnose", "record at least 40 samples")
    return tuple(logs)


def _check_one_input(logs: Sequence[Experiment]) -> None:
    """Raise LogError where no input is in every log: a session has one."""
    for role in ("command", "pressure"):
        if all(role in log for log in logs):
            return
    log = next(log for log in logs if "command" not in log)
    remedy = "diagnose logs of a command and logs of a pressure apart, or record both in each"
    raise LogError(log.name, "has no command, which other logs have without a pressure", remedy)


def check_asked(only: Sequence[str] | None, bootstrap: int) -> None:
    """Raise InputError for so few sessions of a ``bootstrap`` that they set no threshold, FocgenError for an
    effect that nobody knows."""
    if bootstrap < 0 or bootstrap == 1:
        raise InputError("bootstrap", f"is {bootstrap}", "give at least 2 sessions, or 0 for none")
    for name in only or ():
        if name not in EFFECTS:
            raise FocgenError(name, "is no effect of the library", f"known: {', '.join(sorted(EFFECTS))}")
