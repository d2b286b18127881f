"""Logs of every kind: what is read, in which order, on which clock, and how malformed ones are refused.

Red when an experiment gets other samples, another clock or another name, or a malformed file is taken.
"""

import gzip

import numpy as np
import pytest

from focgen.cli.main import main
from focgen.errors import LogError
from focgen.logs import read_logs
from focgen.logs.clock import on_grid
from focgen.rig.files import write_rig
from focgen.rig.rig import Signals
from tests.conftest import paper_rig

STEP, COUNT = 0.01, 60
SIGNALS = Signals("t_s", "kappa_per_mm", "u_V", "p_bar", "kappa_cam_per_mm", "ref_per_mm", "run")
LIMITS = {"command": (0.0, 10.0), "pressure": (0.0, 0.25), "output": (0.0, 0.02)}


def table(count=COUNT, **changes) -> dict[str, np.ndarray]:
    """Columns of a log: a step of pressure at 0.1 s."""
    time = STEP * np.arange(count)
    up = time >= 0.1
    columns = {
        "t_s": time,
        "u_V": 1.5 * up,
        "p_bar": 0.15 * up,
        "kappa_cam_per_mm": 0.008 * up * time,
        "kappa_per_mm": 0.0079 * up * time,
    }
    return {**columns, **changes}


def csv_text(columns) -> str:
    rows = zip(*columns.values())
    cells = (
        ",".join(str(cell) if isinstance(cell, str) else repr(float(cell)) for cell in row) for row in rows
    )
    return "\n".join([",".join(columns), *cells]) + "\n"


def write_csv(path, columns):
    path.write_text(csv_text(columns))


def write_csv_gz(path, columns):
    path.write_bytes(gzip.compress(csv_text(columns).encode()))


def write_parquet(path, columns):
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    parquet.write_table(pyarrow.table({k: np.asarray(v) for k, v in columns.items()}), path)


def write_mat(path, columns):
    from scipy.io import savemat

    savemat(path, {"log": {k: np.asarray(v) for k, v in columns.items()}, "gain": 3.0})


def write_tdms(path, columns):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(str(path)) as writer:
        writer.write_segment([nptdms.ChannelObject("log", k, np.asarray(v)) for k, v in columns.items()])


WRITERS = {
    "csv": write_csv,
    "csv.gz": write_csv_gz,
    "parquet": write_parquet,
    "mat": write_mat,
    "tdms": write_tdms,
    "CSV": write_csv,
}


def read(*paths, signals=SIGNALS, sample_time=STEP, **options):
    return read_logs(paths, signals, sample_time, **options)


def read_columns(tmp_path, columns, **options):
    path = tmp_path / "log.csv"
    write_csv(path, columns)
    return read(path, **options)


@pytest.mark.parametrize("kind", WRITERS)
def test_every_kind_carries_the_same_numbers(tmp_path, kind):
    path = tmp_path / f"steps.{kind}"
    WRITERS[kind](path, table())
    (log,) = read(path, limits=LIMITS)
    assert log.name == "steps" and log.sample_time == STEP and len(log) == COUNT
    for role, column in SIGNALS.columns().items():
        if role != "reference":
            assert np.array_equal(log[role], table()[column])
    assert "reference" not in log


@pytest.mark.parametrize("kind", WRITERS)
def test_runs_are_experiments_in_the_order_of_their_times(tmp_path, kind):
    """The second run was logged first; numbers serve as names of runs as well as words."""
    both = {name: np.concatenate([column, 2.0 * column]) for name, column in table().items()}
    both["t_s"] = np.concatenate([table()["t_s"] + 500.0, table()["t_s"]])
    both["run"] = np.repeat([7.0, 12.0], COUNT)
    path = tmp_path / f"steps.{kind}"
    WRITERS[kind](path, both)
    logs = read(path)
    assert [log.name.removesuffix(".0") for log in logs] == ["12", "7"]
    assert [log.start for log in logs] == [0.0, 500.0]
    assert logs[0]["pressure"].max() == 0.3 and logs[1]["pressure"].max() == 0.15


