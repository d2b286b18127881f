"""What changes at one moment is no drift: it is said when, and by how much.

Red when a wander through the session is named for a zero that jumps, a load that is hung on or a mass that is
added; or when a slow drift is taken for such a moment.
"""

from __future__ import annotations

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.fitting.fit import WHITE, fit
from focgen.diagnosis.hypotheses.nuisances import uncertain
from focgen.diagnosis.problem.segments import make
from focgen.diagnosis.verdict.pieces import pieces
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import LinearActuator, Rig, Signals

H, N, AT = 0.1, 1200, 77.0  # s, samples, s
PLANT = TransferFunction([(2.1, 0.0)], [(0.2, 2.0), (0.9, 1.0), (1.0, 0.0)])
BENCH = Rig("bench", H, Signals("t", "y", "u"), LinearActuator(PLANT))
T = np.arange(N) * H
LEVELS = (3.0, 0.0, 1.5, 5.0, 2.2, 4.5, 0.0, 4.0, 3.0, 0.0, 5.0, 1.5)


def session(seed: int, load: float = 0.0, mass: float = 0.0, zero: float = 0.0, drift: float = 0.0):
    """One experiment of 0.22 y'' + y' + y = 2 u, steps of a twentieth of a sample: from AT on a ``load`` is
    on it, a ``mass`` more, or the ``zero`` of the reading another; or that ``drift``s so far by the end."""
    pump = np.repeat(LEVELS, N // len(LEVELS))
    y = v = 0.0
    seen = np.empty(N)
    for k, u in enumerate(pump):
        seen[k], late = y, T[k] >= AT
        for _ in range(20):
            v += H / 20.0 * (2.0 * u - load * late - v - y) / (0.22 + mass * late)
            y += H / 20.0 * v
    seen += zero * (T >= AT) + drift * T / T[-1] + 0.03 * np.random.default_rng(seed).normal(size=N)
    return [Experiment("day", H, {"command": pump, "output": seen})]


@pytest.mark.parametrize(
    "change",
    [
        pytest.param({"zero": 0.8}, marks=pytest.mark.long),
        {"load": 0.8},
        pytest.param({"mass": 0.4}, marks=pytest.mark.long),
    ],
    ids=["a zero", "a load", "a mass"],
)
def test_what_changes_at_once_is_unknown_and_it_is_said_when(change):
    told = None if "mass" in change else ("sensor_drift", "gain_drift")  # all families take ten times as long
    found = diagnose(BENCH, session(3, **change), only=told)
    assert found.verdict == "unknown"
    (moment,) = found.unexplained["command to output"]["moments"]
    about = 5.0 if "mass" in change else 1.0  # at rest, a mass does not show
    assert moment["at"] == pytest.approx(AT, abs=about) and moment["experiment"] == "day"
    if "mass" not in change:
        assert abs(moment["mean"]) == pytest.approx(0.8, rel=0.15)
    assert any("at once" in note for note in found.notes)


@pytest.mark.parametrize("drift", [pytest.param(0.8, marks=pytest.mark.long), 0.3])
def test_a_slow_drift_is_a_drift(drift):
    found = diagnose(BENCH, session(4, drift=drift), only=("sensor_drift", "gain_drift"))
    assert [c.candidates[0].effect for c in found.causes] == ["sensor_drift"]
    assert found.causes[0].candidates[0].confidence > 0.9


LIGHT = TransferFunction([(2.0, 0.0)], [(0.4, 2.0), (0.12, 1.0), (1.0, 0.0)])
SWINGING = Rig("link", H, Signals("t", "y", "u"), LinearActuator(LIGHT))


def swinging(seed: int, lost: float):
    """The same steps on 0.4 y'' + 0.12 y' + y = 2 u, of whose mass a part is ``lost`` from AT on."""
    pump = np.repeat(LEVELS, N // len(LEVELS))
    y = v = 0.0
    seen = np.empty(N)
    for k, u in enumerate(pump):
        seen[k] = y
        for _ in range(20):
            v += H / 20.0 * (2.0 * u - 0.12 * v - y) / (0.4 * (1.0 - lost * (T[k] >= AT)))
            y += H / 20.0 * v
    seen += 0.03 * np.random.default_rng(seed).normal(size=N)
    return [Experiment("day", H, {"command": pump, "output": seen})]


@pytest.mark.parametrize("lost", [0.2, 0.3])
def test_a_rig_that_is_not_linear_so_far_off_is_fitted_there(lost):
    """Half of a mass less is far beyond what a linear equation tells of a mode: a part of the way to it left
    three times as much, and less for a drift."""
    logs = swinging(1, lost)
    segment = make(logs, "command", "output")
    problem = uncertain(SWINGING, segment, logs)
    nominal = fit(problem, problem.nominal(), WHITE, 20)
    cut = next(cut for cut in pieces(nominal, WHITE) if not cut.together)
    assert cut.samples[0] * H == pytest.approx(AT, abs=6.0)  # until the next step nothing moves
    assert cut.simulated(WHITE).square < 1.1 * cut.square < 0.4 * nominal.sse
