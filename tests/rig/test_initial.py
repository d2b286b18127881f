"""Experiments that do not begin at rest: the state told by the input's past, and how it is estimated.

Red when a past gives another state than the simulation that had it.
"""

from dataclasses import replace

import mpmath
import numpy as np
import pytest

import focgen
from focgen.fractional.transfer import TransferFunction
from focgen.logs.begin import REST, Begin
from focgen.logs.experiment import Experiment
from focgen.rig import linear
from focgen.rig.effects import Run, form_of, library
from focgen.rig.engine import Chain
from focgen.rig.initial import NOTE, begun
from focgen.rig.placed import Placed, slot_in
from focgen.rig.rig import Actuator, Delays, LinearActuator, Rig, Signals
from focgen.rig.session import run_of
from tests.diagnosis_rig import RIG, H, session

N = 400


def actuator_alone(actuator):
    return Rig("actuator", H, Signals("t", "y", pressure="p"), actuator)


def answer(rig, x, begin=REST, first="actuator", held=False):
    run = Run.of([len(x)], [0.0], H, [begin])
    return Chain(rig).run(np.asarray(x, float), first, "sensor", run, held)


def relaxation(t, T, alpha):
    """1 − S(t): what a step t ago still lacks, by inversion of its Laplace transform."""
    f = lambda s: 1 / s - 1 / (s * (T * s**alpha + 1))
    return float(mpmath.invertlaplace(f, t, method="talbot"))


# -------------------------------------------------------------------------------------- the past as samples


def test_a_past_as_samples():
    assert Begin((0.3,)).samples(0.1).tolist() == [0.3]
    assert Begin((0.0, 2.0), (0.3,)).samples(0.1).tolist() == pytest.approx([0.0, 1.0, 2.0, 2.0])
    two = Begin((1.0, 3.0, 2.0), (0.45, 0.25)).samples(0.1)
    assert two.tolist() == pytest.approx([1.0, 3.0, 3.0, 2.0, 2.0])


def test_a_step_moves_evenly_between_samples():
    ends = [Begin((0.0, 1.0), (ago,)).samples(0.1).sum() for ago in (0.30, 0.34, 0.38)]
    assert np.diff(ends) == pytest.approx([0.4, 0.4])


# -------------------------------------------------------------------------------------------- the responses


@pytest.mark.parametrize("T, alpha", [(1.3, 0.6), (1.0, 0.3), (2.0, 0.9), (1.5, 1.0), (1.0, 1.5)])
def test_a_step_before_the_log_relaxes_as_mittag_leffler(T, alpha):
    rig = actuator_alone(Actuator(T, alpha, (0.5,)))
    ago = 60 * H
    y = answer(rig, np.full(N, 2.0), Begin((1.2, 2.0), (ago,)))
    for k in (0, 7, 60, 399):
        exact = 0.5 * (2.0 - 0.8 * relaxation(ago + k * H, T, alpha))
        assert y[k] == pytest.approx(exact, abs=5e-5)


def test_a_first_order_stage_goes_on_from_where_it_was():
    lag = LinearActuator(TransferFunction([(3.0, 0.0)], [(0.7, 1.0), (1.0, 0.0)]))
    y = answer(actuator_alone(lag), np.zeros(N), Begin((2.0,)))
    t = np.arange(N) * H
    # the input falls on a straight line over the sample before the first
    exact = 6.0 * 0.7 / H * np.exp(-t / 0.7) * -np.expm1(-H / 0.7)
    np.testing.assert_allclose(y, exact, atol=1e-12)


@pytest.mark.parametrize("held", [False, True])
def test_a_second_order_stage_held_for_ever_stays(held):
    den = [(1.0, 2.0), (1.4, 1.0), (4.0, 0.0)]
    rig = replace(actuator_alone(None), regulator=TransferFunction([(8.0, 0.0)], den))
    y = answer(rig, np.full(N, 0.4), Begin((0.4,)), "regulator", held)
    np.testing.assert_allclose(y, 0.8, rtol=1e-12)


def test_a_stage_that_integrates_starts_from_zero():
    lag = LinearActuator(TransferFunction([(2.0, 0.0)], [(1.0, 1.0)]))
    y = answer(actuator_alone(lag), np.ones(N), Begin((1.0,)))
    np.testing.assert_allclose(y, 2.0 * H * (1.5 + np.arange(N)), rtol=1e-9)  # the ramp from 0 to 1 first


