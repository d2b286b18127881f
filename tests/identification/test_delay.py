"""The dead time of the actuator: found with an interval that holds it, whatever the input does.

Red when an interval of the dead time misses the truth.
"""

import numpy as np
import pytest

from focgen.errors import FitError
from focgen.identification.excitation import prepare
from focgen.identification.fractional import fit_fractional
from focgen.identification.identify import identify
from tests.conftest import paper_rig
from tests.exact_actuator import ALPHA, T, Truth, log_of, straight

STEP = 0.02
LEVELS = (0.1, 0.2)


def held(p, t, of):
    return straight([(0.0, 0.0), (0.0, p), (12.0, p), (12.0, 0.0)], t, of)


def slow(p, t, of):
    """Rises at a speed, then stays: a bend in the drive shows the delay."""
    return straight([(0.0, 0.0), (2.0, p), (12.0, p), (14.0, 0.0)], t, of)


def trials(course, delay: float, seeds: range):
    """Errors of L, T, α over their half intervals, and the half interval of L in s; (seeds, 3) and
    (seeds,)."""
    t, of = STEP * np.arange(-50, 1100), Truth(delay=delay)
    clean, errors, halves = [course(p, t, of) for p in LEVELS], [], []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        logs = [log_of(f"{p}", t, c, (0.002, 0.01), rng) for p, c in zip(LEVELS, clean)]
        fit = fit_fractional([prepare(log, paper_rig(), 2) for log in logs], delay=True)
        half = [fit.half[name] for name in ("delay", "T", "alpha")]
        errors.append(np.array([fit.delay - delay, fit.T - T, fit.alpha - ALPHA]) / half)
        halves.append(half[0])
    return np.array(errors), np.array(halves)


@pytest.mark.parametrize(
    "course, delay",
    [
        *((held, 2.37 * STEP), (slow, 0.15)),
        *(
            pytest.param(*case, marks=pytest.mark.long)
            for case in ((slow, 2.37 * STEP), (held, 0.0), (slow, 0.0), (held, 0.15))
        ),
    ],
)
def test_the_dead_time_lies_in_its_interval(course, delay):
    errors, halves = trials(course, delay, range(5))
    assert np.mean(np.abs(errors) <= 1.0) >= 0.7 and np.abs(errors).max() < 2.2
    assert np.all((1e-4 < halves) & (halves < STEP))  # far from nothing, and from what says nothing


@pytest.mark.long
@pytest.mark.parametrize("course", [held, slow])
@pytest.mark.parametrize("delay", [2.37 * STEP, 0.15])
def test_the_dead_time_is_unbiased_over_many_sessions(course, delay):
    errors, _ = trials(course, delay, range(1000, 1100))
    assert np.all(np.abs(errors.mean(axis=0)) < 0.5 * errors.std(axis=0))
    assert np.all(np.mean(np.abs(errors) <= 1.0, axis=0) >= 0.88)


def test_a_dead_time_is_found_in_experiments_of_different_sample_times():
    rng, of, logs = np.random.default_rng(1), Truth(delay=1.3), []
    for p, step in ((0.1, 0.05), (0.15, 0.02), (0.2, 0.01)):
        t = step * np.arange(-round(1.0 / step), round(22.0 / step))
        logs.append(log_of(f"{p}", t, held(p, t, of), (0.002, 0.01), rng))
    for order in (logs, logs[::-1]):
        found = identify(paper_rig(), order, delay=True, integer=False).joint
        low, high = found.ci95["delay"]
        assert low < 1.3 < high and high - low < 0.02


def test_a_dead_time_beyond_reach_is_refused(tmp_path):
    t, of = STEP * np.arange(-50, 1100), Truth(delay=9.0)
    log = log_of("a", t, held(0.2, t, of), (0.002, 0.01), np.random.default_rng(0))
    with pytest.raises(FitError, match="longest that is looked for"):
        identify(paper_rig(), [log], tmp_path / "new.toml", delay=True, gain_degree=0, integer=False)
    assert list(tmp_path.iterdir()) == []


def test_the_interval_of_a_dead_time_ends_at_zero():
    """Without a dead time it is as likely to come out above as below."""
    t, of = STEP * np.arange(-50, 1100), Truth(delay=0.0)
    rng = np.random.default_rng(1)
    logs = [log_of(f"{p}", t, held(p, t, of), (0.002, 0.01), rng) for p in LEVELS]
    found = identify(paper_rig(), logs, delay=True, integer=False).joint
    low, high = found.ci95["delay"]
    assert low == 0.0 <= found.delay < high < STEP
