"""Fits of the fractional model: exact without noise, honest intervals with it, the paper's order of models.

Red when a fit without noise is off, intervals are too narrow, or models come in another order.
"""

from functools import cache

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.errors import FitError, LogError
from focgen.fractional.responses import mittag_leffler, step_response
from focgen.fractional.transfer import TransferFunction
from focgen.identification import identify as module
from focgen.identification.excitation import prepare
from focgen.identification.fractional import fit_fractional
from focgen.identification.gain import secants_of
from focgen.identification.integer import SHAPES, fit_integer_models
from focgen.identification.kernel import kernels
from focgen.identification.quality import gof
from focgen.identification.ready import befores_of
from focgen.logs.between import course_of, jumps_of
from focgen.logs.experiment import Experiment
from tests.conftest import paper_rig

K, T, ALPHA, LEVEL = 0.05, 1.32, 0.6, 0.15
COARSE = 0.05  # s between samples, where many fits are asked for


@cache
def exact_step(step: float, count: int, begin: float, T: float = T, alpha: float = ALPHA) -> np.ndarray:
    """1 − E_α(−t^α/T), t since ``begin``: the model's unit step response, by the Mittag-Leffler function."""
    late = step * np.arange(count) - begin
    after = late > 0.0
    answer = np.zeros(count)
    answer[after] = 1.0 - mittag_leffler(alpha, 1.0, -(late[after] ** alpha) / T)
    return answer


def step_log(
    step=0.02, seconds=41.0, release=None, noise=None, level=LEVEL, offset=0.0, **model
) -> Experiment:
    """A held step of pressure at 1 s, released at ``release`` s."""
    time = step * np.arange(round(seconds / step))
    pressure = level * (np.arange(len(time)) >= round(1.0 / step))
    curvature = K * level * exact_step(step, len(time), 1.0, **model) + offset
    if release is not None:
        pressure = pressure * (np.arange(len(time)) < round(release / step))
        curvature = curvature - K * level * exact_step(step, len(time), release, **model)
    noise = 0.0 if noise is None else noise
    return Experiment(
        "step", step, {"pressure": pressure, "curvature": curvature + noise, "output": curvature}
    )


def fitted(log: Experiment):
    return fit_fractional([prepare(log, paper_rig())])


@pytest.mark.parametrize("alpha", [0.3, 0.6, 0.95, 1.4])
@pytest.mark.parametrize("release", [None, 21.0])
def test_parameters_come_back_exactly_without_noise(alpha, release):
    """N = 2000 at 10 ms; plain Grünwald–Letnikov is off by 6e-3 in α."""
    fit = fitted(step_log(0.01, 21.0 if release is None else 30.0, release, alpha=alpha, offset=0.003))
    assert abs(fit.alpha - alpha) <= 1e-7 and abs(fit.T / T - 1.0) <= 1e-6 and abs(fit.K / K - 1.0) <= 1e-6
    assert fit.offset[0] == pytest.approx(0.003, abs=1e-9)


def chain_log(roles: tuple[str, ...]) -> Experiment:
    """A step of the command through regulator, actuator and sensor, each exact; only ``roles`` are logged."""
    rig, time = paper_rig(), 0.01 * np.arange(2000)
    late = time > 1.0
    stages = {"pressure": rig.regulator, "curvature": TransferFunction([(K, 0)], [(T, ALPHA), (1, 0)])}
    signals, so_far = {"command": 1.5 * (time >= 1.0)}, TransferFunction([(1.5, 0)])
    for role, stage in (*stages.items(), ("output", rig.sensor)):
        so_far, signals[role] = so_far * stage, np.zeros(len(time))
        signals[role][late] = step_response(so_far, time[late] - 1.0)
    return Experiment("step", 0.01, {role: signals[role] for role in roles})


@pytest.mark.parametrize("driven_by", ["pressure", "command"])
@pytest.mark.parametrize("fitted_to", ["curvature", "output"])
def test_what_is_not_logged_is_made_by_the_rig(driven_by, fitted_to):
    """The command goes through the regulator, the model through the sensor; the pressure is known
    at its samples only.
    """
    x = prepare(chain_log(tuple(dict.fromkeys((driven_by, fitted_to, "output")))), paper_rig())
    assert (x.input_role, x.fitted_role) == (driven_by, fitted_to)
    fit = fit_fractional([x])
    assert abs(fit.alpha - ALPHA) < 2e-6 and fit.T == pytest.approx(T, rel=3e-6)
    assert fit.K == pytest.approx(K, rel=1e-6)


