"""What loggers, PLCs and spreadsheets write that can be read in two ways: refused, or told of.

Red when minutes, packed dates, frames, dates without a zone, thousands in a frame's texts, or numbers that
stand for nothing pass without a word.
"""

import numpy as np
import pytest

from focgen import init
from focgen.errors import LogError
from focgen.logs import read_logs
from focgen.logs.lvm_file import read as read_lvm
from focgen.logs.outliers import stand_in
from focgen.logs.scales import Scale
from focgen.logs.table import read_table
from focgen.logs.units import unit_named, unit_of
from focgen.rig.rig import Signals
from tests.logs.test_dialects import lvm
from tests.logs.test_misread import PLAIN, text

COUNT = 400
SECONDS = 0.05 * np.arange(COUNT)


def log(tmp_path, times, header="t,p,y", readings=None):
    readings = np.arange(COUNT) if readings is None else readings
    return text(tmp_path, [f"{t},{k},{y}" for k, (t, y) in enumerate(zip(times, readings))], header=header)


# ------------------------------------------------------------------------------------------------------ time


@pytest.mark.parametrize("header", ["t (min),p,y", "t,p,y\nmin,bar,1/mm"])
def test_minutes_that_the_file_tells_of_are_no_seconds(tmp_path, header):
    """A factor of 60 passes for a log of another rate."""
    path = log(tmp_path, [f"{t / 60:.8f}" for t in SECONDS], header)
    with pytest.raises(LogError, match="is in min, and the rig takes it for seconds"):
        read_logs(path, PLAIN, 0.05)


def test_minutes_that_a_name_tells_of_are_no_seconds(tmp_path):
    path = log(tmp_path, [f"{t / 60:.8f}" for t in SECONDS], "t_min,p,y")
    with pytest.raises(LogError, match="unit = 'min'"):
        read_logs(path, Signals("t_min", "y", None, "p"), 0.05)
    scale = Scale(unit="min")
    (found,) = read_logs(path, Signals("t_min", "y", None, "p", scales={"time": scale}), 0.05)
    assert found.sample_time == 0.05 and not found.notes


def test_seconds_by_any_name_and_dates_stay(tmp_path):
    for header, name in (("t_s,p,y", "t_s"), ("t [sec],p,y", "t"), ("t (UTC),p,y", "t")):
        path = log(tmp_path, [f"{t:.2f}" for t in SECONDS], header)
        (found,) = read_logs(path, Signals(name, "y", None, "p"), 0.05)
        assert found.sample_time == 0.05 and not found.notes
    path = log(tmp_path, [f"2026-01-31T12:00:{t:05.2f}" for t in SECONDS], "t (min),p,y")
    assert len(read_logs(path, PLAIN, 0.05)[0]) == COUNT


