"""Nominal dead times: in the file, in the chain at any part of a sample, in a replay and in a diagnosis.

Red when a dead time is lost between file, chain, replay and diagnosis.
"""

from dataclasses import replace

import mpmath
import numpy as np
import pytest

import focgen
from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.problem.segments import stages_of
from focgen.errors import RigError
from focgen.fractional.responses import step_response
from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig import linear, read_rig, write_rig
from focgen.rig.delay import delayed
from focgen.rig.dynamics import Dynamics
from focgen.rig.effects import Run
from focgen.rig.engine import Chain
from focgen.rig.modes import respond
from focgen.rig.rig import UNITY, Actuator, Delays, LinearActuator, Rig, Signals
from tests.diagnosis_rig import RIG, session

H = 0.02
DELAYS = (0.5 * H, H, 2.37 * H, 7 * H)
SIGNALS = Signals("t", "y", "u")
LAG = TransferFunction([(1.0, 0.0)], [(0.3, 1.0), (1.0, 0.0)])
FRACTIONAL = TransferFunction([(1.0, 0.0)], [(1.0, 0.7), (1.0, 0.0)])
HEAD = 'name = "r"\nsample_time = 0.02\n[signals]\ntime = "t"\noutput = "y"\ncommand = "u"\n'


def rest(*lengths):
    return Run.of(lengths, [0.0] * len(lengths), H).rest


def times(n, delay):
    return np.maximum(np.arange(n) * H - delay, 0.0)


# ------------------------------------------------------------------------------------------------------ file


def read(tmp_path, text):
    (tmp_path / "rig.toml").write_text(HEAD + text)
    return read_rig(tmp_path / "rig.toml")


def test_every_stage_takes_a_delay(tmp_path):
    rig = read(
        tmp_path,
        "[regulator]\nnum = [[1.0, 0.0]]\nden = [[0.1, 1.0], [1.0, 0.0]]\ndelay = 0.1\n"
        "[actuator]\nT = 1.3\nalpha = 0.6\ngain = [1.0]\ndelay = 0.02\n[sensor]\ndelay = 0.003\n",
    )
    assert rig.delays == Delays(0.1, 0.02, 0.003) and rig.delays.total == pytest.approx(0.123)
    assert rig.sensor == UNITY and rig.actuator == Actuator(1.3, 0.6, (1.0,))


def test_an_actuator_of_num_and_den_or_of_a_delay_alone(tmp_path):
    rig = read(tmp_path, "[actuator]\nnum = [[2.0, 0.0]]\ndelay = 0.5\noffset = 0.1\n")
    assert rig.delays.actuator == 0.5 and rig.actuator.dynamics.dc_gain == 2.0
    alone = read(tmp_path, "[actuator]\ndelay = 0.5\noffset = 0.1\n")
    assert alone.actuator == LinearActuator(UNITY, 0.1) and alone.delays.actuator == 0.5


@pytest.mark.parametrize("text", ["num = [[1.0, 0.0]]", "num = [[1.0, 0.0]]\ndelay = 0.0"])
def test_a_delay_of_zero_is_no_delay(tmp_path, text):
    rig = read(tmp_path, f"[actuator]\n{text}\n")
    assert rig == Rig("r", 0.02, SIGNALS, LinearActuator(UNITY))
    write_rig(rig, tmp_path / "rig.toml")
    assert "delay" not in (tmp_path / "rig.toml").read_text()


def test_written_delays_read_back_equal(tmp_path, paper_rig):
    for delays in (Delays(0.1, 0.2, 0.3), Delays(sensor=0.03)):
        bare = replace(paper_rig, regulator=UNITY, actuator=LinearActuator(UNITY), sensor=UNITY)
        for rig in (paper_rig, bare):
            write_rig(replace(rig, delays=delays), tmp_path / "rig.toml")
            assert read_rig(tmp_path / "rig.toml") == replace(rig, delays=delays)


