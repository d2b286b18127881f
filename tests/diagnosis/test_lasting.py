"""Loops that lie, as a log begins, where the log before left them, made here of plays and lags.

Red when what a loop kept from the last log is taken for a drift, a dead zone or a folded reading, or when the
rig that was found does not keep it.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.effects import Run, form_of, library
from focgen.rig.engine import Chain
from focgen.rig.placed import Placed
from focgen.rig.replay import simulate_session
from focgen.rig.rig import LinearActuator, Rig, Signals

H, N, REST = 0.02, 1200, 400
LAG = TransferFunction([(2.0, 0.0)], [(0.8, 1.0), (1.0, 0.0)])
FAST = TransferFunction([(1.0, 0.0)], [(0.2, 1.0), (1.0, 0.0)])
RIG = Rig("rig", H, Signals("t", "y", "u", pressure="p"), LinearActuator(LAG), FAST)


def lagged(x, time, gain=1.0):
    kept = np.exp(-H / time)
    return lfilter([0.0, gain * (1.0 - kept)], [1.0, -kept], x)


def loops(x, size):
    """The mean of four plays of half and up to twice a size."""
    found = np.zeros((4, len(x)))
    for row, width in zip(found, size * np.array([0.5, 1.0, 1.5, 2.0])):
        y = 0.0
        for k, v in enumerate(x):
            row[k] = y = min(max(y, v - width), v + width)
    return found.mean(axis=0)


def held(rng):
    """Three commands of random holds that begin and end at 0, in a row with the rests between them."""
    parts = []
    for _ in range(3):
        u = np.repeat(rng.uniform(0.0, 1.0, N // 100), 100)
        u[:60] = u[-100:] = 0.0
        parts += [u, np.zeros(REST)]
    return np.concatenate(parts)


def logged(**signals):
    """The three logs of such a row: nobody logged the rests."""
    return [
        Experiment(f"{k}", H, {role: x[a : a + N] for role, x in signals.items()}, start=k * 32.0)
        for k, a in enumerate(range(0, 3 * (N + REST), N + REST))
    ]


def session(seed, where, size):
    """Such logs of a rig whose actuator or sensor has loops."""
    rng = np.random.default_rng(seed)
    u = held(rng)
    p = lagged(u, 0.2)
    y = lagged(0.4 * p + 0.6 * loops(p, size) if where == "actuator" else p, 0.8, 2.0)
    y = 0.4 * y + 1.2 * loops(y / 2.0, size) if where == "sensor" else y
    noisy = p + 0.003 * rng.standard_normal(len(p))
    return logged(command=u, pressure=noisy, output=y + 0.008 * rng.standard_normal(len(y)))


@pytest.mark.long
@pytest.mark.parametrize(
    "where, effect",
    [("actuator", "hysteresis"), ("sensor", "sensor_hysteresis")],
)
@pytest.mark.parametrize("size", [0.03, 0.1])
def test_a_loop_left_by_the_last_log_is_that_and_no_more(where, effect, size):
    """It had a folded reading beside it, or shared a set, or was `unknown`."""
    found = diagnose(RIG, session(1, where, size), pictures=False)
    (cause,) = found.causes
    behind = where == "sensor"  # without the curvature it may be the actuator's
    assert [c.effect for c in cause.candidates] == [effect] + ["hysteresis"] * behind
    assert cause.candidates[0].confidence > (0.6 if behind else 0.9) and cause.stage == where
    if size == 0.03:  # of noise of 0.008; from 0 at each begin 0.0122 and 0.0143
        assert found.gap.explained < 0.0116


def test_what_remembers_alone_lies_where_the_last_experiment_left_it():
    """As one long run, whose rests are left out; a lag ahead of it begins at 0 all the same."""
    x = np.r_[np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.0, 50)]
    play, late = form_of("hysteresis", "play"), form_of("slow_regulator", "one_lag")
    run = Run.of([100, 100], [0.0, 10.0], H, lasts=True)
    for form, effect, kept in ((play, "hysteresis", True), (late, "slow_regulator", False)):
        placed = Placed(effect, form, "actuator", (0.1,))
        made = placed.act(np.r_[x, x], run)
        whole = placed.act(np.r_[x, x], Run.of([200], [0.0], H))
        anew = placed.act(np.r_[x, x], Run.of([100, 100], [0.0, 10.0], H))
        np.testing.assert_array_equal(made, whole if kept else anew)
        assert np.max(np.abs(whole - anew)) > 0.01


HEAVY = TransferFunction([(2.0, 0.0)], [(0.02, 2.0), (0.3, 1.0), (1.0, 0.0)])


AHEAD = "hysteresis", "play", (0.05,)  # of the lag, which rests where that holds it
OF_THE_SENSOR = "sensor_hysteresis", "play", (0.05,)


@pytest.mark.parametrize(
    "effects, dynamics",
    [
        ([AHEAD], LAG),
        ([OF_THE_SENSOR], LAG),
        ([AHEAD, OF_THE_SENSOR], LAG),
        ([("hysteresis", "added_spring", (0.3, 4.0, 4.0, 1.0))], HEAVY),
        ([("friction", "coulomb", (0.1,))], HEAVY),
        ([("friction", "rising", (0.1, 0.05, 0.02)), OF_THE_SENSOR], HEAVY),
    ],
)
def test_a_later_log_goes_on_where_a_long_rest_has_led(effects, dynamics):
    """As the same rig does in one run, with its rest of 30 s. All that lay behind a loop began at 0."""
    t = H * np.arange(300)
    up = np.interp(t, [0.0, 0.4, 2.0, 3.5, 4.5], [0.0, 0.0, 1.0, 0.3, 0.6])
    again = np.interp(t, [0.0, 0.4, 2.0, 6.0], [0.0, 0.0, 0.5, 0.1])
    pause = np.zeros(1500)
    placed = (Placed(name, form_of(name, form), library()[name].stage, v) for name, form, v in effects)
    chain = Chain(replace(RIG, actuator=LinearActuator(dynamics)), tuple(placed))

    def run(x, *own, **how):
        return chain.run(x, "regulator", "sensor", Run.of(*own, H, **how))

    whole = run(np.r_[up, pause, again], [2100], [0.0])
    made, anew = (run(np.r_[up, again], [300, 300], [0.0, 36.0], lasts=lasts) for lasts in (True, False))
    span = np.ptp(whole)
    assert abs(whole[1800]) > 0.01 * span, "it rests elsewhere than at 0"
    np.testing.assert_allclose(made, np.r_[whole[:300], whole[1800:]], atol=2e-3 * span)
    assert np.max(np.abs(anew[300:] - whole[1800:])) > 0.01 * span


def test_a_log_whose_input_does_not_begin_at_0_begins_at_rest():
    """Nobody knows what it was before."""
    x = np.r_[np.zeros(50), np.ones(50), np.full(100, 0.7)]
    run = Run.of([100, 100], [0.0, 10.0], H, lasts=True)
    assert run.held(x) is not run and run.held(x).rest[100] == 1
    x[100:] = 0.004
    assert run.held(x).rest[100] == 2


@pytest.mark.long
@pytest.mark.parametrize("seed, size, delay", [(1, 0.25, 0.6), (2, 0.15, 0.3)])
def test_a_loop_behind_a_dead_time_is_that(seed, size, delay):
    """One was `unknown`, with a wander in the place of its loop, and one a slow sensor."""
    rng, late = np.random.default_rng(seed), round(delay / H)
    u = held(rng)
    p = lagged(np.r_[np.zeros(late), u[:-late]], 0.2)
    y = lagged(0.4 * p + 0.6 * loops(p, size), 0.8, 2.0)
    logs = logged(command=u, output=y + 0.01 * rng.standard_normal(len(y)))
    found = diagnose(replace(RIG, signals=Signals("t", "y", "u")), logs, pictures=False)
    names = {cause.candidates[0].effect for cause in found.causes}
    assert names == {"hysteresis", "transport_delay"}
    assert found.gap.explained < 0.012


def test_a_session_is_simulated_as_its_experiments_say():
    effects = (Placed("sensor_hysteresis", form_of("sensor_hysteresis", "play"), "sensor", (0.05,)),)
    logs = session(2, "sensor", 0.03)
    anew, lasting = (
        simulate_session(RIG, [replace(log, lasts=k) for log in logs], effects) for k in (False, True)
    )
    np.testing.assert_array_equal(anew[0]["output"], lasting[0]["output"])
    assert anew[1]["output"][0] == 0.0 and lasting[1]["output"][0] == pytest.approx(0.05)
    alone = Chain(RIG, effects).run(logs[0]["command"], "regulator", "sensor", Run.of([N], [0.0], H), True)
    np.testing.assert_array_equal(anew[0]["output"], alone)
