"""What one unit of each parameter is for this rig and these logs: levels by slot, clocks in seconds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.diagnosis.problem.candidates import References
from focgen.diagnosis.problem.segments import Segment
from focgen.logs.experiment import Experiment
from focgen.rig.engine import Chain
from focgen.rig.response import longest, response_time
from focgen.rig.rig import Rig


def references(rig: Rig, segment: Segment, logs: Sequence[Experiment]) -> References:
    """Levels where the segment's slots are, and clocks of rig and session."""
    return References(_levels(rig, segment, logs), clocks(rig, logs))


def _levels(rig: Rig, segment: Segment, logs: Sequence[Experiment]) -> dict[str, float]:
    """Measured where logged, else what the rig as given makes of the input; what leaves the actuator, else
    what the sensor must have read: a reading that stops stays below what the rig as given would reach."""
    taps: dict[str, np.ndarray] = {}
    Chain(rig).run(segment.fed.x, segment.stages[0], segment.stages[-1], segment.fed.run, tap=taps)
    made = {stage: _largest([part]) for stage, part in taps.items()}
    for stage, role in (("regulator", "pressure"), ("actuator", "curvature"), ("sensor", "output")):
        if all(role in log for log in logs):
            made[stage] = _largest([log[role] for log in logs])
    if "sensor" in made and not all("curvature" in log for log in logs):
        made["actuator"] = made["sensor"] / _gain(rig)
    entry, supply = segment.level_in, made.get("regulator", segment.level_in)
    response = made.get("actuator", segment.level_in)
    drive = _largest([rig.actuator.drive(np.linspace(0, supply, 50))]) if rig.actuator else supply
    return {
        "command": entry,
        "supply": supply,
        "chamber": supply,
        "load": supply,
        "drive": drive,
        "spring": response,
        "dynamics": response,
        "response": response,
        "place": response,
        "strain": response,
        "filter": made.get("sensor", segment.level_out),
        "reading": made.get("sensor", segment.level_out),
    }


def _gain(rig: Rig) -> float:
    """The sensor's, at rest; 1 where it has none."""
    gain = abs(rig.sensor.dc_gain) if rig.sensor else 1.0
    return gain if np.isfinite(gain) and gain > 0 else 1.0


def _largest(parts: Sequence[np.ndarray]) -> float:
    most = max(float(np.max(np.abs(p))) for p in parts)
    return most if np.isfinite(most) and most > 0 else 1.0


def clocks(rig: Rig, logs: Sequence[Experiment]) -> dict[str, float]:
    """``response``: 63 % of the nominal chain's step; ``record``: the longest experiment; ``session``: all;
    ``sample``."""
    h = min(log.sample_time for log in logs)
    record = longest(logs)
    begin = min(log.start for log in logs)
    session = max(log.start + len(log) * log.sample_time for log in logs) - begin
    return {"response": response_time(rig, h, record), "record": record, "session": session, "sample": h}
