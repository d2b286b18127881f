"""``focgen init``: roles, units, sample time and ranges of logs whose columns have names of many kinds.

Red when a column gets the wrong role without a doubt being said.
"""

import io
import json
import re
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest

import focgen
from focgen.cli.main import main
from focgen.errors import LogError
from focgen.resources import shipped
from focgen.rig.files import read_rig

STEP = 0.02
TIME = STEP * np.arange(400)
HELD = np.repeat([0.0, 2.0, 4.0, 1.0], 100)
PRESSURE = 0.05 * HELD * (1 - np.exp(-np.tile(np.arange(100), 4) / 8)) + 1e-5 * np.sin(TIME * 31)
ANSWER = np.cumsum(PRESSURE) * 1e-3 + 1e-5 * np.cos(TIME * 17)


def proposed(columns, **options):
    """Proposal for columns in this order: time, command, pressure, output, and what else is given."""
    signals = (TIME, HELD, PRESSURE, ANSWER)
    return focgen.init(dict(zip(columns, signals)) | options)


@pytest.mark.parametrize(
    "names",
    [
        ("t_s", "u_V", "p_bar", "kappa_per_mm"),
        ("time", "valve", "pressure", "angle"),
        ("Time (s)", "Voltage [V]", "Pressure [kPa]", "Bending angle [deg]"),
        ("timestamp", "pwmDuty", "chamberPressure", "flexSensor"),
        ("Zeit_s", "Stell_V", "Druck_mbar", "Winkel_deg"),
        ("t", "p_set_bar", "p_bar", "y"),
    ],
)
@pytest.mark.parametrize("order", [1, -1])
def test_roles_by_names_and_units(names, order):
    """Whatever the order of the columns."""
    columns = dict(list(zip(names, (TIME, HELD, PRESSURE, ANSWER)))[::order])
    found = focgen.init(columns).rig
    named = (found.signals.time, found.signals.command, found.signals.pressure, found.signals.output)
    assert named == names and found.sample_time == STEP


def test_names_that_tell_nothing_are_told_by_shape_and_called_a_guess():
    found = focgen.init({"a": TIME, "b": ANSWER, "c": HELD})
    assert (found.rig.signals.time, found.rig.signals.command, found.rig.signals.output) == ("a", "c", "b")
    assert {doubt.split(":")[0] for doubt in found.doubts if "guess" in doubt} == {"command", "output"}
    assert "# into the regulator (a guess)" in found.text


def test_rivals_for_a_role_are_named_and_the_rest_is_said_to_have_none():
    found = proposed(("t_s", "u1_V", "p1_bar", "y_mm"), u2_V=HELD[::-1], count=np.arange(400.0) % 7)
    assert any("command" in doubt and "'u2_V'" in doubt for doubt in found.doubts)
    assert any(doubt.startswith("no role") and "'count'" in doubt for doubt in found.doubts)


def test_a_camera_and_a_reference():
    more = {"kappa_cam_per_mm": ANSWER * 1.01, "ref_per_mm": HELD * 1e-3}
    found = proposed(("t_s", "u_V", "p_bar", "kappa_per_mm"), **more).rig.signals
    assert (found.curvature, found.reference, found.output) == (
        "kappa_cam_per_mm",
        "ref_per_mm",
        "kappa_per_mm",
    )


def test_runs_that_have_a_column():
    """The run's column has no other role, and the file names it."""
    two = [np.concatenate([x, x]) for x in (TIME, HELD, PRESSURE, ANSWER)]
    labels = np.repeat(["load", "release"], len(TIME))
    found = focgen.init(dict(zip(("t_s", "u_V", "p_bar", "y_mm"), two)) | {"run": labels})
    assert found.rig.signals.run == "run" and found.rig.sample_time == STEP


@pytest.mark.parametrize(
    "stamps, name, unit, step",
    [
        (1e3 * TIME, "t_ms", "ms", STEP),
        (np.round(1e3 * TIME), "clock", "ms", STEP),
        (np.round(np.arange(400) / 256, 4), "t_s", None, 1 / 256),
        (TIME / 3600.0, "Time [h]", "h", STEP),
        (TIME / 60.0, "t_min", "min", STEP),
        (TIME / 60.0, "elapsed (Min)", "min", STEP),
        (1e6 * TIME, "t_us", "us", STEP),
        (1e9 * TIME, "time ns", "ns", STEP),
        (1e3 * TIME, "msec", "msec", STEP),
        (TIME / 86400.0, "Zeit_days", "days", STEP),
        (TIME + 1e-4 * np.random.default_rng(1).uniform(-1, 1, 400), "t", None, STEP),
    ],
)
def test_the_clock(stamps, name, unit, step):
    found = focgen.init({name: stamps, "u_V": HELD, "y_mm": ANSWER}).rig
    assert found.sample_time == pytest.approx(step, rel=1e-12)
    assert (found.signals.scales["time"].unit if found.signals.scales else None) == unit


