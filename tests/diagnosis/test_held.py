"""A pump that loses what it holds in a thousand response times.

Red when its volume is looked at over a few response times only, in which next to nothing is lost.
"""

from itertools import pairwise

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import LinearActuator, Rig, Signals

H, GAIN, LAG, NOISE, PARTS = 0.05, 0.9, 0.3, 0.012, 20
RIG = Rig(
    "arm",
    H,
    Signals("t", "y", command="u", pressure="v"),
    LinearActuator(TransferFunction([(0.95, 0.0)], [(0.32, 1.0), (1.0, 0.0)])),
    TransferFunction([(GAIN, 0.0)], [(1.0, 1.0)]),
)


def session(seed, rate):
    """Three logs of 60 s of strokes both ways, made in steps: a leak of ``rate``, 1/s, of what is held."""
    rng, volume, angle, found = np.random.default_rng(seed), 0.0, 0.0, []
    for log in range(3):
        level = np.r_[0.0, rng.uniform(-6.0, 6.0, 11)]
        flow = np.concatenate([[0.0] * 20, *(np.r_[np.full(20, v), np.zeros(80)] for v in np.diff(level))])
        made = []
        for q, then in pairwise([*flow, 0.0]):
            made.append((volume, angle))
            for j in range(PARTS):
                h = H / PARTS
                volume += h * (GAIN * (q + (then - q) * (j + 0.5) / PARTS) - rate * volume)
                angle += h * (volume - angle) / LAG
        read = np.array(made) + NOISE * 6.0 * rng.standard_normal((len(flow), 2))
        signals = {"command": flow, "pressure": read[:, 0], "output": read[:, 1]}
        found.append(Experiment(f"run {log}", H, signals, start=log * H * len(flow)))
    return found


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.long)])
def test_a_leak_of_a_third_of_a_percent_in_a_second_is_found(seed):
    found = diagnose(RIG, session(seed, 0.003), pictures=False)
    (cause,) = found.causes
    first = cause.candidates[0]
    assert first.effect == "leak"
    assert first.confidence > 0.9
    assert first.parameters["rate"].value == pytest.approx(0.003, rel=0.15)


@pytest.mark.parametrize("seed", [0, *(pytest.param(s, marks=pytest.mark.long) for s in range(1, 4))])
def test_a_tight_pump_loses_nothing(seed):
    assert diagnose(RIG, session(seed, 0.0), pictures=False).verdict in ("none", "parameters")
