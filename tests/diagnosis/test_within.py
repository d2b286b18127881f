"""The actuator behind a quick regulator, driven by the pressure that was read.

Red when lines between the readings make a gap of a rig that has none.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.hypotheses.nuisances import problem_of
from focgen.diagnosis.problem.segments import make
from focgen.diagnosis.problem.within import bent_within
from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.rig.rig import Actuator, Rig
from tests.identification.test_within import GAIN, SIGNALS, H, T, logs_of, staircase


def rig_of(tau, alpha):
    lag = TransferFunction([(1.1, 0.0)], [(tau, 1.0), (1.0, 0.0)])
    return Rig("finger", H, SIGNALS[True], Actuator(T, alpha, (GAIN,)), regulator=lag)


def missed(logs, rig, x):
    """By how much the actuator's output is off from where its noise is, root mean square."""
    problem = problem_of(rig, make(logs, "pressure", "output", x), logs)
    off = problem.segment.y - problem.simulate(problem.nominal())
    return np.sqrt(max(np.mean(off**2) - 0.006**2, 0.0))


@pytest.mark.parametrize("tau", [0.04, 0.08])
@pytest.mark.parametrize("alpha", [1.0, 0.7])
def test_a_healthy_rig_has_little_of_a_gap_between_readings(alpha, tau):
    rig, logs = rig_of(tau, alpha), logs_of(staircase, tau, alpha, True)
    ahead = problem_of(rig, make(logs, "command", "pressure"), logs)
    read = ahead.simulate(ahead.nominal())
    bent = bent_within(ahead, ahead.nominal(), read)
    assert missed(logs, rig, bent) < 0.4 * missed(logs, rig, read)


def test_only_a_held_command_and_a_quick_regulator_bend_it():
    logs = logs_of(staircase, 0.08, 1.0, True)
    ahead = problem_of(rig_of(0.08, 1.0), make(logs, "command", "pressure"), logs)
    straight = replace(ahead, segment=ahead.segment.anew(between=Between.STRAIGHT), memory={})
    slow = problem_of(rig_of(3.0, 1.0), ahead.segment, logs)
    for problem in (straight, slow):
        x = problem.simulate(problem.nominal())
        assert bent_within(problem, problem.nominal(), x) is x