@pytest.mark.parametrize(
    "name, stamps, said",
    [
        ("Time", 45_000.0 + TIME / 86400.0, "'Time' has no unit, and is taken as seconds, 2.31e-07 between"),
        ("Time [samples]", TIME / STEP, "has the unit 'samples', and is taken as seconds, 1 between"),
        ("t", 1e3 * TIME, "'t' has no unit, and is taken as milliseconds, 20 between"),
        ("t", 1e7 * TIME, "'t' has no unit, and is taken as seconds, 2e[+]05 between"),
    ],
)
def test_a_clock_whose_unit_is_a_guess_is_said_to_be_one(name, stamps, said):
    """Days of a spreadsheet, ticks and counts: a factor of time that identification could never see."""
    doubts = focgen.init({name: stamps, "u_V": HELD, "y_mm": ANSWER}).doubts
    assert re.search(said, doubts[0])
    assert "taken as" not in focgen.init({"t": TIME, "u_V": HELD, "y_mm": ANSWER}).doubts[0]


def test_dates_and_times_of_day_are_no_milliseconds(tmp_path):
    """At one sample a second whole numbers look like a clock in milliseconds."""
    since, seconds = np.datetime64("2026-11-24T12:00:00"), np.arange(400)
    clocks = {
        "dates": [str(since + s) for s in seconds],
        "times": [f"12:{s // 60:02d}:{s % 60:02d}" for s in seconds],
        "instants": since + seconds.astype("timedelta64[s]"),
        "spans": seconds.astype("timedelta64[s]"),
    }
    for clock in clocks.values():
        found = focgen.init({"when": clock, "u_V": HELD, "y_mm": ANSWER})
        assert found.rig.sample_time == 1.0 and "taken as" not in found.text
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    table = pandas.DataFrame({"when": clocks["instants"], "u_V": HELD, "y_mm": ANSWER})
    table.to_parquet(tmp_path / "log.parquet")
    found = focgen.init(tmp_path / "log.parquet")
    assert found.rig.sample_time == 1.0 and "taken as" not in found.text


def test_time_has_a_unit_of_time():
    """A counter of samples rises as well, and so does a position that creeps."""
    log = {"Sample": np.arange(400), "x (mm)": 1.0 + TIME, "Elapsed (s)": TIME, "u_V": HELD, "y_mm": ANSWER}
    assert focgen.init(log).rig.signals.time == "Elapsed (s)"
    del log["Elapsed (s)"], log["Sample"]
    with pytest.raises(LogError, match="no column that increases with time"):
        focgen.init(log)


def test_the_reason_of_a_column_that_is_left_out_is_in_the_error():
    odd = ["OL" if k == 7 else float(y) for k, y in enumerate(ANSWER)]
    with pytest.raises(LogError, match=r"no two columns that move.*\('y' holds 'OL' in row 7"):
        focgen.init({"t": TIME, "u_V": HELD, "y": odd})


def test_columns_that_are_left_out_are_named():
    """One word among numbers takes a column away; another one would become the output."""
    odd = ["OL" if k == 7 else float(y) for k, y in enumerate(ANSWER)]
    log = {"t": TIME, "u_V": HELD, "p_bar": PRESSURE, "angle": odd, "empty": np.full(400, np.nan)}
    found = focgen.init(log)
    assert "left out: 'angle' holds 'OL' in row 7, which is no number" in found.doubts
    assert "left out: 'empty' has no reading" in found.doubts
    log = log | {"angle": ANSWER}
    two = focgen.init([log, {key: column for key, column in log.items() if key != "p_bar"}])
    assert "left out: 'p_bar' log 2 has no such column" in two.doubts


def test_ranges_hold_what_was_seen_and_begin_at_0_where_signals_do():
    found = proposed(("t_s", "u_V", "p_bar", "kappa_per_mm")).rig.ranges
    assert found.command == (0.0, 4.0) and found.pressure == (0.0, 0.25)
    both = focgen.init({"t": TIME, "u_V": HELD - 2.0, "y_mm": ANSWER}).rig.ranges
    assert both.command == (-2.0, 2.0)


@pytest.mark.parametrize(
    "columns, message",
    [
        ({"u_V": HELD, "y": ANSWER[::-1]}, "no column that increases"),
        ({"t": TIME, "y": ANSWER}, "no two columns that move"),
        ({"t": TIME, "u": np.ones(400), "y": ANSWER}, "no two columns that move"),
        ({"t": TIME, "word": ["a"] * 400}, "no two columns|no column"),
    ],
)
def test_logs_that_are_none_are_refused(columns, message):
    with pytest.raises(LogError, match=message):
        focgen.init(columns)


def test_names_from_strangers_stay_names(tmp_path):
    """Quotes, brackets and lines in a column's name neither leave their string nor a comment."""
    odd = 'y"]\n[actuator]\nT = 1 # °'
    found = focgen.init({"t": TIME, "u_V": HELD, odd: ANSWER, "x\n[sensor]\nnum = 3": HELD[::-1] + ANSWER})
    assert set(tomllib.loads(found.text)) <= {"name", "sample_time", "signals", "units", "ranges"}
    assert (
        odd in (found.rig.signals.output, found.rig.signals.command) or odd.replace("\n", " ") in found.text
    )


