"""A loop, or a curve, behind an actuator's dynamics, as of an alloy that is heated first or of a linkage:
relays, and the angle of a crank.

Red when it passes for the sensor's because the library has it ahead of the dynamics only, or when without a
gauge between the two either of them is sure.
"""

from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.hypotheses import between_samples
from focgen.diagnosis.hypotheses.rivals import Rival
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import LinearActuator, Rig, Signals

H, HEATS, READS = 0.02, 0.8, 0.05
RIG = Rig(
    "alloy",
    H,
    Signals("t", "y", pressure="p", curvature="q"),
    LinearActuator(TransferFunction([(2.0, 0.0)], [(HEATS, 1.0), (1.0, 0.0)])),
    sensor=TransferFunction([(1.0, 0.0)], [(READS, 1.0), (1.0, 0.0)]),
)
SENSORS = {"hysteresis": "sensor_hysteresis", "gain_nonlinearity": "sensor_nonlinearity"}
LEVELS = (0.5, 0.2, 0.9, 0.4, 0.7, 0.0, 1.0, 0.3, 0.6, 0.1)


def relays(x, share):
    """Preisach's sum of relays, evenly over all thresholds: a ``share`` of the signal."""
    up, down = (v.ravel() for v in np.meshgrid(np.linspace(0.0, 2.0, 41)[1:], np.linspace(0.0, 2.0, 41)[:-1]))
    up, down = up[up > down], down[up > down]
    state, found = np.zeros(len(up)), []
    for value in x:
        state = np.where(value >= up, 1.0, np.where(value <= down, 0.0, state))
        found.append(state.mean())
    return (1.0 - share) * x + share * 2.0 * np.array(found)


def cranked(x, share):
    """The angle of a crank by its height, as far as a ``share`` of its length goes."""
    return 2.0 * np.arcsin(3.0 * share * x / 2.0) / (3.0 * share)


BEHIND = {"hysteresis": relays, "gain_nonlinearity": cranked}


def lagged(x, time, held=True):
    """A lag's exact response to what is held between samples, or runs in lines."""
    kept, y = np.exp(-H / time), np.zeros(len(x))
    mean = (1.0 - kept) * time / H
    past, now = (1.0 - kept, 0.0) if held else (mean - kept, 1.0 - mean)
    for i in range(1, len(x)):
        y[i] = kept * y[i - 1] + past * x[i - 1] + now * x[i]
    return y


def logs(seed, of, effect, share=0.25):
    """Steps and a triangle with smaller ones inside, with the effect behind the heat or in the reading."""
    rng = np.random.default_rng(seed)
    slow = np.interp(
        np.arange(3000) * H, np.r_[0, 12, 20, 26, 36, 42, 48, 60], [0, 1, 0.3, 0.7, 0, 0.6, 0.2, 1]
    )
    made = []
    for number, drive in enumerate((np.repeat(LEVELS, 300), slow)):
        moved = lagged(2.0 * drive, HEATS)
        moved = BEHIND[effect](moved, share) if of == "actuator" else moved
        read = lagged(moved, READS, held=False)
        read = BEHIND[effect](read, share) if of == "sensor" else read
        noise = 0.006 * rng.standard_normal((2, len(drive)))
        signals = {"pressure": drive, "curvature": moved + noise[0], "output": read + noise[1]}
        made.append(Experiment(str(number), H, signals, start=70.0 * number))
    return made


def without_curvature(log):
    return Experiment(
        log.name, H, {k: v for k, v in log.signals.items() if k != "curvature"}, start=log.start
    )


QUICK = {("actuator", "gain_nonlinearity", 1)}
CASES = [
    pytest.param(*case, marks=() if case in QUICK else pytest.mark.long)
    for case in product(("actuator", "sensor"), SENSORS, (1, 2))
]


@pytest.mark.parametrize("of, effect, seed", CASES)
def test_what_is_behind_the_dynamics_is_whose_the_curvature_shows(of, effect, seed):
    (cause,) = diagnose(RIG, logs(seed, of, effect), pictures=False).causes
    assert [c.effect for c in cause.candidates] == [effect if of == "actuator" else SENSORS[effect]]
    assert cause.candidates[0].form.endswith("_behind") == (of == "actuator")


@pytest.mark.long
@pytest.mark.parametrize("of, effect, seed", [case.values for case in CASES])
def test_without_the_curvature_it_is_either_s(of, effect, seed):
    found = diagnose(RIG, [without_curvature(log) for log in logs(seed, of, effect)], pictures=False)
    (cause,) = found.causes
    assert [c.effect for c in cause.candidates[:2]] == [SENSORS[effect], effect]
    assert all(0.2 < c.confidence < 0.9 for c in cause.candidates[:2])
    assert found.next_experiment.inputs["also_log"] == "curvature"


def test_the_first_rivals_take_over_how_the_command_runs_between_samples(monkeypatch):
    """Else an experiment is chosen to tell apart what differs by nothing else."""

    def fitted(way):
        return SimpleNamespace(problem=SimpleNamespace(segment=SimpleNamespace(between=way)))

    monkeypatch.setattr(between_samples, "moved_to", lambda of, segment, weighing: fitted(segment.between))
    found, best, others = fitted("held"), fitted("straight"), [fitted("held") for _ in range(4)]
    rivals = [Rival(str(i), "actuator", 0.0, 0.0, fit) for i, fit in enumerate([found, *others])]
    now = between_samples.in_the_end(rivals, found, best, None)
    assert now[0].fit is best
    assert [r.fit.problem.segment.between for r in now] == ["straight"] * 3 + ["held"] * 2
