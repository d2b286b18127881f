"""Logs that hold more than any log: refused in a line, or read as they are.

Red when lines without readings are read for minutes, or a number or a date beyond what numpy stores ends in
an error of a library or in another number.
"""

import gzip
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest

from focgen.errors import LogError
from focgen.logs import read_logs
from focgen.logs.stamps import of_numpy
from focgen.logs.table import read_table
from tests.logs.test_misread import PLAIN

COUNT = 60
TIME = 0.05 * np.arange(COUNT)
LOG = {"t": TIME, "p": np.repeat([0.0, 0.1, 0.2], COUNT // 3), "y": 0.01 * np.sin(TIME)}
ROWS = "".join(f"{t:.2f},{p},{y:.6f}\n" for t, p, y in zip(*LOG.values()))


@pytest.mark.parametrize(
    "bare",
    [
        "\n",
        pytest.param("#\n", marks=pytest.mark.long),
        ",,\n",
        pytest.param("\r\n", marks=pytest.mark.long),
        " \t \n",
        pytest.param("\r", marks=pytest.mark.long),
    ],
)
@pytest.mark.parametrize("name", ["log.csv.gz", "log.lvm.gz"])
def test_lines_without_a_reading_are_bounded(tmp_path, bare, name):
    path = tmp_path / name
    with gzip.open(path, "wt", newline="", compresslevel=1) as file:
        file.write("t,p,y\n" + 1_100_000 * bare + ROWS)
    with pytest.raises(LogError, match="lines without a reading among its first .*leave out empty lines"):
        read_table(path)


@pytest.mark.parametrize("bare", ["\n\n\n", "# a word\n\n", ",,\n"])
def test_the_usual_ones_are_left_out(tmp_path, bare, monkeypatch):
    monkeypatch.setattr("focgen.logs.text_file._BARE", 10)
    (tmp_path / "log.csv").write_text(("t,p,y\n" + ROWS).replace("\n", "\n" + bare), encoding="utf-8")
    (log,) = read_logs(tmp_path / "log.csv", PLAIN, 0.05)
    assert len(log) == COUNT


def test_lines_are_bounded(tmp_path, monkeypatch):
    monkeypatch.setattr("focgen.logs.text_file._MOST_LINES", COUNT)
    (tmp_path / "log.csv").write_text("t,p,y\n" + ROWS, encoding="utf-8")
    with pytest.raises(LogError, match="has more than 60 lines; split it"):
        read_table(tmp_path / "log.csv")


@pytest.mark.parametrize("number", [10**400, -(10**400), Decimal("Infinity"), Decimal("1e999")])
def test_a_number_beyond_all_is_refused_by_its_row(number):
    y = [*LOG["y"]]
    y[7] = number
    with pytest.raises(LogError, match=r"log \[y\]: is infinite in row 7"):
        read_logs(LOG | {"y": y}, PLAIN, 0.05)


def test_a_signalling_nan_is_a_reading_that_is_missing():
    y = [Decimal(f"{v:.6f}") for v in LOG["y"]]
    y[7] = Decimal("sNaN")
    (log,) = read_logs(LOG | {"y": y}, PLAIN, 0.05)
    assert any("bridged" in note for note in log.notes) and np.isfinite(log["output"]).all()


def test_whole_numbers_of_128_bits_are_numbers():
    polars = pytest.importorskip("polars")
    frame = polars.DataFrame(LOG).with_columns((polars.col("y") * 1e6).cast(polars.Int128))
    (log,) = read_logs(frame, PLAIN, 0.05)
    np.testing.assert_allclose(log["output"], np.trunc(1e6 * LOG["y"]))


@pytest.mark.parametrize("begin", ["2262-04-11T23:47:14", "2300-01-01", "1677-09-21T00:12:42", "0001-01-01"])
@pytest.mark.parametrize("unit", ["us", "ms"])
def test_instants_beyond_what_64_bits_count_in_ns_go_on(begin, unit):
    spans = (1e3 * TIME).round().astype("timedelta64[ms]")
    (log,) = read_logs(LOG | {"t": np.datetime64(begin, unit) + spans}, PLAIN, 0.05)
    assert len(log) == COUNT and not any("anew" in note for note in log.notes)


@pytest.mark.parametrize("unit", "Y M W D h m s ms us ns".split())
@pytest.mark.parametrize("kind", ["datetime64", "timedelta64"])
def test_in_whatever_unit_they_are_the_same_seconds(unit, kind):
    one = np.array([1, 2, "NaT"], f"{kind}[{unit}]")
    found = of_numpy(one)
    np.testing.assert_array_equal(
        found, np.where(np.isnat(one), np.nan, one.astype(f"{kind}[ns]").astype(float) * 1e-9)
    )
    if unit not in ("us", "ns"):
        far = np.array([10**13, "NaT"], f"{kind}[{unit}]") if unit != "Y" else np.array([10**9], f"{kind}[Y]")
        assert found[0] < of_numpy(far)[0] < 1e30


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="no such files")
def test_what_the_kernel_makes_as_it_is_read_is_no_log(tmp_path):
    """Some such files wait for ever, as that of the kernel's messages does; all are regular ones."""
    (tmp_path / "log.csv").symlink_to("/proc/self/status")
    with pytest.raises(LogError, match="is no regular file; save its content to a file first"):
        read_table(tmp_path / "log.csv")