def every_form():
    clocks = {"response": 0.8, "record": 50.0, "session": 4000.0, "sample": H}
    for effect in library().values():
        for form in (f for f in effect.forms if not (f.seen or f.adds_up)):
            slot = slot_in(form, effect.stage)
            size = {"command": 1.8, "chamber": 0.2, "supply": 0.2, "load": 0.2}.get(slot, 0.02)
            values = [p.starts[0] * size**p.level * clocks[p.clock] ** p.time for p in form.parameters]
            yield pytest.param(
                Placed(effect.name, form, effect.stage, tuple(values)), id=f"{effect.name}-{form.name}"
            )


@pytest.mark.parametrize("placed", list(every_form()))
def test_every_effect_begins_as_its_past_left_it(placed):
    """A cut log with its past told against the whole one, which begins at rest long before."""
    before = np.r_[np.full(60_000, 0.5), np.full(140, 1.5)]
    u = np.r_[before, 1.5 + 0.3 * np.sin(0.05 * np.arange(N))]
    chain, cut = Chain(RIG, (placed,)), len(before)
    whole = chain.run(u, "regulator", "sensor", Run.of([len(u)], [0.0], H), True)[cut:]
    part = Run.of([N], [cut * H], H, [Begin((0.5, 1.5), (140 * H,))])
    again = chain.run(u[cut:], "regulator", "sensor", part, True)
    assert np.max(np.abs(again - whole)) < 2e-3 * np.max(np.abs(whole))
    rested = chain.run(u[cut:], "regulator", "sensor", Run.of([N], [cut * H], H), True)
    assert np.max(np.abs(rested - whole)) > 0.3 * np.max(np.abs(whole))


def test_experiments_at_rest_are_not_touched_by_those_beside_them():
    u = np.r_[np.zeros(20), np.ones(N - 20)]
    alone = answer(RIG, u, first="regulator")
    run = Run.of([N, N, N], [0.0, 100.0, 200.0], H, [REST, Begin((0.5, 1.0), (3.0,)), REST])
    taps = {}
    y = Chain(RIG).run(np.tile(u, 3), "regulator", "sensor", run, tap=taps)
    np.testing.assert_array_equal(y[:N], alone)
    np.testing.assert_array_equal(y[2 * N :], alone)
    assert y[N] > 0.3 * y.max() and taps["actuator"].shape == y.shape


# --------------------------------------------------------------------------------------------- the estimate


def cut(log, seconds):
    return log.between(seconds, None)


def test_sessions_at_rest_stay_at_rest():
    for effect in ({}, {"drift": 2e-3}, {"zone": 0.05}, {"slip": 0.2}, {"vent": 0.8}):
        logs = session(seed=3, **effect)
        assert not any(log.begins for log in begun(RIG, logs))


def test_a_transient_cut_is_told():
    logs = session(seed=1)
    steps = cut(logs[0], 8.0 + 2.5)  # the step to 1.2 V came 2.5 s earlier
    told, still = begun(RIG, [steps, logs[2]])
    begin = told.before("command")
    assert NOTE in told.notes and not still.begins and NOTE not in still.notes
    assert begin.levels[-1] == pytest.approx(1.2)
    rms = [np.sqrt(np.mean((steps["output"] - answer_of(log)) ** 2)) for log in (told, steps)]
    assert rms[0] < 1.3 * 0.006 * 0.011 and rms[1] > 3 * rms[0]


def answer_of(log):
    run = Run.of([len(log)], [0.0], H, [log.before("command")])
    return Chain(RIG).run(log["command"], "regulator", "sensor", run, True)


def test_a_held_level_is_told():
    n = 600
    p = np.full(n, 0.1)
    p[200:] = 0.18
    rig = actuator_alone(Actuator(1.3, 0.6, (0.002, 0.34)))
    y = answer(rig, p, Begin((0.1,))) + 2e-5 * np.random.default_rng(0).normal(size=n)
    log = Experiment("held", H, {"pressure": p, "output": y})
    (told,) = begun(rig, [log])
    assert told.before("pressure") == Begin((pytest.approx(0.1),))


def kept(before):
    """A log that begins with a pressure a little off 0, which was ``before`` for ever ahead of it."""
    p = np.repeat([0.008, 0.18, 0.008], 120)
    y = answer(KEEPING, p, Begin((before,)))
    y = y + 3e-4 * np.random.default_rng(1).normal(size=len(p))
    return Experiment("kept", H, {"command": np.where(p > 0.1, 1.8, 0.0), "pressure": p, "output": y})


