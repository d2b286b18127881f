"""A gain whose curve was fitted to logs that had the fault in them holds part of that fault.

Red when the curve of the rig's file is held for the rig's own, and a dead zone or an obstacle beside it is
named a bent gain, which alone was free to take the curve back.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.problem.free import Free, GainFreedom
from focgen.identification.identify import identify
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, Relative, Rig, Signals, Uncertainty
from tests.diagnosis_rig import RIG, session

CURVED = Actuator(1.0, 1.0, (2.5, -0.4))  # slopes of 2.5 at no load and of 0.1 at 3
STEP = 0.05


def ends(freedom, known=0.02, gain=CURVED.gain):
    """Lower and upper ends of the gain's coefficients, in the rig's units."""
    rig = Rig("r", STEP, Signals("t", "y", "u"), replace(CURVED, gain=gain))
    rig = replace(rig, uncertainty=Uncertainty(actuator=Relative(known, 0.1, 0.1)))
    low, high = Free(rig, "actuator", 3.0, 4.0).bounds(False, freedom)
    scale = 4.0 / 3.0 ** np.arange(1, len(gain) + 1)
    return low[2:-1] * scale, high[2:-1] * scale


def test_a_static_effect_lets_the_gain_be_a_line():
    low, high = ends(GainFreedom.WITHIN)
    assert high[1] < -0.1 and low[0] > 2.0
    low, high = ends(GainFreedom.STRAIGHT)
    for slope in (0.1, 0.8, 2.5):  # of any of its tangents
        assert np.all(low <= [slope, 0.0]) and np.all([slope, 0.0] <= high)
    assert np.all(np.isfinite([low, high]))


def test_a_line_goes_as_far_as_before():
    for freedom in (GainFreedom.WITHIN, GainFreedom.STRAIGHT):
        low, high = ends(freedom, gain=(2.5,))
        assert low[0] == pytest.approx(2.5 * 0.94) and high[0] == pytest.approx(2.5 * 1.06)


@pytest.mark.parametrize("freedom", GainFreedom)
def test_what_is_known_exactly_does_not_move(freedom):
    low, high = ends(freedom, known=0.0)
    assert np.array_equal(low, high)


@pytest.mark.parametrize(
    "roles", [("pressure", "curvature"), pytest.param((), marks=pytest.mark.long)], ids=["all", "ends"]
)
def test_a_dead_zone_that_was_there_before(roles):
    """It was a bent gain, alone, at 0.67, with the pressure logged."""
    logs = session(1, zone=0.06, roles=roles)
    found = diagnose(identify(RIG, logs, integer=False).rig, logs, pictures=False)
    assert [c.effect for c in found.causes[0].candidates] == ["dead_zone"] and len(found.causes) == 1
    assert found.causes[0].candidates[0].confidence > 0.8


def pushing(seed: int) -> Experiment:
    """Steps of a lag that meets a stiffer place half-way, with all signals."""
    rng = np.random.default_rng(seed)
    pressure = np.repeat(np.r_[0.0, rng.uniform(0.0, 3.0, 15)], 60)
    drive, now = (1.8 + 0.13 * pressure) * pressure, 0.0
    free = np.empty_like(drive)
    for k, level in enumerate(drive):
        free[k] = now
        now += (level - now) * (1.0 - np.exp(-STEP / 1.0))
    met = np.where(free > 3.3, 3.3 + 0.35 * (free - 3.3), free)
    read = {"pressure": pressure, "output": met}
    noisy = {name: values + rng.normal(0.0, 0.025 * np.ptp(values), 960) for name, values in read.items()}
    return Experiment(f"s{seed}", STEP, noisy)


@pytest.mark.parametrize("seed", [2, pytest.param(4, marks=pytest.mark.long)])
def test_an_obstacle_that_was_there_before(seed):
    """It was a bent sensor at 0.6, or a bent gain."""
    rig = Rig("r", STEP, Signals("t", "y", pressure="p"), Actuator(1.0, 1.0, (2.0, 0.0)))
    logs = [pushing(seed), pushing(seed + 1), pushing(seed + 10)]
    identified = identify(rig, logs, integer=False).rig
    assert identified.actuator.gain[1] < -0.2  # the curve that the obstacle made
    found = diagnose(identified, logs, pictures=False)
    assert [c.effect for c in found.causes[0].candidates] == ["contact"] and len(found.causes) == 1
