"""What the logs of a session say of each other, and the columns of one log.

Red when units that differ from file to file, a column with two names, two columns of one name, dates that a
rig's scale would stretch, or rows of zeros at the end of an array go unsaid or are a fault.
"""

import decimal

import numpy as np
import pytest

from focgen import init
from focgen.errors import LogError
from focgen.logs import read_logs
from focgen.logs.scales import Scale
from focgen.rig.rig import Signals
from tests.logs.test_misread import PLAIN

COUNT = 100
TIME = 0.05 * np.arange(COUNT)
PRESSURE = np.repeat([0.0, 0.1, 0.2, 0.05], COUNT // 4)
OUTPUT = 0.01 * np.sin(TIME)


def file_of(tmp_path, name, header, factor=1.0, times=TIME):
    rows = [f"{t},{factor * p:.6g},{y:.6g}" for t, p, y in zip(times, PRESSURE, OUTPUT)]
    path = tmp_path / name
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


# ----------------------------------------------------------------------------------------------------- units


@pytest.mark.parametrize("header", ["t,p,y\ns,{},mm", "t (s),p ({}),y (mm)"])
@pytest.mark.parametrize("unit, factor", [("psi", 14.5), ("kPa", 100.0), ("furlong", 3.0)])
def test_logs_of_one_session_in_different_units_are_refused(tmp_path, header, unit, factor):
    """Side by side they make a K(p) that fits both, and is of neither."""
    one = file_of(tmp_path, "one.csv", header.format("bar"))
    other = file_of(tmp_path, "other.csv", header.format(unit), factor)
    with pytest.raises(LogError, match=rf"other.csv: gives 'p' in {unit}, and .*one.csv in bar"):
        read_logs([one, other], PLAIN, 0.05)
    told = Signals("t", "y", None, "p", units={"pressure": "bar"})
    _, second = read_logs([one, other], told, 0.05)
    assert any("taken as bar" in note for note in second.notes)


def test_one_unit_by_two_spellings_and_a_log_without_one_are_read(tmp_path):
    headers = ("t,p,y\ns,mbar,mm", "t,p,y\ns,hPa,mm", "t,p,y")
    logs = [file_of(tmp_path, f"{k}.csv", header) for k, header in enumerate(headers)]
    assert len(read_logs(logs, PLAIN, 0.05)) == 3


def test_init_writes_no_unit_that_another_log_contradicts(tmp_path):
    logs = [file_of(tmp_path, f"{unit}.csv", f"t,p,y\ns,{unit},mm") for unit in ("bar", "psi")]
    with pytest.raises(LogError, match="psi.csv: gives 'p' in psi"):
        init(logs)


def scaled(factor, offset=0.0):
    return Signals("t", "y", None, "p", scales={"time": Scale(factor, offset)})


@pytest.mark.parametrize("kind", ["instants", "spans", "texts"])
def test_a_scale_for_the_time_of_other_logs_does_not_stretch_dates(kind):
    """Minutes by ``scale = 60``: a date would count 60 times as long, with a note of the rate only."""
    spans = np.round(1e3 * TIME).astype("timedelta64[ms]")
    instants = np.datetime64("2026-01-31T12:00:00.000") + spans
    times = {"instants": instants, "spans": spans, "texts": [f"{t}".replace("T", " ") for t in instants]}[
        kind
    ]
    (found,) = read_logs({"t": times, "p": PRESSURE, "y": OUTPUT}, scaled(60.0), 0.05)
    assert found.sample_time == 0.05
    assert any("not multiplied by 60" in note for note in found.notes)


def test_minutes_seconds_and_frames_are_scaled_where_the_rig_says_so():
    times = [f"00:{k // 60:02d}:{k % 60:02d}" for k in range(COUNT)]
    (found,) = read_logs({"t": times, "p": PRESSURE, "y": OUTPUT}, scaled(1 / 60), 1 / 60)
    assert any("which are multiplied by 0.01" in note for note in found.notes)


def test_a_scale_against_the_unit_that_the_file_gives_is_told_of(tmp_path):
    path = file_of(tmp_path, "one.csv", "t (s),p,y")
    (found,) = read_logs(path, scaled(60.0), 0.05)
    assert any("gives 't' in s, and the rig multiplies it by 60, not 1" in note for note in found.notes)
    (found,) = read_logs(file_of(tmp_path, "ms.csv", "t (ms),p,y", times=1e3 * TIME), scaled(1e-3), 0.05)
    assert not any("multiplies" in note for note in found.notes)


# --------------------------------------------------------------------------------------------------- columns


@pytest.mark.parametrize("role, name", [("command", "p (bar)"), ("curvature", "y (mm)"), ("run", "t (s)")])
def test_two_names_of_a_column_are_no_two_roles(tmp_path, role, name):
    """The rig's file is refused for one name in two roles: the stage between them would be 1, unsaid."""
    path = file_of(tmp_path, "one.csv", "t (s),p (bar),y (mm)")
    with pytest.raises(LogError, match=f"one column for .*{role}.*'{name[0]}'"):
        read_logs(path, Signals("t", "y", pressure="p", **{role: name}), 0.05)


def test_names_that_differ_by_their_type_only_are_refused():
    with pytest.raises(LogError, match="two columns called 1"):
        read_logs(
            {"t": TIME, 1: PRESSURE, "1": 9 * PRESSURE, "y": OUTPUT}, Signals("t", "y", None, "1"), 0.05
        )


def test_a_table_of_pyarrow_is_asked_to_be_a_frame():
    arrow = pytest.importorskip("pyarrow")
    with pytest.raises(LogError, match="to_pandas"):
        read_logs(arrow.table({"t": TIME, "p": PRESSURE, "y": OUTPUT}), PLAIN, 0.05)


def test_decimals_of_python_are_numbers_whatever_their_digits():
    """Three places behind the point, all of them from 1 on: as texts they may have thousands."""
    exact = [decimal.Decimal(f"{2.0 + y:.3f}") for y in OUTPUT]
    (found,) = read_logs({"t": TIME, "p": PRESSURE, "y": exact}, PLAIN, 0.05)
    assert np.array_equal(found["output"], [float(y) for y in exact])


def test_decimals_of_parquet_are_numbers_and_a_name_that_is_there_twice_is_told(tmp_path):
    arrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    exact = arrow.array([decimal.Decimal(f"{2.0 + y:.3f}") for y in OUTPUT], arrow.decimal128(9, 3))
    path = tmp_path / "log.parquet"
    parquet.write_table(arrow.table({"t": TIME, "p": PRESSURE, "y": exact}), path)
    (found,) = read_logs(path, PLAIN, 0.05)
    assert np.allclose(found["output"], np.round(2.0 + OUTPUT, 3), atol=1e-12)
    twice = arrow.Table.from_arrays([arrow.array(x) for x in (TIME, PRESSURE, OUTPUT, OUTPUT)], list("tpyy"))
    parquet.write_table(twice, path)
    with pytest.raises(LogError, match="has the column 'y' twice"):
        read_logs(path, PLAIN, 0.05)


# ------------------------------------------------------------------------------------------------------ rows


def test_an_array_that_was_made_too_long_ends_where_its_samples_do():
    log = {"t": TIME + 1.0, "p": PRESSURE, "y": OUTPUT}
    longer = {name: np.concatenate([values, np.zeros(50)]) for name, values in log.items()}
    (found,) = read_logs(longer, PLAIN, 0.05)
    assert np.array_equal(found["output"], OUTPUT) and any("left out" in note for note in found.notes)


def test_a_log_of_one_row_again_and_again_is_refused():
    with pytest.raises(LogError, match="fewer than 8 samples"):
        read_logs({"t": np.zeros(50), "p": np.ones(50), "y": np.ones(50)}, PLAIN, 0.05)