@pytest.mark.parametrize("name", ["a; id $(id) `id`.csv", "two words.csv", "it's.csv"])
def test_the_next_command_names_the_log_to_a_shell(tmp_path, name):
    """A log from a stranger is called as he likes: pasted, its name ran."""
    path = tmp_path / name
    rows = [f"{t},{u},{y}" for t, u, y in zip(TIME, HELD, ANSWER)]
    path.write_text("\n".join(["t_s,u_V,y", *rows]))
    words = shlex.split(focgen.init(path, tmp_path / "a $(id).toml").next)
    assert words[2] == str(path) and words[4] == str(tmp_path / "a $(id).toml")


def test_the_command_writes_a_rig_that_identify_takes(tmp_path, capsys):
    log = str(shipped("examples") / "logs" / "steps.csv")
    out = tmp_path / "rig.toml"
    assert main(["init", log, "--out", str(out), "--json"]) == 0
    told = json.load(io.StringIO(capsys.readouterr().out))
    given = read_rig(shipped("examples") / "rig.toml")
    assert read_rig(out).signals.columns() == {
        k: v for k, v in given.signals.columns().items() if k != "reference"
    }
    assert told["rig"]["signals"]["run"] == "run" and told["doubts"] and f"--rig {out}" in told["next"]
    words = [*told["next"].split()[1:-1], str(tmp_path / "identified.toml"), "--no-integer", "--to", "10"]
    assert main(words) == 0 and read_rig(tmp_path / "identified.toml").actuator.T > 0
    assert main(["init", log, "--out", log]) == 2 and Path(log).stat().st_size > 1000


def test_on_a_terminal_it_asks(tmp_path, monkeypatch, capsys):
    """An answer that is no column is asked again; - is none, Enter the likely one."""
    import sys

    np.savetxt(
        tmp_path / "log.csv",
        np.stack([TIME, HELD, ANSWER, PRESSURE], 1),
        delimiter=",",
        header="t,a,b,c",
        comments="",
    )
    answers = io.StringIO("q\nc\nb\n\n")
    answers.isatty = lambda: True
    monkeypatch.setattr(sys, "stdin", answers)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    assert main(["init", str(tmp_path / "log.csv"), "--out", str(tmp_path / "rig.toml")]) == 0
    signals = read_rig(tmp_path / "rig.toml").signals
    assert (signals.command, signals.output) == ("c", "b")


def test_a_log_of_one_row_is_refused_in_a_line_and_no_warning_beside(tmp_path):
    (tmp_path / "log.csv").write_text("run,t_s,u_V,y\na,0.0,1.0,0.5\n")
    with pytest.raises(LogError, match="no column that increases with time"):
        focgen.init(tmp_path / "log.csv")


@pytest.mark.parametrize(
    "name, roles",
    [
        ("spba_pump_two_chamber_steps", ("u1_V", "p1_kPa", "angle_deg")),
        ("spba_pump_pressure_steps", ("u_V", None, "p_kPa")),
        ("hair_dryer_delay", ("u_V", None, "y_V")),
        ("coupled_electric_drives", ("u_V", None, "y_speed")),
        ("emps_train", ("u_V", None, "q_m")),
    ],
)
def test_measured_logs(open_data, name, roles):
    found = focgen.init(open_data / f"{name}.csv").rig.signals
    assert (found.command, found.pressure, found.output) == roles


@pytest.mark.parametrize(
    "rows, told",
    [
        (lambda rows: [*rows[:50], rows[51], rows[50], *rows[52:]], "time has to increase"),
        (lambda rows: rows[:2], "at least 8"),
    ],
)
def test_a_log_that_other_commands_refuse_is_doubted(tmp_path, capsys, rows, told):
    lines = [f"{t:.2f},{u},{p:.6f},{y:.6f}" for t, u, p, y in zip(TIME, HELD, PRESSURE, ANSWER)]
    log, out = tmp_path / "log.csv", tmp_path / "rig.toml"
    log.write_text("\n".join(["t_s,u_V,p_bar,kappa_per_mm", *rows(lines)]) + "\n")
    assert main(["init", str(log), "--out", str(out), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert told in said["doubts"][0] and said["text"] == out.read_text()
    assert any(line.startswith("# unsure: the logs: ") and told in line for line in said["text"].splitlines())
    assert main(["replay", str(out), str(log)]) == 2 and told in capsys.readouterr().err


def test_a_log_that_can_be_used_has_no_such_doubt(tmp_path, capsys):
    np.savetxt(tmp_path / "log.csv", np.column_stack([TIME, HELD, PRESSURE, ANSWER]), delimiter=",",
               header="t_s,u_V,p_bar,kappa_per_mm", comments="")  # fmt: skip
    assert main(["init", str(tmp_path / "log.csv"), "--json"]) == 0
    assert not [d for d in json.loads(capsys.readouterr().out)["doubts"] if d.startswith("the logs")]
