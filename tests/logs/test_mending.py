"""What is done to a log as it comes from a rig: holes, clocks, missing readings, outliers, slow sensors.

Red when a mended log departs from the clean one, or a change is not told.
"""

import numpy as np
import pytest

from focgen.errors import LogError
from focgen.logs import Experiment, notes_of
from focgen.logs.drives import barred_by, turned_by
from focgen.logs.notes import Note
from focgen.logs.outliers import are_many, outliers
from focgen.logs.read import in_session_order
from focgen.logs.repeats import fresh_rows, frozen
from tests.logs.test_read import STEP, read_columns, table

COUNT = 1000


def rows_of(columns, rows) -> dict:
    return {name: np.asarray(values)[rows] for name, values in columns.items()}


def noted(experiment, *words) -> bool:
    return any(all(word in note for word in words) for note in experiment.notes)


def ramp(count=COUNT, **changes) -> dict:
    """A log whose every signal is a straight line: bridging must give it back exactly."""
    time = STEP * np.arange(count)
    lines = {"p_bar": 0.02 * time, "kappa_cam_per_mm": 0.001 * time, "kappa_per_mm": 0.0005 * time}
    return table(count, **{**lines, **changes})


@pytest.mark.parametrize("lost", [1, 5])
def test_short_holes_in_time_are_bridged_and_said_once(tmp_path, lost):
    rows = np.setdiff1d(np.arange(COUNT), [*range(200, 200 + lost), *range(600, 600 + lost)])
    (log,) = read_columns(tmp_path, rows_of(ramp(), rows))
    assert len(log) == COUNT and log.sample_time == STEP and not log.continues
    assert log["output"] == pytest.approx(ramp()["kappa_per_mm"], abs=1e-12)
    assert len(log.notes) == 1 and noted(log, "bridged", f"{2 * lost}, the first at 2 s")
    assert np.array_equal(log.raw_time, STEP * rows) and len(log.rows["output"]) == len(rows)


@pytest.mark.parametrize("digits", [2, 3])
def test_a_lost_sample_is_not_taken_for_a_slower_clock(tmp_path, digits):
    """Stamps of two digits, 0.02 s apart: half a percent is lost, the clock is not half a percent slow."""
    rows = np.setdiff1d(np.arange(COUNT), [500])
    columns = ramp(t_s=np.round(0.02 * np.arange(COUNT), digits))
    (log,) = read_columns(tmp_path, rows_of(columns, rows), sample_time=0.02)
    assert log.sample_time == 0.02 and len(log) == COUNT and noted(log, "samples missing", "at 10 s")


def test_a_command_is_held_over_a_hole(tmp_path):
    columns = table(COUNT, u_V=np.where(np.arange(COUNT) < 203, 0.0, 1.5))
    (log,) = read_columns(tmp_path, rows_of(columns, np.setdiff1d(np.arange(COUNT), range(200, 205))))
    assert np.array_equal(log["command"], np.where(np.arange(COUNT) < 205, 0.0, 1.5))


@pytest.mark.parametrize("lost, jump", [(6, 0.0), (400, 0.0), (0, 3600.0)])
def test_what_follows_a_long_hole_is_an_experiment_of_its_own(tmp_path, lost, jump):
    """Six lost samples are too many; so is a clock set forward by an hour."""
    columns = ramp(t_s=STEP * np.arange(COUNT) + jump * (np.arange(COUNT) >= 300))
    first, second = read_columns(tmp_path, rows_of(columns, np.r_[:300, 300 + lost : COUNT]))
    assert (first.name, second.name) == ("log", "log (2)")
    assert (first.continues, second.continues) == (False, True)
    assert (len(first), len(second)) == (300, 700 - lost)
    assert second.start == pytest.approx(STEP * (300 + lost) + jump)
    assert np.array_equal(second["output"], ramp()["kappa_per_mm"][300 + lost :])
    assert noted(first, "holes in time", "at 2.99 s") and second.notes == ()


def test_holes_in_an_irregular_clock_are_told_from_its_own_steps(tmp_path):
    time = np.cumsum(np.random.default_rng(3).uniform(0.2, 1.8, COUNT)) * STEP
    (whole,) = read_columns(tmp_path, ramp(t_s=time))
    assert noted(whole, "not uniform")
    bursts = np.cumsum(np.where(np.arange(COUNT) % 3 == 0, 8.37, 1.0)) * STEP
    assert len(read_columns(tmp_path, ramp(t_s=bursts))) == 1, "three rows at a time"
    parts = read_columns(tmp_path, ramp(t_s=time + 500.0 * (np.arange(COUNT) >= 400)))
    assert [part.continues for part in parts] == [False, True]
    assert parts[0].time[-1] < 6.0 and parts[1].start == pytest.approx(time[400] + 500.0)


