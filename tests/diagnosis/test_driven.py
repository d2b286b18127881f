"""What is left beside an effect and has passed through the rig: something else acts there.

Red when a cut-out that switches a heater off and on again is an obstacle for sure, or when an effect loses
its confidence to noise.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.verdict import unexplained
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import LinearActuator, Rig, Signals

H = 0.1
HEATER = Rig(
    "heater",
    H,
    Signals("t", "y", "u"),
    LinearActuator(TransferFunction([(7.0, 0.0)], [(8.0, 2.0), (6.3, 1.0), (1.0, 0.0)])),
)


def heated(power, cut=np.inf, back=np.inf):
    """Two capacities one after the other (n,), 7 K a W, in Euler's steps: a cut-out opens above ``cut`` K and
    closes below ``back``."""
    inner = outer = 0.0
    on, made = True, np.empty(len(power))
    for i, watts in enumerate(power):
        made[i] = outer
        for _ in range(10):
            on = outer < (cut if on else back)
            inner += H / 10 / 4.5 * (7.0 * watts * on - inner)
            outer += H / 10 / 1.8 * (inner - outer)
    return made


def session(seed, **what):
    rng, t = np.random.default_rng(seed), np.arange(3000) * H
    stairs = np.repeat([2.0, 6.0, 10.0, 4.0, 9.0, 0.0, 7.0, 10.0, 3.0, 5.0], 300)
    sines = 5.0 - 5.0 * np.cos(2 * np.pi * t / 90.0)
    logs, start = [], 0.0
    for name, power in (("stairs", stairs), ("sines", sines)):
        y = heated(power, **what) + 0.25 * rng.normal(size=len(power))
        logs.append(Experiment(name, H, {"command": power, "output": y}, start=start))
        start += len(power) * H + 200.0
    return logs


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2])
def test_a_cut_out_is_nothing_for_sure(seed):
    found = diagnose(HEATER, session(seed, cut=52.0, back=46.0), pictures=False)
    sure = [c.confidence for cause in found.causes for c in cause.candidates]
    assert found.verdict == "unknown" or max(sure) <= 0.67
    assert found.verdict == "unknown" or any("no input predicts it" in note for note in found.notes)


@pytest.mark.parametrize("jumps", [False, True])
def test_slips_at_another_time_are_nothing_else(jumps, monkeypatch):
    """What a valve that sticks leaves, where it slips a little late, is whole slips."""
    monkeypatch.setattr(unexplained, "disturbed", lambda e: SimpleNamespace(pushed=True))
    monkeypatch.setattr(unexplained, "is_rounded", lambda causes: False)
    form = SimpleNamespace(jumps=jumps)
    found = SimpleNamespace(
        causes=(None,),
        segment=SimpleNamespace(closed=False, pace=0.0),
        best=SimpleNamespace(problem=SimpleNamespace(candidates=[SimpleNamespace(form=form)])),
        amiss=0.0,
    )
    assert unexplained.is_driven(found) != jumps


@pytest.mark.parametrize(
    "seed, count", [(1, 1), *(pytest.param(s, 2, marks=pytest.mark.long) for s in (1, 2))]
)
def test_noise_takes_no_confidence(seed, count):
    """In ``count`` logs."""
    logs = session(seed)[:count]
    late = [
        replace(log, signals={**log.signals, "output": np.r_[np.zeros(9), log["output"][:-9]]})
        for log in logs
    ]
    found = diagnose(HEATER, late, pictures=False)
    (cause,) = found.causes
    assert cause.candidates[0].effect == "transport_delay" and cause.candidates[0].confidence > 0.9
