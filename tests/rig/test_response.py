"""Rigs that run away are refused where they would be run on logs; all others are not.

Red when a wrong sign in a rig's file ends in NaN or a fault, or a rig that integrates or rings is refused.
"""

from dataclasses import replace

import numpy as np
import pytest

import focgen
from focgen.diagnosis.proposals.identifiability import plan
from focgen.errors import RigError
from focgen.fractional.transfer import TransferFunction
from focgen.rig.response import check_bounded, integrations, response_time
from focgen.rig.rig import LinearActuator, Rig, Signals

LAG = TransferFunction([(10.0, 0.0)], [(1.0, 1.0), (10.0, 0.0)])
SIGNALS = Signals("t", "y", command="u")


def rig(*den, num=((1.0, 0.0),)):
    return Rig("axis", 0.01, SIGNALS, LinearActuator(TransferFunction(num, den)), LAG, LAG)


def coupled(order):
    """A stage that lets no constant through, as an amplifier that is coupled by a capacitor."""
    return TransferFunction([(1.0, order)], [(1.0, order), (10.0, 0.0)])


RUNAWAYS = {
    "first order": ((1.0, 1.0), (-1.0, 0.0)),
    "second order": ((1.0, 2.0), (-2.0, 1.0), (100.0, 0.0)),
    "an integrator with it": ((1.0, 2.0), (-1.0, 1.0)),
    "fractional": ((-1.0, 1.5), (0.3, 0.5), (65536.0, 0.0)),
    "an order beyond 2": ((1.0, 2.6), (1000.0, 0.0)),
}
BOUNDED = {
    "a lag": ((0.5, 1.0), (1.0, 0.0)),
    "it rings without a damper": ((1.0, 2.0), (100.0, 0.0)),
    "it integrates twice": ((1.0, 2.0),),
    "fractional": ((1.3, 0.6), (1.0, 0.0)),
    "it grows by less than a log shows": ((1.0, 1.0), (-1e-3, 0.0)),
}


@pytest.mark.parametrize("den", RUNAWAYS.values(), ids=RUNAWAYS)
def test_what_grows_by_itself_is_refused_by_stage(den):
    with pytest.raises(RigError, match=r"axis \[actuator\]: grows by itself"):
        check_bounded(rig(*den), 60.0)


@pytest.mark.parametrize("den", BOUNDED.values(), ids=BOUNDED)
def test_what_does_not_is_taken(den):
    check_bounded(rig(*den), 60.0)


def test_a_sensor_counts_as_well():
    with pytest.raises(RigError, match=r"axis \[sensor\]"):
        check_bounded(
            replace(rig((1.0, 0.0)), sensor=TransferFunction([(1.0, 0.0)], [(1.0, 1.0), (-9.0, 0.0)])), 60.0
        )


@pytest.mark.parametrize("run", [focgen.replay, focgen.diagnose, focgen.identify, plan])
def test_no_run_of_it_ends_in_numbers_that_are_none(run):
    t = np.arange(3000) * 0.01
    log = {"t": t, "u": (t % 10 > 5).astype(float), "y": np.sin(t)}
    away = replace(
        rig((1.0, 1.0), (-1.0, 0.0)), regulator=TransferFunction([(1.0, 0.0)], [(1.0, 1.0), (-9.0, 0.0)])
    )
    with pytest.raises(RigError, match="grows by itself"):
        run(away, [log])


@pytest.mark.parametrize("order", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("stage", ["regulator", "sensor", "actuator"])
def test_a_rig_that_lets_no_constant_through_has_a_response_time(order, stage):
    """It integrates less than not at all, which no difference of a response is."""
    away = LinearActuator(coupled(order)) if stage == "actuator" else coupled(order)
    made = replace(rig((0.4, 1.0), (1.0, 0.0)), **{stage: away})
    t = np.arange(300) * 0.01
    log = {"t": t, "u": (t > 1.0).astype(float), "y": np.where(t > 1.0, np.exp(1.0 - t), 0.0)}
    assert integrations(made) == 0 and 0.02 < response_time(made, 0.01, 3.0) < 1.0
    assert all(np.isfinite(r["output"]).all() for r in focgen.replay(made, [log]).simulated.values())


def test_it_is_as_slow_as_what_its_integral_does():
    lag = TransferFunction([(10.0, 0.0)], [(1.0, 1.0), (10.0, 0.0)])
    same, ac = (replace(rig((0.4, 1.0), (1.0, 0.0)), sensor=s) for s in (lag, coupled(1.0)))
    assert response_time(ac, 0.01, 9.0) == pytest.approx(response_time(same, 0.01, 9.0), abs=0.03)


def test_what_differentiates_an_integrator_is_no_integrator():
    made = replace(rig((1.0, 2.0), (1.0, 1.0)), sensor=coupled(1.0))
    assert integrations(rig((1.0, 2.0), (1.0, 1.0))) == 1 and integrations(made) == 0