KEEPING = replace(RIG, actuator=Actuator(0.8, 1.0, (0.34,)))


def test_what_a_valve_keeps_in_a_rig_between_logs_is_held_before_them():
    """4 % of the pressure: too little to be off from rest by, and not nothing."""
    (told,) = begun(KEEPING, [kept(0.008)])
    assert told.begins == {"pressure": Begin((pytest.approx(0.008),))}


def test_a_little_pressure_that_comes_with_the_log_was_not_held_before_it():
    (told,) = begun(KEEPING, [kept(0.0)])
    assert told.begins == {}


def test_an_offset_or_a_drift_is_no_past():
    logs = session(seed=5, noise=0.004)
    moved = [shifted(log, 0.0015 * (1 + i / 5)) for i, log in enumerate(logs)]
    assert not any(log.begins for log in begun(RIG, moved))


def shifted(log, by):
    return replace(log, signals={**log.signals, "output": log["output"] + by})


@pytest.mark.parametrize("still", [6, 10])
def test_a_fall_that_the_rig_makes_more_slowly_is_no_offset(still):
    """A log that begins as the regulator vents, no faster than a limit, and rests a moment at a command of 0.
    It hardly falls there, as if by an offset; but that would not be gone later."""
    limit = Placed("flow_limit", form_of("flow_limit", "choked"), "regulator", (0.04,))
    u = np.r_[np.zeros(100), np.full(300, 0.5), np.zeros(still + 3), np.repeat([0.4, 0.9, 0.2, 0.0], 250)]
    first = 403
    y = Chain(RIG, (limit,)).run(u, "regulator", "sensor", Run.of([len(u)], [0.0], H), True)[first:]
    y = y + 0.004 * y.max() * np.random.default_rng(6).normal(size=len(y))
    (told,) = begun(RIG, [Experiment("vents", H, {"command": u[first:], "output": y})])
    assert not told.before("command").at_rest
    run = Run.of([len(u) - first], [0.0], H)
    at_rest = Chain(RIG).run(u[first:], "regulator", "sensor", run, True)
    (off,) = begun(RIG, [Experiment("off", H, {"command": u[first:], "output": at_rest + 0.5 * y[0]})])
    assert off.before("command").at_rest


def test_a_moment_at_zero_tells_nothing():
    """A triangle that rises from the first sample on, on an output that falls back to where it rests."""
    log = session(seed=3, noise=0.01)[4]
    fading = 0.0022 * np.exp(-log.time / 0.4)
    (told,) = begun(
        RIG, [Experiment("rise", H, {"command": log["command"], "output": log["output"] + fading})]
    )
    assert told.begins == {}


@pytest.mark.parametrize("turn", [1, -1])
def test_an_input_that_passes_through_zero_hides_no_past(turn):
    """A rig of both signs, held at a level and then driven by a sine: its log begins where that is near 0."""
    rig = actuator_alone(Actuator(0.8, 1.0, (8.0,)))
    sine = np.sin(0.05 * np.arange(-1, 500)) * 1.2
    whole = turn * np.r_[np.zeros(200), np.full(30, 1.1), sine]
    y = answer(rig, whole)[230:]
    y = y + 0.05 * np.random.default_rng(2).normal(size=len(y))
    log = Experiment("sine", H, {"pressure": whole[230:], "output": y})
    (told,) = begun(rig, [log])
    left = y - answer(rig, log["pressure"], told.before("pressure"))
    assert np.sqrt(np.mean((y - answer(rig, log["pressure"]))[:60] ** 2)) > 1.0
    assert np.sqrt(np.mean(left[:60] ** 2)) < 0.1


@pytest.mark.parametrize("held", [0.4, 1.5, 4.0])
def test_a_log_that_begins_with_a_step_is_told_the_hold_ahead_of_it(held):
    """The command steps as the log begins, from a level that it held for a while after a rest."""
    sine = 0.5 + 0.4 * np.sin(0.05 * np.arange(600) - 1.2)
    u = np.r_[np.zeros(400), np.full(int(held / H), 0.85), sine]
    tap: dict[str, np.ndarray] = {}
    y = Chain(RIG).run(u, "regulator", "sensor", Run.of([len(u)], [0.0], H), True, tap)
    true = {"pressure": tap["regulator"][-600:], "output": y[-600:]}
    rng = np.random.default_rng(4)
    noisy = {k: v + 3e-3 * v.max() * rng.normal(size=600) for k, v in true.items()}
    (told,) = begun(RIG, [Experiment("sine", H, {"command": sine, **noisy})])
    run = Run.of([600], [0.0], H, [told.before("command")])
    made = Chain(RIG).run(sine, "regulator", "sensor", run, True, tap)
    assert np.abs(tap["regulator"] - true["pressure"]).max() < 0.02 * true["pressure"].max()
    assert np.abs(made - true["output"]).max() < 0.02 * true["output"].max()


