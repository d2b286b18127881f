"""The joint fit beside logs that are exact at every sample: slow pressures, noise, cuts, any excitation.

Red when the joint fit is biased by slow pressures, cuts or noise.
"""

import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest

from focgen.errors import FitError
from focgen.identification.excitation import prepare
from focgen.identification.fractional import fit_fractional
from focgen.identification.identify import identify
from focgen.logs.experiment import Experiment
from tests.conftest import paper_rig
from tests.exact_actuator import ALPHA, GAIN, T, Truth, decaying, log_of, rise, straight

LEVELS = (0.075, 0.1, 0.125, 0.15, 0.175, 0.2)
AT = 0.15  # bar, where K is compared


def clock(step: float, end: float, before: float = 1.0) -> np.ndarray:
    return step * np.arange(-round(before / step), round(end / step))


def fitted(logs, powers: int = 2, **options):
    return fit_fractional([prepare(log, paper_rig(), powers) for log in logs], **options)


def compared(fit) -> tuple[np.ndarray, np.ndarray]:
    """Errors and half intervals of T, α and K at 0.15 bar."""
    powers = AT ** np.arange(len(fit.gain))
    quantile = np.max(fit.half["gain"] / np.sqrt(np.diag(fit.gain_covariance)))
    half = quantile * np.sqrt(powers @ fit.gain_covariance @ powers)
    errors = fit.T - T, fit.alpha - ALPHA, powers @ fit.gain - Truth().K(AT)
    return np.array(errors), np.array([fit.half["T"], fit.half["alpha"], half])


def test_the_truth_is_the_convolution_integral():
    """By mpmath's quadrature of the impulse response's series with p = 0.1 (1 − e^(−2t)) and K(p) p."""
    from mpmath import exp, gamma, inf, mpf, nsum, quad

    alpha, time = mpf(ALPHA), mpf("0.37")
    term = lambda v: lambda k: (-v / mpf(T)) ** k / gamma(alpha * k + alpha)
    impulse = lambda v: nsum(term(v), [0, inf]) / T / alpha
    drive = lambda p: GAIN[0] * p + GAIN[1] * p**2
    moved = lambda v: drive((1 - exp(-2 * (time - v ** (1 / alpha)))) / 10)
    whole = quad(lambda v: impulse(v) * moved(v), [0, time**alpha / 4, time**alpha])
    assert rise(0.1, 0.5, clock(0.01, 0.6))[1][137] == pytest.approx(float(whole), rel=1e-10)
    ramp = straight([(0.0, 0.0), (0.2, 0.1), (0.2, 0.05)], clock(0.01, 0.6))[1][137]
    ends = [(time - mpf(s)) ** alpha for s in ("0.37", "0.2", "0.0")]
    held = quad(lambda v: impulse(v) * drive(mpf("0.05")), ends[:2])
    moved = lambda v: drive((time - v ** (1 / alpha)) / 2)
    assert ramp == pytest.approx(float(held + quad(lambda v: impulse(v) * moved(v), ends[1:])), rel=1e-10)


# -- pressures that rise slowly --------------------------------------------------------------------


@pytest.mark.parametrize(
    "tau, near",
    [
        *((0.0, 1e-9), (0.03, 5e-5), (5.0, 1e-8)),
        *(
            pytest.param(*case, marks=pytest.mark.long)
            for case in ((0.1, 1e-7), (0.05, 1e-6), (0.5, 1e-8), (2.5, 1e-8))
        ),
    ],
)
def test_a_slow_pressure_gives_the_parameters_back(tau, near):
    """At 10 ms; where the pressure rises within three samples the polynomials between them are what is
    left."""
    t = clock(0.01, 20.0)
    fit = fitted([log_of(f"{p}", t, rise(p, tau, t)) for p in (0.075, 0.125, 0.2)])
    assert abs(fit.T / T - 1.0) <= near and abs(fit.alpha - ALPHA) <= near
    assert np.abs(fit.gain / GAIN - 1.0).max() <= 10.0 * near


