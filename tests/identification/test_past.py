"""A past is estimated where the data ask for one, and nowhere else.

Red when noise or a simplified model passes for something that was before the first sample, or a log that
begins in a transient is fitted as if it had begun at rest.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import TransferFunction
from focgen.identification.identify import identify
from focgen.identification.past import asks_for_past
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, Rig, Signals

H, FINER = 0.05, 10  # s between samples; the rig runs in so many parts of one
T, ALPHA, GAIN = 1.5, 0.8, (2.0, 0.3)
VALVE = TransferFunction([(0.5, 0.0)], [(0.3, 1.0), (1.0, 0.0)])
HEATER = TransferFunction([(1.0, 0.0)], [(T, ALPHA), (1.0, 0.0)])
SIGNALS = Signals("t", "k", None, "p", "k")
LIKELY = Rig("heater", H, SIGNALS, Actuator(1.3, 0.9, (2.2, 0.2)))


def heated(name, voltage, rng, first=0.0) -> Experiment:
    """What a heater's flow and warmth do by ``voltage`` (n,) in parts of a sample, logged from ``first`` s
    on."""
    flow = Convolution(VALVE, H / FINER, "zero").run(voltage)
    warmth = Convolution(HEATER, H / FINER, "linear").run((GAIN[0] + GAIN[1] * flow) * flow)
    logged = slice(round(first * FINER / H), None, FINER)
    noise = {"pressure": 0.002, "curvature": 0.005}
    exact = {"pressure": flow[logged], "curvature": warmth[logged]}
    signals = {role: v + rng.normal(0.0, noise[role], len(v)) for role, v in exact.items()}
    return Experiment(name, H, {**signals, "output": signals["curvature"]})


def pressed(level, begin, end, seconds) -> np.ndarray:
    """``level`` from ``begin`` to ``end`` s."""
    time = np.arange(round(seconds * FINER / H)) * H / FINER
    return level * ((time >= begin) & (time < end)).astype(float)


@cache
def rested(seed):
    """Four steps, each after a second of rest."""
    rng = np.random.default_rng(seed)
    logs = [heated(f"s{level}", pressed(level, 1.0, 99.0, 25.0), rng) for level in (1, 2, 3, 4)]
    return identify(LIKELY, logs, integer=False)


@pytest.mark.parametrize("seed", [3, 19])
def test_experiments_that_begin_at_rest_have_no_past(seed):
    found = rested(seed)
    assert found.joint.pasts == {} and not any("transient" in note for note in found.notes)
    for fit, level in zip(found.experiments, (1, 2, 3, 4)):
        truth = GAIN[0] + 0.5 * GAIN[1] * level
        low, high = fit.ci95["K"]
        assert fit.K == pytest.approx(truth, rel=5e-3) and high - low < 0.02 * truth


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.long)])
def test_what_a_pulse_before_the_first_sample_left_is_told(seed):
    """Cut while the input rests again and the warmth still goes."""
    rng = np.random.default_rng(seed)
    rest = heated("rest", pressed(2.0, 1.0, 10.0, 20.0), rng)
    before = pressed(4.0, 1.0, 2.5, 24.0) + pressed(4.0, 6.0, 15.0, 24.0)
    cut = heated("cut", before, rng, first=3.5)
    found = identify(LIKELY, [rest, cut], integer=False)
    assert set(found.joint.pasts) == {"cut"}
    assert found.joint.T == pytest.approx(T, rel=0.01) and found.joint.alpha == pytest.approx(ALPHA, rel=0.01)
    assert found.experiments[1].K == pytest.approx(GAIN[0] + 2.0 * GAIN[1], rel=0.02)


def wandering(rng, first):
    """White noise with a drift that only goes from sample ``first`` on, (200,)."""
    place = np.maximum(np.arange(200) - first, 0) / 200.0
    return rng.normal(0.0, 1.0, 200) + 1.5 * place


def test_what_wanders_only_after_the_input_has_moved_is_no_past():
    """An output that rests for 40 samples and then wanders: only the rest tells it from a past."""
    made = np.exp(-np.arange(200) / np.array([[60.0], [120.0], [400.0]]))
    answer = 100.0 * np.maximum(np.arange(200) - 40, 0)
    residual = wandering(np.random.default_rng(5), 40)
    assert not asks_for_past(residual, made, 100.0, answer)
    assert asks_for_past(residual, made, 100.0, answer[40:].repeat(2)[:200])
    assert asks_for_past(residual + 6.0 * made[0], made, 100.0, answer)
