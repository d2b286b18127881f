"""Files that are whole and unusual: what they hold is read as it is meant, or refused. Never another number.

Red when a factor of 1000 or 2π, a shifted clock, a merged run or half of a file passes without a word.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.errors import LogError
from focgen.logs import read_logs
from focgen.logs.clock import counted
from focgen.logs.experiment import Experiment
from focgen.logs.frames import table_of
from focgen.logs.scales import between
from focgen.logs.still import check_moving
from focgen.logs.table import read_table
from focgen.rig.rig import Signals
from tests.logs.test_dialects import COLUMNS, STEP, TIME, lvm

SIGNALS = Signals("t", "y", None, "p", run="run")
PLAIN = Signals("t", "y", None, "p")
ROWS = [f"{0.01 * k:.2f},{0.1 * k:.1f},{k + 0.5}" for k in range(40)]


def text(tmp_path, lines, name="log.csv", header="t,p,y"):
    path = tmp_path / name
    path.write_text("\n".join([header, *lines]) + "\n")
    return path


# ------------------------------------------------------------------------------------------------ thousands


GERMAN = [
    f"{0.01 * k:.2f};".replace(".", ",") + ("1.200" if k > 30 else "900") + f";{k},5" for k in range(40)
]
QUOTED = [f'{k},"1,{k:03d}",{k}' for k in range(40)]
WHOLE = [f"{k};{'1.200' if k > 30 else '900'};{k}" for k in range(40)]


@pytest.mark.parametrize(
    "lines, header, said",
    [
        (GERMAN, "t;p;y", "whole numbers beside ones like 1.200"),
        (
            [line.replace("900", "1.100") for line in GERMAN],
            "t;p;y",
            "which may be 1100 or have a decimal '.'",
        ),
        (QUOTED, "t,p,y", "which may be 1000 or have a decimal ','"),
        (WHOLE, "t;p;y", "whole numbers beside ones like 1.200"),
    ],
)
def test_marks_between_thousands_are_no_decimal_marks(tmp_path, lines, header, said):
    with pytest.raises(LogError, match=said):
        read_table(text(tmp_path, lines, header=header)).numbers("p")


def test_a_mark_between_thousands_behind_a_long_beginning_is_seen(tmp_path, monkeypatch):
    """Of a long table only numbers are kept: what they looked like is remembered."""
    monkeypatch.setattr("focgen.logs.cells.PART", 60)
    monkeypatch.setattr("focgen.logs.cells._LEVELS", 4)
    lines = [f"{k},5;{k};{k},5" for k in range(100, 1000)] + ["1000,5;1.000;1000,5"]
    with pytest.raises(LogError, match="whole numbers beside ones like 1.200"):
        read_table(text(tmp_path, lines, header="t;p;y")).numbers("p")


@pytest.mark.parametrize(
    "cells, header, value",
    [
        (["0,125", "1,600", "2,125"], "t;p;y", 1.6),
        (["1,60", "2,125"], "t;p;y", 1.6),
        (["1.125", "2.250"], "t;p;y", 1.125),
        (["0.5", "1", "1.125"], "t;p;y", 1.125),
        (["1", "1.125"], "t,p,y", 1.125),
        (["1", "1.125", "2"], "t;p;y;z", 1.125),
    ],
)
def test_decimals_that_cannot_be_thousands_are_read(tmp_path, cells, header, value):
    mark = header[1]
    lines = [
        mark.join([str(k), cells[k % len(cells)], str(k), *["0.5"] * header.count("z")]) for k in range(40)
    ]
    assert value in read_table(text(tmp_path, lines, header=header)).numbers("p")


# ------------------------------------------------------------------------------------------ quotes and rows


@pytest.mark.parametrize("begin", ["# 2 bar", "% of it", "// valve"])
def test_a_remark_of_two_lines_does_not_swallow_the_file(tmp_path, begin):
    lines = [f"{row}," for row in ROWS]
    lines[10] += f'"new tube\n{begin}"'
    found = read_table(text(tmp_path, lines, header="t,p,y,note"))
    assert len(found) == 40 and np.array_equal(found.numbers("t"), [float(row[:4]) for row in ROWS])


@pytest.mark.parametrize("places", [(10,), (10, 11), (10, 20)])
def test_a_quote_that_does_not_close_is_refused(tmp_path, places):
    lines = [f"{row}," for row in ROWS]
    for k in places:
        lines[k] += '"1/4 fitting'
    with pytest.raises(LogError, match="is not CSV"):
        read_table(text(tmp_path, lines, header="t,p,y,note"))
    lines[10:21] = [f'{ROWS[k]},"' for k in range(10, 21)]
    with pytest.raises(LogError, match="a quoted cell holds a whole row"):
        read_table(text(tmp_path, lines, header="t,p,y,note"))
    lines[10:21] = [f'{ROWS[k]},"1/4" fitting' for k in range(10, 21)]
    assert len(read_table(text(tmp_path, lines, header="t,p,y,note"))) == 40


def test_names_are_not_shifted_by_row_numbers_without_a_name(tmp_path):
    """R's write.table has them; the last column is empty here, so that a row may as well end in a tab."""
    lines = [f"{k + 1}\t" + row.replace(",", "\t") + "\t" for k, row in enumerate(ROWS)]
    with pytest.raises(LogError, match="counts its rows in a first cell"):
        read_table(text(tmp_path, lines, header="t\tp\ty\tnote"))
    lines = [f"{k / 10}\t{k}\t{k}\t" for k in range(40)]
    assert read_table(text(tmp_path, lines, header="t\tp\ty")).numbers("t")[-1] == 3.9


