"""What a refit of the own parameters may take of a gap, in rigs moved by the test.

Red when a refit may take more or less of a gap than it should.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import Actuator, Rig, Signals
from focgen.trials.severity import Trial, surviving

H = 0.01
RIG = Rig(
    "bench",
    0.02,
    Signals("t", "y", command="u", pressure="p", curvature="z"),
    Actuator(0.5, 0.8, (0.2, 0.3)),
    TransferFunction([(0.1, 0.0)], [(0.3, 1.0), (1.0, 0.0)]),
    TransferFunction([(1.0, 0.0)], [(0.4, 1.0), (1.0, 0.0)]),
)
TRIAL = Trial([np.repeat([0.0, 1.0, 0.4, 2.0, 0.0], 300)], [0.0], H)


def left(moved, *logged):
    """What survives of a gap, by signal, as a share of it; the noise is a hundredth of it."""
    gap = {n: TRIAL.signals(moved)[n] - TRIAL.signals(RIG)[n] for n in logged}
    whole = {n: float(np.sqrt(np.mean(gap[n] ** 2))) for n in logged}
    found = surviving(RIG, TRIAL, gap, {n: whole[n] / 100.0 or 1.0 for n in logged})
    return {n: found[n] / 100.0 for n in logged}


def regulator(gain, tau):
    return replace(RIG, regulator=TransferFunction([(0.1 * gain, 0.0)], [(tau, 1.0), (1.0, 0.0)]))


@pytest.mark.parametrize("gain, share", [(0.95, 0.0), (1.05, 0.0), (0.88, 0.5), (0.8, 0.7)])
def test_a_gain_survives_by_what_is_beyond_three_times_its_uncertainty(gain, share):
    """A little less, for times give way as well, and half a per cent of the span is the gauge's zero."""
    moved = regulator(gain, 0.3)
    pressure, without = (TRIAL.signals(rig)["pressure"] for rig in (moved, RIG))
    zero = 0.005 * np.ptp(without) / np.sqrt(np.mean((pressure - without) ** 2))
    assert share - 0.03 - zero < left(moved, "pressure")["pressure"] < share + 1e-3


def test_so_does_a_lag():
    near, far = (left(regulator(1.0, tau), "pressure")["pressure"] for tau in (0.33, 0.9))
    assert near < 0.1 < 0.6 < far


def test_the_actuator_is_refitted_freely():
    moved = replace(RIG, actuator=Actuator(0.5, 0.8, (0.1, 0.15)))
    assert max(left(moved, "curvature", "output").values()) < 0.01


@pytest.mark.parametrize("samples, least, most", [(0.4, 0.0, 0.005), (1.0, 0.02, 1.0)])
def test_half_a_sample_out_of_step_is_no_effect(samples, least, most):
    late = round(samples * RIG.sample_time / H * 50)
    fine = Trial([np.repeat(c, 50) for c in TRIAL.commands], [0.0], H / 50)
    clean = fine.signals(RIG)["output"]
    gap = {"output": np.r_[np.zeros(late), clean[: len(clean) - late]] - clean}
    noise = float(np.sqrt(np.mean(gap["output"] ** 2)))
    assert least <= surviving(RIG, fine, gap, {"output": noise})["output"] < most


@pytest.mark.parametrize("share, seen", [(0.004, False), (0.03, True)])
def test_the_zero_of_a_gauge_in_one_experiment_is_no_effect(share, seen):
    twice = Trial([TRIAL.commands[0]] * 2, [0.0, 30.0], H)
    clean = twice.signals(RIG)["output"]
    gap = {"output": share * np.ptp(clean) * (np.arange(len(clean)) >= len(clean) // 2)}
    noise = float(np.sqrt(np.mean(gap["output"] ** 2)))
    assert (surviving(RIG, twice, gap, {"output": noise})["output"] > 0.3) == seen