def test_words_name_runs_that_are_interleaved(tmp_path):
    columns = table(t_s=STEP * (np.arange(COUNT) // 2), run=["up", "down"] * (COUNT // 2))
    logs = read_columns(tmp_path, columns)
    assert [log.name for log in logs] == ["up", "down"] and all(len(log) == COUNT // 2 for log in logs)
    assert np.array_equal(logs[1]["pressure"], table()["p_bar"][1::2])


def test_files_that_start_at_0_keep_the_order_given(tmp_path):
    for name in ("b", "a"):
        write_csv(tmp_path / f"{name}.csv", table())
    logs = read(tmp_path / "b.csv", tmp_path / "a.csv")
    assert [log.name for log in logs] == ["b", "a"]
    assert logs[0].start == 0.0 and logs[1].start == pytest.approx(COUNT * STEP)


def test_names_that_repeat_are_told_apart(tmp_path):
    for folder in ("x", "y"):
        (tmp_path / folder).mkdir()
        write_csv(tmp_path / folder / "log.csv", table())
    names = [log.name for log in read(tmp_path / "x" / "log.csv", tmp_path / "y" / "log.csv")]
    assert len(set(names)) == 2
    with pytest.raises(LogError, match="twice"):
        read(tmp_path / "x" / "log.csv", tmp_path / "x" / "log.csv")


def test_time_stamps_with_jitter_are_resampled_and_said(tmp_path):
    """A ramp survives linear interpolation exactly; a held command keeps its two values, and in the sample
    that it steps in the mean of them, for as long as it was either."""
    time = STEP * (np.arange(COUNT) + np.random.default_rng(3).uniform(-0.4, 0.4, COUNT))
    ramp = 0.3 * time
    (log,) = read_columns(tmp_path, table(t_s=time, kappa_per_mm=ramp))
    assert any("not uniform" in note and "resampled every 0.01 s" in note for note in log.notes)
    assert log["output"] == pytest.approx(0.3 * (time[0] + log.time), abs=1e-12)
    between = log["command"][(log["command"] != 0.0) & (log["command"] != 1.5)]
    assert len(between) == 1 and 0.0 < between[0] < 1.5 and log.sample_time == STEP
    assert np.array_equal(log.raw_time, time)
    applied = STEP * np.sum(log["command"])
    assert applied == pytest.approx(1.5 * (time[0] + STEP * len(log) - time[10]))


@pytest.mark.parametrize("level", [0.3, 1e6])
def test_a_command_that_stands_still_stays_what_it_was(level):
    """Whatever sums of it are rounded to."""
    time = STEP * (np.arange(3000) + np.random.default_rng(3).uniform(-0.4, 0.4, 3000))
    commands = {"command": np.full(3000, level)}, {"command": np.where(time < 10.0, level, level + 1.0)}
    for signals, levels in zip(commands, (1, 3)):
        _, found, _ = on_grid(time, signals, STEP, "log")
        assert len(set(found["command"])) == levels and set(signals["command"]) <= set(found["command"])


def test_rounded_time_stamps_are_uniform(tmp_path):
    (log,) = read_columns(tmp_path, table(t_s=np.round(STEP * np.arange(COUNT), 2)))
    assert log.notes == ()
    assert np.array_equal(log["output"], table()["kappa_per_mm"])


def test_another_rate_is_kept_and_said(tmp_path):
    (log,) = read_columns(tmp_path, table(), sample_time=0.004)
    assert log.sample_time == STEP and any("0.01 s" in note and "0.004 s" in note for note in log.notes)


@pytest.mark.parametrize("kind", ["csv", "parquet", "mat"])
def test_a_column_empty_in_a_run_is_absent_there(tmp_path, kind):
    both = {name: np.tile(column, 2) for name, column in table().items()}
    both["run"] = np.repeat([1.0, 2.0], COUNT)
    both["p_bar"] = np.concatenate([table()["p_bar"], np.full(COUNT, np.nan)])
    path = tmp_path / f"log.{kind}"
    WRITERS[kind](path, both)
    first, second = read(path)
    assert "pressure" in first and "pressure" not in second and "command" in second


def test_empty_cells_of_csv_are_absent_too(tmp_path):
    (log,) = read_columns(tmp_path, table(kappa_cam_per_mm=[""] * COUNT))
    assert "curvature" not in log and "output" in log


def test_a_column_that_is_not_there_is_said(tmp_path):
    columns = table()
    columns["kappa_cam"] = columns.pop("kappa_cam_per_mm")
    (log,) = read_columns(tmp_path, columns)
    assert "curvature" not in log
    assert any("kappa_cam_per_mm" in note and "is it 'kappa_cam'" in note for note in log.notes)


def test_from_and_to_cut_each_experiment(tmp_path):
    """Both ends included, in the experiment's own time; what lies outside may be damaged."""
    damaged = table(t_s=table()["t_s"] + 100.0)
    damaged["p_bar"][:5] = np.nan
    (log,) = read_columns(tmp_path, damaged, first=0.1, last=0.4)
    assert len(log) == 31 and log.start == pytest.approx(100.1)
    assert np.array_equal(log["output"], table()["kappa_per_mm"][10:41])


def _text(edit):
    return lambda path: path.write_text(edit(csv_text(table())))


def _table(**changes):
    return lambda path: write_csv(path, table(**changes))


def _with(column, row, value):
    cells = list(table()[column])
    cells[row] = value
    return _table(**{column: cells})


def _without(column, renamed=None):
    def write(path):
        columns = table()
        values = columns.pop(column)
        write_csv(path, {**columns, **({renamed: values} if renamed else {})})

    return write


def _only_output(path):
    write_csv(path, {name: table()[name] for name in ("t_s", "kappa_per_mm", "kappa_cam_per_mm")})


MALFORMED = {
    "infinite": (_with("p_bar", 3, np.inf), "infinite in line 5"),
    "no output": (
        _without("kappa_per_mm", "kappa_permm"),
        "no column 'kappa_per_mm'.*output = 'kappa_permm'",
    ),
    "no time": (_without("t_s", "t_ms"), "no column 't_s'.*time = 't_ms'"),
    "no input": (_only_output, "no column 'u_V'"),
    "one sample": (lambda path: write_csv(path, table(1)), "1 samples"),
    "too few": (lambda path: write_csv(path, table(5)), "5 samples"),
    "no sample": (_text(lambda text: text.splitlines()[0] + "\n"), "no samples"),
    "time back": (_with("t_s", 20, 0.01), "line 22: time has to increase"),
    "time twice": (_with("t_s", 20, 0.19), "line 22: time has to increase"),
    "no time stamp": (_with("t_s", 20, np.nan), "no time stamp in line 22"),
    "milliseconds": (_table(t_s=1e3 * table()["t_s"]), r"milliseconds\?.*give time in seconds"),
    "microseconds": (_table(t_s=1e6 * table()["t_s"]), r"microseconds\?"),
    "words": (_with("p_bar", 8, "low"), "'low' in line 10"),
    "underscore": (_with("p_bar", 8, "0_1"), "'0_1' in line 10"),
    "decimal comma": (_with("p_bar", 8, '"0,15"'), "'0,15' in line 10.*point"),
    "cells missing": (
        _text(lambda text: text[: text.rindex(",")] + "\n"),
        "line 61 has 4 cells, the header 5",
    ),
    "empty file": (_text(lambda text: ""), "is empty"),
    "blank lines": (_text(lambda text: "\n\n"), "is empty"),
    "no header": (_text(lambda text: text.partition("\n")[2]), "instead of a header"),
    "a column twice": (_text(lambda text: text.replace("p_bar", "u_V", 1)), "'u_V' twice"),
    "binary": (lambda path: path.write_bytes(b"t_s,\x00\x00\n" * 9), "log.csv"),
    "in mbar": (_table(p_bar=1e3 * table()["p_bar"]), "pressure reaches 150 .* range is 0 to 0.25"),
    "in m": (_table(kappa_per_mm=1e-3 * table()["kappa_per_mm"]), "output reaches .* range is 0 to 0.02"),
    "constant output": (_table(kappa_cam_per_mm=np.full(COUNT, 0.004)), "0.004 throughout"),
    "rest": (_table(p_bar=np.zeros(COUNT)), "pressure of 0 throughout"),
}


@pytest.fixture
def rig(tmp_path):
    path = tmp_path / "rig.toml"
    write_rig(paper_rig(), path)
    return path


def refusal(log, rig, tmp_path, capsys, *more) -> str:
    """The one line with which ``focgen identify`` refuses a log; nothing may be written."""
    before = set(tmp_path.rglob("*"))
    new = tmp_path / "new"
    argv = [
        "identify",
        str(log),
        "--rig",
        str(rig),
        "--out",
        str(new / "rig.toml"),
        "--report",
        str(new / "pictures"),
    ]
    assert main([*argv, *more]) == 2
    printed = capsys.readouterr()
    lines = [line for line in printed.err.splitlines() if line.startswith("focgen: error: ")]
    assert len(lines) == 1 and printed.err.rstrip().endswith(lines[0]) and "Traceback" not in printed.err
    assert printed.out == "" and set(tmp_path.rglob("*")) == before
    assert lines[0].count("; ") == 1, "where: what; remedy"
    return lines[0]


@pytest.mark.parametrize("fault", MALFORMED)
def test_malformed_logs_are_refused_in_one_line(tmp_path, rig, capsys, fault):
    write, message = MALFORMED[fault]
    write(tmp_path / "log.csv")
    line = refusal(tmp_path / "log.csv", rig, tmp_path, capsys)
    with pytest.raises(LogError, match=message):
        raise LogError(line, "", "")
    if fault not in ("constant output", "rest"):
        with pytest.raises(LogError, match=message):
            read(tmp_path / "log.csv", limits=LIMITS)


@pytest.mark.parametrize(
    "name", ["log.xlsx", "log", "missing.csv", "missing.parquet", "missing.mat", "missing.tdms"]
)
def test_unknown_and_missing_files_are_refused(tmp_path, rig, capsys, name):
    if not name.startswith("missing"):
        write_csv(tmp_path / name, table())
    assert name in refusal(tmp_path / name, rig, tmp_path, capsys)


@pytest.mark.parametrize("name", ["log.csv.gz", "log.parquet", "log.mat", "log.tdms"])
@pytest.mark.parametrize("content", ["empty", pytest.param("text", marks=pytest.mark.long), "cut"])
def test_damaged_files_are_refused(tmp_path, rig, capsys, name, content):
    path = tmp_path / name
    WRITERS[name.partition(".")[2]](path, table())
    whole = path.read_bytes()
    path.write_bytes(
        {"empty": b"", "text": csv_text(table()).encode(), "cut": whole[: len(whole) // 2]}[content]
    )
    assert name in refusal(path, rig, tmp_path, capsys)


def test_vectors_of_different_lengths_are_refused(tmp_path, rig, capsys):
    for kind in ("mat", "tdms"):
        path = tmp_path / f"log.{kind}"
        WRITERS[kind](path, table(p_bar=np.ones(COUNT - 1)))
        assert "different lengths" in refusal(path, rig, tmp_path, capsys)


def test_a_window_outside_the_log_is_refused(tmp_path, rig, capsys):
    write_csv(tmp_path / "log.csv", table())
    line = refusal(tmp_path / "log.csv", rig, tmp_path, capsys, "--from", "30")
    assert "0 samples" in line and "0.59 s" in line
    refusal(tmp_path / "log.csv", rig, tmp_path, capsys, "--from", "0.4", "--to", "0.2")


def test_a_run_without_a_name_is_refused(tmp_path, rig, capsys):
    write_csv(tmp_path / "log.csv", table(run=["a"] * (COUNT - 1) + [""]))
    assert "line 61" in refusal(tmp_path / "log.csv", rig, tmp_path, capsys)
