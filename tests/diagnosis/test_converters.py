"""A coarse reading on a noisy wire: its levels are blurred, and it still reads in steps.

Red when steps of a third of the span are named a bent curve because noise behind the converter hides that the
levels are few, when a fit moves the steps that were seen, or when rests of a rig pass for steps.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.hypotheses import converter
from focgen.diagnosis.hypotheses.converter import Converter, converter_of
from focgen.diagnosis.hypotheses.explain import candidates_for
from focgen.diagnosis.hypotheses.nuisances import problem_of
from focgen.diagnosis.problem.segments import make
from focgen.diagnosis.verdict.instead import bases
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.effects import form_of
from focgen.rig.replay import replay
from focgen.rig.rig import LinearActuator, Rig, Signals
from tests.diagnosis_rig import RIG as FINGER
from tests.diagnosis_rig import session as finger_session

H = 0.05
LAG = TransferFunction([(1.9, 0.0)], [(1.06 * 0.8, 1.0), (1.0, 0.0)])
HEATER = Rig("heater", H, Signals("t", "y", "u"), LinearActuator(LAG))
LEVELS = (4.0, 0.0, 7.0, 2.0, 12.0, 5.0, 10.0, 0.0, 6.0, 12.0, 1.0, 8.0, 3.0, 0.0)
SEEN = form_of("sensor_quantization", "rounding").seen


def answered(drive: np.ndarray, time: float = 0.8) -> np.ndarray:
    """2/(time s + 1) of a drive (n,) held from sample to sample."""
    kept = np.exp(-H / time)
    return lfilter([0.0, 2.0 * (1.0 - kept)], [1.0, -kept], drive)


def session(step: float, noise: float, seed: int) -> list[Experiment]:
    """Steps and a slow sine, read in steps and carried by a noisy wire."""
    rng, t = np.random.default_rng(seed), np.arange(840) * H
    logs = []
    for i, pump in enumerate((np.repeat(LEVELS, 60), 6.0 - 6.0 * np.cos(0.4 * t))):
        read = step * np.round(answered(pump) / step) + noise * rng.normal(size=840)
        logs.append(replace(Experiment(str(i), H, {"command": pump, "output": read}), start=60.0 * i))
    return logs


@pytest.mark.parametrize(
    "step, seed, told",
    [pytest.param(8.0, 1, None, marks=pytest.mark.long), (12.0, 2, ("sensor_quantization",))],
)
def test_steps_of_a_third_and_half_of_the_span_are_steps(step, seed, told):
    found = diagnose(HEATER, session(step, 0.1, seed), only=told)
    (cause,) = found.causes
    assert [c.effect for c in cause.candidates] == ["sensor_quantization"]
    assert cause.candidates[0].parameters["step"].value == pytest.approx(step, rel=0.01)
    assert found.gap.explained < 0.5 * found.gap.refitted


def test_levels_are_seen_through_noise_and_only_levels():
    t = np.arange(4000) * H
    rng = np.random.default_rng(3)
    smooth, noise = 12.0 - 12.0 * np.cos(0.1 * t), 0.1 * rng.normal(size=4000)
    step, _ = SEEN(3.0 * np.round(smooth / 3.0) + noise)
    assert step == pytest.approx(3.0, rel=0.01)
    assert SEEN(smooth + noise) is None
    assert SEEN(0.5 * np.round(smooth / 0.5) + noise) is None  # drowned
    assert (
        SEEN(answered(np.repeat((0.0, 4.0, 8.0, 4.0), 1000)) + noise) is None
    )  # it passes between its rests


@pytest.mark.parametrize("noises", (5.5, 7.5, 9.5, 11.0))
def test_levels_are_seen_where_noise_hardly_reaches_half_way_to_the_next(noises):
    """Steps of nine noises look like a staircase to anybody, and passed for noise of the output. Of six or
    eight, readings of one level reach the next one's half."""
    rng, step = np.random.default_rng(11), 0.09
    swept = np.interp(np.arange(3500.0), [0, 800, 1300, 1650, 2050, 3500], [0, 1, 0.3, 0.75, 0.15, 1])
    reading = step * np.round(swept / step) + step / noises * rng.normal(size=3500)
    found, phase = SEEN(reading)
    assert abs(found - step) < 0.01 * step and abs(phase) < 0.03 * step


