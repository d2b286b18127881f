"""What a set of logs cannot show, said before anybody relies on it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.identification.excitation import Excitation
from focgen.identification.model import ExperimentFit

_FALL = 0.5  # of the step: the input comes nearer to 0 by at least this in a release
_WIDE = 0.3  # of a parameter: an interval wider than this says little


def warnings_of(excitations: Sequence[Excitation], fits: Sequence[ExperimentFit]) -> tuple[str, ...]:
    """The warnings that apply, most important first."""
    found = []
    if not any(_releases(x) for x in excitations):
        found.append(
            "positive steps only: whether the actuator unloads as it loads, and its hysteresis, cannot be "
            "seen; log the releases too, and a slow sine"
        )
    levels = np.array([x.loaded for x in excitations])
    rising = len(levels) > 2 and bool(np.all(np.diff(levels) > 0.0))
    if rising:
        found.append(
            "the levels rise from run to run: a gain that grows with the level cannot be told from one that "
            "grows with every load; shuffle them, or repeat the first at the end"
        )
    found += [
        f"{f.name}: {key} is known to ±{_half(f, key):.0%} only; hold the step longer or lower the noise"
        for f in fits
        for key in ("K", "T", "alpha")
        if _half(f, key) > _WIDE
    ]
    return tuple(found)


def _releases(x: Excitation) -> bool:
    """Whether the input comes back towards 0 in the log, for more than a single last sample."""
    size = np.abs(np.concatenate([[x.before], x.pressure]))
    fallen = np.maximum.accumulate(size) - size >= _FALL * abs(x.level - x.before)
    return bool(x.level != x.before and np.count_nonzero(fallen) > 1)


def _half(fit: ExperimentFit, key: str) -> float:
    low, high = fit.ci95[key]
    return abs((high - low) / 2.0 / getattr(fit, key))
