"""What a step response is judged by: settling time, overshoot, steady error."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Array

BAND = 0.05
_TAIL = 0.1  # of the record: what happens there is called steady


@dataclass(frozen=True)
class StepMeasures:
    """``settling_s``: when the output is within ±5 % of the step for good, s; NaN where it is not for at
    least the record's last tenth. ``overshoot_pct``: past the set point, in percent of the step.
    ``steady_error``: set point minus the mean of the record's last tenth, in output units.
    """

    settling_s: float
    overshoot_pct: float
    steady_error: float

    @property
    def settled(self) -> bool:
        """Whether the output stayed within the band."""
        return math.isfinite(self.settling_s)


def measure_step(
    output: ArrayLike, sample_time: float, start: float, target: float, band: float = BAND
) -> StepMeasures:
    """Judge the ``output``, shape (n,), after a step of the set point at sample 0 from ``start`` to
    ``target``.

    Between samples the output is taken as straight. Raises ValueError where ``target`` equals ``start``.
    """
    if target == start:
        raise ValueError("the set point does not move")
    progress = (np.asarray(output, dtype=float) - start) / (target - start)
    tail = progress[-max(1, round(_TAIL * len(progress))) :]
    return StepMeasures(
        settling_s=_settling(progress, band) * sample_time,
        overshoot_pct=100.0 * max(0.0, float(progress.max()) - 1.0),
        steady_error=float((1.0 - tail.mean()) * (target - start)),
    )


def _settling(progress: Array, band: float) -> float:
    """Return the place, in samples, where ``progress`` enters 1 ± ``band`` for the last time."""
    away = np.abs(progress - 1.0)
    outside = np.flatnonzero(~(away <= band))
    if len(outside) == 0:
        return 0.0
    last = int(outside[-1])
    if last + 1 >= len(away) - round(_TAIL * len(away)):
        return math.nan
    # where the band is crossed whole between two samples, what counts is the side it is entered from
    edge = 1.0 + band if progress[last] > 1.0 else 1.0 - band
    return last + float((edge - progress[last]) / (progress[last + 1] - progress[last]))
