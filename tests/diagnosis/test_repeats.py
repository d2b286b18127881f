"""What wanders through a session: named where repeats show it, and nothing of it promised.

Red when a wander is named that no repeat shows, or improvement is predicted from one.
"""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.fitting.repeats import repeats_of
from focgen.diagnosis.hypotheses.disturbance import disturbance
from focgen.diagnosis.hypotheses.nuisances import problem_of
from focgen.diagnosis.hypotheses.search import rank
from focgen.diagnosis.problem.problem import CandidateEffect
from focgen.diagnosis.problem.segments import make
from focgen.logs.experiment import Experiment
from focgen.rig.effects import Run, library
from focgen.rig.rig import Actuator, Ranges, Rig, Signals
from tests.foreign.chain import Fault, Physics, Session

TS = 0.1
PHYSICS = Physics(1.0, 0.15, 0.8, 0.7, (0.1, 0.05), 1.0, 0.1)
RIG = Rig(
    "joint",
    TS,
    Signals("t", "y", "u", "p", None),
    Actuator(0.75, 0.7, (0.095, 0.055)),
    ranges=Ranges((0.0, 1.0), (0.0, 1.0), (0.0, 0.2)),
)
AGAIN = [(0.8, 0.5)] * 5
OTHERS = [(0.2,), (0.45, 0.3), (0.7, 0.58), (0.98, 0.85)]


def wanders(clock):
    """Up, down below where it began, and up again, within three minutes."""
    return 0.15 * np.sin(2 * np.pi * clock / 110.0) * (1.0 - clock / 400.0)


def session(courses, seed=0):
    """Levels held 6 s, each after a release of 4 s; the gain wanders."""
    rng, logs, now = np.random.default_rng(seed), [], 0.0
    rig = Session(PHYSICS, (Fault("drive", lambda x, clock, memory: x * (1.0 + wanders(clock))),), TS)
    for i, levels in enumerate(courses):
        course = [0.0, *(v for level in levels for v in (level, 0.0))]
        command = np.repeat(course, [10, *[60, 40] * len(levels)])
        made = rig.run(command, now + TS * np.arange(len(command)))
        noisy = made["curvature"] + 0.0008 * rng.normal(size=len(command))
        logs.append(Experiment(f"run{i}", TS, {"pressure": made["pressure"], "output": noisy}, now))
        now += len(command) * TS + 5.0
    return logs


def forms(diagnosis):
    return [[(c.effect, c.form) for c in cause.candidates] for cause in diagnosis.causes]


def test_a_wander_that_repeats_show_is_named_and_promises_nothing():
    found = diagnose(RIG, session(AGAIN))
    assert forms(found)[0][0] == ("gain_drift", "wandering")
    assert found.gap.explained < 0.5 * found.gap.refitted
    assert found.shrink == 0.0 and found.causes[0].shrink == 0.0
    assert any("gain_drift wanders" in note for note in found.notes)


def drift_found(logs):
    """The form of gain_drift that a ranking of its forms alone leaves."""
    problem = problem_of(RIG, make(logs, "pressure", "output"), logs)
    candidates = [CandidateEffect("gain_drift", form, "actuator") for form in library()["gain_drift"].forms]
    return rank(problem, problem.nominal(), candidates).best["gain_drift"].problem.candidates[-1].form.name


def test_without_repeats_no_path_through_time_is_drawn():
    """Each run at levels of its own: a gain by level would explain as much."""
    assert drift_found(session(AGAIN)) == "wandering"
    assert drift_found(session(OTHERS)) != "wandering"


def test_repeats_are_found_by_the_input_and_its_past():
    logs = session([AGAIN[0], (1.0, 0.3), AGAIN[0]])
    repeats = repeats_of(make(logs, "pressure", "output"), 2.0)
    cells = np.array(repeats.cells)
    last = len(logs[0]) + len(logs[1])
    changed = repeats.again[:, cells[:, 0] >= last]
    assert np.sum(np.any(changed == 1.0, axis=1)) > 0.9 * np.sum(cells[:, 0] >= last)
    assert np.allclose(repeats.again.sum(axis=1), 0.0)
    apart = repeats_of(make(session([(0.2,), (0.9,)]), "pressure", "output"), 2.0)
    loaded = [row for row in apart.again if np.any(np.abs(row) * (apart_means(apart) > 0.05) > 0)]
    assert not loaded


def test_what_a_creep_may_remember_is_no_repeat():
    """The rig of 2 s has long forgotten a hold that ended 40 s before; what creeps in it has not."""
    steps = [0.0, 1.0, 0.0, 0.5, 0.0]
    rests, held = np.zeros(400), np.ones(1200)
    block = np.repeat(steps, 40)

    def repeated(*between):
        pressure = np.concatenate([rests, block, *between, rests, block])
        log = Experiment("one", TS, {"pressure": pressure, "output": pressure}, 0.0)
        found = repeats_of(make([log], "pressure", "output"), 2.0)
        later = np.array(found.cells)[:, 0] >= len(pressure) - len(block)
        return np.sum(np.any(found.again[:, later] == 1.0, axis=1))

    assert repeated(np.zeros(1200)) > 10 and repeated(held) == 0


def apart_means(repeats):
    pressure = np.concatenate([log["pressure"] for log in session([(0.2,), (0.9,)])])
    return np.array([pressure[a:b].mean() for a, b in repeats.cells])


@pytest.mark.parametrize("family", ["gain_drift", "sensor_drift"])
def test_a_bend_never_turns_back_and_goes_straight_on(family):
    bending = next(f for f in library()[family].forms if f.name == "bending")
    run = Run.of([4001], [0.0], 0.05)
    for straight in (0.0, 0.7, 2.0):
        trend = bending.act(np.ones(4001), (0.3, straight, 100.0), run) - 1.0
        assert np.all(np.diff(trend) > -1e-12) and trend[2000] == pytest.approx(0.3)
        assert np.diff(trend[2000:], 2) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("family", ["gain_drift", "sensor_drift"])
def test_a_wander_comes_to_its_mean_after_the_session(family):
    wandering = next(f for f in library()[family].forms if f.name == "wandering")
    path = wandering.act(np.ones(4001), (0.2, -0.1, 0.3, 0.1, 100.0), Run.of([4001], [0.0], 0.05)) - 1.0
    assert path[500] == pytest.approx(0.2) and path[2000] == pytest.approx(0.1)
    assert path[2001:] == pytest.approx(np.mean(path[:2000]), abs=1e-3)


@pytest.mark.parametrize("size, pushed", [(0.0, False), (0.3, False), (4.0, True)])
def test_what_pushes_the_rig_is_no_noise_of_a_sensor(size, pushed):
    """White noise, and what a filter of the sensor makes of it, against pushes at the pace of the rig."""
    rng = np.random.default_rng(3)
    filtered = [lfilter([0.3], [1.0, -0.7], rng.normal(size=4000)) for _ in range(3)]
    slow = [gaussian_filter1d(rng.normal(size=4000), 15.0) for _ in range(3)]
    parts = [n + size * s / np.std(s) for n, s in zip(filtered, slow)]
    assert disturbance(parts, 0.05, 1.5).pushed == pushed
