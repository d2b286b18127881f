"""How fast a rig is."""

from __future__ import annotations

import numpy as np

from focgen.rig.effects import Run
from focgen.rig.engine import Chain
from focgen.rig.model import Rig


def response_time(rig: Rig, h: float, record: float) -> float:
    """When the nominal chain's response to a step passes 63 % of its value at a third of the record, in s."""
    count = int(min(max(record / h / 3, 20), 20_000))
    span = max(record / 3 / count, h)
    run = Run.of([count + 1], [0.0], span)
    y = Chain(rig).run(np.r_[0.0, np.ones(count)], "regulator", "sensor", run)
    y = y - y[0]
    passed = np.abs(y) >= 0.63 * abs(y[-1])
    return float(np.clip(span * max(int(np.argmax(passed)), 1), 3 * h, record / 3))
