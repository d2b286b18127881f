"""A chain whose samples are far apart beside two of its stages, against one run at many more.

Red when what a stage makes of a jump drives the next one as a straight line, or a chain that needs no parts
of a sample is run at them.
"""

from __future__ import annotations

import numpy as np
import pytest

from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.rig.effects import Run
from focgen.rig.engine import Chain
from focgen.rig.finer import finer, parts_of
from focgen.rig.rig import Actuator, Rig, Signals

MANY = 64


def lag(tau):
    return TransferFunction([(1.0, 0.0)], [(tau, 1.0), (1.0, 0.0)])


def rig_of(h, tau=0.263, alpha=0.8, sensor=None):
    more = {} if sensor is None else {"sensor": lag(sensor)}
    return Rig(
        "finger", h, Signals("t", "y", "u"), Actuator(0.68, alpha, (0.6, 0.05)), regulator=lag(tau), **more
    )


def run(rig, x, h, begins=(1,), tap=None):
    """Of as many experiments of the same length."""
    made = Run.of([len(x) // len(begins)] * len(begins), [0.0] * len(begins), h)
    made.rest[np.flatnonzero(made.rest)] = begins
    return Chain(rig).run(x, "regulator", "sensor", made, Between.HELD, tap)


@pytest.mark.parametrize("h", [0.05, 0.2, 0.4])
@pytest.mark.parametrize("sensor", [None, 0.3])
@pytest.mark.parametrize("begins", [(1,), (2, 1)], ids=["one", "two, one in equilibrium"])
def test_a_coarse_run_is_right_at_its_samples(h, sensor, begins):
    x = np.repeat(np.random.default_rng(0).uniform(0.5, 3.0, 20), 14)
    rig, truth = rig_of(h, sensor=sensor), rig_of(h / MANY, sensor=sensor)
    taps, wanted = {}, {}
    made = run(rig, x, h, begins, taps)
    exact = run(truth, np.repeat(x, MANY), h / MANY, begins, wanted)[::MANY]
    assert np.max(np.abs(made - exact)) < 1.5e-3 * np.ptp(exact)
    for stage, signal in taps.items():
        assert np.max(np.abs(signal - wanted[stage][::MANY])) < 1.5e-3 * np.ptp(wanted[stage])


@pytest.mark.parametrize(
    "rig, h, parts",
    [
        (rig_of(0.2), 0.2, 8),
        (rig_of(0.1), 0.1, 4),
        (rig_of(0.01), 0.01, 1),
        (Rig("one", 0.2, Signals("t", "y", "u"), Actuator(0.68, 0.8, (0.6,))), 0.2, 1),  # one stage alone
        (rig_of(0.2, alpha=1.5), 0.2, 1),  # what begins flat has its area in lines
    ],
    ids=["far", "less", "near", "one stage", "flat"],
)
def test_only_what_is_far_apart_is_run_at_parts(rig, h, parts):
    assert parts_of(rig, "regulator", "sensor", h) == parts
    assert parts_of(rig, "regulator", "regulator", h) == 1


def test_a_run_at_parts_is_made_once_and_has_its_clock():
    coarse = Run.of([3, 2], [0.0, 10.0], 0.5)
    fine = finer(coarse, 4)
    assert finer(coarse, 4) is fine and finer(coarse, 2) is not fine
    assert fine.h == 0.125 and fine.spans == ((0, 12), (12, 20))
    np.testing.assert_allclose(fine.clock[::4], coarse.clock)
    np.testing.assert_allclose(np.diff(fine.clock[:12]), 0.125)