def packed(t, form):
    return form.format(int(t) // 60, t % 60, round(1000 * (t % 60)))


@pytest.mark.parametrize(
    "form", ["2026013112{0:02d}{1:05.2f}", "12{0:02d}{2:05d}", "2026013123{0:02d}{2:05d}", "{0:d}{2:05d}"]
)
def test_dates_and_milliseconds_in_one_number_are_refused(tmp_path, form):
    """A minute ends at 59 and goes on at 100: 40 s that never were, each minute an experiment of its own."""
    path = log(tmp_path, [packed(t, form) for t in SECONDS + 50.0])
    with pytest.raises(LogError, match="hhmmss"):
        read_table(path).seconds("t")


@pytest.mark.parametrize("lost", [-1, 0], ids=["the last of a minute", "the first"])
def test_a_row_that_is_lost_does_not_hide_packed_times(tmp_path, lost):
    times = [packed(t, "12{0:02d}{1:05.2f}") for t in SECONDS + 50.0]
    del times[int(np.argmax(SECONDS + 50.0 >= 60.0)) + lost]
    with pytest.raises(LogError, match="hhmmss"):
        read_table(log(tmp_path, times)).seconds("t")


@pytest.mark.parametrize("unit", [10, 100])
def test_tenths_and_hundredths_in_one_number_are_refused(tmp_path, unit):
    """Tenths passed for seconds, at a tenth of the rate."""
    whole = np.arange(58 * unit, 58 * unit + COUNT)
    width = len(f"59{unit}") - 1
    times = [f"12{k // (60 * unit):02d}{k % (60 * unit):0{width}d}" for k in whole.tolist()]
    with pytest.raises(LogError, match="hhmmss"):
        read_table(log(tmp_path, times)).seconds("t")


def test_a_frame_that_is_lost_does_not_hide_frames(tmp_path):
    frames = [k for k in range(COUNT + 2) if k not in (130, 220)]
    path = log(tmp_path, [f"{k // 1200:02d}:{k // 20 % 60:02d}:{k % 20:02d}" for k in frames])
    with pytest.raises(LogError, match="frames"):
        read_table(path).seconds("t")


def test_minutes_seconds_and_frames_are_no_hours(tmp_path):
    frames = np.arange(COUNT)
    path = log(tmp_path, [f"{k // 1200:02d}:{k // 20 % 60:02d}:{k % 20:02d}" for k in frames])
    with pytest.raises(LogError, match="frames"):
        read_table(path).seconds("t")
    for keeps in (
        lambda t: f"{t // 3600:02d}:{t // 60 % 60:02d}:{t % 60:02d}",
        lambda t: f"0:{t // 60:02d}:07",
    ):
        path = log(tmp_path, [keeps(int(k)) for k in frames])
        read_table(path).seconds("t")


def test_dates_of_which_some_have_a_zone_are_refused(tmp_path):
    times = [f"2026-01-31T12:00:{t:05.2f}{'+01:00' if k < 200 else ''}" for k, t in enumerate(SECONDS)]
    with pytest.raises(LogError, match="some have a zone, some have none"):
        read_table(log(tmp_path, times)).seconds("t")
    mixed = [f"2026-01-31T1{k % 2}:00:{t:05.2f}+0{k % 2}:00" for k, t in enumerate(SECONDS)]
    assert np.allclose(np.diff(read_table(log(tmp_path, mixed)).seconds("t")), 0.05)


@pytest.mark.parametrize(
    "times, step, may_be",
    [
        (np.arange(COUNT), 0.05, "a count of samples or of ticks"),
        (2 * np.arange(COUNT), 0.05, "a count of samples or of ticks"),
        ([f"{t / 60:.8f}" for t in SECONDS], 0.05, "minutes"),
        ([f"{k // 3600:02d}:{k // 60 % 60:02d}:{k % 60:02d}" for k in range(COUNT)], 1 / 60, "frames"),
    ],
    ids=["samples", "ticks", "minutes", "frames"],
)
def test_a_clock_that_fits_the_rig_otherwise_is_no_seconds_until_the_rig_says_so(
    tmp_path, times, step, may_be
):
    """A factor of 20 or 60 passed for a log of another rate. What is refused has a door."""
    path = log(tmp_path, times)
    with pytest.raises(LogError, match=f"may be .*{may_be}"):
        read_logs(path, PLAIN, step)
    (found,) = read_logs(path, Signals("t", "y", None, "p", scales={"time": Scale(unit="s")}), step)
    assert len(found) == COUNT and "kept so" in found.notes[-1]


@pytest.mark.parametrize(
    "times, unit",
    [
        (range(COUNT), "s"),
        ([f"{1000 * t + 0.5:.1f}" for t in SECONDS], "ms"),
        ([f"{1e6 * t + 0.5:.1f}" for t in SECONDS], "us"),
        ([f"{t / 86400 + 46053.5:.10f}" for t in SECONDS], "day"),
    ],
)
def test_what_to_write_is_written_with_the_columns_own_name(tmp_path, times, unit):
    """`column = …` is nothing that one can copy, and 'ms' is wrong of a spreadsheet's days."""
    path = log(tmp_path, times, "Zeit,p,y")
    with pytest.raises(LogError) as caught:
        read_logs(path, Signals("Zeit", "y", None, "p"), 0.05)
    assert f"write time = {{ column = 'Zeit', unit = '{unit}' }} in the rig's [signals]" in str(caught.value)


def test_a_clock_without_a_column_has_no_column_to_write():
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"p": SECONDS, "y": SECONDS}, index=pandas.to_timedelta(SECONDS, unit="ms"))
    with pytest.raises(LogError, match="; correct sample_time$"):
        read_logs(frame, PLAIN, 0.05)


def test_whole_seconds_pass_at_the_rate_of_the_rig_and_where_the_file_says_so(tmp_path):
    path = log(tmp_path, range(COUNT))
    assert read_logs(path, PLAIN, 1.0)[0].sample_time == 1.0
    path = log(tmp_path, range(COUNT), "t (s),p,y")
    assert read_logs(path, PLAIN, 0.1)[0].sample_time == 1.0
    path = log(tmp_path, [f"{0.01 * k:.2f}" for k in range(COUNT)])
    assert read_logs(path, PLAIN, 0.05)[0].sample_time == 0.01


