"""A zero that all experiments share is part of the rig; zeros of each experiment's own are not.

Red when a rig is written that lies a gauge's zero away from its own logs, or when what each experiment has
for itself, or a gain that is little known, passes for a zero.
"""

from __future__ import annotations

import numpy as np
import pytest

from focgen.errors import FitError
from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import TransferFunction
from focgen.identification.identify import identify
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
from focgen.rig.replay import replay
from focgen.rig.rig import Actuator, Rig, Signals

H, FINER = 0.1, 20  # s between samples; the rig runs in so many parts of one
T, ALPHA, GAIN = 1.5, 0.8, (2.0, 0.3)
PLANT = TransferFunction([(1.0, 0.0)], [(T, ALPHA), (1.0, 0.0)])
GAUGE = TransferFunction([(0.5, 0.0)], [(0.2, 1.0), (1.0, 0.0)])
NOISE = 0.004
SIGNALS, LIKELY = Signals("t", "y", pressure="p"), Actuator(1.3, 0.9, (2.2, 0.2))
RIG = Rig("valve", H, SIGNALS, LIKELY, sensor=GAUGE, between=Between.HELD)


def staircase(levels, seconds) -> np.ndarray:
    """Held levels (n,) in parts of a sample."""
    return np.repeat(np.array(levels, float), round(seconds * FINER / H))


def logged(name, drive, zero, rng, skip=0.0) -> Experiment:
    """What the rig reads of ``drive`` (n,), from ``skip`` s on."""
    moved = Convolution(PLANT, H / FINER, "zero").run((GAIN[0] + GAIN[1] * drive) * drive)
    read = Convolution(GAUGE, H / FINER, "linear").run(moved)
    kept = slice(round(skip * FINER / H), None, FINER)
    output = read[kept] + zero + rng.normal(0.0, NOISE, len(read[kept]))
    return Experiment(name, H, {"pressure": drive[kept], "output": output})


RESTED = staircase([0, 3, 1, 2, 0], 12)
MOVING = staircase([2, 1, 3, 1.5, 0.5, 2.5], 12)


@pytest.mark.parametrize("skip, seed", [(0.0, 0), (15.0, 0), (15.0, 1)])
def test_a_zero_that_all_logs_have_is_written_and_replayed(skip, seed):
    rng = np.random.default_rng(seed)
    logs = [logged(f"e{i}", MOVING[:: 1 - 2 * (i % 2)], 3.0, rng, skip) for i in range(3)]
    found = identify(RIG, logs, integer=False)
    assert found.rig.zero == pytest.approx(3.0, abs=0.03) and found.rig.actuator.offset == 0.0
    assert any("written as the offset of the sensor" in note for note in found.notes)
    for one in replay(found.rig, logs).logs.values():
        assert one.rmse < 4.0 * NOISE


@pytest.mark.parametrize("seed", range(3))
def test_a_log_that_rests_shows_its_zero(seed):
    found = identify(RIG, [logged("e", RESTED, -0.4, np.random.default_rng(seed))], integer=False)
    assert found.rig.zero == pytest.approx(-0.4, abs=3.0 * NOISE)


@pytest.mark.parametrize("seed", range(4))
def test_zeros_of_each_experiments_own_are_no_zero_of_the_rig(seed):
    rng = np.random.default_rng(seed)
    own = rng.normal(0.0, 0.05, 4)
    logs = [logged(f"e{i}", RESTED, zero - own.mean(), rng) for i, zero in enumerate(own)]
    assert identify(RIG, logs, integer=False).rig.zero == 0.0


def test_the_zero_of_a_fitted_curvature_is_the_actuators():
    rng = np.random.default_rng(3)
    log = logged("e", RESTED, 0.7, rng)
    rig = Rig(
        "valve", H, Signals("t", "y", pressure="p", curvature="k"), RIG.actuator, sensor=GAUGE, zero=0.2
    )
    read = {"pressure": log["pressure"], "curvature": log["output"] / 0.5, "output": log["output"]}
    seen = Experiment("e", H, read)
    found = identify(rig, [seen], integer=False)
    assert found.rig.actuator.offset == pytest.approx(1.4, abs=0.05) and found.rig.zero == 0.2


HIGH = staircase([2, 1, 3, 1.5, 2.5, 1.2, 2.8, 1.6], 9)
WIDE = staircase([2, 1, 3, 0.5, 2.5, 1.5, 3, 0.6], 9)


@pytest.mark.parametrize("drive", [HIGH, WIDE], ids=["far from 0", "begun underway"])
@pytest.mark.parametrize("seed", range(3))
def test_a_zero_is_no_better_known_than_the_gain(drive, seed):
    """Logs that never come near 0 tell K(p) p there by its slope alone, and that badly. What was before a log
    that begins on its way is not told to a few per cent."""
    found = identify(RIG, [logged("e", drive, 0.0, np.random.default_rng(seed), 9.0)], integer=False)
    assert found.rig.zero == 0.0


def test_counts_are_numbers():
    read = {"pressure": RESTED[::FINER].astype(int), "output": np.arange(len(RESTED[::FINER])) % 7}
    with pytest.raises(FitError):
        identify(RIG, [Experiment("e", H, read)], integer=False)