def test_a_fault_of_a_gauge_further_on_moves_no_past_ahead_of_the_one_before_it():
    """Log begun in a transient, four signals: what the pressure was before is told by the curvature alone."""
    tap: dict[str, np.ndarray] = {}
    u = np.r_[np.zeros(200), np.full(40, 1.0), np.full(300, 0.3)]
    y = Chain(RIG).run(u, "regulator", "sensor", Run.of([len(u)], [0.0], H), True, tap)
    signals = {"command": u, "pressure": tap["regulator"], "curvature": tap["actuator"], "output": y}
    late = {**signals, "output": np.r_[np.zeros(10), y[:-10]]}
    told = [
        begun(RIG, [Experiment("cut", H, {k: v[240:] for k, v in s.items()})])[0] for s in (signals, late)
    ]
    assert not told[0].before("pressure").at_rest
    assert told[0].before("pressure") == told[1].before("pressure")


def test_an_offset_behind_an_input_that_passes_through_zero_is_no_past():
    rig = actuator_alone(Actuator(0.8, 1.0, (8.0,)))
    p = np.sin(0.05 * np.arange(-1, 500)) * 1.2
    y = answer(rig, p) + 1.5 + 0.05 * np.random.default_rng(3).normal(size=len(p))
    assert begun(rig, [Experiment("sine", H, {"pressure": p, "output": y})])[0].begins == {}