@pytest.mark.parametrize(
    "times, step",
    [
        ([f"{100 * (k // 200) + 0.3 * (k % 200):.1f}" for k in range(COUNT)], 0.3),
        ([f"12:{k // 20:02d}:{k % 20:02d}" for k in range(COUNT)], 1.0),
    ],
    ids=["a minute in each 100 s", "20 s in each minute"],
)
def test_the_rig_opens_what_looks_like_another_clock(tmp_path, times, step):
    path = log(tmp_path, times)
    with pytest.raises(LogError, match="unit = 's'"):
        read_logs(path, PLAIN, step)
    found = read_logs(path, Signals("t", "y", None, "p", scales={"time": Scale(unit="s")}), step)
    assert len(found) > 1 and {e.sample_time for e in found} == {step}


@pytest.mark.parametrize("unit", ["min", "ms", "s"])
@pytest.mark.parametrize("form", ["2026-01-31T12:00:{:06.3f}", "12:00:{:06.3f}"])
def test_the_unit_of_other_logs_does_not_scale_dates(tmp_path, unit, form):
    """Minutes, as the rig has it for its other logs, made 0.05 s of a date 3 s."""
    signals = Signals("t", "y", None, "p", scales={"time": Scale(unit=unit)})
    (found,) = read_logs(log(tmp_path, [form.format(t) for t in SECONDS]), signals, 0.05)
    assert found.sample_time == 0.05 and len(found.notes) == (unit != "s")


# --------------------------------------------------------------------------------------------------- numbers


def test_thousands_in_texts_of_a_frame_are_no_decimals():
    """The rule of files of text holds for texts in frames, .parquet and .mat."""
    frame = {"t": SECONDS, "p": SECONDS, "y": [f"{10 * k:,d}".replace(",", ".") for k in range(COUNT)]}
    with pytest.raises(LogError, match="thousands"):
        read_logs(frame, PLAIN, 0.05)
    (found,) = read_logs(frame | {"p": [f"{t:.2f}" for t in SECONDS], "y": SECONDS}, PLAIN, 0.05)
    assert np.allclose(found["pressure"], SECONDS)


@pytest.mark.parametrize("other", ["31.01.2026", "2026-01-31T12:00:00.05", "192.168.0.12", "no.1"])
def test_the_point_of_a_date_tells_nothing_of_thousands(tmp_path, other):
    """1.200 was 1.2 beside a column of dates as they are written where it is 1200."""
    thousands = [f"{10 * k:,d}".replace(",", ".") for k in range(COUNT)]
    lines = [f"{k};{k};{y};{other}" for k, y in enumerate(thousands)]
    with pytest.raises(LogError, match="thousands"):
        read_table(text(tmp_path, lines, header="t;p;y;d")).numbers("y")
    with pytest.raises(LogError, match="thousands"):
        read_logs({"t": SECONDS, "p": SECONDS, "y": thousands, "d": [other] * COUNT}, PLAIN, 0.05)


@pytest.mark.long
def test_thousands_in_texts_of_a_parquet_are_no_decimals(tmp_path):
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    columns = {"t": SECONDS, "p": SECONDS, "y": [f"{10 * k:,d}".replace(",", ".") for k in range(COUNT)]}
    pq.write_table(pa.table(columns), tmp_path / "log.parquet")
    with pytest.raises(LogError, match="thousands"):
        read_table(tmp_path / "log.parquet").numbers("y")


def test_a_number_that_stands_for_no_reading_is_told_of(tmp_path):
    """A camera that writes 0 where it sees nothing: of outliers these would be too many."""
    seen = 3.0 + np.sin(0.05 * np.arange(COUNT))
    lost = np.where(np.arange(COUNT) % 25 == 7, 0.0, seen)
    (found,) = read_logs(log(tmp_path, SECONDS, readings=lost), PLAIN, 0.05)
    (note,) = (note for note in found.notes if "again and again" in note)
    assert note.startswith("output is 0") and "0.35 s" in note


@pytest.mark.parametrize(
    "swing",
    [
        np.tile([0.0, 1.0, 2.0, 1.0], 100),
        np.tile([0.0, 1.0], 200),
        np.repeat([0.0, 1.0, 0.0, 2.0, 0.0, 3.0, 0.0, 4.0], 50),
        np.round(np.random.default_rng(5).normal(size=COUNT)),
    ],
    ids=["sine", "square", "steps", "coarse"],
)
def test_what_swings_or_rests_stands_for_itself(swing):
    assert stand_in(swing) is None