def test_the_regulator_of_the_paper_gives_the_parameters_back():
    """152.48/(s² + 53.39 s + 1528), from the pressure at 10 ms alone."""
    t, (a, b) = clock(0.01, 20.0), np.roots([1.0, 53.39, 1528.0])
    parts = lambda p: {0.0: p, -a: p * b / (a - b), -b: -p * a / (a - b)}
    fit = fitted([log_of(f"{p}", t, decaying(parts(p), t)) for p in (0.075, 0.125, 0.2)])
    assert abs(fit.T / T - 1.0) <= 2e-6 and abs(fit.alpha - ALPHA) <= 2e-6


@pytest.mark.parametrize(
    "tau", [0.0, *(pytest.param(tau, marks=pytest.mark.long) for tau in (0.5, 2.5, 5.0))]
)
def test_the_rig_written_is_no_worse_than_the_single_fits(tau):
    """K times p at one level cannot be K(p) p where the pressure is slow; the rig has it."""
    t = clock(0.02, 30.0)
    found = identify(paper_rig(), [log_of(f"{p}", t, rise(p, tau, t)) for p in LEVELS[::2]], integer=False)
    assert found.gof["rig"]["mean"] >= found.gof["fom"]["mean"] - 0.005
    assert min(found.gof["rig"].values()) > 0.9999


# -- intervals -------------------------------------------------------------------------------------


def trials(tau: float, seeds: range, step: float, end: float, levels=LEVELS, noise=(0.004, 0.02)):
    """Errors and hits (seeds, 3) of the fits to a noisy session."""
    t = clock(step, end)
    clean = [rise(p, tau, t) for p in levels]
    made = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        made.append(compared(fitted([log_of(f"{p}", t, c, noise, rng) for p, c in zip(levels, clean)])))
    errors, halves = map(np.array, zip(*made))
    return errors, np.abs(errors) <= halves


@pytest.mark.long
def test_intervals_cover_the_truth_whatever_the_pressure_does():
    cells = [
        trials(tau, range(100 * cell, 100 * cell + 14), 0.05, 30.0, LEVELS[::2])
        for cell, tau in enumerate((0.0, 0.5, 5.0))
    ]
    assert np.mean([hits for _, hits in cells]) >= 0.9
    for errors, _ in cells:
        assert np.all(np.abs(errors.mean(axis=0)) < 0.9 * errors.std(axis=0))  # 3.4 of its own errors


@pytest.mark.long
def test_intervals_cover_the_truth_over_many_sessions():
    """Half a standard error of bias at most, and 95 % that is 92 to 98 %."""
    taus = (0.0, 0.03, 0.5, 2.5, 5.0)
    cells = [trials(tau, range(10_000 * c, 10_000 * c + 200), 0.02, 40.0) for c, tau in enumerate(taus)]
    for errors, hits in cells:
        assert np.all(np.abs(errors.mean(axis=0)) < 0.5 * errors.std(axis=0)) and hits.mean() >= 0.9
    assert 0.92 <= np.mean([hits for _, hits in cells]) <= 0.98


@pytest.mark.long
def test_a_noisy_step_of_pressure_is_a_step():
    """0.0007 bar of noise; read as a line from sample to sample, T would be 0.01 too large, and covered in 15
    %."""
    share = 0.0007 / 0.15
    errors, hits = trials(0.0, range(20), 0.01, 20.0, (0.15,), (share, 0.01))
    assert abs(errors[:, 0].mean()) < errors[:, 0].std() and hits[:, :2].mean() >= 0.85


# -- any excitation --------------------------------------------------------------------------------


def sine(t, seed):
    return decaying({0.0: 0.1, 0.6j: 0.05, -0.6j: 0.05}, t)


def multisine(t, seed):
    parts = {0.0: 0.1, 0.3j: 0.02, -0.3j: 0.02, 1.7j: -0.02j, -1.7j: 0.02j}
    return decaying(parts, t)


