"""Logs that lack a signal which others of their session have, where no stage of the rig stands for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.errors import FitError
from focgen.logs.experiment import Experiment
from focgen.logs.notes import listed
from focgen.logs.scales import known, same
from focgen.rig.rig import UNITY, Rig

_APART = 2.0  # times: two signals whose sizes differ by more are not the same quantity
_ENDS = (("regulator", "command", "pressure"), ("sensor", "output", "curvature"))


def check_alike(experiments: Sequence[Experiment], rig: Rig) -> None:
    """Raise FitError where some logs lack the pressure, or the curvature, and would be fitted by another
    quantity as it stands: by the command in volts, as a pressure in bar."""
    for stage, own, meant in _ENDS:
        lacking = [e.name for e in experiments if meant not in e and own in e]
        there = [e for e in experiments if meant in e]
        if (
            getattr(rig, stage) != UNITY
            or not lacking
            or not there
            or not _differ(experiments, rig, own, meant)
        ):
            continue
        verb = "lacks" if len(lacking) == 1 else "lack"
        what = f"{verb} the {meant} that other logs have, and no [{stage}] of the rig tells it from the {own}"
        remedy = f"identify it with --stages {stage},actuator, or leave out logs without the {meant}"
        raise FitError(listed(lacking), what, remedy)


def _differ(experiments: Sequence[Experiment], rig: Rig, one: str, other: str) -> bool:
    """Whether two signals are not the same quantity: by their units, or by their sizes in logs of both."""
    units = [rig.signals.unit_of(role) for role in (one, other)]
    if all(unit and known(unit) for unit in units):
        return not same(*units)
    both = [e for e in experiments if one in e and other in e] or experiments
    sizes = [max(float(np.abs(e[role]).max()) for e in both if role in e) for role in (one, other)]
    return max(sizes) > _APART * min(sizes)