def test_a_reading_that_hardly_moves_from_sample_to_sample_takes_no_time_to_look_at():
    """A thousand millionth of its span: no histogram of noises has so many bins."""
    reading = np.cumsum(np.r_[np.full(2100, 1e-9), np.full(4000, 5e-4), np.full(2100, 1e-9)])
    assert SEEN(reading) is None


def test_many_levels_are_counted_one_by_one():
    """The middle of a level that is seldom read is a little off: by its distance others were miscounted."""
    rng, step = np.random.default_rng(5), 0.25
    reading = step * np.round(2.3 * np.sin(0.01 * np.arange(6000.0)) / step) + 0.02 * rng.normal(size=6000)
    reading[np.argsort(reading)[:6]] = 0.018 - 10 * step
    found, _ = SEEN(reading)
    assert found == pytest.approx(step, rel=0.01)


def test_rests_of_a_rig_that_answers_within_a_sample_are_no_steps():
    quick = TransferFunction([(1.9, 0.0)], [(0.005, 1.0), (1.0, 0.0)])
    rig, rng = replace(HEATER, actuator=LinearActuator(quick)), np.random.default_rng(4)
    pump = np.repeat((0.0, 4.0, 8.0, 12.0, 8.0, 4.0, 0.0), 60)
    seen = answered(pump, 0.004) + 0.1 * rng.normal(size=420)
    assert SEEN(seen) is not None  # by sight they may be
    found = diagnose(rig, [Experiment("stairs", H, {"command": pump, "output": seen})])
    assert "sensor_quantization" not in [c.candidates[0].effect for c in found.causes]


@pytest.mark.long
def test_levels_of_a_finer_converter_behind_are_steps(monkeypatch):
    """Each level is read as its nearest of 4096, so that none is where even steps would have it. That they
    are steps needs no model that comes closer by them."""
    monkeypatch.setattr(converter, "_is_read", lambda *given: False)
    rng, step, fine = np.random.default_rng(6), 1.0, 24.0 / 4095
    logs = []
    for log in session(step, 0.0, 4):
        near = answered(log["command"]) + 0.14 * step * rng.normal(size=840)
        read = fine * np.round(step * np.round(near / step) / fine)
        logs.append(replace(log, signals={"command": log["command"], "output": read}))
    assert len(np.unique(np.concatenate([log["output"] for log in logs]))) < 40
    found = diagnose(HEATER, logs)
    assert [c.candidates[0].effect for c in found.causes] == ["sensor_quantization"]


@pytest.mark.parametrize(
    "noise, seed",
    [(0.6, 5), pytest.param(0.6, 6, marks=pytest.mark.long), pytest.param(0.1, 5, marks=pytest.mark.long)],
)
def test_steps_are_a_cause_where_they_make_most_of_the_noise(noise, seed):
    """Every converter has steps. Readings of a healthy rig whose noise is 0.6 of a step were named coarse at
    96 %, and 0 % of the gap."""
    rng, logs = np.random.default_rng(seed), []
    for log in session(1e-9, 0.0, seed):
        read = 0.3 * np.round((log["output"] + 0.3 * noise * rng.normal(size=840)) / 0.3)
        logs.append(replace(log, signals={"command": log["command"], "output": read}))
    found = diagnose(HEATER, logs, pictures=False)
    coarse = noise < 0.2
    assert [c.candidates[0].effect for c in found.causes] == ["sensor_quantization"] * coarse
    assert any("which are part of the noise" in note for note in found.notes) is not coarse


