"""A command that goes straight into an actuator of real order is held between its samples, and jumps.

Red when half a sample of it is left over, or passes for an effect: a low order answers a jump at once, so a
line from sample to sample leaves several per cent of the output behind every one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, Rig, Signals

HOLD, LEVELS, LOGS = 100, 8, 4
SIGNALS = Signals("t", "y", "u")


def staircases(seed: int, alpha: float, noise: float) -> tuple[Rig, list[Experiment]]:
    """A rig of this order, each of its numbers up to 8 % off, and four logs of random levels."""
    rng = np.random.default_rng(seed)
    T, gain = rng.uniform(0.5, 3.0), (rng.uniform(0.5, 2.0), rng.uniform(-0.1, 0.1))
    step = 0.1 * T ** (1.0 / alpha)
    plant = TransferFunction([(1.0, 0.0)], [(T, alpha), (1.0, 0.0)])
    logs = []
    for i in range(LOGS):
        command = np.repeat(np.r_[0.0, rng.uniform(0.0, 3.0, LEVELS - 1)], HOLD)
        made = Convolution(plant, step, "zero").run((gain[0] + gain[1] * command) * command)
        read = made + rng.normal(0.0, noise * np.ptp(made), len(made))
        logs.append(Experiment(f"e{i}", step, {"command": command, "output": read}))
    off = rng.uniform(0.92, 1.08, 3)
    given = Actuator(T * off[0], alpha * (1.0 + 0.5 * (off[1] - 1.0)), tuple(off[2] * g for g in gain))
    return Rig("coil", step, SIGNALS, given), logs


CASES = [
    (0, 0.5, 0.003),
    *(pytest.param(s, 0.4 + 0.1 * s, 0.003, marks=pytest.mark.long) for s in range(1, 4)),
]


@pytest.mark.parametrize("seed, alpha, noise", CASES)
def test_a_healthy_rig_of_real_order_is_healthy(seed, alpha, noise):
    rig, logs = staircases(seed, alpha, noise)
    found = diagnose(rig, logs, pictures=False)
    assert found.causes == () and found.verdict in ("none", "parameters")
    assert found.gap.refitted < 1.05 * noise * np.ptp(np.concatenate([log["output"] for log in logs]))


@pytest.mark.parametrize("seed", [0, *(pytest.param(s, marks=pytest.mark.long) for s in range(1, 4))])
def test_a_pressure_that_jumps_and_rests_is_held_as_well(seed):
    """Its gauge's noise is none of what drives the rig: a loop that takes it away is no loop of the rig."""
    rig, logs = staircases(seed, 0.5 + 0.1 * seed, 0.003)
    rng = np.random.default_rng(seed)
    read = [log["command"] + rng.normal(0.0, 0.02, len(log)) for log in logs]
    logs = [
        Experiment(log.name, log.sample_time, {"pressure": p, "output": log["output"]})
        for log, p in zip(logs, read)
    ]
    found = diagnose(replace(rig, signals=Signals("t", "y", pressure="u")), logs, pictures=False)
    assert found.causes == () and found.verdict in ("none", "parameters")
    assert found.gap.refitted < 1.1 * found.gap.floor
