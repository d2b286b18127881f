"""A fractional actuator that idles at a level between its logs, made here by its full history.

Red when what it remembers of the logs before, and of the time between them, is taken for an effect.
"""

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.logs.read import in_session_order
from focgen.rig.rig import Actuator, Rig, Signals

H, LAG, NOISE = 0.05, 0.1, 0.06


def lagged(x, time):
    y, made = x[0], np.empty_like(x)
    keep = np.exp(-H / time)
    for k, v in enumerate(x):
        y = keep * y + (1 - keep) * v
        made[k] = y
    return made


def remembered(x, T, alpha):
    """T D^alpha y + y = x by Grünwald and Letnikov's sum over all samples, from a rest at the first one."""
    weights = np.cumprod(np.r_[1.0, 1 - (alpha + 1) / np.arange(1, len(x))])
    c, y, off = T * H**-alpha, np.zeros(len(x)), x - x[0]
    for k in range(len(x)):
        y[k] = (off[k] - c * (weights[1 : k + 1] @ y[:k][::-1])) / (1 + c)
    return y + x[0]


def session(seed):
    """A command of holds and what is read, with which of four logs (−1: of none) each sample is in."""
    rng, u, of = np.random.default_rng(seed), [], []
    alpha, T, idle = rng.uniform(0.5, 0.7), rng.uniform(0.5, 2.0), rng.choice([0.15, 0.3])

    def hold(level, seconds, log):
        count = int(seconds / H)
        u.extend([level] * count)
        of.extend([log] * count)

    for log in range(4):
        for _ in range(4 if log == 0 else 0):
            hold(rng.uniform(0.1, 1.0), rng.uniform(3.0, 15.0), -1)
        hold(idle, rng.uniform(2.0, 12.0), -1)
        hold(idle, 1.0, log)
        for _ in range(8):
            hold(rng.uniform(0.1, 1.0), rng.uniform(4.0, 12.0), log)
        hold(idle, 4.0, log)
    y = 10.0 * remembered(lagged(np.array(u), LAG), T, alpha)
    return np.array(u), y + NOISE * rng.standard_normal(len(y)), np.array(of), (T, alpha)


def found_in(seed, clock):
    u, y, of, (T, alpha) = session(seed)
    rig = Rig(
        "finger",
        H,
        Signals("t", "y", command="u"),
        Actuator(1.06 * T, alpha, (9.7,)),
        regulator=TransferFunction([(1.0, 0.0)], [(LAG, 1.0), (1.0, 0.0)]),
    )
    starts = [int(np.argmax(of == log)) * H for log in range(4)]
    logs = [
        Experiment(f"run {k}", H, {"command": u[of == k], "output": y[of == k]}, start=start)
        for k, start in enumerate(starts)
    ]
    if clock != "one":
        logs = in_session_order([Experiment(log.name, H, log.signals) for log in logs])
    return diagnose(rig, logs, pictures=False)


@pytest.mark.parametrize("clock", [pytest.param("one", marks=pytest.mark.long), "of its own"])
@pytest.mark.parametrize("seed", [1, pytest.param(11, marks=pytest.mark.long)])
def test_a_healthy_actuator_that_idled_at_a_level_leaves_the_noise(seed, clock):
    found = found_in(seed, clock)
    assert not found.causes
    assert found.verdict == "parameters"
    assert found.gap.refitted < 1.3 * found.gap.floor


@pytest.mark.long
@pytest.mark.parametrize("clock", ["one", "of its own"])
@pytest.mark.parametrize("seed", [2, 3, *range(4, 11), 12])
def test_no_healthy_actuator_is_at_fault(seed, clock):
    found = found_in(seed, clock)
    assert not found.causes
    assert found.gap.refitted < 1.6 * found.gap.floor
