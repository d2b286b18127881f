"""Columns of time that are another clock than they look: refused with what to write, or read with a note.

Red when digits without their zeros, minutes and seconds in one number, rows of several sensors, or a clock
that is put back tear experiments or open holes that the rig never had; and when a good clock is taken for one
of them.
"""

import tomllib
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from focgen import init
from focgen.errors import LogError
from focgen.logs import read_logs, stamps
from focgen.logs.scales import Scale
from focgen.logs.table import read_table
from focgen.rig.files import read_rig, rig_text
from focgen.rig.rig import Signals
from tests.logs.test_misread import PLAIN, text
from tests.logs.test_two_readings import COUNT, SECONDS, log

MILLI = 50 * np.arange(COUNT)
TOLD = Signals("t", "y", None, "p", scales={"time": Scale(unit="s")})


def bare(ms, form="{0}.{1}"):
    """Seconds and milliseconds, neither with zeros ahead."""
    return [form.format(t // 1000, t % 1000) for t in ms.tolist()]


# ------------------------------------------------------------------------------------------ one number of two


@pytest.mark.parametrize(
    "times, step",
    [
        (bare(MILLI), 0.05),
        (bare(MILLI, "12:00:{0:02d}.{1}"), 0.05),
        (bare(MILLI, "2026-01-31T12:00:{0:02d}.{1}"), 0.05),
        (bare(MILLI, "{0}.{1}000"), 0.05),
        (bare(np.arange(4000)), 0.001),
        (bare(10 * np.arange(COUNT)), 0.01),
        (bare(3 * MILLI), 0.15),
        (bare(MILLI + np.random.default_rng(1).integers(0, 8, COUNT)), 0.05),
        (bare(np.concatenate([MILLI, MILLI])), 0.05),
    ],
    ids=["numbers", "of a day", "dates", "microseconds", "1 ms", "10 ms", "150 ms", "jitter", "a restart"],
)
def test_milliseconds_without_their_zeros_are_no_decimals(tmp_path, times, step):
    """`5.50` for 50 ms comes ahead of `5.100`: parts of experiments, with holes between."""
    with pytest.raises(LogError, match="may lack zeros; write 50 ms as 0.050, or, .* unit = 's'"):
        read_logs(log(tmp_path, times, readings=range(len(times))), PLAIN, step)


@pytest.mark.parametrize(
    "times",
    [
        SECONDS,
        np.tile(0.01 * np.arange(1, 51), 8),
        np.concatenate([0.1 + SECONDS[:12], 0.1 + SECONDS]),
        0.25 * np.arange(COUNT) - 0.25 * (np.arange(COUNT) % 7 == 3),
        np.concatenate([0.25 * np.arange(40), 0.25 * np.arange(40) + 0.1]),
        np.column_stack([0.25 * np.arange(2, 42), 0.25 * np.arange(1, 41)]).ravel(),
        np.column_stack([0.2 * np.arange(2, 42) + 0.1, 0.2 * np.arange(1, 41) + 0.1]).ravel(),
        1.7e9 + SECONDS,
    ],
    ids=["even", "short runs", "a restart", "out of order", "two", "two at once", "two by 0.2 s", "1970"],
)
def test_a_clock_that_falls_back_otherwise_does_not_lack_zeros(times):
    assert not stamps.lacks_zeros(np.round(times, 6))


@pytest.mark.parametrize(
    "times, step, may_be",
    [
        ([f"{k // 60}.{k % 60:02d}" for k in range(COUNT)], 1.0, "mm.ss"),
        ([f"{k // 60}.{k % 60:02d}" for k in range(COUNT)], 0.01, "mm.ss"),
        ([f"{t // 60000}.{t % 60000:05d}" for t in (4 * MILLI).tolist()], 0.2, "mm.ss"),
        ([f"12.{k // 60:02d}{k % 60:02d}" for k in range(COUNT)], 1.0, "mm.ss"),
        ([f"{k // 25}.{k % 25:02d}" for k in range(COUNT)], 0.04, "seconds and frames"),
        ([f"{k // 50}.{k % 50:02d}" for k in range(COUNT)], 0.02, "seconds and frames"),
    ],
    ids=["mm.ss", "at the rate", "mm.ssfff", "h.mmss", "25 frames", "50 frames"],
)
def test_minutes_or_frames_behind_a_point_are_no_decimals(tmp_path, times, step, may_be):
    """12.59 goes on at 13.00: a hole of 0.41 s in every second."""
    with pytest.raises(LogError, match=may_be):
        read_logs(log(tmp_path, times), PLAIN, step)
    assert len(read_table(log(tmp_path, times)).seconds("t", told=True)) == COUNT


@pytest.mark.parametrize(
    "step", [0.5, 0.25, 0.2, 0.1, 0.05, 0.04, 0.02, 0.01, 0.001, 1 / 60, 1 / 30, 0.55, 0.3]
)
@pytest.mark.parametrize("begin", [0.0, 0.4, 1.7e9, 59.5])
def test_even_clocks_count_neither_minutes_nor_frames(step, begin):
    times = np.round(begin + step * np.arange(4000), 6)
    for each in (times, np.delete(times, np.arange(7, 3900, 41))):
        assert stamps.other_reading(each, dated=False) is None and not stamps.skips_frames(each)


def test_short_parts_at_the_rate_of_the_rig_are_no_frames(tmp_path):
    """A logger that is triggered every second: of two readings the one at the rig's rate."""
    path = log(tmp_path, [f"{k // 20 + 0.01 * (k % 20):.2f}" for k in range(COUNT)])
    assert len(read_logs(path, PLAIN, 0.01)) == COUNT // 20
    with pytest.raises(LogError, match="seconds and frames"):
        read_logs(path, PLAIN, 0.05)


# --------------------------------------------------------------------------------- one sensor under the other

GAUGE = 3.0 * np.sin(0.02 * np.arange(COUNT)) + 5.0
BEND = np.sin(0.02 * np.arange(COUNT) - 0.2)
TWO = [f"{t:.2f},{y:.4f},{name}" for t, p, b in zip(SECONDS, GAUGE, BEND) for name, y in (("p", p), ("b", b))]
CELLS = [row.partition(",") for row in TWO]
OFF = [f"{float(t) + 0.001 * (k % 2):.3f},{rest}" for k, (t, _, rest) in enumerate(CELLS)]
ALIKE = [f"{t:.2f},{b + 0.001 * k:.4f},{'pb'[k]}" for t, b in zip(SECONDS, BEND) for k in range(2)]
ONE = Signals("t", "y", None, "y")


@pytest.mark.parametrize(
    "lines, header, said",
    [
        (TWO, "t,y,sensor", "as 'sensor' says"),
        (ALIKE, "t,y,sensor", "as 'sensor' says"),
        (OFF, "t,y,which", "as 'which' says"),
        ([row for k, row in enumerate(OFF) if k % 4 != 3], "t,y,tag", "as 'tag' says"),
        ([row.replace(",p", ",1").replace(",b", ",2") for row in TWO], "t,y,id", "2 rows of each time stamp"),
        ([row[:-2] for row in TWO], "t,y", "2 rows of each time stamp"),
        (TWO[::2] + TWO[1::2], "t,y,Sensor 1", "the same time stamps for each 'Sensor 1'"),
    ],
    ids=["in turn", "alike", "at other moments", "two rates", "numbered", "without a name", "in blocks"],
)
def test_rows_of_several_sensors_are_no_faster_clock(tmp_path, lines, header, said):
    """Pressure and bending one under the other are not one signal at twice the rate."""
    path = text(tmp_path, lines, header=header)
    with pytest.raises(LogError, match=f"{said}.*; give each sensor a column of its own"):
        read_logs(path, ONE, 0.05)
    name = header.split(",")[-1]
    if name not in ("y", "id"):
        found = read_logs(path, replace(ONE, run=name), 0.05)
        assert len(found) == 2 and not any("rounded" in note for e in found for note in e.notes)


def test_signals_that_are_never_in_one_row_are_of_one_moment(tmp_path):
    """Half a sample between pressure and output would be a dead time that no rig has."""
    rows = [f"{t:.2f},{p:.4f},\n{t:.2f},,{b:.4f}" for t, p, b in zip(SECONDS, GAUGE, BEND)]
    with pytest.raises(LogError, match="2 rows of each time stamp"):
        read_logs(text(tmp_path, rows), PLAIN, 0.05)


def test_a_role_that_is_a_word_in_the_rows_is_said_to_be(tmp_path):
    with pytest.raises(LogError, match="no column 'b' .output., but rows that 'sensor' names so; give each"):
        read_logs(text(tmp_path, TWO, header="t,value,sensor"), Signals("t", "b", None, "p"), 0.05)


@pytest.mark.parametrize(
    "word", [lambda k: k // 50 % 2, lambda k: k % 2, lambda k: k // 2 % 2, lambda k: k % 3 == 0, lambda k: 0]
)
@pytest.mark.parametrize("stamps", [0.05, 0.001])
@pytest.mark.parametrize("names", [("open", "shut"), ("0", "1")])
def test_words_beside_one_sensor_name_no_other(tmp_path, word, stamps, names):
    times = np.floor(SECONDS / stamps + 1e-6) * stamps
    rows = [
        f"{t:.3f},{p:.4f},{b:.4f},{names[word(k)]}" for k, (t, p, b) in enumerate(zip(times, GAUGE, BEND))
    ]
    (found,) = read_logs(text(tmp_path, rows, header="t,p,y,sensor"), PLAIN, 0.05)
    assert len(found) == COUNT


def test_rounded_stamps_and_a_slow_camera_are_of_one_sensor(tmp_path):
    times = np.floor(SECONDS / 0.1 + 1e-6) * 0.1
    ends = ["" if k % 2 else f"{b:.4f}" for k, b in enumerate(BEND)]
    rows = [f"{t:.1f},{p:.4f},{b:.4f},{e}" for t, p, b, e in zip(times, GAUGE, BEND, ends)]
    path = text(tmp_path, rows, header="t,p,y,c")
    assert len(read_logs(path, replace(PLAIN, curvature="c"), 0.05)[0]) >= COUNT - 1


# ------------------------------------------------------------------------------------------- clocks put back


def put_back(begin, hours, at, form="%H:%M:%S.%f", step=0.05, lost=0):
    """Stamps of a clock that begins at ``begin`` and is put back by ``hours`` after ``at`` s."""
    times = [begin + timedelta(seconds=step * k) for k in range(COUNT + lost)]
    back = [timedelta(hours=hours * (step * k > at - 1e-9)) for k in range(COUNT + lost)]
    made = [(time - less).strftime(form) for time, less in zip(times, back)]
    return made[: int(at / step)] + made[int(at / step) + lost :]


DATE = "%Y-%m-%dT%H:%M:%S.%f"
SUMMER = datetime(2026, 10, 25, 2, 59, 50, tzinfo=UTC)
NOON = datetime(2026, 1, 31, 12, 59, 50, tzinfo=UTC)


@pytest.mark.parametrize("lost", [0, 1])
@pytest.mark.parametrize("form", ["%H:%M:%S.%f", DATE])
@pytest.mark.parametrize("begin, hours", [(SUMMER, 1), (NOON, 12)], ids=["end of summer", "one o'clock"])
def test_a_clock_that_is_put_back_tears_no_experiment(tmp_path, begin, hours, form, lost):
    """The state of the rig goes on: what follows did not begin at rest."""
    (found,) = read_logs(log(tmp_path, put_back(begin, hours, 10.0, form, lost=lost)), PLAIN, 0.05)
    assert len(found) == COUNT + lost and found.sample_time == 0.05
    (note,) = [note for note in found.notes if "put back" in note]
    assert f"put back by {hours} h" in note and "in line 202" in note


def test_times_of_a_frame_are_put_back_alike(tmp_path):
    times = np.array(put_back(SUMMER, 1, 10.0, DATE), dtype="datetime64[us]")
    (found,) = read_logs({"t": times, "p": SECONDS, "y": SECONDS}, PLAIN, 0.05)
    assert len(found) == COUNT and "put back by 1 h" in found.notes[0]


@pytest.mark.parametrize(
    "begin, hours",
    [
        (SUMMER + timedelta(hours=8), 1),
        (SUMMER - timedelta(minutes=30), 1),
        (SUMMER, 1.01),
        (NOON, 11),
        (NOON - timedelta(hours=1), 12),
    ],
    ids=["by day", "within an hour", "a little more", "eleven hours", "at twelve"],
)
def test_a_clock_that_falls_back_otherwise_starts_anew(tmp_path, begin, hours):
    found = read_logs(log(tmp_path, put_back(begin, hours, 10.0)), PLAIN, 0.05)
    assert [len(e) for e in found] == [200, 200] and "starts anew" in found[0].notes[0]


def test_a_clock_of_24_hours_is_not_put_back_by_12(tmp_path):
    """Who logs at 13:00 or at 0:30 has no clock of twelve hours."""
    times = put_back(NOON, 12, 10.0)
    times[:8] = [f"00:30:0{k}.000" for k in range(8)]
    found = read_logs(log(tmp_path, times), PLAIN, 0.05)
    assert len(found) > 1 and not any("put back" in note for e in found for note in e.notes)


def test_logs_of_which_some_have_a_zone_are_of_no_one_clock(tmp_path):
    """Hours may lie between them, in which a drift goes on or a softening rests."""
    zoned, bare_of_it = (tmp_path / name for name in "ab")
    for folder, zone in ((zoned, "+02:00"), (bare_of_it, "")):
        folder.mkdir()
        log(folder, [f"2026-01-31T12:00:{t:06.3f}{zone}" for t in SECONDS])
    with pytest.raises(LogError, match="b/log.csv .*without a zone, beside a log with one; write the zone"):
        read_logs([zoned / "log.csv", bare_of_it / "log.csv"], PLAIN, 0.05)
    log(bare_of_it, [f"2026-01-31T10:05:{t:06.3f}Z" for t in SECONDS])
    first, second = read_logs([zoned / "log.csv", bare_of_it / "log.csv"], PLAIN, 0.05)
    assert second.start - first.start == pytest.approx(300.0)
    log(bare_of_it, [f"{t:.2f}" for t in SECONDS])
    assert len(read_logs([zoned / "log.csv", bare_of_it / "log.csv"], PLAIN, 0.05)) == 2


# ----------------------------------------------------------------------------------------------- thousands


@pytest.mark.parametrize("kind", ["text", "frame"])
def test_numbers_that_all_look_like_thousands_are_asked_for(tmp_path, kind):
    """1.013 is a pressure in bar, and one in mbar with its thousands marked."""
    path = tmp_path / "log.csv"
    dates = [f"2026-01-31T12:00:{t:06.3f}" for t in SECONDS]
    p, y = ([f"{v:.3f}" for v in values] for values in (1.0 + GAUGE, 2.5 + BEND))
    path.write_text("\n".join(["t;p;y", *map(";".join, zip(dates, p, y))]) + "\n")
    given = path if kind == "text" else {"t": SECONDS, "p": p, "y": y}
    with pytest.raises(LogError, match=r"\[p\]: .*like 1.200.* pressure = { column = 'p', scale = 1 }"):
        read_logs(given, PLAIN, 0.05)
    scaled = replace(PLAIN, scales={"pressure": Scale()})
    for found in (read_logs(given, scaled, 0.05), read_logs(given, PLAIN, 0.05, ranged={"output"})):
        assert found[0]["pressure"][0] == pytest.approx(6.0)
    (found,) = read_logs(given, PLAIN, 0.05, limits={"output": (0.0, 5.0)})
    assert found["output"].max() < 4.0


def test_init_says_that_it_takes_points_for_decimal_ones(tmp_path):
    """It writes ranges, which tell the other commands."""
    rows = [f"{k};{p:.3f};{y:.3f}" for k, (p, y) in enumerate(zip(1.0 + GAUGE, 2.5 + BEND))]
    found = init(text(tmp_path, rows, header="t;p;y"))
    assert sum("point is taken for a decimal one" in doubt for doubt in found.doubts) == 2


def test_one_number_that_is_no_thousand_tells_of_all(tmp_path):
    for one in ("0.999", "12.5", "1200.125"):
        rows = [f"{k + 1000};{1.5 + k / 1000:.3f};{one}" for k in range(COUNT)]
        (found,) = read_logs(text(tmp_path, rows, header="t;p;y"), PLAIN, 1.0)
        assert found["pressure"][0] == 1.5


def test_a_time_that_looks_like_thousands_is_in_seconds_at_the_rate_of_the_rig_only(tmp_path):
    rows = [f"{1 + k / 1000:.3f};{k};{k}" for k in range(COUNT)]
    path = text(tmp_path, rows, header="t;p;y")
    with pytest.raises(LogError, match="may be a thousand times as much"):
        read_logs(path, PLAIN, 0.05)
    assert read_logs(path, PLAIN, 0.001)[0].sample_time == 0.001
    assert read_logs(path, TOLD, 0.05)[0].sample_time == 0.001


def test_a_rig_says_by_a_scale_of_1_that_a_point_is_a_decimal_one():
    given = {"time": "t", "pressure": {"column": "p", "scale": 1}, "output": "y"}
    rig = read_rig({"name": "r", "sample_time": 0.05, "signals": given})
    assert rig.signals.scales == {"pressure": Scale()}
    assert read_rig(tomllib.loads(rig_text(rig))).signals == rig.signals