def test_a_jump_stands_alone_and_above_the_noise():
    time, noise = 0.01 * np.arange(2000), np.random.default_rng(0).normal(size=2000)
    rise = 0.15 * (1.0 - np.exp(-np.maximum(time - 1.0, 0.0) / 0.05))
    step = 0.15 * (time > 1.0)
    jumping = {101: step, 300: step + 6e-4 * noise - step * (time < 3.0)}
    for first, values in jumping.items():
        assert np.flatnonzero(jumps_of(values)).tolist() == [first]
    for moving in (rise, np.round(rise, 3), rise + noise, np.sin(time), 0.0 * time, rise + 6e-4 * noise):
        assert not jumps_of(moving).any()


def test_between_samples_a_smooth_input_is_met_to_the_sixth_order():
    """The area under it in each sample, beside a kink and across a jump; Simpson's rule on 200 parts is the
    truth."""
    h, places = 0.05, np.linspace(0.0, 1.0, 201)
    smooth = lambda t: np.sin(2.0 * t) + 2.0 * np.maximum(t - 1.5, 0.0) * np.exp(-t)
    time = h * np.arange(80)
    values = smooth(time) + 1.5 * (np.arange(80) >= 50)
    jumps = np.arange(80) == 50
    course = course_of((values - values[0])[None], jumps)
    begin = course.values[0, :-1]
    area = begin + course.straight[0, 1:] / 2.0 - course.bends[0, 1:] / 6.0
    fine = smooth(time[:-1, None] + h * places) + 1.5 * (np.arange(79) >= 50)[:, None] - values[0]
    kept = np.arange(79) != 49  # the sample that ends in the jump is the jump
    weights = np.r_[1.0, np.tile([4.0, 2.0], 99), 4.0, 1.0] / 600.0
    assert np.abs(area - fine @ weights)[kept].max() < 2e-8
    assert np.abs(begin + course.straight[0, 1:] / 2.0 - fine @ weights)[kept].max() > 1e-4  # straight lines


def coverage(colour: float, seeds: int) -> float:
    """Share of the 95 % intervals of K, T and α that contain the truth; noise of 2 % of the final value."""
    count, hits = len(step_log(COARSE)), 0
    for seed in range(seeds):
        white = np.random.default_rng(seed).normal(size=count + 200)
        noise = lfilter([np.sqrt(1.0 - colour**2)], [1.0, -colour], white)[200:]
        fit = fitted(step_log(COARSE, noise=0.02 * K * LEVEL * noise))
        hits += abs(fit.K - K) <= fit.half["gain"][0]
        hits += (abs(fit.T - T) <= fit.half["T"]) + (abs(fit.alpha - ALPHA) <= fit.half["alpha"])
    return hits / (3 * seeds)


@pytest.mark.parametrize("seeds", [100, pytest.param(400, marks=pytest.mark.long)])
def test_intervals_cover_the_truth_with_white_noise(seeds):
    assert 0.92 <= coverage(0.0, seeds) <= 0.98


@pytest.mark.parametrize("seeds", [60, pytest.param(200, marks=pytest.mark.long)])
def test_intervals_cover_the_truth_with_coloured_noise(seeds):
    """Ignoring the correlation would cover about half of it."""
    assert 0.90 <= coverage(0.9, seeds) <= 0.985


@pytest.mark.long
@pytest.mark.parametrize("seeds", [60, 200])
def test_intervals_cover_the_truth_where_the_pressure_is_noisy_too(seeds):
    """Its first sample alone, for the rest before it, would shift K: 82 % instead of 95 %."""
    clean, hits = chain_log(("pressure", "curvature", "output")), 0
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        noise = {"pressure": 0.004, "curvature": 0.01, "output": 0.01}
        noisy = {
            role: values + noise[role] * values[-1] * rng.normal(size=2000)
            for role, values in clean.signals.items()
        }
        fit = fitted(Experiment("step", 0.01, noisy))
        hits += int(abs(fit.K - K) <= fit.half["gain"][0]) + int(abs(fit.T - T) <= fit.half["T"])
        hits += int(abs(fit.alpha - ALPHA) <= fit.half["alpha"])
    assert 0.92 <= hits / (3 * seeds) <= 0.98


