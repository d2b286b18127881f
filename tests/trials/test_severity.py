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
    """A little less, for times give way as well."""
    assert share - 0.03 < left(regulator(gain, 0.3), "pressure")["pressure"] < share + 1e-3


def test_so_does_a_lag():
    near, far = (left(regulator(1.0, tau), "pressure")["pressure"] for tau in (0.33, 0.9))
    assert near < 0.1 < 0.6 < far


def test_the_actuator_is_refitted_freely():
    moved = replace(RIG, actuator=Actuator(0.5, 0.8, (0.1, 0.15)))
    assert max(left(moved, "curvature", "output").values()) < 0.01
