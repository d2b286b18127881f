"""An oven in minutes and a piezo in milliseconds are diagnosed alike.

Red when a number that is fitted, its prior or a note on how far it moved depends on the unit of time.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.problem.free import Free
from focgen.diagnosis.verdict.moves import far_moves
from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, Rig, Signals

TIMES = [1.0 / 1024.0, 1024.0]  # powers of two: all that is the same is so to the last digit


def rig_in(c, alpha=1.0, T=125.0, h=1.0):
    """A rig of time constant T^(1/alpha), with a second that is c of its own."""
    return Rig("oven", c * h, Signals("t", "y", "u"), Actuator(c**alpha * T, alpha, (2.0,)))


@pytest.mark.parametrize("c", TIMES)
@pytest.mark.parametrize("alpha, to", [(1.0, 0.9), (0.6, 0.65), (1.5, 1.3)])
def test_an_order_that_moves_keeps_the_time_constant(c, alpha, to):
    for way in (0.0, 0.3):
        made = []
        for each in (1.0, c):
            free = Free(rig_in(each, alpha), "actuator", 1.0, 2.0)
            vector = free.start() + np.r_[way, to - alpha, np.zeros(len(free.start()) - 2)]
            assert free.prior_penalty(vector) > 0.0
            actuator = free.put(rig_in(each, alpha), vector).actuator
            made.append((actuator.T ** (1.0 / to) / each, free.prior_penalty(vector)))
        assert made[1] == pytest.approx(made[0], rel=1e-9)
        assert made[0][0] == pytest.approx(125.0 ** (1.0 / alpha) * np.exp(way / to), rel=1e-9)


@pytest.mark.parametrize("c", [1.0, *TIMES])
def test_a_note_on_a_move_knows_no_unit(c):
    given = rig_in(c, 0.6)
    same = replace(given, actuator=replace(given.actuator, alpha=0.7, T=given.actuator.T_at(0.7)))
    assert not any("actuator's T" in note for note in far_moves(given, same))
    far = replace(same, actuator=replace(same.actuator, T=1.8 * same.actuator.T))
    assert any("actuator's T by +80" in note for note in far_moves(given, far))


@pytest.mark.parametrize("c", TIMES)
def test_a_diagnosis_is_the_same_in_another_unit(c):
    """By a prior on T in seconds to the power of an order that moves as well, a balloon's creep was 0.45 in
    seconds and 0.02 in milliseconds."""
    rng, h, n = np.random.default_rng(4), 1.0, 1500
    plant = TransferFunction([(2.0, 0.0)], [(125.0, 0.95), (1.0, 0.0)])
    sessions: dict = {1.0: [], c: []}
    for number in range(2):
        u = np.repeat(rng.uniform(0.0, 3.0, n // 150), 150)
        y = np.minimum(Convolution(plant, h, "zero").run(u), 3.6) + rng.normal(0.0, 0.02, n)
        for each, logs in sessions.items():
            kept = {"command": u, "output": y}
            logs.append(Experiment(f"e{number}", each * h, kept, start=each * 9e3 * number))
    found = [diagnose(rig_in(each), logs, pictures=False) for each, logs in sessions.items()]
    told = [[[(x.effect, x.confidence) for x in f.candidates] for f in d.causes] for d in found]
    assert told[0] and [[e for e, _ in f] for f in told[0]] == [[e for e, _ in f] for f in told[1]]
    for one, other in zip(*told):
        np.testing.assert_allclose([p for _, p in one], [p for _, p in other], atol=1e-3)
    assert found[0].gap.explained == pytest.approx(found[1].gap.explained, rel=1e-4)