def test_the_pressure_before_a_step_is_that_of_its_rest():
    time, rng = 0.01 * np.arange(2000), np.random.default_rng(5)
    rest = lambda p: prepare(Experiment("e", 0.01, {"pressure": p, "output": time}), paper_rig()).before
    step = 0.1 + 0.05 * (time > 1.0)
    assert rest(step) == 0.1
    assert abs(rest(step + 1e-3 * rng.normal(size=2000)) - 0.1) < 4e-4  # of 80 samples
    for moving in (0.1 + 0.05 * np.sin(time), 0.01 * time, 0.1 + 0.05 * (time > 0.0)):
        assert rest(moving) == pytest.approx(moving[0], abs=1e-12)


def test_the_fractional_model_ranks_as_in_the_paper():
    """FOM ≈ 3p2z > 2p1z > 1p, of 40 s steps with 2 % noise."""
    scores = []
    for seed in range(4):
        noise = 0.02 * K * LEVEL * np.random.default_rng(seed).normal(size=2050)
        x = prepare(step_log(noise=noise), paper_rig())
        models = {f.name: gof(x.measured, f.simulated) for f in fit_integer_models(x)}
        scores.append({**models, "fom": gof(x.measured, fit_fractional([x]).simulated[0])})
    mean = {name: np.mean([s[name] for s in scores]) for name in scores[0]}
    assert abs(mean["fom"] - mean["3p2z"]) < 0.01
    assert min(mean["fom"], mean["3p2z"]) > mean["2p1z"] + 0.01 and mean["2p1z"] > mean["1p"] + 0.1


def test_larger_integer_models_never_fit_worse():
    noise = 0.02 * K * LEVEL * np.random.default_rng(1).normal(size=2050)
    x = prepare(step_log(noise=noise), paper_rig())
    scores = {(f.poles, f.zeros): gof(x.measured, f.simulated) for f in fit_integer_models(x)}
    assert set(scores) == set(SHAPES)
    for (poles, zeros), score in scores.items():
        assert score >= scores.get((poles, zeros - 1), -1.0) - 1e-3


def test_an_integer_plant_is_found_exactly():
    """A held input through (2 s + 1)/((s + 3)(s + 0.2)): the closed form of its step response."""
    time = 0.02 * np.arange(1500)
    late = np.maximum(time - 1.0, 0.0)
    residues = {pole: (2.0 * pole + 1.0) / (2.0 * pole + 3.2) / pole for pole in (-3.0, -0.2)}
    answer = 1.0 / 0.6 + sum(r * np.exp(p * late) for p, r in residues.items())
    moved = np.arange(1500) >= 50
    log = Experiment("plant", 0.02, {"pressure": 1.0 * moved, "curvature": answer * (time > 1.0)})
    fit = {f.name: f for f in fit_integer_models(prepare(log, paper_rig()))}["2p1z"]
    assert fit.num == pytest.approx([2.0, 1.0], rel=1e-4) and fit.den == pytest.approx(
        [1.0, 3.2, 0.6], rel=1e-4
    )


def six_levels(**changes) -> list[Experiment]:
    line = lambda p: (0.0015 + 0.345 * p) * p / (K * LEVEL)
    logs = []
    for i, level in enumerate((0.075, 0.1, 0.125, 0.15, 0.175, 0.2)):
        log = step_log(**changes)
        signals = {
            "pressure": log["pressure"] / LEVEL * level,
            "curvature": log["curvature"] * line(level),
            "output": log["output"],
        }
        logs.append(Experiment(f"{level}", log.sample_time, signals, start=100.0 * i))
    return logs


def test_the_rig_has_the_line():
    found = module.identify(paper_rig(), six_levels(), integer=False)
    assert found.joint.gain == pytest.approx((0.0015, 0.345), rel=1e-5) and found.joint.gain_r2 > 1.0 - 1e-9
    assert found.joint.T == pytest.approx(T, rel=1e-6) and found.joint.alpha == pytest.approx(ALPHA, abs=1e-6)
    assert found.gof["rig"]["mean"] > 0.9999
    assert any("positive steps only" in w for w in found.warnings)
    assert any("levels rise" in w for w in found.warnings)


def between(p: float, q: float) -> Experiment:
    """At rest at p for ever, then stepped to q."""
    drive = lambda p: (0.0015 + 0.345 * p) * p
    pressure = np.where(np.arange(2000) >= 50, q, p)
    curvature = drive(p) + (drive(q) - drive(p)) * exact_step(0.02, 2000, 1.0)
    return Experiment(
        f"{p} to {q}", 0.02, {"pressure": pressure, "curvature": curvature, "output": curvature}
    )