def binary(t, seed):
    rng, knots, p = np.random.default_rng(seed), [(0.0, 0.05)], 0.05
    for when in np.flatnonzero(rng.random(int(t[-1] / 0.4)) < 0.5) * 0.4:
        knots += [(when, p), (when, 0.2 - p)]
        p = 0.2 - p
    return straight(knots, t, Truth(gain=(Truth().K(AT),)))  # two levels show no line


def slow_ramp(t, seed):
    return straight([(0.0, 0.0), (12.0, 0.2), (24.0, 0.0)], t)


def staircase(t, seed):
    """Rests of 1.5 s, far too short to settle."""
    levels = [0.0, 0.05, 0.1, 0.15, 0.2, 0.12, 0.17, 0.08, 0.03, 0.0]
    return straight([(1.5 * i, p) for i, pair in enumerate(pairwise(levels)) for p in pair], t)


def working_day(t, seed):
    rng, knots = np.random.default_rng(seed), [(0.0, 0.0)]
    while knots[-1][0] < t[-1]:
        when, _p = knots[-1]
        knots.append((when + rng.choice([0.0, 0.5, 2.0]), rng.uniform(0.0, 0.2)))
        knots.append((round(knots[-1][0] + 0.02 * rng.integers(25, 200), 2), knots[-1][1]))
    return straight(knots, t)


@pytest.mark.parametrize(
    "course",
    [
        *(pytest.param(course, marks=pytest.mark.long) for course in (sine, multisine)),
        *(binary, slow_ramp, staircase, working_day),
    ],
)
def test_any_excitation_shows_the_parameters(course):
    """Exact without noise; with it, errors within 3.5 standard errors, and small."""
    t = clock(0.02, 30.0)
    clean, powers = course(t, 1), 1 if course is binary else 2
    exact = compared(fitted([log_of("a", t, clean)], powers))[0]
    assert np.all(np.abs(exact) < [2e-4, 1e-4, 1e-5])
    noisy = log_of("a", t, clean, (0.001, 0.01), np.random.default_rng(3))
    errors, halves = compared(fitted([noisy], powers))
    assert np.all(np.abs(errors) < 1.8 * halves) and halves[1] < 0.05


def test_one_level_has_a_constant_gain_and_says_so():
    t = clock(0.02, 30.0)
    made = straight([(0.0, 0.0), (0.0, 0.15), (15.0, 0.15), (15.0, 0.0)], t)
    found = identify(
        paper_rig(), [log_of("a", t, made, (0.001, 0.01), np.random.default_rng(0))], integer=False
    )
    (low, high) = found.joint.ci95["gain"][0]
    assert len(found.joint.gain) == 1 and low < Truth().K(0.15) < high
    assert any("1 distinct level: K(p) of degree 0, not 1" in note for note in found.notes)


def test_experiments_may_differ_in_length_and_sample_time():
    rng, logs = np.random.default_rng(2), []
    for p, t in ((0.1, clock(0.01, 30.0)), (0.15, clock(0.02, 12.0)), (0.2, clock(0.05, 25.0, 0.5))):
        made = straight([(0.0, 0.0), (0.0, p), (10.0, p), (10.0, 0.0)], t)
        logs.append(log_of(f"{p}", t, made, (0.002, 0.01), rng))
    for order in (logs, logs[::-1]):
        errors, halves = compared(fitted(order))
        assert np.all(np.abs(errors) < 1.8 * halves) and halves[0] < 0.01


# -- logs that begin in the middle -----------------------------------------------------------------


def release_course(p: float) -> list[tuple[float, float]]:
    return [(0.0, 0.0), (0.0, p), (15.0, p), (15.0, 0.0)]


def staircase_course(p: float) -> list[tuple[float, float]]:
    levels = [0.0, 0.5 * p, p, 0.75 * p, 0.25 * p, 0.0]
    return [(6.0 * i, q) for i, pair in enumerate(pairwise(levels)) for q in pair]


