"""What every bench has and no effect is: noise of a colour, zeros that wander, readings that are bad, missing
or repeated. A healthy rig stays healthy with each of them, and a faulty one is named as before.

Red when one of these is taken for an effect, or hides one.
"""

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.fitting.fit import WHITE, fit
from focgen.diagnosis.hypotheses.nuisances import _zeroed, problem_of
from focgen.diagnosis.problem.segments import make
from focgen.logs.experiment import Experiment
from tests.diagnosis_rig import RIG, H, session

SPANS = {"pressure": 0.18, "curvature": 0.011, "output": 0.011}
COLUMNS = {"command": "u", "pressure": "p", "curvature": "k", "output": "y"}
FAULTS = {
    "dead_zone": {"zone": 0.03},
    "valve_asymmetry": {"vent": 0.5},
    "hysteresis": {"slip": 0.35},
}


def coloured(rng, y, span):
    """A hundredth of noise that forgets within 1.6 s."""
    noise = lfilter([1.0], [1.0, -0.97], rng.normal(size=len(y) + 400))[400:]
    return y + 0.01 * span * noise * np.sqrt(1.0 - 0.97**2)


def flicker(rng, y, span):
    """Noise of as much power in each octave."""
    spectrum = np.fft.rfft(rng.normal(size=len(y)))
    spectrum[0], spectrum[1:] = 0.0, spectrum[1:] / np.sqrt(np.arange(1, len(spectrum)))
    noise = np.fft.irfft(spectrum, len(y))
    return y + 0.015 * span * noise / noise.std()


def rezeroed(rng, y, span):
    """Another zero in each experiment."""
    return y + 0.006 * span * rng.normal()


def sparks(rng, y, span):
    """One reading in 250 far off."""
    return np.where(rng.random(len(y)) < 0.004, y + 0.3 * span * rng.choice([-1.0, 1.0], len(y)), y)


def holes(rng, y, span):
    """One reading in a hundred missing."""
    return np.where(rng.random(len(y)) < 0.01, np.nan, y)


def repeats(rng, y, span):
    """One reading in twenty the last once more."""
    fresh = rng.random(len(y)) > 0.05
    fresh[0] = True
    return y[np.maximum.accumulate(np.where(fresh, np.arange(len(y)), 0))]


NUISANCES = (coloured, flicker, rezeroed, sparks, holes, repeats)


def spoilt(nuisance, seed, **case):
    """A session of whose measured signals each has the nuisance."""
    rng = np.random.default_rng(1000 + seed)
    return [
        Experiment(
            log.name,
            H,
            {r: log[r] if r == "command" else nuisance(rng, log[r], SPANS[r]) for r in log.signals},
            log.start,
        )
        for log in session(seed, **case)
    ]


def found(folder, logs):
    """The diagnosis of logs as they are read from files."""
    files = []
    for log in logs:
        clock = log.start + H * np.arange(len(log))
        names = ",".join(["t_s", *(COLUMNS[r] for r in log.signals)])
        rows = np.column_stack([clock, *log.signals.values()])
        files.append(folder / f"{len(files)}.csv")
        np.savetxt(files[-1], rows, delimiter=",", header=names, comments="", fmt="%.9g")
    return diagnose(RIG, files, pictures=False)


@pytest.mark.parametrize(
    "nuisance", (coloured, pytest.param(rezeroed, marks=pytest.mark.long)), ids=lambda n: n.__name__
)
def test_what_every_bench_has_is_no_fault(nuisance, tmp_path):
    assert found(tmp_path, spoilt(nuisance, 1)).verdict in ("none", "parameters")


@pytest.mark.long
@pytest.mark.parametrize("seed", range(1, 6))
@pytest.mark.parametrize("nuisance", NUISANCES, ids=lambda n: n.__name__)
def test_what_every_bench_has_is_no_fault_in_any_session(nuisance, seed, tmp_path):
    assert found(tmp_path, spoilt(nuisance, seed)).verdict in ("none", "parameters")


@pytest.mark.long
@pytest.mark.parametrize("seed", range(2, 4))
@pytest.mark.parametrize("effect", FAULTS)
@pytest.mark.parametrize("nuisance", NUISANCES, ids=lambda n: n.__name__)
def test_a_fault_is_named_beside_what_every_bench_has(nuisance, effect, seed, tmp_path):
    causes = found(tmp_path, spoilt(nuisance, seed, **FAULTS[effect])).causes
    assert causes and causes[0].candidates[0].effect == effect and len(causes) == 1


def test_zeros_that_differ_are_found_as_they_are():
    """Each experiment's own, as far as they differ from one another."""
    off = np.array([0.0, 8e-5, -9e-5, 5e-5, -4e-5])
    logs = [
        Experiment(log.name, H, {**log.signals, "curvature": log["curvature"] + zero}, log.start)
        for log, zero in zip(session(2), off)
    ]
    problem = _zeroed(problem_of(RIG, make(logs, "pressure", "curvature"), logs))
    assert problem.uneven
    best = fit(problem, problem.nominal(), WHITE)
    alike = problem.simulate(best.vector) - problem.simulate(problem.level(best.vector))
    zeros = [part[0] for part in problem.segment.parts(alike)]
    assert zeros - np.mean(zeros) == pytest.approx(off - off.mean(), abs=1.5e-5)
