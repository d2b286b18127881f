"""A creep far slower than its logs are long, made here step by step: three or four short logs in a row.

Red when every log is taken to begin without what the earlier ones left, so that the creep is lost to a drift.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.recalled import all_ahead
from focgen.rig.rig import LinearActuator, Rig, Signals

H, LAG, NOISE, REST, PARTS = 0.05, 0.2, 0.004, 60, 5


def session(seed, share, slow):
    """Four logs of 27 s, with rests of 3 s at 0 between them, of one lag with a Kelvin-Voigt element."""
    rng, y, crept, found, start = np.random.default_rng(seed), 0.0, 0.0, [], 0.0
    for log in range(4):
        p = np.r_[np.zeros(5), np.repeat(rng.uniform(0.2, 1.0, 8), 60), np.zeros(60 + REST)]
        made = []
        for x, then in zip(p, np.r_[p[1:], 0.0]):  # the pressure runs in lines
            made.append(y + crept)
            for j in range(PARTS):
                y += H / PARTS * (2.0 * (x + (then - x) * (j + 0.5) / PARTS) - y) / LAG
                crept += H / PARTS * (share * y - crept) / slow
        count = len(p) - REST
        output = np.array(made[:count]) + NOISE * rng.standard_normal(count)
        found.append(Experiment(f"run {log}", H, {"pressure": p[:count], "output": output}, start=start))
        start += H * len(p)
    return found


RIG = Rig(
    "beam",
    H,
    Signals("t", "y", pressure="p"),
    LinearActuator(TransferFunction([(2.1, 0.0)], [(0.21, 1.0), (1.0, 0.0)])),
)


def with_own_clocks(logs):
    """As a folder of logs is read whose clocks all begin at 0: one after the other, the rests unknown."""
    ahead = np.cumsum([0.0, *(H * len(log) for log in logs[:-1])])
    return [replace(log, start=float(t), paused=n > 0) for n, (log, t) in enumerate(zip(logs, ahead))]


@pytest.mark.parametrize(
    ("seed", "share", "slow", "clocks"),
    [
        pytest.param(1, 0.68, 135.0, list, marks=pytest.mark.long),
        (3, 0.4, 60.0, list),
        pytest.param(1, 0.68, 135.0, with_own_clocks, marks=pytest.mark.long),
    ],
)
def test_a_creep_slower_than_the_logs_is_no_drift(seed, share, slow, clocks):
    found = diagnose(RIG, clocks(session(seed, share, slow)), pictures=False)
    (cause,) = found.causes
    assert cause.candidates[0].effect == "creep"
    assert found.gap.explained < 1.3 * NOISE


def test_a_night_is_not_put_ahead():
    logs = session(1, 0.4, 60.0)
    later = Experiment("later", H, logs[3].signals, start=logs[3].start + 40_000.0)
    (ahead,) = all_ahead(RIG, [*logs[:3], later])
    begins = [log.before("pressure").after for log in ahead]
    assert begins == pytest.approx([None, REST * H + H, REST * H + H, None], nan_ok=True)
