"""How large the signals of a session are, which of them tell of a past, and how fast its rig is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from focgen.logs.experiment import Experiment
from focgen.rig.response import response_time
from focgen.rig.rig import Rig
from focgen.rig.stages import ENTERS, LEAVES, STAGES

_ROLES = ("command", "pressure", "curvature", "output")


@dataclass(frozen=True)
class Magnitudes:
    """Of a session: by role a signal's ``ranges`` with 0 in it and ``sizes``, its largest magnitude;
    ``pace``: the rig's response time, s."""

    ranges: Mapping[str, tuple[float, float]]
    sizes: Mapping[str, float]
    pace: float

    @classmethod
    def of(cls, rig: Rig, logs: Sequence[Experiment]) -> Magnitudes:
        """Those of the logs of a rig."""
        ranges = {role: _range(logs, role) for role in _ROLES if all(role in log for log in logs)}
        sizes = {role: max(-low, high) or 1.0 for role, (low, high) in ranges.items()}
        longest = max(len(log) * log.sample_time for log in logs)
        return cls(ranges, sizes, response_time(rig, logs[0].sample_time, longest))

    def behind(self, entry: str) -> dict[str, str]:
        """The measured signals that tell what an input was before, by the stage that they leave.

        The first input of a log runs through all stages, and all that is measured tells of it. One in between
        is simulated up to the next measured signal: what a gauge further on shows may be that one's fault.
        """
        stages = STAGES[STAGES.index(ENTERS[entry]) :]
        found = {stage: LEAVES[stage] for stage in stages if LEAVES[stage] in self.sizes}
        first = next(role for role in ENTERS if role in self.sizes)
        return found if entry == first else dict(list(found.items())[:1])


def _range(logs: Sequence[Experiment], role: str) -> tuple[float, float]:
    ends = [(float(np.min(log[role])), float(np.max(log[role]))) for log in logs]
    return min(0.0, *(low for low, _ in ends)), max(0.0, *(high for _, high in ends))