def test_parts_of_a_few_samples_are_left_out_and_said(tmp_path):
    rows = np.r_[:300, 400:407, 500:COUNT]
    first, second = read_columns(tmp_path, rows_of(ramp(), rows))
    assert (len(first), len(second)) == (300, 500) and second.continues
    assert noted(first, "fewer than 8 samples left out", "at 4 s")
    with pytest.raises(LogError, match="without a hole"):
        read_columns(tmp_path, rows_of(ramp(), np.flatnonzero(np.arange(COUNT) % 50 < 7)))


def test_a_clock_that_starts_anew_begins_an_experiment(tmp_path):
    columns = ramp(t_s=STEP * np.r_[0:400, 0:350, 0:250])
    logs = read_columns(tmp_path, columns)
    assert [log.name for log in logs] == ["log", "log (2)", "log (3)"]
    assert [len(log) for log in logs] == [400, 350, 250] and not any(log.continues for log in logs)
    assert [log.start for log in logs] == pytest.approx([0.0, 4.0, 7.5])
    hour_back = 7200.0 + STEP * np.arange(COUNT) - 3600.0 * (np.arange(COUNT) > 499)
    back = read_columns(tmp_path, ramp(t_s=hour_back))
    assert [len(log) for log in back] == [500, 500]


@pytest.mark.parametrize("row, stamp", [(20, 0.01), (20, 0.17), (500, 4.985)])
def test_single_stamps_that_fall_back_are_refused(tmp_path, row, stamp):
    time = STEP * np.arange(COUNT)
    time[row] = stamp
    with pytest.raises(LogError, match=f"line {row + 2}: time has to increase; sort the rows"):
        read_columns(tmp_path, ramp(t_s=time))


@pytest.mark.parametrize("step, to", [(0.005, 0.01), (0.015, 0.01), (1 / 300, 0.01)])
@pytest.mark.parametrize("rounding", [np.round, np.floor])
def test_the_uniform_clock_behind_rounded_stamps_is_found(tmp_path, step, to, rounding):
    time = to * rounding(step * np.arange(COUNT) / to + 1e-9)
    (log,) = read_columns(tmp_path, ramp(t_s=time))
    assert log.sample_time == pytest.approx(step, rel=1e-4) and len(log) == COUNT
    assert np.array_equal(log["output"], ramp()["kappa_per_mm"]) and noted(log, "rounded")


def test_repeated_stamps_without_a_uniform_clock_are_refused(tmp_path):
    gaps = np.random.default_rng(0).integers(0, 3, COUNT) * STEP
    with pytest.raises(LogError, match="log finer time stamps"):
        read_columns(tmp_path, ramp(t_s=np.cumsum(gaps)))


def test_rows_logged_twice_are_taken_once(tmp_path):
    (log,) = read_columns(tmp_path, rows_of(ramp(), np.sort(np.r_[:COUNT, 77, 500])))
    assert np.array_equal(log["output"], ramp()["kappa_per_mm"])
    assert noted(log, "twice", "2, the first in line 80")


@pytest.mark.parametrize("column", ["p_bar", "kappa_cam_per_mm", "kappa_per_mm", "u_V"])
def test_short_stretches_of_missing_readings_are_bridged(tmp_path, column):
    columns = ramp()
    columns[column] = columns[column].copy()
    columns[column][[50, 51, 52, 53, 54, 300]] = np.nan
    (log,) = read_columns(tmp_path, columns)
    assert len(log) == COUNT and noted(log, "missing", "6, the first at 0.5 s") and len(log.notes) == 1
    for role, name in {"command": "u_V", "pressure": "p_bar", "output": "kappa_per_mm"}.items():
        assert log[role] == pytest.approx(ramp()[name], abs=1e-12)


def test_a_long_stretch_without_output_is_cut_out(tmp_path):
    columns = ramp()
    columns["kappa_per_mm"][400:500] = np.nan
    first, second = read_columns(tmp_path, columns)
    assert (len(first), len(second)) == (400, 500) and second.continues
    assert noted(first, "readings of output missing for long", "at 4 s")


@pytest.mark.parametrize("missing, dropped", [(100, False), (500, True)])
def test_of_an_optional_role_rows_or_the_role_go(tmp_path, missing, dropped):
    """Four roles: 10 % of the camera's readings are cut out, of 50 % the other three roles are worth more."""
    columns = ramp()
    columns["kappa_cam_per_mm"][200 : 200 + missing] = np.nan
    logs = read_columns(tmp_path, columns)
    assert len(logs) == (1 if dropped else 2) and ("curvature" in logs[0]) != dropped
    assert sum(map(len, logs)) == (COUNT if dropped else COUNT - missing)
    assert noted(logs[0], "curvature left out" if dropped else "readings of curvature missing for long")