def test_nothing_is_held_against_steps_that_the_best_fit_goes_without():
    """A note said "instead of it may be (100 %) that at once it becomes another": steps are no noise."""
    coarse = SimpleNamespace(rivals=[SimpleNamespace(effect="sensor_quantization")])
    nothing = SimpleNamespace(problem=SimpleNamespace(families=(), candidates=()))
    assert bases.__wrapped__(SimpleNamespace(causes=(coarse,), whole=None)) == ()
    bare = SimpleNamespace(causes=(), best=nothing, nominal=nothing, whole=None, ar=())
    assert bases.__wrapped__(bare) == (nothing,)


@pytest.mark.parametrize("dead", [3.0, pytest.param(0.0, marks=pytest.mark.long)])
def test_steps_that_are_noise_beside_an_effect_are_no_second_one(dead):
    """A pump that does nothing below 3 V, read in steps of 0.5 of 24."""
    t = np.arange(840) * H
    logs = []
    for i, pump in enumerate((np.repeat(LEVELS, 60), 6.0 - 6.0 * np.cos(0.4 * t))):
        read = 0.5 * np.round(answered(np.maximum(pump - dead, 0.0)) / 0.5)
        logs.append(replace(Experiment(str(i), H, {"command": pump, "output": read}), start=60.0 * i))
    found = diagnose(HEATER, logs, pictures=False)
    names = [cause.candidates[0].effect for cause in found.causes]
    assert names == (["dead_zone"] if dead else ["sensor_quantization"])
    assert any("steps of 0.5" in note for note in found.notes) == bool(dead)


def behind_steps(half: float, dead: float, seed: int) -> list[Experiment]:
    """Steps and two sines behind a pump that does nothing below ``dead`` volts, read through a play of
    ``half`` a width each way, in steps of 6 of 24."""
    rng, t, logs = np.random.default_rng(seed), np.arange(840) * H, []
    for i, pump in enumerate((np.repeat(LEVELS, 60), *(6.0 - 6.0 * np.cos(w * t) for w in (0.4, 1.1)))):
        at, moved = 0.0, np.empty(840)
        for k, heat in enumerate(answered(np.maximum(pump - dead, 0.0))):
            moved[k] = at = min(max(at, heat - half), heat + half)
        read = 6.0 * np.round((moved + 0.1 * rng.normal(size=840)) / 6.0)
        logs.append(replace(Experiment(str(i), H, {"command": pump, "output": read}), start=60.0 * i))
    return logs


@pytest.mark.long
@pytest.mark.parametrize("seed", (1, 2))
@pytest.mark.parametrize(
    "half, dead, right",
    [
        (4.0, 0.0, {"hysteresis", "sensor_hysteresis"}),
        (0.0, 3.0, {"dead_zone"}),
        (0.0, 0.0, None),
    ],
)
def test_what_moves_the_times_of_the_steps_is_seen_through_them(half, dead, right, seed):
    """It changes less than half a step, and was held to be the steps' own."""
    found = diagnose(HEATER, behind_steps(half, dead, seed), pictures=False)
    names = [cause.candidates[0].effect for cause in found.causes]
    beside = [name for name in names if name != "sensor_quantization"]
    assert "sensor_quantization" in names and len(beside) == bool(right)
    assert not right or beside[0] in right
    assert found.shrink > 0.6


def rubbed(force: np.ndarray, rub: float) -> np.ndarray:
    """m y'' + c y' + k y + Coulomb's friction = force, in steps of a hundredth of a sample."""
    y, v, found, h = 0.0, 0.0, [], H / 100.0
    for u in force:
        found.append(y)
        for _ in range(100):
            free = v + h * (u - 0.5 * v - 4.0 * y) / 0.2
            held = h * rub / 0.2
            v = free - float(np.clip(free, -held, held))
            y += h * v
    return np.array(found)


