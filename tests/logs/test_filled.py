"""Rows that a logger filled in, told from readings.

Red when a held or a drawn row is taken for a reading, when noise, a coarse converter or a signal at rest is
taken for a logger's doing, or when a dead band is not told.
"""

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.logs.experiment import Experiment
from focgen.logs.filled import readings, with_readings
from focgen.logs.repeats import dead_band
from tests.logs.test_read import STEP, read_columns, table

COUNT = 3000


def signal(rng, noise=0.004):
    """A smooth signal (n,) about as large as 1, with noise."""
    t = np.arange(COUNT) / COUNT
    waves = sum(np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for f in (2.0, 5.0, 9.0))
    return waves / 2.0 + noise * rng.normal(size=COUNT)


def held(y, rows):
    return y[rows[np.searchsorted(rows, np.arange(len(y)), side="right") - 1]]


def drawn(y, rows):
    return np.interp(np.arange(len(y)), rows, y[rows])


def written(y, digits):
    return np.array([float(f"{value:.{digits}g}") for value in y])


def reported(y, band):
    """``y`` (n,) as a logger writes it that repeats a reading until one differs by ``band``."""
    made, last = np.empty_like(y), y[0]
    for i, value in enumerate(y):
        last = value if abs(value - last) > band else last
        made[i] = last
    return made


@pytest.mark.parametrize("fill", [held, drawn])
@pytest.mark.parametrize("every", [2, 3, 10, 7.4])
@pytest.mark.parametrize("digits", [None, 7])
def test_the_rows_between_readings_are_found(fill, every, digits):
    for seed in range(10):
        rng = np.random.default_rng(seed)
        rows = np.unique(np.r_[0, np.round(np.arange(rng.uniform(0, every), COUNT - 1, every)).astype(int)])
        filled = [fill(signal(rng), rows) for _ in range(2)]
        found = readings([y if digits is None else written(y, digits) for y in filled])
        for kept in found:
            inner = kept[(kept > 0) & (kept < rows[-1])]
            assert np.isin(inner, rows).all() and len(inner) > 0.97 * len(rows)


@pytest.mark.parametrize("every", [4.3, 12.7])
def test_readings_between_the_rows_are_found_next_to_them(every):
    for seed in range(10):
        rng = np.random.default_rng(seed)
        at = np.arange(rng.uniform(0, 1), COUNT, every)
        y = np.interp(
            np.arange(COUNT),
            at,
            np.interp(at, np.arange(COUNT), signal(rng, 0.0)) + 0.004 * rng.normal(size=len(at)),
        )
        (found,) = readings([y])
        apart = np.abs(found[1:-1, None] - at).min(axis=1)
        assert apart.max() <= 1.0 and len(found) == pytest.approx(len(at), rel=0.03)


@pytest.mark.parametrize("noise", [0.0, 1e-6, 0.004])
def test_what_was_read_at_every_row_is_left_alone(noise):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        y = signal(rng, noise)
        at_rest = np.where(np.arange(COUNT) % 600 < 200, y[::600].repeat(600), y)
        ramps = np.interp(np.arange(COUNT), np.sort(rng.integers(0, COUNT, 30)), rng.normal(size=30))
        coarse = [np.round(y / step) * step for step in (1e-4, 3e-3, 0.02, 0.1)]
        settled = np.repeat(rng.normal(size=30), 100) * (1 - np.exp(-np.arange(COUNT) % 100 / 5.0))
        for logged in (y, written(y, 4), at_rest, ramps, settled, *coarse):
            assert readings([logged, logged[::-1]]) is None and dead_band(logged) == 0.0


@pytest.mark.parametrize("band", [0.01, 0.05])
def test_a_dead_band_is_told(band):
    for seed in range(10):
        logged = reported(signal(np.random.default_rng(seed)), band)
        assert dead_band(logged) == pytest.approx(band, rel=0.1)
        assert dead_band(written(logged, 4)) == pytest.approx(band, rel=0.1)


def test_a_dead_band_is_said_with_its_size(tmp_path):
    rng = np.random.default_rng(1)
    (log,) = read_columns(tmp_path, table(COUNT, kappa_per_mm=reported(signal(rng), 0.05)))
    (note,) = [note for note in log.notes if "dead band" in note]
    assert "output" in note and "0.05" in note


def test_straight_lines_take_the_place_of_what_was_held():
    rng = np.random.default_rng(2)
    rows = np.arange(0, COUNT, 5)
    log = Experiment("held", STEP, {"command": signal(rng), "output": held(signal(rng), rows)})
    (found,) = with_readings([log])
    assert np.array_equal(found.readings["output"], rows) and list(found.readings) == ["output"]
    assert np.allclose(found["output"], drawn(log["output"], rows))
    assert found["command"] is log["command"]
    assert not found.between(1.0, 5.0).readings


def lagged(drive, kept):
    """``drive`` (n,) behind a lag that keeps this much from sample to sample."""
    return lfilter([1.0 - kept], [1.0, -kept], drive)


@pytest.mark.parametrize("kept", [0.0, 0.5, 0.9, 0.98])
@pytest.mark.parametrize("digits", [2, 3, 5, 15])
def test_a_cycle_of_the_experiment_is_no_logger(kept, digits):
    """Squares, triangles and stairs of one length, with little noise or none."""
    t = np.arange(1800)
    cycles = [np.where(t // 40 % 2, 1.0, 0.0), np.abs((t % 60) - 30) / 30.0]
    cycles += [np.random.default_rng(3).uniform(size=90)[t // 20], np.minimum(t % 50, 20) / 20.0]
    for drive in cycles:
        for noise in (0.0, 0.1, 0.2):
            rng = np.random.default_rng(4)
            y = np.round(lagged(drive, kept) + noise * 10.0**-digits * rng.normal(size=len(t)), digits)
            logs = [Experiment(str(i), STEP, {"command": drive, "output": y}) for i in range(2)]
            assert not any(log.readings for log in with_readings(logs))


@pytest.mark.parametrize("fill", [held, drawn])
def test_a_part_too_short_to_tell_has_the_pace_of_the_others(fill):
    rng = np.random.default_rng(5)
    rows = np.arange(0, COUNT, 8)
    filled = fill(signal(rng), rows)
    parts = [filled, filled[::-1], filled[800:861], np.zeros(60), filled[:3], filled[:1]]
    found = readings(parts)
    assert [kept[0] for kept in found] == [0] * 6
    assert all(kept[-1] < len(part) for kept, part in zip(found, parts, strict=True))
    assert [len(kept) for kept in found[2:]] == [8, 8, 2, 1]


def test_numbers_next_to_nothing_are_no_fault():
    rng = np.random.default_rng(6)
    assert readings([1e-298 * rng.normal(size=COUNT)]) is None
    assert readings([np.zeros(COUNT)]) is None and readings([np.full(7, 1e300)]) is None