def test_a_camera_logged_in_every_tenth_row_is_no_hole(tmp_path):
    columns = ramp()
    columns["kappa_cam_per_mm"] = np.where(np.arange(COUNT) % 10 == 0, columns["kappa_cam_per_mm"], np.nan)
    columns["kappa_cam_per_mm"][-1] = ramp()["kappa_cam_per_mm"][-1]
    (log,) = read_columns(tmp_path, columns)
    assert log["curvature"] == pytest.approx(ramp()["kappa_cam_per_mm"], abs=1e-12)


def test_a_needed_column_without_a_reading_is_refused(tmp_path):
    with pytest.raises(LogError, match="output is empty or not a number in line 2 and 999 more"):
        read_columns(tmp_path, ramp(kappa_per_mm=[""] * COUNT))
    with pytest.raises(LogError, match="command is empty"):
        read_columns(tmp_path, ramp(u_V=[""] * COUNT, p_bar=[""] * COUNT))


def test_one_that_continues_keeps_its_distance_in_a_session():
    """Two files on clocks of their own, the first with a hole of 5 s."""
    y = {"output": np.zeros(100)}
    a, b = Experiment("a", 0.1, y), Experiment("a (2)", 0.1, y, 15.0, continues=True)
    placed = in_session_order([a, b, Experiment("b", 0.1, y)])
    assert [(e.name, e.start) for e in placed] == [("a", 0.0), ("a (2)", 15.0), ("b", 25.0)]


def test_notes_of_a_kind_are_one_line():
    def log(name, *notes):
        return Experiment(name, 0.1, {"output": np.zeros(9)}, notes=notes)

    logs = [log("7", Note("x", 2, "at 1 s"), "slow"), log("9", Note("x", 1, "at 4 s")), log("11")]
    assert notes_of(logs) == ("7 and 9: x (3, the first at 1 s of 7)", "7: slow")
    assert notes_of(logs[:2])[0].startswith("all experiments: x (3")
    many = [log(f"{i}", "slow") for i in range(9)] + [log("last")]
    assert notes_of(many) == ("9 experiments (0, 1, 2, …): slow",)
    assert Note("x", 1, "at 4 s") == "x (at 4 s)"


# -- outliers ------------------------------------------------------------------------------------------------


