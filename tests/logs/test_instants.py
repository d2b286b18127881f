"""Columns of instants and spans, as frames and binary logs have them, and notes and refusals about times.

Red when the rig's unit for other logs multiplies instants or spans, when an instant without a zone stands
beside one with a zone, when a log without any word of its unit is said to be in seconds, and when a date that
cannot be read is taken for a number that is missing.
"""

from datetime import UTC

import numpy as np
import pandas as pd
import polars as pl
import pytest

from focgen.errors import LogError
from focgen.logs import parquet_file, read_logs, tdms_file
from focgen.logs.mat_file import read as read_mat
from focgen.logs.scales import Scale
from focgen.logs.table import read_table
from focgen.rig.rig import Signals
from tests.logs.test_misread import PLAIN, text

COUNT = 400
STEP = 0.05
SECONDS = STEP * np.arange(COUNT)
INSTANTS = pd.date_range("2026-01-31 12:00", periods=COUNT, freq="50ms")
SPANS = pd.to_timedelta(SECONDS, unit="s")
READINGS = {"p": np.sin(SECONDS), "y": np.cos(SECONDS)}


def frame(times):
    return pd.DataFrame({"t": times} | READINGS)


def told(unit):
    return Signals("t", "y", None, "p", scales={"time": Scale(unit=unit)})


def as_parquet(path, times):
    frame(times).to_parquet(path / "log.parquet")
    return path / "log.parquet"


def as_tdms(path, times, groups=("g",)):
    nptdms = pytest.importorskip("nptdms")
    columns = {"t": np.asarray(times)} | READINGS
    with nptdms.TdmsWriter(str(path / "log.tdms")) as writer:
        writer.write_segment([nptdms.ChannelObject(g, n, v) for g in groups for n, v in columns.items()])
    return path / "log.tdms"


# ------------------------------------------------------------------------------ the rig's unit of other logs


@pytest.mark.parametrize("unit", ["min", "ms"])
@pytest.mark.parametrize(
    "log",
    [
        frame(INSTANTS),
        frame(SPANS),
        frame(INSTANTS).set_index("t"),
        pl.from_pandas(frame(INSTANTS)),
        pl.from_pandas(frame(SPANS)),
        {"t": INSTANTS.to_numpy()} | READINGS,
    ],
    ids=["pandas", "spans", "index", "polars", "polars spans", "arrays"],
)
def test_the_unit_of_other_logs_does_not_scale_instants_and_spans(log, unit):
    """Minutes made them 60 times as long, with a note that a log in minutes got as well."""
    (found,) = read_logs(log, told(unit), STEP)
    assert found.sample_time == STEP and len(found) == COUNT
    (note,) = found.notes
    assert f"which are not in {unit}, as the rig has it" in note


@pytest.mark.parametrize("times", [INSTANTS, SPANS], ids=["instants", "spans"])
def test_nor_those_of_parquet(tmp_path, times):
    (found,) = read_logs(as_parquet(tmp_path, times), told("min"), STEP)
    assert found.sample_time == STEP and len(found.notes) == 1


def test_readers_say_which_columns_hold_instants_and_which_have_a_zone(tmp_path):
    for times, zone in ((INSTANTS, False), (INSTANTS.tz_localize("Europe/Berlin"), True), (SPANS, None)):
        assert parquet_file.read(as_parquet(tmp_path, times)).times == {"t": zone}
    for groups, name in ((("a",), "t"), (("a", "b"), "t")):
        assert tdms_file.read(as_tdms(tmp_path, INSTANTS, groups)).times == {name: True}


# ---------------------------------------------------------------------------------------------------- zones

LATER = INSTANTS + pd.Timedelta("1min")
ZONED = LATER.tz_localize("Europe/Berlin")


@pytest.mark.parametrize(
    "logs",
    [
        [frame(INSTANTS), frame(ZONED)],
        [frame(ZONED), frame(INSTANTS)],
        [frame(INSTANTS).set_index("t"), frame(ZONED).set_index("t")],
        [pl.from_pandas(frame(INSTANTS)), pl.from_pandas(frame(ZONED))],
        [frame(INSTANTS), frame(ZONED.astype(str))],
    ],
    ids=["pandas", "turned", "index", "polars", "texts"],
)
def test_instants_of_which_some_have_a_zone_are_of_no_one_clock(logs):
    """Hours lie between them that never were, or they stand in another order."""
    with pytest.raises(LogError, match="has dates without a zone, beside a log with one"):
        read_logs(logs, PLAIN, STEP)


