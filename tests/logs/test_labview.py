"""The rows of an .lvm: its time is counted by them, and each cell is of one channel.

Red when a row of missing readings moves all that follows in time, or a header that counts other samples than
there are rows goes without a word; when readings behind a cell too many are those of another channel; or when
LabVIEW's own ways have such a word.
"""

import numpy as np
import pytest

from focgen.errors import LogError
from focgen.logs import read_logs
from focgen.logs.table import read_table
from focgen.rig.rig import Signals

ROLES = Signals("X_Value", "y", None, "p")
COUNT, STEP = 80, 0.05
PRESSURE = np.repeat([0.0, 0.1, 0.2, 0.05], COUNT // 4)
BEND = np.linspace(0.0, 0.01, COUNT)
EMPTY = (9, 10, 11, 30, 55)


def rows(lost=(), row="\t\t\t", timed=False):
    """Rows of a segment, ``row`` in the place of those that are lost."""
    full = (f"{STEP * k if timed else ''}\t{PRESSURE[k]}\t{BEND[k]:.6f}\t" for k in range(COUNT))
    return [row if k in lost else line for k, line in enumerate(full)]


def segment(body, samples=COUNT, begin=0.0):
    counts = [f"Samples\t{samples}\t{samples}"] if samples is not None else []
    head = ["Channels\t2", *counts, f"X0\t{begin}\t{begin}", f"Delta_X\t{STEP}\t{STEP}"]
    return ["", *head, "***End_of_Header***", "X_Value\tp\ty\tComment", *body]


def saved(path, *segments, columns="No"):
    head = ["LabVIEW Measurement", "Separator\tTab", f"X_Columns\t{columns}", "***End_of_Header***"]
    lines = [*head, *(line for part in segments for line in part), ""]
    (path / "log.lvm").write_text("\n".join(lines), encoding="utf-8")
    return path / "log.lvm"


def words(path):
    return [note for note in read_table(path).notes if "rows" in note]


@pytest.mark.parametrize("row, samples", [("\t\t\t", COUNT), ("\t\t\t", None), ("\t", COUNT), ("", COUNT)])
def test_an_empty_row_moves_nothing_in_time(tmp_path, row, samples):
    """It may have its separators, or the header counts it."""
    path = saved(tmp_path, segment(rows(EMPTY, row), samples))
    (log,) = read_logs(path, ROLES, STEP)
    assert len(log) == COUNT and np.allclose(log.time, STEP * np.arange(COUNT))
    assert np.allclose(log["output"], BEND, atol=2e-6) and words(path) == []
    assert "readings of output missing, bridged by straight lines (5, the first at 0.45 s)" in log.notes


def test_a_row_may_lack_its_last_reading(tmp_path):
    path = saved(tmp_path, segment(rows(EMPTY, "\t0.1\t\t")))
    (log,) = read_logs(path, ROLES, STEP)
    assert len(log) == COUNT and np.allclose(log["output"], BEND, atol=2e-6)


def test_blank_lines_that_the_header_does_not_count_are_none(tmp_path):
    body = [line for row in rows() for line in (row, "")]
    (log,) = read_logs(saved(tmp_path, segment(body)), ROLES, STEP)
    assert len(log) == COUNT and words(tmp_path / "log.lvm") == []


@pytest.mark.parametrize("samples", [None, COUNT - 2])
def test_blank_lines_of_which_the_header_does_not_tell_are_told_of(tmp_path, samples):
    found = words(saved(tmp_path, segment(rows(EMPTY, ""), samples)))
    assert (
        found[-1]
        == f"5 blank lines among its rows are counted as none, the first is line {20 + (samples is not None)}"
    )


@pytest.mark.parametrize("columns", ["No", "One"])
@pytest.mark.parametrize("which", [0, 1])
def test_a_header_that_counts_other_samples_is_told_of(tmp_path, columns, which):
    bodies = [rows(timed=columns == "One") for _ in range(2)]
    del bodies[which][20:27]
    path = saved(tmp_path, *(segment(body) for body in bodies), columns=columns)
    (note,) = words(path)
    first = 12 + which * (COUNT + 7)
    assert f"than there are rows: 73 rows from line {first} on, and 80 Samples" in note
    assert ("its clock counts the rows" in note) == (columns == "No")


def test_rows_that_are_appended_under_one_header_are_told_of_where_it_has_their_time(tmp_path):
    assert words(saved(tmp_path, segment(rows(timed=True), 10), columns="One")) == []
    (note,) = words(saved(tmp_path, segment(rows(), 10)))
    assert "80 rows from line 12 on, and 10 Samples; its clock counts the rows" in note


@pytest.mark.parametrize("behind", [[""], ["", "\t\t\t"], ["\t\t\t\t", "\t", ""]])
@pytest.mark.parametrize("columns", ["No", "One"])
def test_of_what_fits_nothing_is_said(tmp_path, behind, columns):
    body = [*rows(timed=columns == "One"), *behind]
    path = saved(tmp_path, segment(body), segment(body, None), segment(body, 0), columns=columns)
    assert words(path) == [] and len(read_table(path)) == 3 * COUNT


def without_comments(part):
    return [line.replace("\tComment", "") for line in part]


@pytest.mark.parametrize("timed", [True, False])
@pytest.mark.parametrize("cell", ["", "0.3"])
def test_a_cell_too_many_is_refused(tmp_path, timed, cell):
    """Taken, it moves the readings behind it to the next columns."""
    body = rows(timed=timed)
    body[40] = body[40].rstrip("\t").replace("\t", f"\t{cell}\t", 1)
    path = saved(tmp_path, without_comments(segment(body)), columns="One" if timed else "No")
    with pytest.raises(LogError, match="line 52 has 4 values for 3 columns; take out the cell"):
        read_table(path)


@pytest.mark.parametrize("timed", [True, False])
@pytest.mark.parametrize("count", [1, COUNT - 40])
@pytest.mark.parametrize("mark", [".", ","])
def test_readings_that_an_empty_cell_moves_into_the_comments_are_refused(tmp_path, timed, count, mark):
    body = [row.replace(".", mark) for row in rows(timed=timed)]
    body[40 : 40 + count] = [row.replace("\t", "\t\t", 1) for row in body[40 : 40 + count]]
    path = saved(tmp_path, segment(body), columns="One" if timed else "No")
    with pytest.raises(LogError, match="a number as comment of line 52, and an empty cell .*; take out"):
        read_table(path)


@pytest.mark.parametrize("timed", [True, False])
def test_comments_are_no_readings(tmp_path, timed):
    """Words beside an empty cell, numbers beside full ones, and beside one of the empty ones too."""
    columns, plain = "One" if timed else "No", rows(timed=timed)
    lacking = plain[:9] + [row.split("\t")[0] + "\t\t0.001\t" for row in plain[9:11]] + plain[11:]
    for body in (
        [row + "7" for row in plain],
        [row + ("a word" if k == 9 else "") for k, row in enumerate(lacking)],
        [row + ("7" if k < 10 else "8") for k, row in enumerate(lacking)],
        [row + ("\t" if k % 2 else "") for k, row in enumerate(plain)],
    ):
        assert len(read_table(saved(tmp_path, segment(body), columns=columns))) == COUNT
    path = saved(tmp_path, without_comments(segment(plain)), columns=columns)
    assert len(read_table(path)) == COUNT


@pytest.mark.parametrize("columns", ["No", "One"])
def test_a_line_that_is_no_row_is_refused(tmp_path, columns):
    body = rows(timed=columns == "One")
    body[40] = "0.1"
    with pytest.raises(LogError, match="line 52 has 1 values for 3 columns; complete the line"):
        read_table(saved(tmp_path, segment(body), columns=columns))
