"""Readings that jump away and back, alone or for longer, in rest and among jumps of the command.

Red when one is taken as it stands without a word, or an honest log has such a word.
"""

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.identification.ranges import seen_ranges
from focgen.logs import Experiment
from focgen.logs.drives import Drive, answers_to, barred_by, turned_by
from focgen.logs.mending import mended
from focgen.logs.outliers import outliers
from focgen.rig.rig import Ranges

STEP, COUNT = 0.02, 1500
TOLD = ("jumps away", "outliers", "stands out", "together", "frozen")


def lagged(u: np.ndarray, rows: float) -> np.ndarray:
    """``u`` through a first-order lag of so many rows; of none, as it is."""
    if not rows:
        return u.copy()
    share, now, y = 1.0 - np.exp(-1.0 / rows), 0.0, np.empty(len(u))
    for k, x in enumerate(u):
        now += share * (x - now)
        y[k] = now
    return y


def answered(command: np.ndarray, rows: float = 3.0, noise: float = 0.005, seed: int = 1) -> dict:
    """A log of a quick pressure and a slower output, by role."""
    rng = np.random.default_rng(seed)
    p = lagged(0.1 * command, rows)
    signals = {"pressure": p, "output": lagged(0.1 * p, 8.0 * rows)}
    noisy = {role: y + noise * np.ptp(y) * rng.normal(size=len(y)) for role, y in signals.items()}
    return {"command": command, **noisy}