FAULTS = {
    "negative": ("[sensor]\ndelay = -0.1\n", "is -0.1"),
    "not a number": ('[sensor]\ndelay = "0.1 s"\n', "not a finite number"),
    "not finite": ("[regulator]\ndelay = inf\n", "not a finite number"),
    "in microseconds": ("[actuator]\nnum = [[1.0, 0.0]]\ndelay = 1e6\n", "over a million samples"),
    "no num beside den": ("[sensor]\nden = [[1.0, 1.0]]\ndelay = 0.1\n", "lacks 'num'"),
    "no T beside gain": ("[actuator]\ngain = [1.0]\ndelay = 0.1\n", "lacks 'T'"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_delay_that_cannot_be_is_refused(tmp_path, fault):
    text, expected = FAULTS[fault]
    with pytest.raises(RigError) as caught:
        read(tmp_path, text)
    assert expected in str(caught.value) and caught.value.remedy


# ----------------------------------------------------------------------------------------------------- chain


@pytest.mark.parametrize("delay", DELAYS)
def test_a_first_order_lag_later_is_its_closed_form_earlier(delay):
    n, tau, lag = 200, 0.3, TransferFunction([(2.0, 0.0)], [(0.3, 1.0), (1.0, 0.0)])
    t = times(n, delay)
    held = linear.run(lag, np.ones(n), rest(n), H, n * H, True, delay)
    np.testing.assert_allclose(held, 2.0 * (1 - np.exp(-t / tau)), atol=1e-12)
    ramp = linear.run(lag, np.arange(n) * H, rest(n), H, n * H, False, delay)
    np.testing.assert_allclose(ramp, 2.0 * (t - tau * (1 - np.exp(-t / tau))), atol=1e-12)


@pytest.mark.parametrize("held", [True, False])
@pytest.mark.parametrize(
    "num, den",
    [
        ([(3.0, 0)], [(1.0, 0)]),
        ([(152.48, 0)], [(1, 2), (53.39, 1), (1528, 0)]),
        ([(1, 1), (3, 0)], [(0.1, 1), (1, 0)]),  # passes something at once
        ([(1, 0)], [(1, 2), (2, 1), (1, 0)]),  # a double pole
        ([(1, 0)], [(1, 1)]),
    ],
)
def test_any_input_later_is_the_exact_response_to_it(num, den, held):
    """Against the convolution with the exact step response, which shares no code with the recursion."""
    rng, transfer, n = np.random.default_rng(1), TransferFunction(num, den), 300
    x = np.r_[0.0, np.cumsum(rng.standard_normal(n - 1))]
    for delay in DELAYS:
        exact = Convolution(transfer, H, "zero" if held else "linear", delay).run(x)
        found = linear.run(transfer, x, rest(n), H, n * H, held, delay)
        np.testing.assert_allclose(found, exact, atol=1e-10 * np.abs(exact).max())


@pytest.mark.parametrize("delay", DELAYS)
@pytest.mark.parametrize("T, alpha", [(1.32, 0.6), (1.0, 1.6), (2.0, 1.0)])
def test_a_fractional_lag_later_is_the_mittag_leffler_function_earlier(T, alpha, delay):
    """A ramp's response is t (1 − E_{α,2}(−t^α/T)); the inversion of its transform is by mpmath."""
    n = 400
    y = respond(np.arange(n) * H, rest(n), H, T, alpha, n * H, delay=delay)
    for k in (9, 30, 399):
        t = k * H - delay
        exact = mpmath.invertlaplace(lambda s: 1 / (s**2 * (T * s**alpha + 1)), t, method="talbot", degree=24)
        assert abs(y[k] - float(exact)) < 2e-5 * max(t, 0.1)
    np.testing.assert_array_equal(y[: int(delay / H)], 0.0)


@pytest.mark.parametrize("delay", DELAYS)
def test_several_fractional_orders_later_are_the_exact_response_earlier(delay):
    n, transfer = 400, TransferFunction([(1.0, 0), (0.3, 0.5)], [(1.0, 1.5), (0.2, 0.7), (1.0, 0)])
    y = linear.run(transfer, np.arange(n) * H, rest(n), H, n * H, delay=delay)
    ramp = transfer * TransferFunction([(1.0, 0)], [(1.0, 1.0)])
    t = times(n, delay)
    exact = np.where(t > 0.0, step_response(ramp, np.maximum(t, 1e-6)), 0.0)
    np.testing.assert_allclose(y, exact, atol=1e-5 * exact.max())


def test_a_delay_is_the_same_before_between_and_at_samples():
    """Continuous in the delay: a hair to either side of whole samples gives the same."""
    x = np.sin(0.3 * np.arange(300))
    for transfer in (UNITY, LAG, FRACTIONAL):
        near = [linear.run(transfer, x, rest(300), H, 6.0, False, 3 * H + d) for d in (-1e-7, 0.0, 1e-7)]
        assert np.abs(near[0] - near[1]).max() < 3e-6 and np.abs(near[2] - near[1]).max() < 3e-6


def test_a_staircase_that_passes_late_is_what_it_was_at_the_sample_before():
    x = np.arange(10.0)
    found = linear.run(UNITY, x, rest(10), H, 1.0, True, 2.37 * H)
    np.testing.assert_array_equal(found, [0, 0, 0, 0, 1, 2, 3, 4, 5, 6])


def test_nothing_late_passes_from_one_experiment_to_the_next():
    x = np.r_[np.ones(50), np.zeros(50)]
    for transfer in (UNITY, LAG, FRACTIONAL):
        y = linear.run(transfer, x, rest(50, 50), H, 1.0, False, 2.37 * H)
        assert y[49] > 0.5 * step_response(transfer, 47 * H) and np.all(y[50:] == 0.0)


@pytest.mark.parametrize("stage", ["regulator", "actuator", "sensor"])
def test_each_stage_holds_back_what_leaves_it_and_no_signal_before(stage):
    """Static stages: all there is to see is the delay, which passes K(p) p unchanged."""
    rig = Rig("r", H, SIGNALS, Actuator(1e-9, 1.0, (1.0, 2.0)), delays=Delays(**{stage: 1.6 * H}))
    x, now, late = np.minimum(np.arange(100) * 0.05, 2.0), {}, {}
    Chain(replace(rig, delays=Delays())).run(x, "regulator", "sensor", Run.of([100], [0.0], H), False, now)
    Chain(rig).run(x, "regulator", "sensor", Run.of([100], [0.0], H), False, late)
    order = ("regulator", "actuator", "sensor")
    for tapped in order:
        if order.index(tapped) < order.index(stage):
            np.testing.assert_array_equal(late[tapped], now[tapped])
        else:  # K(p) p bends what is straight between samples
            expected = delayed(now[tapped], rest(100), H, 1.6 * H)
            np.testing.assert_allclose(late[tapped], expected, atol=2e-3)


def test_changed_dynamics_are_late_by_whole_samples_exactly():
    x, bent = np.r_[0.0, np.ones(200), np.zeros(200)], Dynamics(unloading=2.0)
    soon = respond(x, rest(401), H, 0.5, 0.8, 8.0, bent)
    late = respond(x, rest(401), H, 0.5, 0.8, 8.0, bent, delay=4 * H)
    np.testing.assert_array_equal(late[4:], soon[:-4])
    np.testing.assert_array_equal(late[:4], 0.0)


# -------------------------------------------------------------------------------------- replay and diagnosis


def late_log(delay, n=500):
    """A log made in closed form: a command ramp into a first-order lag, ``delay`` s later."""
    t, at = np.arange(n) * H, times(n, delay)
    y = 2.0 * (at - 0.3 * (1 - np.exp(-at / 0.3)))
    return Experiment("ramp", H, {"command": t.copy(), "pressure": t.copy(), "output": y})


def test_replay_of_a_log_made_with_2_37_samples_of_delay():
    sensor, delay = TransferFunction([(2.0, 0.0)], [(0.3, 1.0), (1.0, 0.0)]), 2.37 * H
    rig = Rig("r", H, SIGNALS, sensor=sensor, delays=Delays(sensor=delay))
    found = focgen.replay(rig, [late_log(delay)]).logs["ramp"]
    assert found.rmse < 1e-10 and found.gof == pytest.approx(1.0, abs=1e-10)
    rounded = focgen.replay(replace(rig, delays=Delays(sensor=2 * H)), [late_log(delay)]).logs["ramp"]
    assert rounded.rmse == pytest.approx(2.0 * 0.37 * H, rel=0.1)


def test_a_delay_that_the_rig_file_knows_is_no_gap():
    """Four samples of delay: named where the rig file does not have them, nothing where it does."""
    logs = [log for log in session(11, delay=4) if log.name in ("steps", "stairs")]
    known = replace(RIG, delays=Delays(regulator=4 * RIG.sample_time))
    found = diagnose(known, logs)
    assert found.verdict in ("none", "parameters") and not found.causes
    assert diagnose(RIG, logs).causes[0].candidates[0].effect == "transport_delay"


def test_a_sensor_that_only_delays_is_a_stage():
    rig = Rig("r", H, SIGNALS, Actuator(1.0, 0.6, (1.0,)), delays=Delays(sensor=0.1))
    assert stages_of(rig) == ("actuator", "sensor")
