"""How fast a rig is, and whether it comes to rest."""

from __future__ import annotations

import numpy as np

from focgen.rig.effects import Run
from focgen.rig.engine import Chain
from focgen.rig.rig import LinearActuator, Rig


def response_time(rig: Rig, h: float, record: float) -> float:
    """When the nominal chain's response to a step passes 63 % of its value at a third of the record, in s; of
    a rig that integrates, when its rate does, for its response never settles."""
    count = int(min(max(record / h / 3, 20), 20_000))
    span = max(record / 3 / count, h)
    run = Run.of([count + 1], [0.0], span)
    y = Chain(rig).run(np.r_[0.0, np.ones(count)], "regulator", "sensor", run)
    y = np.diff(y - y[0], integrations(rig))
    passed = np.abs(y) >= 0.63 * abs(y[-1])
    return float(np.clip(span * max(int(np.argmax(passed)), 1), 3 * h, record / 3))


def integrations(rig: Rig) -> int:
    """How often the rig integrates its input: 0 where a constant one brings it to rest."""
    stages = [rig.regulator, rig.sensor]
    if isinstance(rig.actuator, LinearActuator):
        stages.append(rig.actuator.dynamics)
    return sum(int(min(t.order for t in s.den)) - int(min(t.order for t in s.num)) for s in stages)