def cut_session(seed: int, course, latest: float, step: float) -> list[Experiment]:
    """Three levels, each cut off ahead of a random time."""
    rng, t, logs = np.random.default_rng(seed), clock(step, 32.0), []
    for p in (0.1, 0.15, 0.2):
        whole = log_of(f"{p}", t, straight(course(p), t), (0.002, 0.01), rng)
        first = rng.integers(0, int(latest / step))
        logs.append(Experiment(whole.name, step, {role: v[first:] for role, v in whole.signals.items()}))
    return logs


def cut_trials(seeds: range, course, latest: float, step: float = 0.02) -> tuple[int, np.ndarray]:
    """How many sessions had a model, and the errors of T and α in half intervals."""
    found = []
    for seed in seeds:
        try:
            ci95 = identify(paper_rig(), cut_session(seed, course, latest, step), integer=False).joint.ci95
        except FitError:
            continue
        spans = np.array([ci95["T"], ci95["alpha"]])
        found.append((spans.mean(axis=1) - (T, ALPHA)) / (0.5 * np.ptp(spans, axis=1)))
    return len(found), np.array(found)


@pytest.mark.long
def test_logs_cut_off_within_a_hold_tell_the_same():
    count, errors = cut_trials(range(3), release_course, 12.0, 0.05)
    assert count == 3 and np.mean(np.abs(errors) <= 1.0) >= 0.75 and np.abs(errors).max() < 2.0


@pytest.mark.long
@pytest.mark.parametrize("course, latest", [(release_course, 14.0), (staircase_course, 20.0)])
def test_logs_cut_off_anywhere_tell_the_same(course, latest):
    count, errors = cut_trials(range(100), course, latest)
    assert count >= 90 and np.mean(np.abs(errors) <= 1.0) >= 0.9


# -- what is no log of such a rig ------------------------------------------------------------------


def refused(log: Experiment, folder) -> FitError:
    with pytest.raises(FitError) as caught:
        identify(paper_rig(), [log], folder / "new.toml", integer=False)
    assert list(folder.iterdir()) == []
    return caught.value


def test_noise_that_does_not_follow_the_input_is_no_model(tmp_path):
    t, rng = clock(0.02, 20.0), np.random.default_rng(0)
    made = 0.15 * (t >= 0.0), rng.normal(size=len(t))
    assert "look at its columns" in str(refused(log_of("a", t, made), tmp_path))


def test_a_constant_input_after_a_cut_is_no_model(tmp_path):
    t = clock(0.02, 30.0)
    whole = log_of("a", t, rise(0.15, 0.0, t), (0.0, 0.01), np.random.default_rng(0))
    cut = Experiment("a", 0.02, {role: values[120:] for role, values in whole.signals.items()})
    assert "several levels and back to 0" in str(refused(cut, tmp_path))


def test_a_pulse_of_three_samples_in_noise_is_no_model(tmp_path):
    t = clock(0.01, 10.0)
    made = straight([(0.0, 0.0), (0.0, 0.15), (0.03, 0.15), (0.03, 0.0)], t)
    assert "hold a step" in str(refused(log_of("a", t, made, (0.0, 0.3), np.random.default_rng(0)), tmp_path))


# -- long logs -------------------------------------------------------------------------------------

_LONG = """
import resource, numpy as np
from tests.exact_actuator import power_answer
from tests.identification.test_joint import log_of, fitted
t = 0.01 * np.arange(-1000, 999_000)
made = np.zeros(len(t)), np.zeros(len(t))
for i, p in enumerate(np.random.default_rng(0).uniform(-0.1, 0.1, 40)):
    late = t - 200.0 * i
    made[0][late >= -1e-9] += p
    made[1][:] += 0.05 * p * power_answer(late, 0)
fit = fitted([log_of("a", t, made, (0.0, 0.01), np.random.default_rng(1))], powers=1)
assert abs(fit.T - 1.32) < 2.0 * fit.half["T"] < 0.02
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.long
def test_a_million_samples_fit_into_a_gigabyte():
    run = subprocess.run([sys.executable, "-c", _LONG], capture_output=True, text=True, check=True)
    assert int(run.stdout) < 1e6  # kB