@pytest.mark.parametrize("seed", [4, *(pytest.param(s, marks=pytest.mark.long) for s in (3, 5, 6))])
def test_steps_that_are_noise_hide_no_friction(seed):
    """The friction moves the reading by half a step, of twice the noise. Noise of half a step blurs steps:
    simulated without it they hid the friction, and a valve that sticks was named at 0.94."""
    rng, step = np.random.default_rng(seed), 0.1
    steps = np.r_[np.zeros(10), np.repeat((2.0, -2.0, 4.0, 0.0, -4.0, 1.0, -1.0, 3.0, 0.0), 60)]
    sine = 4.0 * np.sin(0.5 * H * np.arange(900))
    logs = []
    for i, force in enumerate((steps, sine)):
        y = rubbed(force, 0.2) + 0.05 * rng.normal(size=len(force))
        roles = {"command": force, "output": step * np.round(y / step)}
        logs.append(replace(Experiment(str(i), H, roles), start=100.0 * i))
    given = LinearActuator(TransferFunction([(0.255, 0.0)], [(0.05, 2.0), (0.13, 1.0), (1.0, 0.0)]))
    found = diagnose(Rig("flexure", H, Signals("t", "y", "u"), given), logs)
    assert [c.candidates[0].effect for c in found.causes] == ["friction"]
    assert found.shrink is not None and found.shrink > 0.8


def test_levels_that_the_model_passes_between_are_read_though_another_effect_hides_them():
    """A spring presses on from a place on: the steps alone bring the model hardly closer."""
    rng, step, t = np.random.default_rng(8), 0.5, np.arange(1600) * H
    drives = (np.repeat((2.0, -2.0, 4.0, 0.0, -4.0, 1.0, -1.0, 3.0), 200), 4.0 * np.sin(0.4 * t))
    logs = []
    for i, drive in enumerate(drives):
        y = answered(drive)
        y = y - 0.5 * np.maximum(y - 2.0, 0.0)
        read = step * np.round(y / step) + 0.02 * rng.normal(size=1600)
        logs.append(replace(Experiment(str(i), H, {"command": drive, "output": read}), start=100.0 * i))
    problem = problem_of(HEATER, make(logs, "command", "output"), logs)
    found = converter_of(problem, candidates_for(problem.segment, HEATER))
    assert found is not None
    assert found.step * problem.segment.level_out == pytest.approx(step, rel=0.01)


@pytest.mark.parametrize("plain, part", [(0.9, True), (1.1, False)])
def test_a_rounding_is_part_of_the_rig_only_where_users_see_it_come_closer(monkeypatch, plain, part):
    """By trust it is closer; by every sample alike it may be farther, and would promise less than nothing."""

    def left(weighed, every):
        problem = SimpleNamespace(residual=lambda vector: np.full(50, every))
        return SimpleNamespace(
            weighed=np.full(50, weighed), problem=problem, vector=None, predictable_share=0.0
        )

    nominal, both = left(1.0, 1.0), left(0.8, plain)
    monkeypatch.setattr(Converter, "stepped", lambda self, of, weighing: both)
    monkeypatch.setattr(Converter, "is_noise", lambda self, nominal, alone: False)
    found = Converter(SimpleNamespace(effect="sensor_quantization", stage="sensor"), (), 1.0)
    best, (cause,) = found.beside(nominal, nominal, (), None)
    assert (best is both) == part
    assert cause.rivals[0].effect == "sensor_quantization"


def late(y, step, lag):
    """``y`` (n,) read in steps that go on ``lag`` of a step late, on either way."""
    read, level = np.empty_like(y), 0.0
    for i, value in enumerate(y / step):
        level = np.round(value) if abs(value - level) > 0.5 + lag else level
        read[i] = step * level
    return read


def read_late(part, lag, seed):
    """A sound finger read in steps, ``part`` of the span each, that go on late."""
    logs = finger_session(seed, noise=0.003)
    step = part * np.ptp(np.concatenate([log["output"] for log in logs]))
    return [replace(log, signals={**log.signals, "output": late(log["output"], step, lag)}) for log in logs]