def test_a_title_and_excels_first_line_are_no_names(tmp_path):
    found = read_table(text(tmp_path, ["t,p,y", *ROWS], header="Rig A,Test 7,Ola"))
    assert set(found.columns) == {"t", "p", "y"} and not found.units
    found = read_table(text(tmp_path, ["t;p;y", *(row.replace(",", ";") for row in ROWS)], header="sep=;"))
    assert set(found.columns) == {"t", "p", "y"}
    found = read_table(text(tmp_path, ["s,bar,deg", *ROWS]))
    assert found.units == {"t": "s", "p": "bar", "y": "deg"}


# ---------------------------------------------------------------------------------------------------- clocks


@pytest.mark.parametrize("key", ["X0", "Delta_X"])
def test_channels_of_lvm_with_clocks_of_their_own_are_refused(tmp_path, key):
    """Taken for one clock, they are a dead time that no rig has."""
    (tmp_path / "log.lvm").write_text(lvm(".", "No", 1).replace(f"{key}\t0.", f"{key}\t0.2", 1))
    with pytest.raises(LogError, match="different X0 or Delta_X"):
        read_table(tmp_path / "log.lvm")


@pytest.mark.parametrize("field, one, other", [("start", 0.0, 0.2), ("step", STEP, 2 * STEP)])
@pytest.mark.parametrize("groups", [("a", "b"), ("a", "a")])
def test_waveforms_of_tdms_with_clocks_of_their_own_are_refused(tmp_path, field, one, other, groups):
    nptdms = pytest.importorskip("nptdms")

    def channel(group, name, value):
        clock = {"start": 0.0, "step": STEP} | {field: value}
        given = {"wf_increment": clock["step"], "wf_start_offset": clock["start"]}
        return nptdms.ChannelObject(group, name, COLUMNS[name], properties=given)

    for last in (one, other):
        with nptdms.TdmsWriter(str(tmp_path / "log.tdms")) as writer:
            writer.write_segment([channel(groups[0], "p_bar", one), channel(groups[1], "kappa_per_mm", last)])
        roles = Signals("t_s", "kappa_per_mm", None, "p_bar")
        if last == one:
            assert np.allclose(read_logs([tmp_path / "log.tdms"], roles, STEP)[0].time, TIME)
            continue
        with pytest.raises(LogError, match="clocks that differ"):
            read_logs([tmp_path / "log.tdms"], roles, STEP)


