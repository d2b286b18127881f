"""Logs that begin where earlier moves, which nobody logged, have left the rig.

Red when what is left of those passes for an effect, for something unknown or hides an effect, when a log that
does begin at rest is given a past, or when the rigs that are written do not begin as the fits do.
"""

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.hypotheses.initial import loosened
from focgen.diagnosis.problem.segments import make
from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, Rig, Signals

H, FINER, COUNT = 0.05, 10, 900
SIGNALS = Signals("t", "y", command="u")


def rig_of(T, alpha):
    """As its owner knows it: 8 % off."""
    return Rig("finger", H, SIGNALS, Actuator(1.08 * T, 0.98 * alpha, (1.84,)))


def session(T, alpha, seed, rested, noise=0.004, stop=np.inf):
    """Two logs of held steps, each the later part of a run that moved the rig, let go of it for ``rested`` s
    and began again; no log has the moves ahead. ``stop``: where an obstacle is."""
    rng, logs = np.random.default_rng(seed), []
    plant = TransferFunction([(1.0, 0.0)], [(T, alpha), (1.0, 0.0)])
    for number in range(2):
        moves = np.repeat(rng.uniform(1.0, 3.0, 8), 50)
        asked = np.repeat(rng.uniform(0.0, 3.0, COUNT // 90), 90)
        u = np.r_[np.zeros(5), moves, np.zeros(round(rested / H)), asked]
        y = 2.0 * Convolution(plant, H / FINER, "zero").run(np.repeat(u, FINER))[::FINER]
        y = np.minimum(y, stop) + 0.3 * np.maximum(y - min(stop, 1e9), 0.0)
        read = y[-COUNT:] + rng.normal(0.0, noise * 6.0, COUNT)
        logs.append(Experiment(f"e{number}", H, {"command": u[-COUNT:], "output": read}))
    return logs


PLANTS = [(1.0, 1.0), (1.4, 0.6), (0.5, 1.4)]


@pytest.mark.parametrize("T, alpha", PLANTS)
@pytest.mark.parametrize("rested", [1.5, 4.0])
def test_what_unlogged_moves_left_is_no_gap(T, alpha, rested):
    """Of healthy rigs that began so 22 in 60 were unknown or had an effect; one was `sensor_drift`, 0.95."""
    found = diagnose(rig_of(T, alpha), session(T, alpha, 3, rested), pictures=False)
    assert found.verdict in ("none", "parameters") and not found.causes
    assert found.gap.refitted < 1.2 * found.gap.floor


@pytest.mark.parametrize("T, alpha", PLANTS)
def test_an_effect_is_named_beside_it(T, alpha):
    found = diagnose(rig_of(T, alpha), session(T, alpha, 4, 2.0, stop=4.2), pictures=False)
    named = {candidate.effect for candidate in found.causes[0].candidates}
    assert len(found.causes) == 1 and named <= {"contact", "sensor_saturation", "sensor_nonlinearity"}
    assert found.causes[0].candidates[0].effect in ("contact", "sensor_saturation")


@pytest.mark.parametrize("off", [0.0, 0.3])
def test_a_log_at_rest_has_no_past_to_fit(off):
    """Nor has one whose reading is off by a zero: the refit tells that."""
    u = np.r_[np.zeros(20), np.repeat([1.0, 2.5, 0.5, 1.5], 220)]
    kept = np.exp(-H)
    y = 2.0 * lfilter([0.0, 1.0 - kept], [1.0, -kept], u)
    noise = np.random.default_rng(2).normal(0.0, 0.02, len(u))
    log = Experiment("e", H, {"command": u, "output": y + off + noise})
    segment = make([log], "command", "output")
    assert loosened(rig_of(1.0, 1.0), segment, [log]).loose.shape[1] == 0
    found = diagnose(rig_of(1.0, 1.0), [log], pictures=False)
    assert not found.causes and found.refitted.actuator.offset == pytest.approx(off, abs=0.02)


@pytest.mark.parametrize("first", [0, 2])
@pytest.mark.parametrize("T, gain, late", [(1.0, 1.84, 0), (0.7, 1.84, 0), (1.0, 2.5, 0), (1.0, 1.84, 2)])
def test_a_step_in_the_first_samples_is_no_past(first, T, gain, late):
    """What a wrong time, gain or a dead time makes of it was one: a creep beside it became a slow sensor."""
    u = np.r_[np.zeros(first), np.repeat([2.0, 0.5, 1.5], 150)]
    kept = np.exp(-H / T)
    y = gain * lfilter([0.0] * (late + 1) + [1.0 - kept], [1.0, -kept], u)
    for seed in range(5):
        noise = np.random.default_rng(seed).normal(0.0, 0.01, len(u))
        log = Experiment("e", H, {"command": u, "output": y + noise})
        segment = make([log], "command", "output")
        assert loosened(rig_of(1.0, 1.0), segment, [log]).loose.shape[1] == 0
