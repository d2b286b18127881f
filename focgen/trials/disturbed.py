"""The cases of the suite "full" once more, with what every bench has: stages that are a little off, and logs
that begin when somebody pressed the button.

Only what is given of a case changes, the rig file or the logs; the true rig, what it does, and the logs that
stay sealed are the same, so that both can be compared case by case.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import Relative, Rig, Uncertainty
from focgen.trials.cases import Case

DISTURBED = ("off", "begun", "sound")
_SOUND = Relative(0.03, 0.2)  # what gain and times of a healthy rig are off by at most: twice what is usual
_CUT = (0.2, 8.0)  # s after the input first moves


def disturbed(case: Case, suite: str, rng: np.random.Generator) -> Case:
    """The case as ``suite`` gives it: ``off``, ``begun`` or ``sound``."""
    if suite == "begun":
        return begun(case, rng)
    return replace(case, rig=off(case.rig, rng, _SOUND if suite == "sound" else None))


def off(rig: Rig, rng: np.random.Generator, at_most: Relative | None = None) -> Rig:
    """The nominal rig with gain and times of regulator and sensor off, by as much as is uncertain of them or
    ``at_most``."""
    stages: dict[str, Any] = {}
    for name in ("regulator", "sensor"):
        known = at_most or getattr(Uncertainty(), name)
        gain, time = (1.0 + part * rng.uniform(-1.0, 1.0) for part in (known.gain, known.time))
        stages[name] = _scaled(getattr(rig, name), gain, time)
    return replace(rig, **stages)


def _scaled(stage: TransferFunction, gain: float, time: float) -> TransferFunction:
    """``gain`` times the stage, all of whose times are ``time`` as long: s becomes ``time`` s."""
    num = [(gain * c * time**order, order) for c, order in stage.num]
    return TransferFunction(num, [(c * time**order, order) for c, order in stage.den])


def begun(case: Case, rng: np.random.Generator) -> Case:
    """With half of the logs cut in a transient."""
    logs = [
        (name, _cut(columns, case.recorder.absolute, rng) if rng.random() < 0.5 else columns)
        for name, columns in case.logs
    ]
    return replace(case, logs=logs)


def _cut(columns: dict[str, Any], absolute: bool, rng: np.random.Generator) -> dict[str, Any]:
    """What is left of a log (by column, (n,)) from a moment after its input first moved; at least half."""
    time, command = columns["time"], columns["command"]
    moves = int(np.argmax(command != command[0]))
    begin = min(np.searchsorted(time, time[moves] + rng.uniform(*_CUT)), len(time) // 2)
    left = {name: values[begin:] for name, values in columns.items()}
    return left if absolute else left | {"time": left["time"] - left["time"][0]}