def test_groups_of_tdms_with_channels_of_time_that_differ_are_refused(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    for late, name in ((0.0, "t"), (0.5, "t"), (0.5, "x")):
        with nptdms.TdmsWriter(str(tmp_path / "log.tdms")) as writer:
            time = TIME if name == "t" else np.cos(9.0 * TIME)
            channels = ("a", name, time), ("a", "p", TIME), ("b", name, time + late), ("b", "y", TIME)
            writer.write_segment([nptdms.ChannelObject(*channel) for channel in channels])
        if (late, name) == (0.5, "t"):
            with pytest.raises(LogError, match="channels of time that differ"):
                read_table(tmp_path / "log.tdms")
        else:
            assert "p" in read_table(tmp_path / "log.tdms")


def test_logs_that_are_placed_by_their_stamps_are_said_to_be(tmp_path):
    """Monday afternoon and Tuesday morning, by the time of day: nobody can know, but it is said."""
    late = text(tmp_path, [f"15:00:{k:02d},{k},{k}" for k in range(40)], "mon.csv")
    early = text(tmp_path, [f"09:00:{k:02d},{k},{2 * k}" for k in range(40)], "tue.csv")
    found = read_logs([late, early], PLAIN, 1.0)
    assert [e.name for e in found] == ["tue", "mon"] and "not in the order given" in found[0].notes[0]
    assert not any(e.notes for e in read_logs([early, late], PLAIN, 1.0))


def test_a_clock_from_0_and_one_from_1970_are_not_one(tmp_path):
    dated = text(tmp_path, [f"{1.7e9 + k},{k},{k}" for k in range(40)], "a.csv")
    plain = text(tmp_path, [f"{k},{k},{k}" for k in range(40)], "b.csv")
    found = read_logs([dated, plain], PLAIN, 1.0)
    assert [e.name for e in found] == ["a", "b"] and found[1].start - found[0].start == 40.0


def test_two_numbers_of_a_time_of_day_are_refused(tmp_path):
    """Minutes and seconds, most likely, which Python reads as hours and minutes."""
    lines = [f"{k // 60:02d}:{k % 60:02d},{k},{k}" for k in range(90)]
    with pytest.raises(LogError, match="hours and minutes, or minutes and seconds"):
        read_table(text(tmp_path, lines)).seconds("t")


def test_a_time_of_day_in_six_digits_is_refused(tmp_path):
    clock = np.arange(40) + 3590.0
    packed = 1e4 * (clock // 3600) + 100 * (clock // 60 % 60) + clock % 60
    for shift, times in ((0, packed), (110_000, packed), (0, packed + 1e-3)):
        lines = [f"{t + shift},{k},{k}" for k, t in enumerate(times)]
        with pytest.raises(LogError, match="hhmmss"):
            read_table(text(tmp_path, lines)).seconds("t")
    apart = np.concatenate([np.arange(50.0), 100 + np.arange(50.0), 200 + np.arange(50.0)])
    for times in (clock, apart, apart[::2], apart + np.repeat([0, 12, 25], 50)):
        lines = [f"{t},{k},{k}" for k, t in enumerate(times)]
        assert np.array_equal(read_table(text(tmp_path, lines)).seconds("t"), times)


def test_a_clock_that_wraps_keeps_the_order_of_the_rows(tmp_path):
    """A counter of 16 bits: what follows its turn came later, though its stamps are smaller."""
    ticks = (np.arange(600) + 300) % 512
    lines = [f"{0.01 * t:.2f},{k},{k}" for k, t in enumerate(ticks)]
    found = read_logs([text(tmp_path, lines)], PLAIN, 0.01)
    assert [int(e["output"][0]) for e in found] == [0, 212] and found[0].start < found[1].start
    assert found[0].notes[0].startswith("the clock starts anew") and "line 214" in found[0].notes[0]


def test_rows_ahead_of_a_clock_that_starts_anew_are_left_out_with_a_word(tmp_path):
    lines = [f"{7.0 + 0.01 * k},0,0" for k in range(5)] + ROWS
    (found,) = read_logs([text(tmp_path, lines)], PLAIN, 0.01)
    assert len(found) == 40 and "fewer than 8 samples left out (in line 2)" in found.notes[0]


# ------------------------------------------------------------------------------------------ units, runs, gaps


@pytest.mark.parametrize(
    "unit, to",
    [("rpm", "Hz"), ("Hz", "rad/s"), ("Hz", "rpm"), ("turn", "1"), ("revolution/s", "Hz"), ("rad/s", "1/s")],
)
def test_a_turn_is_not_counted_in_radians(unit, to):
    with pytest.raises(ValueError, match="a turn counts as 1 or as 2π"):
        between(unit, to)


def test_angles_that_are_told_are_converted():
    assert between("rpm", "rad/s")[0] == pytest.approx(np.pi / 30)
    assert between("deg/s", "rpm")[0] == pytest.approx(1 / 6)
    assert between("rad/m", "1/mm")[0] == pytest.approx(1e-3) and between("Hz", "1/min")[0] == pytest.approx(
        60
    )


@pytest.mark.parametrize("unit, to", [("dBm", "mW"), ("dB", "1")])
def test_what_goes_by_no_straight_line_is_refused(unit, to):
    with pytest.raises(ValueError, match="no straight line"):
        between(unit, to)


@pytest.mark.parametrize("unit", ["PSI", "KPA", "psig", "mBar"])
def test_another_unit_than_the_rigs_is_said_however_it_is_spelled(tmp_path, unit):
    signals = Signals("t", "y", None, "p", units={"pressure": "bar"})
    log = read_logs([text(tmp_path, ROWS, header=f"t,p [{unit}],y")], signals, 0.01)[0]
    assert any(f"in {unit}, pressure is taken as bar" in note for note in log.notes)
    same = read_logs([text(tmp_path, ROWS, header="t,p [BAR],y")], signals, 0.01)[0]
    assert not any("is taken as" in note for note in same.notes)


def test_another_unit_than_the_columns_name_ends_in_is_said(tmp_path):
    path = text(tmp_path, ROWS, header="t,p_bar,y_deg")
    for unit, said in (("kPa", True), ("bar", False)):
        signals = Signals("t", "y_deg", None, "p_bar", units={"pressure": unit, "output": "deg"})
        (log,) = read_logs([path], signals, 0.01)
        assert [n for n in log.notes if "in bar, pressure is taken as kPa" in n] == list(log.notes)
        assert bool(log.notes) == said


@pytest.mark.parametrize("kind", ["frame", "parquet"])
def test_runs_with_long_numbers_are_told_apart(tmp_path, kind):
    """In six digits 20260131 and 20260132 are one run, and two rigs one experiment."""
    pandas = pytest.importorskip("pandas")
    table = pandas.DataFrame({"t": np.tile(0.01 * np.arange(40), 2), "p": 1.0, "y": np.arange(80.0)})
    table["run"] = np.repeat([20260131, 20260132], 40)
    if kind == "parquet":
        pytest.importorskip("pyarrow")
        table.to_parquet(tmp_path / "log.parquet")
    log = tmp_path / "log.parquet" if kind == "parquet" else table
    found = read_logs([log], SIGNALS, 0.01)
    assert [e.name.rpartition("/")[2] for e in found] == ["20260131", "20260132"]
    for missing in ([1.0, np.nan], ["a", "NA"], ["a", "NaN"], ["a", None]):
        table["run"] = np.repeat(np.array(missing, dtype=object), 40)
        with pytest.raises(LogError, match="is empty in row 40"):
            read_logs([table], SIGNALS, 0.01)


def test_what_a_mask_hides_is_missing():
    y = np.arange(40.0)
    masked = np.ma.masked_equal(np.where(y == 20, -9999.0, y), -9999.0)
    (found,) = read_logs([{"t": 0.01 * y, "p": y, "y": masked}], PLAIN, 0.01)
    assert found["output"][20] == pytest.approx(20.0) and "missing" in found.notes[0]
    counts = np.ma.array(np.arange(40), mask=y == 20)
    assert np.isnan(table_of({"y": counts}, "log").numbers("y")[20])


def test_what_pandas_has_for_nothing_is_missing():
    pandas = pytest.importorskip("pandas")
    cells = [pandas.NA if k == 7 else float(k) for k in range(40)]
    odd = {
        "objects": np.array(cells, dtype=object),
        "extended": pandas.array(cells, dtype="Float64"),
        "texts": pandas.array([pandas.NA if k == 7 else str(k) for k in range(40)], dtype="string"),
        "none": [None if k == 7 else float(k) for k in range(40)],
    }
    for column in odd.values():
        values = table_of(pandas.DataFrame({"y": column}), "log").numbers("y")
        assert np.isnan(values[7]) and np.array_equal(np.delete(values, 7), np.delete(np.arange(40.0), 7))
    when = pandas.to_datetime(np.arange(40), unit="s").to_series(index=range(40))
    when[39] = pandas.NaT
    with pytest.raises(LogError, match="no time stamp in row 39"):
        read_logs([pandas.DataFrame({"t": when, "p": 1.0, "y": np.arange(40.0)})], PLAIN, 1.0)


def test_quantities_keep_their_unit():
    pint = pytest.importorskip("pint")
    signals = Signals("t", "y", None, "p", units={"pressure": "bar"})
    pressure = pint.UnitRegistry().Quantity(np.arange(40.0), "kPa")
    (found,) = read_logs([{"t": 0.01 * np.arange(40), "p": pressure, "y": np.arange(40.0)}], signals, 0.01)
    assert any("in kPa, pressure is taken as bar" in note for note in found.notes)


@pytest.mark.parametrize("count, step, resolution", [(110, 1.0, 60.0), (2000, 0.02, 128.0), (75, 0.02, 1.0)])
def test_stamps_too_coarse_to_tell_the_clock_are_refused(count, step, resolution):
    """Of hours and minutes over two minutes any step fits; the time constants would follow it."""
    time = resolution * np.floor((0.6 * resolution + step * np.arange(count)) / resolution)
    assert counted(time) is None


def test_a_clock_that_is_counted_is_right():
    random, told = np.random.default_rng(0), 0
    for _ in range(2000):
        resolution, count = 10.0 ** random.uniform(-1.0, 2.5), int(random.integers(10, 2000))
        exact = random.uniform(0.0, resolution) + np.arange(count)
        found = counted(resolution * np.floor(exact / resolution)) if resolution < count else None
        if found is not None:
            told += 1
            assert found[1] - found[0] == pytest.approx(1.0, abs=0.01)
    assert told > 1000


def test_a_rig_at_rest_behind_a_coarse_converter_logs_nothing_twice(tmp_path):
    rest = [(k / 10, 0.0, 0.0) for k in range(20) for _ in range(5)]
    moves = [(2.0 + k / 10, 1.0, 5 * k + j) for k in range(20) for j in range(5)]
    path = text(tmp_path, [",".join(map(str, row)) for row in rest + moves])
    (found,) = read_logs([path], PLAIN, 0.02)
    assert len(found) == 200 and "time stamps are rounded, 0.02 s" in found.notes[0]
    twice = [",".join(map(str, row)) for row in moves[::5] for _ in range(2)]
    (found,) = read_logs([text(tmp_path, twice)], PLAIN, 0.1)
    assert len(found) == 20 and "rows logged twice" in found.notes[0]


def test_runs_in_different_units_are_refused(tmp_path):
    head, last = lvm(".", "One", 2).rsplit("Y_Unit_Label", 1)
    (tmp_path / "log.lvm").write_text(f"{head}Y_Unit_Label{last.replace('bar', 'kPa', 1)}")
    with pytest.raises(LogError, match="gives 'p_bar' in bar and in kPa, by the run"):
        read_table(tmp_path / "log.lvm")


@pytest.mark.parametrize("mark", [" ", "   "])
def test_blanks_between_decimal_commas_and_quoted_names(tmp_path, mark):
    for width in (2, 3, 4):
        names = [f"name {k}" for k in range(width)]
        lines = [mark.join([f"{k + 0.5:.2f}".replace(".", ",")] * width) for k in range(40)]
        header = mark.join(f'"{name}"' for name in names)
        found = read_table(text(tmp_path, lines, header=header))
        assert list(found.columns) == names and found.numbers("name 1")[39] == 39.5


# ---------------------------------------------------------------------------------------- what stands still


@pytest.mark.parametrize(
    "still, said",
    [
        (("output",), "output is 0 throughout, while command, pressure move; check its plug and its column$"),
        (("pressure",), "pressure is 0 throughout, while command, output move; .* leave pressure out"),
        (("output", "pressure", "command"), "output is 0 throughout, while nothing moves"),
    ],
)
def test_a_measured_signal_that_stands_still_is_no_dead_zone(still, said):
    signals = {
        role: np.zeros(40) if role in still else np.arange(40.0) for role in ("command", "pressure", "output")
    }
    log = Experiment("log", 0.01, signals)
    with pytest.raises(LogError, match=said):
        check_moving([log])
    check_moving([log, replace(log, signals={role: np.arange(40.0) for role in signals})])


def test_a_column_without_a_reading_is_said_to_be_left_out(tmp_path):
    lines = [f"{0.01 * k:.2f},{k},{k}," for k in range(40)]
    roles = Signals("t", "y", "u", "p")
    (found,) = read_logs([text(tmp_path, lines, header="t,u,y,p")], roles, 0.01)
    assert "pressure has no reading at all, taken as not logged" in found.notes and "pressure" not in found