@pytest.mark.parametrize("place, told", [(0.0, 0.0), (0.002, 0.0), (3.0, 3.0), (-40.0, -40.0)])
@pytest.mark.parametrize("curvature", [True, False], ids=["its place logged", "the output alone"])
def test_of_a_rig_that_integrates_is_told_where_it_stood(place, told, curvature):
    """No past of its input tells that; its sensor, of gain 2, is at rest there. A little is noise."""
    sensor = TransferFunction([(2.0, 0.0)], [(0.1, 1.0), (1.0, 0.0)])
    axis = LinearActuator(TransferFunction([(1.0, 0.0)], [(1.0, 1.0)]))
    rig, rng, n = Rig("axis", H, RIG.signals, axis, sensor=sensor), np.random.default_rng(4), 400
    u = np.repeat([0.0, 0.6, -0.3, 0.2], n // 4)
    y = place + H * np.cumsum(np.r_[0.0, (u[1:] + u[:-1]) / 2])
    seen = linear.run(sensor, y - place, Run.of([n], [0.0], H).rest, H, n * H) + 2.0 * place
    noisy = {
        "pressure": u,
        "curvature": y + 0.02 * rng.normal(size=n),
        "output": seen + 0.02 * rng.normal(size=n),
    }
    if not curvature:
        del noisy["curvature"]
    (log,) = begun(rig, [Experiment("move", H, noisy)])
    assert log.stands == pytest.approx(told, abs=0.02) and (NOTE in log.notes) == bool(told)
    assert ("curvature" in log.begins) == (curvature and bool(told))
    run = run_of([log], "pressure")
    made = Chain(rig).run(u, "actuator", "sensor", run)
    np.testing.assert_allclose(made, seen, atol=0.05)


AXIS = LinearActuator(TransferFunction([(1.0, 0.0)], [(1.0, 1.0)]))


def axis_log(place=0.0, late=0, held=1, seed=1):
    """An axis that moves from the first sample on, its output so many samples ``late`` and ``held``."""
    t = 0.01 * np.arange(1200)
    u = 1.0 + 0.3 * np.sin(t)
    y = place + t + 0.3 * (1.0 - np.cos(t)) + 0.01 * np.random.default_rng(seed).normal(size=len(t))
    y = np.r_[np.full(late, y[0]), y[: len(y) - late]]
    return Experiment("move", 0.01, {"pressure": u, "output": np.repeat(y[::held], held)[: len(y)]})


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("how", [{"late": 5}, {"held": 10}, {"late": 5, "held": 10}])
def test_what_is_late_or_read_seldom_is_no_place(how, seed):
    rig = Rig("axis", 0.01, RIG.signals, AXIS)
    assert begun(rig, [axis_log(seed=seed, **how)])[0].stands == 0.0
    assert begun(rig, [axis_log(2.0, seed=seed, **how)])[0].stands == pytest.approx(2.0, abs=0.07)


def test_a_sensor_that_lets_no_constant_through_shows_no_place():
    gyro = TransferFunction([(1.0, 1.0)], [(0.05, 1.0), (1.0, 0.0)])
    rig = Rig("axis", 0.01, RIG.signals, AXIS, sensor=gyro)
    assert begun(rig, [axis_log(2.0)])[0].stands == 0.0


def test_a_place_told_anew_takes_the_old_one_with_it():
    rig, log = Rig("axis", 0.01, RIG.signals, AXIS), axis_log(2.0)
    log = replace(log, signals={**log.signals, "curvature": log["output"]})
    (told,) = begun(rig, [log])
    assert told.stands and told.begins and NOTE in told.notes
    (again,) = begun(replace(rig, actuator=replace(AXIS, offset=2.0)), [told])
    assert (again.stands, dict(again.begins), again.notes) == (0.0, {}, ())


def test_of_a_log_that_goes_on_no_place_is_told():
    """It has its past ahead of it, be it that its sensor shows the rate alone."""
    gyro = TransferFunction([(1.0, 1.0)], [(0.05, 1.0), (1.0, 0.0)])
    rig, log = Rig("axis", 0.01, RIG.signals, AXIS, sensor=gyro), axis_log(2.0)
    log = replace(log, signals={**log.signals, "curvature": log["output"]})
    parts = [replace(log.between(None, 6.0), name="first"), replace(log.between(6.01, None), name="second")]
    assert set(focgen.replay(rig, parts).logs) == {"first", "second"}


def test_a_window_of_a_log_forgets_the_begin_of_the_whole():
    log = replace(session(seed=1)[0], begins={"command": Begin((0.5,))})
    assert log.between(None, 10.0).begins and not log.between(1.0, None).begins


def test_replay_says_where_it_did_not_begin_at_rest(tmp_path):
    logs = session(seed=2, noise=0.004)
    found = focgen.replay(RIG, [cut(logs[0], 9.5), logs[1]])
    whole = focgen.replay(RIG, [logs[0], logs[1]])
    assert any(NOTE in note and logs[0].name in note for note in found.notes)
    assert not any(NOTE in note for note in whole.notes)
    assert found.logs[logs[0].name].gof > whole.logs[logs[0].name].gof - 0.01


def test_a_large_offset_of_a_log_that_begins_with_its_step_is_no_past():
    u = np.r_[np.full(300, 1.2), np.full(300, 0.6)]
    y = Chain(RIG).run(u, "regulator", "sensor", Run.of([600], [0.0], H), True)
    y = y + 0.5 * y.max() + 4e-5 * np.random.default_rng(1).normal(size=600)
    (told,) = begun(RIG, [Experiment("offset", H, {"command": u, "output": y})])
    assert told.begins == {}


@pytest.mark.parametrize("delay", [3 * H, 2.4 * H])
@pytest.mark.parametrize("held", [False, True])
def test_a_dead_time_shows_what_was_before(delay, held):
    rig = replace(RIG, delays=Delays(delay, delay, delay))
    y = answer(rig, np.full(N, 1.4), Begin((1.4,)), "regulator", held)
    np.testing.assert_allclose(y, y[-1], rtol=1e-9)
    assert y[0] == pytest.approx(RIG.actuator.drive(0.14), rel=1e-9)


def test_a_past_in_which_nothing_holds_a_spring_is_none(monkeypatch):
    """A spring that gives way runs off to NaN from some of the levels that are tried; the others tell."""
    run, seen = Chain.run, []

    def breaking(self, x, first, last, over, *further):
        made = run(self, x, first, last, over, *further)
        if over.begins and len(over.begins[0].levels) == 3:
            seen.append(over)
            for signal in (made, *further[1].values()):
                signal[:] = np.nan
        return made

    monkeypatch.setattr(Chain, "run", breaking)
    steps = cut(session(seed=1)[0], 8.0 + 2.5)
    (told,) = begun(RIG, [steps])
    assert seen and told.before("command").levels[-1] == pytest.approx(1.2)
    assert all(np.all(np.isfinite((*b.levels, *b.ago))) for b in told.begins.values())