@pytest.mark.long
@pytest.mark.parametrize("part, lag, seed", [(0.05, 0.3, 1), (0.08, 0.2, 2)])
def test_steps_that_go_on_late_are_no_loop_beside_them(part, lag, seed, tmp_path):
    logs = read_late(part, lag, seed)
    found = diagnose(FINGER, logs, out=tmp_path / "gap", pictures=False)
    (cause,) = found.causes
    first = cause.candidates[0]
    assert (first.effect, first.form) == ("sensor_quantization", "sluggish")
    again = replay(tmp_path / "gap" / "augmented.toml", logs)
    left = np.sqrt(np.mean([log.rmse**2 for log in again.logs.values()]))
    assert left == pytest.approx(found.gap.explained, rel=0.02)


@pytest.mark.long
def test_a_loop_that_is_taken_for_granted_stays():
    told = ("sensor_hysteresis", "sensor_quantization")
    found = diagnose(FINGER, read_late(0.05, 0.3, 2), only=told, pictures=False)
    assert "sensor_hysteresis" in [cause.candidates[0].effect for cause in found.causes]


@pytest.mark.long
@pytest.mark.parametrize("step", [1.2, 0.8])
def test_a_loop_wider_than_a_step_stays_beside_it(step):
    rng, logs = np.random.default_rng(5), session(0.5, 0.0, 5)
    for i, log in enumerate(logs):
        y, reading, loop = answered(log["command"]), 0.0, np.empty(len(log))
        for k, value in enumerate(y):  # a play of 1.5 steps either way
            reading = min(max(reading, value - 1.5 * step), value + 1.5 * step)
            loop[k] = reading
        read = step * np.round((loop + 0.03 * rng.normal(size=len(log))) / step)
        logs[i] = replace(log, signals={**log.signals, "output": read})
    names = {cause.candidates[0].effect for cause in diagnose(HEATER, logs, pictures=False).causes}
    assert names & {"hysteresis", "sensor_hysteresis"}


def slower_down(step: float, down: float, uneven: float, seed: int) -> list[Experiment]:
    """Steps and a slow sine, of a rig whose time is 0.8 s upwards and ``down`` s downwards. Each level is
    ``uneven`` steps (a standard deviation) too high or too low where the next one begins."""
    edges, t = uneven * np.random.default_rng(seed).normal(size=200), np.arange(840) * H
    logs = []
    for i, pump in enumerate((np.repeat(LEVELS, 60), 6.0 - 6.0 * np.cos(0.4 * t))):
        level, y = 0.0, np.zeros(840)
        for k, goal in enumerate(2.0 * pump):
            level += (goal - level) * (1.0 - np.exp(-H / (0.8 if goal > level else down)))
            y[k] = level
        place = y / step + 0.5
        code = np.floor(place).astype(int)
        code = np.where(place - code < edges[code], code - 1, code)
        code = np.where(place - code >= 1.0 + edges[code + 1], code + 1, code)
        log = Experiment(str(i), H, {"command": pump, "output": step * code})
        logs.append(replace(log, start=60.0 * i))
    return logs


@pytest.mark.long
@pytest.mark.parametrize(
    "down, uneven, named",
    [
        (1.4, 0.0, ["unloading_asymmetry"]),
        (1.8, 0.1, ["unloading_asymmetry"]),
        (0.8, 0.0, []),
    ],
)
def test_what_moves_levels_by_whole_steps_is_seen_though_no_input_predicts_much_of_it(down, uneven, named):
    """What is left at a sixth of the span is whole steps, late or soon: of that inputs predict 5 to 9 in a
    hundred: as little as of the steps by themselves."""
    found = diagnose(HEATER, slower_down(4.0, down, uneven, seed=1))
    first = [c.candidates[0].effect for c in found.causes]
    assert sorted(first) == sorted([*named, "sensor_quantization"])
