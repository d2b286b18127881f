"""Long logs in text are read in parts: to the same numbers, texts and lines, in the memory of the numbers.

Red when a long log gives another number, text or line than a short one, or takes more memory than
its numbers.
"""

import subprocess
import sys
import tracemalloc

import numpy as np
import pytest

from focgen.errors import LogError
from focgen.logs import cells, outliers
from focgen.logs.cells import Levels, Lines
from focgen.logs.drives import barred_by
from focgen.logs.read import read_logs
from focgen.logs.table import read_table
from focgen.rig.rig import Signals
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
    read_table(tmp_path / "log.csv")  # what its modules take is not of the log
    tracemalloc.start()
    try:
        table = read_table(tmp_path / "log.csv")
        kept, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(table) == count and kept < 21 * count and peak < 100 * count


SIGNALS = Signals("t", "y", "u", None, None, None, None)


def measured(count: int) -> dict[str, np.ndarray]:
    """A log of steps whose every reading is another number."""
    row, rng = np.arange(count), np.random.default_rng(1)
    noise = rng.normal(0.0, 0.01, count)
    return {"t": 0.01 * row, "u": 0.5 * (row // 500 % 7), "y": np.cos(1e-3 * row) + noise}


ODD = {  # what is to be done to a log, and bytes a row that it may take beside the three columns
    "nothing": (lambda log: log, 34),
    "outliers": (lambda log: {**log, "y": log["y"] + 3.0 * (np.arange(len(log["y"])) % 5003 == 9)}, 42),
    "a slow sensor": (lambda log: {**log, "y": np.repeat(log["y"][::4], 4)}, 62),
    "lost rows": (lambda log: {k: v[np.arange(len(v)) % 5003 != 9] for k, v in log.items()}, 66),
    "an uneven clock": (
        lambda log: {**log, "t": log["t"] + 0.003 * np.sin(1.7 * np.arange(len(log["t"])))},
        58,
    ),
}


@pytest.mark.parametrize(
    "what", [pytest.param(w, marks=pytest.mark.long if turn % 2 else ()) for turn, w in enumerate(ODD)]
)
def test_experiments_take_little_beside_their_columns(monkeypatch, what):
    """Ten million rows of three columns: 0.24 GB, and so much again and more while they are looked at."""
    monkeypatch.setattr(outliers, "_PART", 512)
    change, most = ODD[what]
    count = 60_000
    read_logs(change(measured(count)), SIGNALS, 0.01)  # what is loaded and kept once
    log = change(measured(count))
    tracemalloc.start()
    try:
        (found,) = read_logs(log, SIGNALS, 0.01)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(found) == pytest.approx(count, abs=2)
    assert peak < (24 + most) * count


def test_parts_of_a_signal_show_the_same_outliers(monkeypatch):
    """However long the parts are; one lies across two of them."""
    y = measured(3000)["y"]
    y[[400, 1023, 1024, 2000]] += 3.0
    barred = barred_by(np.where(np.arange(3000) < 1990, 0.0, 1.0))
    whole = outliers.outliers(y, barred)
    assert np.flatnonzero(whole).tolist() == [400, 1023, 1024]
    for part in (1, 7, 1024):
        monkeypatch.setattr(outliers, "_PART", part)
        assert np.array_equal(outliers.outliers(y, barred), whole)


READ = """
import resource, sys
from focgen.logs.read import read_logs
from focgen.rig.rig import Signals
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
(found,) = read_logs(sys.argv[1], Signals("t", "y", "u", None, None, None, None), 0.01)
print(len(found), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="other systems count in other units")
def test_a_million_rows_open_in_a_tenth_of_a_gigabyte(tmp_path):
    """And so ten million in one: what does not grow with the rows, 20 MB and more, is counted in."""
    log = measured(1_000_000)
    with open(tmp_path / "log.csv", "w") as file:
        file.write("t,u,y\n")
        file.writelines(f"{t:.2f},{u:.1f},{y:.5f}\n" for t, u, y in zip(*log.values()))
    command = [sys.executable, "-c", READ, str(tmp_path / "log.csv")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    rows, kilobytes = map(int, done.stdout.split())
    assert rows == 1_000_000 and kilobytes < 100_000