@pytest.mark.parametrize(
    "ends",
    [
        [(0.1, 0.0), (0.15, 0.0), (0.2, 0.0)],
        [(0.0, 0.1), (0.1, 0.0), (0.0, 0.2), (0.2, 0.0)],
        pytest.param([(0.05, 0.1), (0.1, 0.2), (0.15, 0.05)], marks=pytest.mark.long),
    ],
    ids=["releases", "up and down", "between levels"],
)
def test_steps_from_anywhere_to_anywhere_give_the_line(ends):
    found = module.identify(paper_rig(), [between(*each) for each in ends], integer=False)
    assert found.joint.gain == pytest.approx((0.0015, 0.345), rel=1e-6)
    assert found.gof["rig"]["mean"] > 0.9999
    assert [fit.level for fit in found.experiments] == [max(each) for each in ends]
    assert not any("positive steps only" in w for w in found.warnings)
    said = [note for note in found.notes if "mean slope of K(p) p" in note]
    inside = [f"{p} to {q}" for p, q in ends if min(p, q) > 0.0]
    assert len(said) == bool(inside) and all(name in said[0] for name in inside)


def test_the_gain_of_a_step_is_the_slope_of_the_drive_on_it():
    """K(p) of degree 2: a step from p to q has the secant of K(p) p for its gain."""
    ends = np.array([(0.0, 0.1), (0.1, 0.2), (0.2, 0.05), (0.15, 0.0), (0.0, 0.2)])
    drive = np.polynomial.Polynomial([0.0, 0.02, -0.3, 2.0])
    slopes = np.diff(drive(ends)).ravel() / np.diff(ends).ravel()
    assert secants_of(ends, 3) @ [0.02, -0.3, 2.0] == pytest.approx(slopes, rel=1e-12)


def test_releases_are_fitted_and_silence_the_warning():
    found = module.identify(paper_rig(), six_levels(release=25.0), integer=False)
    assert found.joint.gain == pytest.approx((0.0015, 0.345), rel=1e-5)
    assert not any("positive steps only" in w for w in found.warnings)


def test_a_degree_that_the_levels_cannot_show_is_lowered_and_said():
    found = module.identify(paper_rig(), six_levels()[:2], gain_degree=3, integer=False)
    assert len(found.joint.gain) == 2 and any("2 distinct levels" in note for note in found.notes)


def test_useless_logs_are_refused():
    flat = step_log()
    with pytest.raises(LogError, match="throughout"):
        module.identify(
            paper_rig(), [Experiment("flat", 0.02, {**flat.signals, "curvature": np.ones(len(flat))})]
        )
    with pytest.raises(LogError, match="0 throughout"):
        module.identify(
            paper_rig(), [Experiment("rest", 0.02, {**flat.signals, "pressure": np.zeros(len(flat))})]
        )


def test_an_output_that_does_not_follow_the_input_is_no_model(tmp_path):
    """Noise unrelated to the steps: nothing is determined, and nothing is written."""
    for seed in range(4):
        log, noise = step_log(), np.random.default_rng(seed).normal(size=2050)
        signals = {"pressure": log["pressure"], "curvature": noise, "output": noise}
        with pytest.raises(FitError, match="determine|edge"):
            module.identify(
                paper_rig(), [Experiment("noise", 0.02, signals)], tmp_path / "new.toml", integer=False
            )
    assert not list(tmp_path.iterdir())


def test_kernels_stay_finite_where_a_pole_dies_within_a_sample():
    """Levenberg–Marquardt wanders to such time constants; a warning would be an error here."""
    for log_tau in (-12.0, -40.0, -60.0):
        made = kernels(log_tau, 1.4, 0.05, 50)
        for response in (made.steps[0], made.means[0]):
            assert np.all(np.isfinite(response)) and response[1:] == pytest.approx(1.0, abs=1e-4)


def log_of_the_step_alone(noise: float, seed: int = 0, offset: float = 0.0) -> Experiment:
    """40 s at 10 ms that begin with the step; ``noise`` as a share of the final value."""
    clean = K * LEVEL * exact_step(0.01, 4000, 0.0) + offset
    made = clean + noise * K * LEVEL * np.random.default_rng(seed).normal(size=4000)
    return Experiment("step", 0.01, {"pressure": np.full(4000, LEVEL), "curvature": made, "output": made})