def clean(rng: np.random.Generator, kind: str, count: int = 2000) -> tuple[np.ndarray, np.ndarray, float]:
    """(signal without noise, the command behind it, a noise that suits it), by kind, of a span about 1."""
    time = np.arange(count)
    levels = np.repeat(rng.uniform(-0.5, 0.5, 1 + count // 200), 200)[:count]
    command = levels
    if kind == "steps":
        tau, signal = rng.uniform(0.5, 40.0), np.zeros(count)
        signal = _filtered(levels, 1.0 - np.exp(-1.0 / tau), 0.0)
    elif kind == "overshoot":
        signal = _filtered(levels, 0.0, rng.uniform(6.0, 60.0), rng.uniform(0.05, 0.6))
    elif kind == "sines":
        command = signal = 0.5 * np.sin(2 * np.pi * time / rng.uniform(8.0, 800.0) + rng.uniform(0, 6))
    else:
        half = rng.integers(4, 200)
        command = signal = 0.5 * (-1.0) ** (time // half)
    return signal, command, float(10 ** rng.uniform(-4, -1.3))


def _filtered(levels, share, period, damping=1.0):
    out, rate, now = np.empty(len(levels)), 0.0, 0.0
    w = 2 * np.pi / period if period else 0.0
    for k, level in enumerate(levels):
        if period:
            rate += w * w * (level - now) - 2 * damping * w * rate
            now += rate
        else:
            now += share * (level - now)
        out[k] = now
    return out


def measured(rng, signal, noise) -> np.ndarray:
    """With white or slow noise, and through a converter or not."""
    white = rng.normal(size=len(signal))
    if rng.random() < 0.5:
        slow = np.sqrt(1 - 0.81) * 10 * _filtered(rng.normal(size=len(signal)), 0.1, 0)
        white = np.sqrt(0.5) * (white + slow)
    y = signal + noise * white
    count = noise * rng.choice([0.0, 0.3, 3.0, 20.0])
    return np.round(y / count) * count if count else y


@pytest.mark.parametrize("kind", ["steps", "overshoot", "sines", "square"])
def test_no_outlier_is_seen_where_there_is_none(kind):
    """With the command and without it: the signal alone has to tell."""
    rng, seen = np.random.default_rng(5), 0
    for _ in range(60):
        signal, command, noise = clean(rng, kind)
        y = measured(rng, signal, noise)
        seen += bool(outliers(y).any()) + bool(outliers(y, barred_by(command)).any())
    assert seen == 0


@pytest.mark.parametrize(
    "kind, width", [("overshoot", 1), *((k, w) for k in ("steps", "sines") for w in (1, 2, 3))]
)
def test_outliers_at_rest_of_the_signal_are_found(kind, width):
    """Away from the steps, 8 to 40 standard deviations of the noise off; slow sines. Ringing hides some,
    and one that jumps as high keeps pulses of several readings."""
    rng, found, wrong = np.random.default_rng(6), 0, 0
    for _ in range(60):
        signal, _, _ = clean(rng, kind)
        if kind == "sines":
            signal = 0.5 * np.sin(2 * np.pi * np.arange(2000) / rng.uniform(800.0, 2000.0))
        y = signal + 0.01 * rng.normal(size=2000)
        at = 200 * rng.integers(1, 9) - rng.integers(5, 20)
        y[at : at + width] = signal[at : at + width] + 0.01 * rng.uniform(8.0, 40.0) * rng.choice([-1, 1])
        seen = outliers(y)
        found += bool(seen[at : at + width].all())
        wrong += int(seen.sum()) - int(seen[at : at + width].sum())
    assert found >= (56 if width == 1 else 45) and wrong == 0


@pytest.mark.parametrize("size", (1.0, 1e4, 1e9, -1e15, 1e30))
def test_however_far_off_a_reading_is_it_is_an_outlier(size):
    """A bit of an exponent: so far off, every other step was once a rounding error of the span."""
    y = 0.004 * np.linspace(0.0, 1.0, 400) + 5e-5 * np.random.default_rng(3).standard_normal(400)
    y[300] = size
    assert list(np.flatnonzero(outliers(y))) == [300]


@pytest.mark.parametrize("late", (0, 1, 4, 9, 12))
@pytest.mark.parametrize("size", (0.02, -0.02, 1e9))
def test_behind_a_jump_of_the_command_only_what_the_signal_never_does_is_an_outlier(late, size):
    """Readings there were left alone, however far off: a spark of 1 bar made T 1.7 of 1.3."""
    y = 0.004 * (1.0 - np.exp(-np.maximum(np.arange(400) - 200, 0) / 25.0))
    y += 2e-5 * np.random.default_rng(3).standard_normal(400)
    command = np.where(np.arange(400) < 200, 0.0, 1.0)
    y[200 + late] += size
    seen = outliers(y, barred_by(command), turned_by(command))
    assert list(np.flatnonzero(seen)) == [200 + late]
    y[200 + late] = 0.003
    assert not outliers(y, barred_by(command), turned_by(command)).any(), "within what it does"


@pytest.mark.parametrize("width", (1, 2, 3, 8))
def test_the_answer_to_a_short_pulse_of_the_command_is_no_outlier(width):
    command = np.zeros(400)
    command[200 : 200 + width] = 1.0
    y = np.roll(command, 1) + 1e-3 * np.random.default_rng(3).standard_normal(400)
    assert outliers(y).any() == (width < 4)
    assert not outliers(y, barred_by(command), turned_by(command)).any()


def first_off(tmp_path, first: float, moves: float = 1.0):
    """A log of a step in its middle whose first pressure is another."""
    rng = np.random.default_rng(1)
    near = np.arange(COUNT) - COUNT // 2
    command = np.where(near < 0, 0.0, moves)
    p = 0.1 * moves * (1.0 - np.exp(-np.maximum(near, 0) / 5.0)) + 1e-4 * rng.normal(size=COUNT)
    p[0] = first
    y = 0.01 * moves * (1.0 - np.exp(-np.maximum(near, 0) / 60.0)) + 1e-5 * rng.normal(size=COUNT)
    return read_columns(tmp_path, ramp(u_V=command, p_bar=p, kappa_cam_per_mm=y, kappa_per_mm=y))[0]


def test_a_first_reading_that_a_buffer_kept_is_an_outlier_or_told_of(tmp_path):
    """Of every experiment, as some loggers give it, it made alpha 0.36 of 0.6."""
    far = first_off(tmp_path, 0.25)
    assert noted(far, "outliers of pressure", "at 0 s") and abs(far["pressure"][0]) < 1e-3
    within = first_off(tmp_path, 0.09)
    assert noted(within, "pressure begins with a reading far off", "--from") and within["pressure"][0] == 0.09
    for first, moves in ((0.0, 1.0), (3e-4, 1.0)):
        assert not first_off(tmp_path, first, moves).notes
    released = first_off(tmp_path, 0.1, 0.0)
    assert released["pressure"][0] == 0.1, "a release as the log begins, of which it shows nothing else"


def test_pulses_that_come_often_are_the_signal():
    rng = np.random.default_rng(8)
    pulses = np.zeros(2000)
    pulses[rng.permutation(200)[:40] * 10] = 1.0
    y = pulses + 0.01 * rng.normal(size=2000)
    assert are_many(outliers(y))
    few = outliers(np.where(np.arange(2000) < 1700, y - pulses, y))
    assert few.any() and not are_many(few)


def test_an_outlier_of_a_log_is_bridged_and_counted(tmp_path):
    rng = np.random.default_rng(1)
    noise = 1e-5 * rng.normal(size=COUNT)
    columns = ramp(u_V=np.zeros(COUNT))
    columns["kappa_per_mm"] = columns["kappa_per_mm"] + noise
    true = columns["kappa_per_mm"].copy()
    columns["kappa_per_mm"][[120, 700]] = [0.019, -3.0]
    (log,) = read_columns(tmp_path, columns)
    assert noted(log, "outliers of output", "2, the first at 1.2 s")
    assert np.abs(log["output"] - true).max() < 5e-5 and np.array_equal(log["pressure"], ramp()["p_bar"])


# -- repeated readings ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("period", [2, 4, 10, 10 / 3])
def test_a_camera_slower_than_the_log_is_taken_at_its_fresh_readings(tmp_path, period):
    rng = np.random.default_rng(2)
    true = 0.01 * np.sin(2 * np.pi * np.arange(COUNT) / 500)
    last = (np.floor(np.arange(COUNT) / period + 1e-9) * period).astype(int)
    held = (true + 1e-6 * rng.normal(size=COUNT))[last]
    (log,) = read_columns(tmp_path, ramp(kappa_cam_per_mm=held, kappa_per_mm=held.copy()))
    assert noted(log, "curvature is fresh", "straight lines") and noted(log, "output is fresh", "late")
    rate = 100.0 / period
    assert noted(log, f"({rate:.3g} Hz)")
    inner = slice(20, COUNT - 20)
    assert np.abs(log["curvature"] - true)[inner].max() < 0.4 * np.abs(held - true).max()
    assert np.array_equal(log["output"], held)


def test_a_coarse_converter_is_not_taken_for_a_slow_camera():
    rng = np.random.default_rng(3)
    for _ in range(300):
        signal, _, noise = clean(rng, rng.choice(["steps", "overshoot", "sines"]))
        count = noise * rng.uniform(0.5, 30.0)
        assert fresh_rows(np.round((signal + noise * rng.normal(size=len(signal))) / count) * count) is None
    assert fresh_rows(np.floor(np.arange(2000) / 7.0)) is None
    at_times = np.repeat(rng.normal(size=700), rng.integers(2, 5, 700))
    assert fresh_rows(at_times) is None, "readings that come at no rate of their own"


def test_a_frozen_reading_is_named(tmp_path):
    rng = np.random.default_rng(4)
    moving = 0.01 * np.sin(2 * np.pi * np.arange(COUNT) / 200) + 1e-5 * rng.normal(size=COUNT)
    stuck = moving.copy()
    stuck[420:480] = stuck[420]
    (log,) = read_columns(tmp_path, ramp(kappa_cam_per_mm=stuck, kappa_per_mm=moving))
    assert noted(log, "curvature frozen", "for 0.6 s from 4.2 s") and len(log.notes) == 1
    ceiling = np.where(np.arange(COUNT) < 200, np.minimum(moving, 0.009), 0.8 * moving)
    assert frozen(ceiling, [np.roll(moving, 50)]) is None, "a reading that saturates is not frozen"
    assert frozen(stuck, [np.zeros(COUNT)]) is None, "nothing moves"
    play = np.cumsum(np.r_[np.ones(300), np.zeros(100), np.ones(200), -np.ones(400)])
    assert frozen(np.round(play / 5), [moving]) is None, "a coarse converter behind play"


def test_readings_around_a_jump_are_left_alone_however_short_the_log():
    """From three ahead of the first one after it to ten behind; of as few as make an experiment."""
    for count in range(1, 40):
        for jump in range(1, count):
            near = np.arange(count) - jump
            barred = barred_by(np.where(near < 0, 0.0, 1.0))
            assert np.array_equal(barred, (near >= -3) & (near <= 10)), (count, jump)