def stairs() -> np.ndarray:
    return np.repeat([0.0, 1.0, 0.5, 1.5, 0.0], COUNT // 5)


def told(signals: dict) -> list[str]:
    notes = mended(STEP * np.arange(len(signals["command"])), signals)[1]
    return [note for note in notes if any(word in note for word in TOLD)]


def commands(rng: np.random.Generator) -> dict[str, np.ndarray]:
    rows = np.arange(COUNT)
    bits = np.where(rows < 50, 0.0, np.repeat(rng.integers(0, 2, COUNT // 4), 4)[:COUNT])
    pulses = np.where((rows % 190 > 120) & (rows % 190 < 120 + rng.integers(2, 40)), 1.0, 0.0)
    return {
        "steps": stairs(),
        "sine": np.sin(2 * np.pi * rows / rng.uniform(8.0, 800.0)),
        "bits": bits,
        "pulses": pulses,
        "pulses on steps": stairs() + pulses,
        "dither": stairs() + 0.1 * rng.normal(size=COUNT),
        "begins high": 1.0 - rows / COUNT,
    }


@pytest.mark.parametrize(
    "rows", (0.0, pytest.param(0.5, marks=pytest.mark.long), 3.0, pytest.param(40.0, marks=pytest.mark.long))
)
def test_nothing_is_told_of_honest_answers(rows):
    for seed in range(4):
        rng = np.random.default_rng(seed)
        for kind, command in commands(rng).items():
            signals = answered(command, rows, rng.uniform(0.004, 0.02), seed)
            assert not told(signals), (kind, seed)


@pytest.mark.parametrize("width", (4, 10, 50))
@pytest.mark.parametrize("what", ("far", "zero", "a third more", "random"))
def test_a_loose_plug_is_told_of(width, what):
    signals = answered(stairs())
    rng, y = np.random.default_rng(2), signals["pressure"]
    made = {"far": 1.0, "zero": 0.0, "a third more": 0.2, "random": rng.uniform(-1.0, 1.0, width)}
    y[1100 : 1100 + width] = made[what] + 1e-3 * rng.normal(size=width)
    (note,) = [note for note in told(signals) if "jumps away" in note]
    assert "pressure" in note and f"{width} readings from 22 s" in note and "--from" in note


def test_open_ranges_are_taken_without_a_loose_plug():
    signals = answered(stairs())
    before, _ = seen_ranges(Ranges(), [Experiment("a", STEP, signals)])
    signals["output"] = signals["output"].copy()
    signals["output"][1100:1104] = 1.0
    after, _ = seen_ranges(Ranges(), [Experiment("a", STEP, signals)])
    assert before.output is not None and after == before


@pytest.mark.parametrize("every", [25, 60])
@pytest.mark.parametrize("seed", range(6))
def test_a_spark_among_the_steps_of_a_staircase(seed, every):
    """Three out of four were left: the command had jumped a little before, and the signal goes further in all
    than the spark, though never at once."""
    rng = np.random.default_rng([seed, every])
    command = np.repeat(rng.uniform(0.0, 3.0, COUNT // every + 1), every)[:COUNT]
    y = lagged(command, rng.uniform(15.0, 60.0)) + 0.01 * rng.normal(size=COUNT)
    rows = np.sort(rng.choice(np.arange(20, COUNT - 20, 7), 5, replace=False))
    sparked = y.copy()
    sparked[rows] += 0.8 * np.ptp(y) * rng.choice([-1.0, 1.0], 5)
    drive = Drive.by(command)
    assert not outliers(y, drive.barred, drive.never, drive.answers).any()
    assert np.array_equal(np.flatnonzero(outliers(sparked, drive.barred, drive.never, drive.answers)), rows)


@pytest.mark.parametrize("seed", range(6))
def test_what_knocks_behind_steps_is_no_spark(seed):
    """A pipe knocks two rows behind each closing of its valve, once. Sparks do not wait for the command. What
    it does by less than a jump is not asked."""
    rng = np.random.default_rng(seed)
    command = np.repeat(rng.uniform(0.0, 3.0, COUNT // 60), 60)
    change = np.diff(command, prepend=0.0)
    y = lagged(command, 20.0) + 0.01 * rng.normal(size=COUNT)
    knocks = np.roll(np.where((change < 0.0) & (np.arange(COUNT) > 0), -1.5 * change, 0.0), 2)
    drive = Drive.by(command)
    found = outliers(y + knocks, drive.barred, drive.never, drive.answers)
    assert not np.any(found & (knocks > 1.5 * drive.answers.jump)) and np.sum(knocks > 0.5) > 5


@pytest.mark.parametrize("seed", range(12))
def test_what_rings_behind_a_step_is_no_spark(seed):
    """A mode of 2.5 to 15 readings a period, hardly damped, and a signal that follows at once."""
    rng = np.random.default_rng(seed)
    command = np.repeat(rng.uniform(0.0, 3.0, COUNT // 25), 25)
    rate, damping = 2.0 * np.pi / rng.uniform(2.5, 15.0), rng.uniform(0.02, 0.4)
    decay, turn = np.exp(-damping * rate), rate * np.sqrt(1.0 - damping**2)
    poles = np.array([1.0, -2.0 * decay * np.cos(turn), decay**2])
    noise = 0.005 * rng.normal(size=COUNT)
    drive = Drive.by(command)
    for y in (lfilter([0.0, poles.sum()], poles, command), np.r_[0.0, command[:-1]] + lagged(command, 50.0)):
        assert not outliers(y + noise, drive.barred, drive.never, drive.answers).any()


def test_more_outliers_than_are_mended_are_told_of():
    signals, rng = answered(stairs()), np.random.default_rng(3)
    sparks = rng.random(COUNT) < 0.02
    signals["pressure"][sparks] = rng.uniform(0.5, 1.0, sparks.sum())
    assert any("pressure stands out" in note and "mend the log" in note for note in told(signals))


def test_late_answers_to_pulses_are_not_told_of_as_too_many_outliers():
    """What comes from outside comes at rest as well; a dead time is longer than what is barred."""
    command = np.where(np.arange(COUNT) % 75 == 40, 1.0, 0.0)
    y = np.roll(command, 20) + 1e-3 * np.random.default_rng(5).normal(size=COUNT)
    assert not told({"command": command, "output": y})
    drive, sparks = Drive.by(command), np.random.default_rng(6).random(COUNT) < 0.02
    assert drive.is_elsewhere(sparks) and not drive.is_elsewhere(np.roll(command, 20) > 0.5)


@pytest.mark.parametrize("kind", ("bits", "dither"))
@pytest.mark.parametrize("size", (1.0, 1e5))
def test_a_spark_among_jumps_of_the_command_is_mended(kind, size):
    command = commands(np.random.default_rng(0))[kind]
    for role in ("pressure", "output"):
        signals = answered(command)
        clean = signals[role].copy()
        signals[role][1003] = size
        found, notes = mended(STEP * np.arange(COUNT), signals)
        assert np.abs(found[role] - clean).max() < 0.1 and any(f"outliers of {role}" in n for n in notes)


@pytest.mark.parametrize("row", ((0.0, 0.0, 0.0), (10.0, 1.0, 0.1), (5.0, 0.35, 0.04)))
def test_a_row_misread_as_a_whole_is_mended_and_told_of(row):
    signals = answered(stairs(), rows=3.0, noise=0.002)
    clean = signals["pressure"].copy()
    for role, x in zip(signals, row, strict=True):
        signals[role][1100] = x
    found, notes = mended(STEP * np.arange(COUNT), signals)
    assert np.abs(found["pressure"] - clean).max() < 2e-3
    assert any("command leaves" in n and "pressure and output" in n and "at 22 s" in n for n in notes)


def test_a_static_answer_in_the_row_of_the_pulse_is_no_misread_row():
    command = stairs()
    command[[1050, 1100]] = [0.0, 10.0]
    y = 0.1 * command + 1e-4 * np.random.default_rng(4).normal(size=COUNT)
    assert not outliers(y, barred_by(command), turned_by(command), answers_to(command)).any()


@pytest.mark.parametrize("also", ("nothing", "an empty cell", "empty others", "a spark", "sparks elsewhere"))
def test_an_empty_cell_or_a_spark_hides_no_frozen_reading(also):
    signals = answered(stairs(), rows=10.0)
    y, p = signals["output"], signals["pressure"]
    y[310:400] = y[310]
    if also == "an empty cell":
        y[900] = np.nan
    elif also == "empty others":
        p[900] = np.nan
    elif also == "a spark":
        y[800] = 5.0
    elif also == "sparks elsewhere":
        p[800] = 50.0
    assert any("output frozen" in note and "from 6.2 s" in note for note in told(signals))


@pytest.mark.parametrize("rows", (0.0, 0.5, 3.0))
@pytest.mark.parametrize("width", (4, 10, 50, 51, 120))
def test_a_dropout_at_a_hold_is_told_of_however_quick_the_rig(rows, width):
    """A quick rig falls as far behind a step of its command; at rest of it nothing does."""
    signals = answered(stairs(), rows)
    y = signals["pressure"]
    y[1060 : 1060 + width] -= y[1059]
    (note,) = [note for note in told(signals) if "jumps away" in note]
    assert "pressure" in note and f"{width} readings from 21.2 s" in note


@pytest.mark.parametrize("width", (51, 80, 130))
@pytest.mark.parametrize("what", ("far", "noisy"))
def test_a_loose_plug_is_told_of_as_long_as_the_command_rests(width, what):
    signals, rng = answered(stairs()), np.random.default_rng(2)
    y = signals["pressure"]
    y[1060 : 1060 + width] = 1.0 if what == "far" else 0.4 + 1e-3 * rng.normal(size=width)
    assert any("jumps away" in note and f"{width} readings" in note for note in told(signals))


@pytest.mark.parametrize("every", (2, 3))
def test_a_chattering_plug_is_told_of_as_one(every):
    signals = answered(stairs())
    signals["pressure"][1050:1110:every] += 0.5
    notes = [note for note in told(signals) if "jumps away" in note]
    assert len(notes) == 1 and "from 21 s" in notes[0]


def late_ones() -> dict[str, np.ndarray]:
    """Commands whose answers come when they rest, or that seem to rest."""
    rows, steps = np.arange(COUNT), np.repeat([0.0, 1.0, 0.5], COUNT // 3)
    pulse = np.where((rows > 700) & (rows < 722), 0.3, 0.0)
    return {
        "pulse in a hold": steps + pulse,
        "before the log": np.where((rows >= 850) & (rows < 950), 1.0, 0.0),
        "a step of four per cent": steps + np.where((rows > 700) & (rows < 780), 0.03, 0.0),
        "slopes": np.clip(np.minimum(rows - 300, 1000 - rows) / 30.0, 0.0, 1.0),
    }


@pytest.mark.parametrize("kind", late_ones())
@pytest.mark.parametrize("late", (0, 110, 150))
def test_late_and_small_answers_are_not_told_of(kind, late):
    command = late_ones()[kind]
    signals = answered(command, 0.0, 1e-3)
    for role in ("pressure", "output"):
        signals[role] = np.concatenate([np.full(late, signals[role][0]), signals[role][: COUNT - late]])
    if kind == "before the log":
        answer = 0.05 * ((np.arange(COUNT) > 150) & (np.arange(COUNT) < 180))
        signals["pressure"] = signals["pressure"] + answer
    assert not told(signals)


def test_a_short_run_of_one_step_has_dropouts_at_its_hold_told_of():
    command = np.where(np.arange(450) < 100, 0.0, 1.0)
    signals = answered(command, 0.5)
    signals["pressure"][250:280] = 0.0
    assert any("jumps away" in note and "30 readings from 5 s" in note for note in told(signals))


@pytest.mark.parametrize("begin", (-20, 20, 310))
def test_what_may_answer_a_pulse_late_is_not_told_of(begin):
    """A pulse of 30 readings, which may have begun ahead of the log; the answer comes 150 readings late."""
    rows = np.arange(begin + 930) - begin
    edges = (0, 30, 520, 660, 800)  # the later ones answered while the command has just jumped again
    command = np.searchsorted(edges, rows, side="right") % 2.0
    late = np.searchsorted(edges, rows - 150, side="right") % 2.0
    y = 0.1 * late + 1e-4 * np.random.default_rng(1).normal(size=len(rows))
    assert not told({"command": command, "pressure": y})
