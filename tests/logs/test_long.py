"""Long logs in text are read in parts: to the same numbers, texts and lines, in the memory of the numbers.

Red when a long log gives another number, text or line than a short one, or takes more memory than
its numbers.
"""

import tracemalloc

import numpy as np
import pytest

from focgen.errors import LogError
from focgen.logs import cells
from focgen.logs.cells import Levels, Lines
from focgen.logs.table import read_table
from tests.logs.test_dialects import TEXTS


def read(path, text: str, monkeypatch, part: int, levels: int):
    monkeypatch.setattr(cells, "PART", part)
    monkeypatch.setattr(cells, "_LEVELS", levels)
    path.write_text(text, encoding="utf-8")
    return read_table(path)


def rows(count: int, cell=lambda i: f"{i % 3}") -> str:
    return "t,u,y\n" + "".join(f"{0.01 * i:.2f},{cell(i)},{i * 0.125}\n" for i in range(count))


@pytest.mark.parametrize("levels", (0, 5, 4096))
@pytest.mark.parametrize("what", TEXTS)
def test_parts_give_what_the_whole_gives(tmp_path, monkeypatch, what, levels):
    """Columns kept as few texts, as numbers, and as texts, one after the other."""
    text = TEXTS[what][0]
    whole = read(tmp_path / "log.csv", text, monkeypatch, 10**6, levels)
    parts = read(tmp_path / "log.csv", text, monkeypatch, 12, levels)
    assert list(parts.columns) == list(whole.columns) and len(parts) == len(whole)
    assert (parts.notes, parts.units, parts.decimal) == (whole.notes, whole.units, whole.decimal)
    for name in whole.columns:
        assert np.array_equal(parts.seconds(name), whole.seconds(name), equal_nan=True), name
    assert [parts.line(i) for i in range(len(parts))] == [whole.line(i) for i in range(len(whole))]


def test_names_of_runs_stay_as_they_stand(tmp_path, monkeypatch):
    """As numbers "01" and "1.0" would be one run."""
    table = read(tmp_path / "log.csv", rows(40, lambda i: ("01", "1.0")[i // 20]), monkeypatch, 12, 4)
    assert isinstance(table.columns["u"], Levels) and isinstance(table.columns["t"], np.ndarray)
    assert table.texts("u") == ["01"] * 20 + ["1.0"] * 20
    assert table.columns["u"][19:21] == ["01", "1.0"] and table.columns["u"][-1] == "1.0"


@pytest.mark.parametrize("levels", (0, 4096))
def test_what_is_no_number_late_is_named_with_its_line(tmp_path, monkeypatch, levels):
    text = rows(60, lambda i: "off" if i == 50 else f"{i}.5")
    table = read(tmp_path / "log.csv", text, monkeypatch, 12, levels)
    with pytest.raises(LogError, match="'off' in line 52"):
        table.numbers("u")
    with pytest.raises(LogError, match="1e\\+99 in line 52"):
        read(tmp_path / "log.csv", text.replace("off", "1e99"), monkeypatch, 12, levels).numbers("u")


def test_gaps_and_blank_lines_keep_their_places(tmp_path, monkeypatch):
    text = rows(30, lambda i: "" if i in (3, 17) else f"{i}.5").replace("\n0.10,", "\n\n# note\n0.10,")
    table = read(tmp_path / "log.csv", text, monkeypatch, 6, 0)
    assert np.flatnonzero(np.isnan(table.numbers("u"))).tolist() == [3, 17]
    assert [table.line(i) for i in (0, 9, 10, 29)] == ["line 2", "line 11", "line 14", "line 33"]
    counted = Lines()
    for line in (1, 2, 5, 6, 9):
        counted.add(line)
    assert [counted.of(row) for row in range(5)] == ["line 2", "line 3", "line 6", "line 7", "line 10"]


def test_it_takes_the_memory_of_its_numbers(tmp_path, monkeypatch):
    """Two columns of numbers and one of levels are 18 bytes a row, and a part is a few cells of text."""
    monkeypatch.setattr(cells, "PART", 6000)
    monkeypatch.setattr(cells, "_LEVELS", 100)
    count = 30_000
    (tmp_path / "log.csv").write_text(rows(count))
    tracemalloc.start()
    try:
        table = read_table(tmp_path / "log.csv")
        kept, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(table) == count and kept < 21 * count and peak < 100 * count