def test_integer_models_have_no_offset_where_no_rest_is_on_record():
    """The models then differ as in the paper: 0.826, 0.823, 0.802, 0.567 by a fit of others, without any
    offset.
    """
    found = module.identify(paper_rig(), [log_of_the_step_alone(0.02)])
    mean = {model: values["mean"] for model, values in found.gof.items()}
    reached = [mean[model] for model in ("fom", "iom_3p2z", "iom_2p1z", "iom_1p")]
    assert reached == pytest.approx([0.826, 0.823, 0.802, 0.567], abs=0.006)
    assert all(f.offset == 0.0 for f in found.experiments[0].integer)
    assert any("shows no offset" in note for note in found.notes)


def test_an_offset_that_is_there_is_found_without_a_rest():
    found = module.identify(paper_rig(), [log_of_the_step_alone(0.01, offset=0.2 * K * LEVEL)])
    (fit,) = found.experiments
    assert fit.offset == pytest.approx(0.2 * K * LEVEL, rel=0.1)
    assert fit.ci95["alpha"][0] < ALPHA < fit.ci95["alpha"][1]
    assert all(f.offset != 0.0 for f in fit.integer) and not any(
        "shows no offset" in note for note in found.notes
    )


def later(log: Experiment, begin: float) -> Experiment:
    """The log from ``begin`` s on, as if nothing had been recorded before."""
    first = round(begin / log.sample_time)
    return Experiment(
        log.name, log.sample_time, {role: values[first:] for role, values in log.signals.items()}
    )


def test_the_interval_of_a_dead_time_is_in_seconds():
    """0.113 s at 20 ms a sample: the estimates scatter as widely as their intervals say."""
    late, found, half = 0.113, [], []
    for seed in range(20):
        log = step_log(seconds=21.0)
        noise = 0.02 * K * LEVEL * np.random.default_rng(seed).normal(size=len(log))
        curvature = K * LEVEL * exact_step(0.02, len(log), 1.0 + late) + noise
        delayed = Experiment("late", 0.02, {**log.signals, "curvature": curvature})
        fit = fit_fractional([prepare(delayed, paper_rig())], True)
        found.append(fit.delay)
        half.append(fit.half["delay"])
    spread = float(np.std(found))
    assert abs(np.mean(found) - late) < spread and 0.6 < 1.96 * spread / np.mean(half) < 1.6


def test_a_log_that_is_shown_but_not_fitted_may_begin_in_a_transient():
    log = step_log(release=21.0)
    found = module.identify(paper_rig(), [log], gain_degree=0, unseen=[later(log, 3.0)], integer=False)
    assert found.unseen[0].gof > 0.99


def test_an_input_that_is_up_at_first_has_stepped_there_only_where_the_answer_begins_there():
    rng = np.random.default_rng(1)
    log = step_log(release=21.0, noise=0.01 * K * LEVEL * rng.normal(size=2050))
    assert befores_of([later(log, 1.0)], paper_rig(), 1) == [0.0]
    assert befores_of([later(log, 3.0)], paper_rig(), 1) == [None]


def test_a_misfit_is_not_blamed_on_short_holds():
    """An output that wanders by itself: no holding of steps helps."""
    log = step_log(release=21.0)
    wandering = np.cumsum(np.random.default_rng(2).normal(size=len(log)))
    wanders = Experiment("w", 0.02, {**log.signals, "curvature": wandering})
    with pytest.raises(FitError) as raised:
        module.identify(paper_rig(), [wanders], integer=False)
    assert "hold" not in raised.value.remedy and "columns" in raised.value.remedy


def test_a_log_that_only_relaxes_is_not_taken_for_driven():
    """What a release left, beside a gauge's noise about 0: any gain would make a step of the first
    reading."""
    log = step_log(release=12.0)
    rng = np.random.default_rng(3)
    signals = {role: values[800:] for role, values in log.signals.items()}
    signals["pressure"] = signals["pressure"] + 3e-4 * rng.normal(size=len(signals["pressure"]))
    rests = Experiment("rests", 0.02, signals)
    with pytest.raises(LogError, match="only its own noise moves"):
        module.identify(paper_rig(), [rests], integer=False)
    found = module.identify(paper_rig(), [log, rests], integer=False)
    assert found.joint.T == pytest.approx(T, rel=1e-6) and any("rests: not used" in n for n in found.notes)
