"""Regulator and sensor from their own signals: right shape, honest intervals, both directions apart.

The truth is simulated here, by scipy's holds on a grid 20 times finer than the log's.

Red when a stage gets another order, or an interval misses its truth.
"""

from functools import cache

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from focgen.errors import FitError
from focgen.identification.rational import Record, Shape, responses
from focgen.identification.stages import identify_stage
from focgen.logs.experiment import Experiment

FINER = 20
PAPER = [152.48], [1.0, 53.39, 1528.0]
WN, DAMPING, GAIN = np.sqrt(1528.0), 53.39 / 2.0 / np.sqrt(1528.0), 152.48 / 1528.0


def staircase(rng, count, held=150, top=10.0):
    return np.repeat(rng.uniform(0.0, top, count // held + 1), held)[:count]


def steps(count, level, begin, end):
    command = np.zeros(count)
    command[begin:end] = level
    return command


def prbs(rng, count, bit=8, low=2.0, high=6.0):
    return np.repeat(np.where(rng.random(count // bit + 1) < 0.5, low, high), bit)[:count]


def commands(seed=0, count=1500):
    """A staircase, a step and its release, and a random binary signal."""
    rng = np.random.default_rng([seed, 99])
    return [staircase(rng, count), steps(count, 6.0, 50, count // 2), prbs(rng, count)]


def on_fine_grid(system, fine, h, late=0.0, hold="zoh"):
    """The answer at the samples to an input known on the fine grid, from rest, ``late`` samples later."""
    num, den, _ = cont2discrete(system, h / FINER, hold)
    shift = round(late * FINER)
    fine = np.concatenate([np.zeros(shift), fine])[: len(fine)]
    return lfilter(np.ravel(num), den, fine)[::FINER]


def regulator_logs(system, inputs, h=0.01, noise=0.004, late=0.0, seed=0, offset=0.3, skip=0):
    rng = np.random.default_rng(seed)
    logs = []
    for i, command in enumerate(inputs):
        pressure = on_fine_grid(system, np.repeat(command, FINER), h, late)
        pressure = pressure + offset + noise * np.ptp(pressure) * rng.standard_normal(len(command))
        signals = {"command": command[skip:], "pressure": pressure[skip:]}
        logs.append(Experiment(f"run {i}", h, signals))
    return logs


def sensor_logs(system, h=0.01, count=3000, input_noise=0.005, noise=0.002, seed=0, late=0.0):
    """A curvature that swings smoothly, known on the fine grid; both signals are measured with noise."""
    rng = np.random.default_rng(seed)
    time = np.arange((count + 100) * FINER) * h / FINER  # the first 100 samples are before the log
    logs = []
    for i in range(3):
        phases, rates = rng.uniform(0.0, 6.0, 6), np.array([0.3, 0.7, 1.5, 3.0, 6.0, 9.0])
        curvature = np.sin(np.outer(rates, time) + phases[:, None]).T @ (0.004 / np.sqrt(rates)) + 0.01
        output = on_fine_grid(system, curvature, h, late, "foh")[100:]
        output = output + noise * 0.02 * rng.standard_normal(count)
        measured = curvature[100 * FINER :: FINER] + input_noise * 0.02 * rng.standard_normal(count)
        logs.append(Experiment(f"run {i}", h, {"curvature": measured, "output": output}))
    return logs


def two_lags(command, h, up, down, gain=6.0):
    """A first-order lag that rises with one time constant and falls with another, from rest at 0."""
    pressure, now = [], 0.0
    for target in command:
        pressure.append(gain * now)
        now += (target - now) * -np.expm1(-h / (up if target > now else down))
    return np.array(pressure)


def chamber_logs(up, down, seed=0, h=0.04, noise=0.004, count=1400):
    rng = np.random.default_rng(seed)
    inputs = [steps(count, level, 25, 525) for level in (7.0, 9.0, 11.0)]
    inputs.append(np.repeat(rng.uniform(0.0, 10.0, 14), 100))
    logs = []
    for i, command in enumerate(inputs):
        pressure = two_lags(command, h, up, down)
        pressure = pressure + noise * np.ptp(pressure) * rng.standard_normal(count)
        logs.append(Experiment(f"run {i}", h, {"command": command, "pressure": pressure}))
    return logs


def covers(fit, name, truth):
    value, half = fit.parameters[name]
    return bool(abs(value - truth) <= half)


def over_seeds(seeds, logs):
    return [identify_stage(logs(seed), "regulator") for seed in range(seeds)]


@cache
def paper_fit(seed):
    return identify_stage(regulator_logs(PAPER, commands(seed), seed=seed), "regulator")


def paper_fits(seeds):
    return [paper_fit(seed) for seed in range(seeds)]


@cache
def sensor_fit(seed):
    return identify_stage(sensor_logs(([10.0], [1.0, 10.0]), seed=seed), "sensor")


# the regulator of the paper


def test_the_papers_regulator_is_found_as_it_is_written():
    fit = paper_fits(1)[0]
    assert (fit.shape, fit.delay) == ("2p", 0.0)
    found = {term.order: term.coefficient for term in fit.transfer.den}
    assert found[2.0] == 1.0
    assert found[1.0] == pytest.approx(53.39, rel=0.01)
    assert found[0.0] == pytest.approx(1528.0, rel=0.01)
    assert fit.transfer.dc_gain == pytest.approx(GAIN, rel=1e-3)
    assert 0.0 < fit.gain_relative < 0.001 and 0.0 < fit.time_relative < 0.01
    assert fit.up_down.one_line_will_do


@pytest.mark.long
def test_intervals_of_the_papers_regulator_in_a_few_seeds():
    fits = paper_fits(12)
    assert [fit.shape for fit in fits] == ["2p"] * 12
    inside = sum(covers(f, "wn", WN) + covers(f, "damping", DAMPING) + covers(f, "gain", GAIN) for f in fits)
    assert inside >= 30  # of 36 at 95 %: fewer in one of 500 tries
    bias = np.mean([f.parameters["gain"][0] for f in fits]) - GAIN
    assert abs(bias) < 0.5 * np.mean([f.parameters["gain"][1] for f in fits]) / 1.96


@pytest.mark.long
@pytest.mark.parametrize("name, truth", [("wn", WN), ("damping", DAMPING), ("gain", GAIN)])
def test_coverage_of_the_papers_regulator(name, truth):
    fits = paper_fits(100)
    assert sum(fit.shape == "2p" for fit in fits) >= 99
    kept = [fit for fit in fits if name in fit.parameters]
    assert 90 <= sum(covers(fit, name, truth) for fit in kept) <= 99
    values = np.array([fit.parameters[name][0] for fit in kept])
    assert abs(values.mean() - truth) < 0.5 * values.std()


def test_without_noise_the_truth_is_found():
    fit = identify_stage(regulator_logs(PAPER, commands(), noise=0.0), "regulator")
    assert fit.shape == "2p"
    assert fit.parameters["wn"][0] == pytest.approx(WN, rel=1e-5)
    assert fit.parameters["damping"][0] == pytest.approx(DAMPING, rel=1e-5)
    assert fit.gof > 0.9999


# other shapes


@pytest.mark.parametrize("late", [0.0, 0.35, 2.8, 5.0])
@pytest.mark.parametrize("hold", ["zero", "linear"])
@pytest.mark.parametrize(
    "shape, x, system",
    [
        (Shape(1, 0, True), [4.0], ([1.0], [4.0, 1.0])),
        (Shape(2, 1, True), [0.3, 0.4], ([0.09], [1.0, 0.24, 0.09])),
        (Shape(2, 1, True), [0.3, 1.0], ([0.09], [1.0, 0.6, 0.09])),
    ],
)
def test_responses_are_those_of_a_finer_grid(shape, x, system, hold, late):
    """Time in samples: T, or wn and damping, here once below and once exactly 1."""
    drive = np.concatenate([[0.0], np.random.default_rng(0).standard_normal(80)])
    places = np.arange(81 * FINER) / FINER
    fine = drive[places.astype(int)] if hold == "zero" else np.interp(places, np.arange(81), drive)
    record = Record("run", drive, drive, hold)
    _, made = responses(shape, np.append(np.log(x), late), [record])[0]
    rule = "zoh" if hold == "zero" else "foh"
    truth = on_fine_grid(system, fine, 1.0, late, rule)
    assert np.allclose(made[0], truth, atol=1e-9)
    if shape.zeros:
        slope = on_fine_grid(([*system[0], 0.0], system[1]), fine, 1.0, late, rule)
        assert np.allclose(made[1], slope, atol=1e-9)


def test_a_dead_time_of_a_fraction_of_a_sample():
    fit = identify_stage(regulator_logs(([2.0], [0.05, 1.0]), commands(), late=2.35), "regulator")
    assert fit.shape == "1p+delay"
    assert covers(fit, "delay", 0.0235) and covers(fit, "T", 0.05)
    assert fit.delay == fit.parameters["delay"][0] and fit.parameters["delay"][1] < 5e-4


def test_a_long_dead_time_is_found_by_its_correlation():
    fit = identify_stage(regulator_logs(([2.0], [0.2, 1.0]), commands(), late=60.0), "regulator")
    assert fit.shape == "1p+delay"
    assert covers(fit, "delay", 0.6)
    binary = [prbs(np.random.default_rng(seed), 1500, 4) for seed in (1, 2)]
    fit = identify_stage(regulator_logs(([2.0], [0.02, 1.0]), binary, late=199.35, seed=1), "regulator")
    assert fit.shape == "1p+delay"
    assert covers(fit, "delay", 1.9935) and covers(fit, "T", 0.02)


def test_two_real_poles_with_a_zero():
    system = [0.6, 3.0], np.polymul([0.3, 1.0], [0.05, 1.0])
    fit = identify_stage(regulator_logs(system, commands()), "regulator")
    assert fit.shape == "2p1z"
    assert covers(fit, "T1", 0.3) and covers(fit, "T2", 0.05) and covers(fit, "zero", 0.2)
    s = 1j * np.array([0.3, 3.0, 30.0])
    truth = np.polyval(system[0], s) / np.polyval(system[1], s)
    assert np.allclose(fit.transfer(s), truth, rtol=0.01)


def test_two_real_poles_and_a_dead_time():
    system = [10.0], np.polymul([0.3, 1.0], [0.05, 1.0])
    fit = identify_stage(regulator_logs(system, commands(count=3000), late=5.0), "regulator")
    assert fit.shape == "2p+delay"
    assert covers(fit, "T1", 0.3) and covers(fit, "T2", 0.05) and covers(fit, "delay", 0.05)


def test_a_zero_in_the_right_half_plane_is_refused():
    system = [-0.1, 1.0], np.polymul([0.3, 1.0], [0.1, 1.0])
    fit = identify_stage(regulator_logs(system, commands()), "regulator")
    refused = {f.shape: f.refused for f in fit.fits}
    assert "wrong direction" in refused["2p1z"] and fit.shape != "2p1z"


def test_faster_than_the_samples_no_dynamics_is_claimed():
    fit = identify_stage(regulator_logs(([2.0], [1e-4, 1.0]), commands()), "regulator")
    assert fit.shape == "gain+delay" and fit.delay == pytest.approx(0.01)
    assert covers(fit, "gain", 2.0) and fit.up_down is None
    assert any("within one sample" in note for note in fit.notes)


def test_a_negative_gain():
    fit = identify_stage(regulator_logs(([-2.0], [0.1, 1.0]), commands()), "regulator")
    assert fit.shape == "1p" and covers(fit, "gain", -2.0) and covers(fit, "T", 0.1)


def test_a_log_may_begin_in_the_middle_of_a_transient():
    logs = regulator_logs(PAPER, [prbs(np.random.default_rng(s), 900, 20) for s in (1, 2)], skip=143)
    slow = regulator_logs(([2.0], [0.8, 1.0]), commands(), skip=90)
    fit = identify_stage(logs, "regulator")
    assert fit.shape == "2p" and covers(fit, "wn", WN) and covers(fit, "gain", GAIN)
    fit = identify_stage(slow, "regulator")
    assert fit.shape == "1p" and covers(fit, "T", 0.8) and covers(fit, "gain", 2.0)


def test_a_log_that_begins_with_its_step():
    logs = regulator_logs(([2.0], [0.8, 1.0]), [np.full(600, level) for level in (2.0, 5.0)])
    fit = identify_stage(logs, "regulator")
    assert fit.shape == "1p" and covers(fit, "T", 0.8) and covers(fit, "gain", 2.0)
    assert any("begins with its step" in note for note in fit.notes)


def test_long_logs_are_fitted_to_the_last_sample():
    rng = np.random.default_rng(3)
    logs = regulator_logs(([2.0], [0.3, 1.0]), [staircase(rng, 120_000, 400)])
    fit = identify_stage(logs, "regulator")
    assert fit.shape == "1p" and covers(fit, "T", 0.3) and covers(fit, "gain", 2.0)
    assert len(fit.simulated[0]) == 120_000 and fit.parameters["T"][1] < 1.5e-4
    assert any("compared on" in note for note in fit.notes)


# the sensor


def test_the_papers_sensor_behind_a_noisy_camera():
    fit = sensor_fit(0)
    assert (fit.shape, fit.delay) == ("1p", 0.0)
    assert covers(fit, "T", 0.1) and covers(fit, "gain", 1.0)
    assert fit.parameters["T"][1] < 0.004 and fit.gain_relative < 0.005
    assert not any("noise" in note for note in fit.notes)


def test_noise_on_the_sensors_input_does_not_bias_it():
    fits = [sensor_fit(seed) for seed in range(4)]
    gains, times = (np.array([f.parameters[name][0] for f in fits]) for name in ("gain", "T"))
    assert abs(gains.mean() - 1.0) < 0.001
    assert abs(times.mean() - 0.1) < 0.001


def test_a_camera_that_is_late():
    fit = identify_stage(sensor_logs(([10.0], [1.0, 10.0]), late=3.35), "sensor")
    assert fit.shape == "1p+delay" and covers(fit, "delay", 0.0335) and covers(fit, "T", 0.1)


def static_sensor(true, seed=5, noise=0.0002):
    """A sensor of gain 1.5, and the share of the curvature's variance that its noise is."""
    noisy = true + noise * np.random.default_rng(seed).standard_normal(len(true))
    fit = identify_stage([Experiment("static", 0.01, {"curvature": noisy, "output": 1.5 * true})], "sensor")
    assert fit.shape == "gain"
    return fit, noise**2 / np.var(noisy)


def test_noise_that_is_told_from_a_smooth_curvature_takes_little_of_the_gain():
    """It took 2 % before a curve was drawn through the readings."""
    true = 0.001 * np.sin(np.outer([0.02, 0.05, 0.11, 0.19], np.arange(3000))).sum(axis=0)
    fit, share = static_sensor(true)
    assert share > 0.015
    assert fit.parameters["gain"][0] == pytest.approx(1.5, rel=0.4 * share)


def test_noise_too_large_to_be_told_from_the_curvature_takes_of_the_gain_and_a_note_says_so():
    true = 0.001 * np.sin(np.outer([0.02, 0.05, 0.11, 0.19], np.arange(3000))).sum(axis=0)
    fit, expected = static_sensor(true, noise=0.00032)
    assert expected > 0.04
    assert fit.parameters["gain"][0] == pytest.approx(1.5 * (1.0 - expected), rel=0.006)
    note = next(n for n in fit.notes if "smaller" in n)
    assert float(note.split("up to ")[1].split("%")[0]) == pytest.approx(100.0 * expected, rel=0.3)


def test_what_noise_takes_of_a_gain_where_the_curvature_is_as_quick_as_noise():
    true = 0.001 * np.random.default_rng(7).standard_normal(3000)
    fit, expected = static_sensor(true)
    assert fit.parameters["gain"][0] == pytest.approx(1.5 * (1.0 - expected), rel=0.01)


# rising and falling


def test_filling_and_venting_with_time_constants_of_their_own():
    fit = identify_stage(chamber_logs(2.7, 5.8), "regulator")
    found = fit.up_down
    assert not found.one_line_will_do
    assert abs(found.rising[0] - 2.7) <= found.rising[1] < 0.1
    assert abs(found.falling[0] - 5.8) <= found.falling[1] < 0.2
    assert fit.shape == "1p" and 2.7 < fit.parameters["T"][0] < 5.8
    note = next(n for n in fit.notes if "the valve's asymmetry" in n)
    assert "fills in 2.7 s and vents in 5.8 s" in note


def test_the_other_way_round():
    found = identify_stage(chamber_logs(5.8, 2.7), "regulator").up_down
    assert not found.one_line_will_do and found.rising[0] > 1.8 * found.falling[0]


@pytest.mark.parametrize("seeds, share", [(6, 0.75), pytest.param(100, 0.9, marks=pytest.mark.long)])
def test_one_line_will_do_where_both_are_equal(seeds, share):
    """At 95 %, fewer than 9 of 12 intervals, or than 180 of 200, cover the truth in one of 400 tries."""
    fits = over_seeds(seeds, lambda seed: chamber_logs(3.0, 3.0, seed))
    good = sum(f.up_down.one_line_will_do and f.shape == "1p" and not f.notes for f in fits)
    assert good >= 0.98 * seeds
    pairs = [pair for f in fits for pair in (f.up_down.rising, f.up_down.falling)]
    assert np.mean([abs(value - 3.0) <= half for value, half in pairs]) >= share


def test_steps_up_alone_do_not_show_the_falling():
    log = regulator_logs(([2.0], [0.3, 1.0]), [steps(1500, 5.0, 200, 1500)])
    fit = identify_stage(log, "regulator")
    assert fit.up_down is None
    assert any("steps up and down" in note for note in fit.notes)


# what cannot be used


def one(**signals):
    return [Experiment("run", 0.01, {name: np.asarray(v, float) for name, v in signals.items()})]


@pytest.mark.parametrize(
    "logs, stage, what, remedy",
    [
        (one(command=np.ones(99), output=np.ones(99)), "regulator", "both command and pressure", "log them"),
        (one(command=np.ones(9), pressure=np.ones(9)), "regulator", "9 samples", "at least 30"),
        (one(command=np.zeros(99), pressure=np.arange(99)), "regulator", "never changes", "log steps"),
        (one(command=np.arange(99), pressure=np.ones(99)), "regulator", "never changes", "check the column"),
        (one(curvature=np.ones(99), output=np.arange(99)), "sensor", "never changes", "log steps"),
        (one(command=np.ones(99), pressure=np.ones(99)), "actuator", "actuator", "choose one of"),
    ],
)
def test_what_cannot_determine_a_stage_is_said(logs, stage, what, remedy):
    with pytest.raises(FitError) as caught:
        identify_stage(logs, stage)
    assert what in f"{caught.value.where}: {caught.value.what}" and remedy in caught.value.remedy


def test_a_pressure_that_does_not_answer():
    rng = np.random.default_rng(1)
    log = one(command=steps(500, 5.0, 100, 300), pressure=rng.standard_normal(500))
    with pytest.raises(FitError, match="gain from command to pressure"):
        identify_stage(log, "regulator")


def test_a_step_that_is_not_held_until_it_settles():
    log = regulator_logs(([2.0], [500.0, 1.0]), [steps(1500, 5.0, 200, 1500)], noise=0.05)
    with pytest.raises(FitError, match="settled"):
        identify_stage(log, "regulator")


def test_two_sample_times_are_not_one_stage():
    logs = [*one(command=prbs(np.random.default_rng(0), 99), pressure=np.arange(99))]
    logs.append(Experiment("other", 0.02, dict(logs[0].signals)))
    with pytest.raises(FitError, match="sampled every"):
        identify_stage(logs, "regulator")


def test_logs_without_the_two_signals_are_left_out_and_named():
    logs = regulator_logs(([2.0], [0.1, 1.0]), commands())
    fit = identify_stage([*logs, *one(command=np.ones(99), output=np.ones(99))], "regulator")
    assert fit.names == ("run 0", "run 1", "run 2") and len(fit.simulated) == 3
    assert any(note.startswith("run: not used") for note in fit.notes)


# measured by others


def read(path):
    return np.genfromtxt(path, delimiter=",", names=True)


def test_a_measured_pump_fills_faster_than_it_vents(open_data):
    table = read(open_data / "spba_pump_two_chamber_steps.csv")
    logs = []
    for run in (7, 9, 11):
        rows = table[table["run_V"] == run]
        log = Experiment(f"{run} V", 0.04, {"command": rows["u1_V"], "pressure": rows["p1_kPa"]})
        logs.append(log.between(1.0, 57.0))
    fit = identify_stage(logs, "regulator")
    assert not fit.up_down.one_line_will_do
    assert 2.2 < fit.up_down.rising[0] < 2.9 and 5.4 < fit.up_down.falling[0] < 6.2  # 63 % times, as measured
    assert fit.up_down.gof > 0.94
    assert all(made[0] < 3.0 for made in fit.simulated)  # at rest at first: kPa, an offset and no more
    assert any("cannot do both" in note and "the valve's asymmetry" in note for note in fit.notes)


def test_a_measured_dead_time(open_data):
    """Published models of this process begin with the input of three samples before. A held input takes one
    of these itself, so the dead time lies between two samples and three; a first-order model, with a lag too
    few, makes it longer."""
    table = read(open_data / "hair_dryer_delay.csv")
    log = Experiment("dryer", 0.08, {"command": table["u_V"], "pressure": table["y_V"]})
    fit = identify_stage([log], "regulator")
    delay, half = fit.parameters["delay"]
    assert half < 0.02 and delay + half >= 0.16 and delay - half <= 0.24
    first_order = next(f for f in fit.fits if f.shape == "1p+delay")
    assert 0.20 < first_order.parameters["delay"][0] < 0.28
    assert fit.gof > 0.88