@pytest.mark.parametrize(
    "name",
    [
        "p_A",
        "chamber_pressure_A",
        "p_m",
        "angle_A",
        "kappa_A",
        "p_s",
        "p1_A",
        "p A",
        "pSet_A",
        "sensor_A",
        "force_A",
    ],
)
def test_the_letter_of_a_channel_is_no_unit(name):
    """The pressure of chamber A was in ampere, without a word."""
    assert unit_of(name) is None and unit_named(name) == ""


def test_letters_that_are_units_stay_units():
    names = ["u_V", "current_A", "valve_A", "force_N", "y_m", "temperature_C", "p_V", "A"]
    assert [unit_named(name) for name in names] == ["V", "A", "A", "N", "m", "C", "V", "A"]


def test_init_takes_the_letter_of_a_chamber_for_no_unit(tmp_path):
    lines = [f"{t:.2f},{k // 100},{k / 100},{k / 100}" for k, t in enumerate(SECONDS)]
    found = str(init(text(tmp_path, lines, header="t_s,u_V,p_A,angle_A")))
    assert '= "A"' not in found and "the unit of 'p_A' is not known" in found


# ---------------------------------------------------------------------------------------------------- LabVIEW


def test_x_values_of_labview_have_the_unit_that_the_file_gives(tmp_path):
    path = tmp_path / "log.lvm"
    path.write_text(lvm(".", "One", 1).replace("X_Dimension\t", "X_Unit_Label\tmin\tmin\nX_Dimension\t"))
    assert read_lvm(path).unit("X_Value") == "min"
    for other in ("Frequency", "Frequenz", "Fréquence"):
        path.write_text(lvm(".", "One", 1).replace("X_Dimension\tTime", f"X_Dimension\t{other}"))
        with pytest.raises(LogError, match="goes over fr"):
            read_lvm(path)
    path.write_text(lvm(".", "One", 1).replace("X_Dimension\tTime", "X_Dimension\tZeit"))
    assert len(read_lvm(path))


def tdms(path, **properties):
    """A channel of time beside two waveforms; ``properties`` are those of the pressure."""
    nptdms = pytest.importorskip("nptdms")
    own = {"wf_increment": 0.05, "wf_start_offset": 0.0}
    with nptdms.TdmsWriter(str(path)) as writer:
        columns = ("t", {}), ("p", own | properties), ("y", own)
        writer.write_segment(
            [nptdms.ChannelObject("g", n, SECONDS, properties=own_of) for n, own_of in columns]
        )
    return path


@pytest.mark.parametrize(
    "properties, said",
    [
        pytest.param({"wf_start_offset": 1.0}, "clocks differ", marks=pytest.mark.long),
        pytest.param({"wf_increment": 0.1}, "clocks differ", marks=pytest.mark.long),
        ({"wf_xname": "Frequency", "wf_xunit_string": "Hz"}, "goes over Frequency in Hz"),
        pytest.param({"wf_xunit_string": "ms"}, "clocks differ", marks=pytest.mark.long),
    ],
    ids=["another start", "another step", "a spectrum", "another unit"],
)
def test_a_channel_of_time_does_not_hide_the_clocks_of_waveforms(tmp_path, properties, said):
    """A second between pressure and output, as a dead time that no rig has."""
    with pytest.raises(LogError, match=said):
        read_logs(tdms(tmp_path / "log.tdms", **properties), PLAIN, 0.05)


def test_the_rig_says_that_a_channel_of_time_is_right(tmp_path):
    signals = Signals("t", "y", None, "p", scales={"time": Scale(unit="s")})
    path = tdms(tmp_path / "log.tdms", wf_start_offset=1.0)
    assert len(read_logs(path, signals, 0.05)[0]) == COUNT
    assert len(read_logs(tdms(path), PLAIN, 0.05)[0]) == COUNT


def test_waveforms_have_the_unit_that_the_file_gives(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    own = {"wf_increment": 0.05 / 60.0, "wf_start_offset": 0.0, "wf_xname": "Time", "wf_xunit_string": "min"}
    with nptdms.TdmsWriter(str(tmp_path / "log.tdms")) as writer:
        writer.write_segment([nptdms.ChannelObject("g", n, SECONDS, properties=own) for n in "py"])
    assert read_logs(tmp_path / "log.tdms", PLAIN, 0.05)[0].sample_time == 0.05
