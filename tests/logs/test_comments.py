"""Comments of a log in text: passed over, and said where they could be rows.

Red when rows that begin like a comment, such as those of a run called "#2", are left out and nobody is told.
"""

import numpy as np
import pytest

from focgen.errors import LogError
from focgen.logs.table import read_table

MARKS = ("#", "%", "//")


def log(tmp_path, lines: list[str], delimiter: str):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(line.replace(",", delimiter) for line in lines) + "\n")
    return path


def rows(run: str, begin: int) -> list[str]:
    return [f"{run},{0.1 * k:.1f},{k}" for k in range(begin, begin + 20)]


@pytest.mark.parametrize("delimiter", [",", ";", " "])
@pytest.mark.parametrize("mark", MARKS)
def test_a_run_whose_name_begins_like_a_comment_is_told_of(tmp_path, mark, delimiter):
    lines = ["run,t,y", *rows("1", 0), *rows(f"{mark}2", 20), *rows("3", 40)]
    table = read_table(log(tmp_path, lines, delimiter))
    assert len(table) == 40
    (note,) = [note for note in table.notes if "comment" in note]
    assert note.startswith("20 lines ") and "line 22," in note and '"#1"' in note


def test_the_remedy_helps(tmp_path):
    lines = ["run,t,y", *rows("1", 0), *rows('"#2"', 20)]
    table = read_table(log(tmp_path, lines, ","))
    assert len(table) == 40 and not table.notes and set(table.texts("run")) == {"1", "#2"}


@pytest.mark.parametrize("mark", MARKS)
def test_comments_that_are_no_rows_are_passed_over_in_silence(tmp_path, mark):
    ahead = [f"{mark} made, by, hand", "t,y", "0.0,1", f"{mark} a disturbance", "0.1,2", "0.2,3"]
    table = read_table(log(tmp_path, ahead, ","))
    assert not table.notes and np.array_equal(table.numbers("y"), [1.0, 2.0, 3.0])


def test_a_log_of_nothing_else_is_not_said_to_be_empty(tmp_path):
    with pytest.raises(LogError, match="nothing but lines that begin with #") as told:
        read_table(log(tmp_path, ["#run,t,y", *rows("#1", 0)], ","))
    assert "in quotes" in told.value.remedy
