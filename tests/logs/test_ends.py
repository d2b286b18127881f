"""Readings far off at the ends of a part, where one side has neighbours for a judgement and the other few.

Red when one stays without a word, wherever it is, or an honest end is changed.
"""

import numpy as np
import pytest

from focgen.logs.drives import Drive
from focgen.logs.outliers import outliers
from tests.logs.test_mending import noted
from tests.logs.test_read import STEP, read_columns, table
from tests.logs.test_strays import answered, commands, lagged, told

COUNT = 600
PLACES = (*range(10), *range(-10, 0))


def seen(command: np.ndarray, y: np.ndarray) -> list[int]:
    drive = Drive.by(command)
    return [int(row) for row in np.flatnonzero(outliers(y, drive.barred, drive.never, drive.answers))]


def rows_at(place: int, width: int) -> list[int]:
    """So many rows in a row that begin at a place, or end there if it counts from the end."""
    return [*range(place, place + width)] if place >= 0 else [*range(place - width + 1, place + 1)]


def moving(kind: str) -> tuple[np.ndarray, np.ndarray]:
    rows, rng = np.arange(COUNT), np.random.default_rng(5)
    made = {
        "rests, moves, rests": np.where((rows > 200) & (rows < 400), 1.0, 0.0),
        "holds": np.where(rows < 300, 0.5, 1.0),
        "sine": 0.5 - 0.5 * np.cos(rows / 20.0),
        "rests only": np.zeros(COUNT),
    }
    y = 0.1 * lagged(made[kind], 8.0) + 5e-4 * rng.normal(size=COUNT)
    return made[kind], y


@pytest.mark.parametrize("width", (1, pytest.param(2, marks=pytest.mark.long), 3))
@pytest.mark.parametrize("kind", ("rests, moves, rests", "holds", "sine"))
@pytest.mark.parametrize("size", (0.3, -2.0, 1e9))
def test_wherever_a_spark_is_it_is_an_outlier(kind, size, width):
    command, clean = moving(kind)
    for place in PLACES:
        rows, y = rows_at(place, width), clean.copy()
        y[rows] += size
        assert seen(command, y) == sorted(row % COUNT for row in rows), place


def test_a_part_that_only_rests_has_sparks_but_in_its_very_ends():
    """There it may have been released, of which it shows nothing else."""
    command, clean = moving("rests only")
    for place in PLACES:
        y = clean.copy()
        y[place] = 0.1
        assert seen(command, y) == ([] if place in (0, -1) else [place % COUNT]), place


@pytest.mark.parametrize("jump", (0, 1, 2, 4, 8))
def test_near_a_jump_of_the_command_a_spark_that_comes_and_goes_is_one_too(jump):
    command = np.where(np.arange(COUNT) <= jump, 0.0, 1.0)
    clean = 0.1 * lagged(command, 8.0) + 2e-4 * np.random.default_rng(1).normal(size=COUNT)
    for place in range(1, 10):
        y = clean.copy()
        y[place] = 1.0
        assert seen(command, y) == [place]
        assert seen(command[::-1], y[::-1]) == [COUNT - 1 - place]
    assert not seen(command, clean) and not seen(command[::-1], clean[::-1])


def test_without_a_command_a_spark_that_comes_and_goes_is_one_too():
    _, clean = moving("rests, moves, rests")
    for place in PLACES:
        y = clean.copy()
        y[place] = 1.0
        found = [int(row) for row in np.flatnonzero(outliers(y))]
        assert found == ([] if place in (0, -1) else [place % COUNT])


def test_beside_a_hole_a_part_has_ends_as_well(tmp_path):
    """Of the part ahead and of the part behind, each reading in turn."""
    count, hole = 400, slice(180, 220)
    rng = np.random.default_rng(2)
    columns = table(count, u_V=np.repeat([0.0, 1.0, 0.5, 1.5], 100)[:count])
    for role, rows in (("p_bar", 2.0), ("kappa_cam_per_mm", 9.0), ("kappa_per_mm", 12.0)):
        columns[role] = 0.1 * lagged(columns["u_V"], rows) + 1e-4 * rng.normal(size=count)
    kept = np.delete(np.arange(count), np.arange(count)[hole])
    for row in (177, 178, 179, 220, 221, 222):
        changed = {**columns, "p_bar": columns["p_bar"].copy()}
        changed["p_bar"][row] = 2.0
        parts = read_columns(tmp_path, {name: y[kept] for name, y in changed.items()})
        assert len(parts) == 2 and max(part["pressure"].max() for part in parts) < 0.2
        assert any(noted(part, "outliers of pressure", f"at {STEP * row:g} s") for part in parts)


@pytest.mark.parametrize(
    "rows", (0.0, pytest.param(0.5, marks=pytest.mark.long), 3.0, pytest.param(40.0, marks=pytest.mark.long))
)
def test_wherever_an_honest_log_is_cut_its_ends_stay(rows):
    rng = np.random.default_rng(7)
    for seed in range(2):
        for kind, command in commands(rng).items():
            signals = answered(command, rows, rng.uniform(0.004, 0.02), seed)
            for _ in range(3):
                first, count = rng.integers(0, 1000), rng.integers(60, 500)
                cut = {role: y[first : first + count] for role, y in signals.items()}
                assert not any("outliers" in note for note in told(cut)), (kind, seed, first, count)


def test_pulses_of_a_command_with_a_dead_time_are_not_taken_off_the_beginning():
    """The pulse was before the log: others behind it show that the signal is like that."""
    command = np.where(np.arange(COUNT) % 90 == 85, 1.0, 0.0)
    y = np.where(np.arange(COUNT) % 90 == 1, 0.1, 0.0) + 1e-4 * np.random.default_rng(3).normal(size=COUNT)
    assert y[1] > 0.05 and not seen(command, y)