@pytest.mark.parametrize(
    "logs",
    [
        [frame(INSTANTS), frame(LATER)],
        [frame(INSTANTS.tz_localize(UTC)), frame(ZONED)],
        [frame(SPANS), frame(ZONED)],
        [pl.from_pandas(frame(SPANS)), pl.from_pandas(frame(ZONED))],
    ],
    ids=["none", "both", "spans", "polars spans"],
)
def test_others_are(logs):
    assert len(read_logs(logs, PLAIN, STEP)) == 2


def test_the_clocks_of_an_index_and_of_waveforms_are_of_a_zone_or_none(tmp_path):
    """A waveform of LabVIEW begins at an instant of UTC, a text beside it may be local."""
    bare = frame(INSTANTS).set_index("t").rename_axis(None)
    with pytest.raises(LogError, match="has dates without a zone, beside a log with one"):
        read_logs([bare, frame(ZONED)], PLAIN, STEP)
    nptdms = pytest.importorskip("nptdms")
    began = {"wf_increment": STEP, "wf_start_time": np.datetime64("2026-01-31T09:00"), "wf_start_offset": 0.0}
    waves = [nptdms.ChannelObject("g", name, values, began) for name, values in READINGS.items()]
    with nptdms.TdmsWriter(str(tmp_path / "log.tdms")) as writer:
        writer.write_segment(waves)
    assert tdms_file.read(tmp_path / "log.tdms").clock_zone is True
    with pytest.raises(LogError, match="has dates without a zone, beside a log with one"):
        read_logs([tmp_path / "log.tdms", frame(INSTANTS)], PLAIN, STEP)
    assert len(read_logs([bare, frame(LATER)], PLAIN, STEP)) == 2


def test_a_zone_comes_through_the_reader_of_its_own(tmp_path):
    assert read_table(as_parquet(tmp_path, ZONED)).has_zone("t") is True


# ------------------------------------------------------------------------- notes and refusals that are true


def test_a_log_that_says_nothing_of_its_unit_is_not_said_to(tmp_path):
    """Every honest log in ms had the note of one in the wrong unit."""
    rows = [f"{50 * k},{k},{k % 7}" for k in range(COUNT)]
    (found,) = read_logs(text(tmp_path, rows, header="t,p,y"), told("ms"), STEP)
    assert not found.notes
    (found,) = read_logs(text(tmp_path, rows, header="t (s),p,y"), told("ms"), STEP)
    assert "gives 't' in s, time is taken as ms" in found.notes[0]


@pytest.mark.parametrize(
    "stamp",
    [
        "31.01.2026 12:00:00.05",
        "01/31/2026 12:00:00.05 PM",
        "12:00:00.05 PM",
        "0 days 00:00:00.050000",
        "00:00.1",
        "12:00:00:050",
        "20260131T120000.05",
        "31-Jan-2026 12:00:00",
        "2026/01/31 12:00:00.05",
    ],
)
def test_a_date_that_cannot_be_read_is_told_how_to_be_written(tmp_path, stamp):
    """It was called no number, to be left empty."""
    path = text(tmp_path, [f"{stamp},{k},{k % 7}" for k in range(COUNT)], header="t,p,y")
    with pytest.raises(LogError, match=r"no time that can be read; write it as 2026-01-31T12:00:00\.000, or"):
        read_logs(path, PLAIN, STEP)


@pytest.mark.parametrize("word", ["1.2.3", "10.0.0.1", "0.35 bar", "1-2", "error 5"])
def test_other_words_are_no_dates(tmp_path, word):
    path = text(tmp_path, [f"{k * STEP:.2f},{word},{k % 7}" for k in range(COUNT)], header="t,p,y")
    with pytest.raises(LogError, match="which is no number"):
        read_logs(path, PLAIN, STEP)


def test_a_query_of_polars_is_asked_to_be_run(recwarn):
    """It was a TypeError of the library."""
    with pytest.raises(LogError, match=r"has not been run; give what its collect\(\) returns"):
        read_logs(pl.from_pandas(frame(SECONDS)).lazy(), PLAIN, STEP)
    assert not len(recwarn)


def test_names_behind_a_comments_mark_and_a_whole_workspace_are_told_what_to_do(tmp_path):
    """What numpy's savetxt and MATLAB's save write when they are given nothing else."""
    path = tmp_path / "log.csv"
    np.savetxt(path, np.column_stack([SECONDS, READINGS["y"]]), header="t,y", delimiter=",")
    with pytest.raises(LogError, match="names in line 1, without # or % ahead"):
        read_logs(path, Signals("t", "y", None, None), STEP)
    scipy_io = pytest.importorskip("scipy.io")
    scipy_io.savemat(tmp_path / "log.mat", {"t": SECONDS} | READINGS | {"K": np.eye(3)})
    with pytest.raises(LogError, match=r"save the signals of one experiment alone, as in save\('log.mat'"):
        read_mat(tmp_path / "log.mat")
