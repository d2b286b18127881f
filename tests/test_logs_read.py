"""Logs: every kind of file gives the same experiments, and every fault is named with its place and remedy."""

import gzip

import numpy as np
import pytest

from focgen.errors import LogError
from focgen.logs import read_logs
from focgen.rig.model import Signals

SIGNALS = Signals("t_s", "y", command="u", pressure="p", curvature="kappa", reference="ref", run="run")
STEP = 0.01


def columns(count=40, begin=0.0) -> dict[str, np.ndarray]:
    time = begin + STEP * np.arange(count)
    return {"t_s": time, "u": 1.0 * (time >= begin + 0.1), "p": np.sqrt(np.arange(count)), "kappa": np.sin(time),
            "y": np.cos(time)}


def text(table: dict, separator=",") -> str:
    rows = zip(*(column if isinstance(column, list) else [repr(float(c)) for c in column] for column in table.values()))
    return "\n".join([separator.join(table), *(separator.join(row) for row in rows)]) + "\n"


def csv_file(path, table):
    path.write_text(table if isinstance(table, str) else text(table), encoding="utf-8")
    return path


def read(path, **options):
    return read_logs(path if isinstance(path, list) else [path], options.pop("signals", SIGNALS), STEP, **options)


def write_gz(path, table):
    path.write_bytes(gzip.compress(text(table).encode()))


def write_parquet(path, table):
    pyarrow = pytest.importorskip("pyarrow")
    import pyarrow.parquet

    pyarrow.parquet.write_table(pyarrow.table(table), path)


def write_mat(path, table):
    from scipy.io import savemat

    savemat(path, {name: column[:, None] for name, column in table.items()})


def write_mat_structure(path, table):
    from scipy.io import savemat

    savemat(path, {"rate": 100.0, "log": dict(table)})


def write_tdms(path, table):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject("log", name, column) for name, column in table.items()])


WRITERS = {".csv": csv_file, ".csv.gz": write_gz, ".parquet": write_parquet, ".mat": write_mat,
           "-structure.mat": write_mat_structure, ".tdms": write_tdms}


@pytest.mark.parametrize("ending", WRITERS)
def test_every_kind_of_file_gives_the_same_experiment(tmp_path, ending):
    table, path = columns(), tmp_path / f"log{ending}"
    WRITERS[ending](path, table)
    (experiment,) = read(path)
    assert experiment.name == path.name.removesuffix(".gz").rpartition(".")[0] and experiment.sample_time == STEP
    roles = {"command": "u", "pressure": "p", "curvature": "kappa", "output": "y"}
    assert set(experiment.signals) == set(roles)
    for role, name in roles.items():
        assert np.array_equal(experiment[role], table[name])
    assert np.array_equal(experiment.raw_time, table["t_s"])


@pytest.mark.parametrize("ending", WRITERS)
def test_a_damaged_or_missing_file_is_refused(tmp_path, ending):
    path = tmp_path / f"log{ending}"
    with pytest.raises(LogError, match="cannot be read"):
        read(path)
    path.write_bytes(b"\x00\xff\xfenot what it says\n\x81" * 9)
    with pytest.raises(LogError):
        read(path)
    path.write_bytes(b"")
    with pytest.raises(LogError):
        read(path)


def test_time_stamps_of_a_clock_become_seconds(tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    import pyarrow.parquet

    table = columns()
    stamps = np.datetime64("2026-03-01T12:00:00", "us") + np.round(table["t_s"] * 1e6).astype("timedelta64[us]")
    pyarrow.parquet.write_table(pyarrow.table({**table, "t_s": stamps}), tmp_path / "log.parquet")
    (experiment,) = read(tmp_path / "log.parquet")
    assert experiment.sample_time == STEP and not experiment.notes


def runs(*named) -> dict:
    """Runs one after the other; ``named``: (name, columns)."""
    table = {"run": [name for name, part in named for _ in part["t_s"]]}
    return table | {key: np.concatenate([part[key] for _, part in named]) for key in named[0][1]}


def test_runs_keep_the_order_of_the_file_where_each_starts_at_0(tmp_path):
    path = csv_file(tmp_path / "log.csv", runs(("b", columns()), ("a", columns(30)), ("c", columns())))
    found = read(path)
    assert [e.name for e in found] == ["b", "a", "c"] and [len(e) for e in found] == [40, 30, 40]
    assert [e.start for e in found] == pytest.approx([0.0, 0.4, 0.7])


def test_a_session_is_ordered_by_its_clock(tmp_path):
    late, early = (csv_file(tmp_path / f"{name}.csv", columns(begin=begin)) for name, begin in (("a", 500.0), ("b", 20.0)))
    found = read([late, early])
    assert [e.name for e in found] == ["b", "a"] and [e.start for e in found] == pytest.approx([20.0, 500.0])


def test_like_names_are_told_apart_by_their_files(tmp_path):
    (tmp_path / "x").mkdir()
    paths = [csv_file(tmp_path / name, runs(("1", columns()))) for name in ("a.csv", "b.csv", "x/a.csv")]
    assert [e.name for e in read(paths[:2])] == ["a/1", "b/1"]
    assert len({e.name for e in read(paths)}) == 3
    with pytest.raises(LogError, match="given twice"):
        read([paths[0], paths[0]])


def test_an_empty_column_means_absent_in_that_run_only(tmp_path):
    table = runs(("1", columns()), ("2", columns()))
    table["kappa"] = [""] * 40 + [repr(float(v)) for v in table["kappa"][40:]]
    first, second = read(csv_file(tmp_path / "log.csv", table))
    assert "curvature" not in first and "curvature" in second


def test_signals_that_a_log_lacks_are_said(tmp_path):
    table = columns()
    table["Kappa"] = table.pop("kappa")
    (experiment,) = read(csv_file(tmp_path / "log.csv", table))
    assert "curvature" not in experiment
    assert experiment.notes == ("no column 'kappa': curvature taken as not logged (is it 'Kappa'?)",)


def test_a_window_is_time_within_each_experiment(tmp_path):
    path = csv_file(tmp_path / "log.csv", runs(("1", columns(begin=7.0)), ("2", columns(begin=9.0))))
    for experiment, begin in zip(read(path, first=0.05, last=0.2), (7.05, 9.05)):
        assert len(experiment) == 16 and experiment.start == pytest.approx(begin)
        assert experiment.raw_time[[0, -1]] == pytest.approx([begin, begin + 0.15])


def test_a_gap_outside_the_window_does_no_harm(tmp_path):
    table = columns()
    table["y"][35:] = np.nan
    path = csv_file(tmp_path / "log.csv", text(table).replace("nan", ""))
    assert len(read(path, last=0.3)[0]) == 31
    with pytest.raises(LogError, match="output is empty.* in line 37 and 4 more"):
        read(path)


def test_uniform_logs_keep_their_rate(tmp_path):
    table = columns()
    table["t_s"] = np.round(table["t_s"] * 4.0, 3)
    (experiment,) = read(csv_file(tmp_path / "log.csv", table))
    assert experiment.sample_time == pytest.approx(0.04) and "kept so" in experiment.notes[0]
    assert np.array_equal(experiment["output"], table["y"])


@pytest.mark.parametrize("seed", range(5))
def test_jittered_logs_are_resampled(tmp_path, seed):
    """Between the stamps signals are linear, commands held: a line stays a line, a staircase has no new values."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.2, 1.8, 300) * STEP)
    table = {"t_s": time, "u": np.floor(time * 4.0), "p": 2.0 + 3.0 * time, "y": -time}
    (experiment,) = read(csv_file(tmp_path / "log.csv", table))
    assert experiment.sample_time == STEP and any("resampled every 0.01 s" in note for note in experiment.notes)
    instants = time[0] + experiment.time
    assert experiment["pressure"] == pytest.approx(2.0 + 3.0 * instants) and experiment["output"] == pytest.approx(-instants)
    last = np.searchsorted(time, instants + 1e-12, side="right") - 1
    assert np.array_equal(experiment["command"], table["u"][last])
    assert np.array_equal(experiment.raw_time, time)


def faulty(change) -> str:
    return change(text(columns()))


def line_changed(number, cells):
    def change(whole):
        lines = whole.split("\n")
        lines[number - 1] = cells(lines[number - 1].split(","))
        return "\n".join(lines)

    return change


FAULTS = {
    "empty": (lambda w: "", "is empty"),
    "header only": (lambda w: w.split("\n")[0], "no samples"),
    "one sample": (lambda w: "\n".join(w.split("\n")[:2]), "has 1 samples"),
    "no header": (lambda w: w.partition("\n")[2], "instead of a header"),
    "semicolons": (lambda w: w.replace(",", ";"), "separates its columns by ';'"),
    "tabs": (lambda w: w.replace(",", "\t"), "separates its columns by tabs"),
    "decimal commas": (line_changed(5, lambda c: ",".join(v.replace(".", ",") for v in c)), "line 5 has 10 cells"),
    "quoted decimal comma": (line_changed(5, lambda c: ",".join([c[0], '"0,5"', *c[2:]])), "decimals with a point"),
    "cut off": (lambda w: w[:-30], "cells, the header 5"),
    "units below the header": (line_changed(2, lambda c: "s,V,bar,1/mm,1/mm"), "'V' in line 2"),
    "thousands": (line_changed(3, lambda c: ",".join(["1_0", *c[1:]])), "'1_0' in line 3"),
    "infinite": (line_changed(9, lambda c: ",".join([*c[:4], "inf"])), "infinite in line 9"),
    "no stamp": (line_changed(9, lambda c: ",".join(["", *c[1:]])), "no time stamp in line 9"),
    "time stands": (line_changed(9, lambda c: ",".join(["0.06", *c[1:]])), "line 9: time has to increase"),
    "gap": (line_changed(9, lambda c: ",".join([*c[:4], "nan"])), "output is empty or not a number in line 9"),
    "doubled column": (lambda w: w.replace("kappa", "y", 1), "'y' twice"),
    "misspelt output": (lambda w: w.replace(",y\n", ",yy\n", 1), r"no column 'y' \(output\), there are: t_s, u, p, kappa, yy"),
    "no input": (lambda w: w.replace("u,p,", "a,b,", 1), r"no column 'u' \(command\)"),
    "no time": (lambda w: w.replace("t_s", "T_s", 1), "write time = 'T_s'"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_named(tmp_path, fault):
    change, what = FAULTS[fault]
    path = csv_file(tmp_path / "log.csv", faulty(change))
    with pytest.raises(LogError, match=what) as caught:
        read(path)
    assert str(caught.value).startswith(str(path)) and caught.value.remedy and "\n" not in str(caught.value)


def test_text_in_another_encoding_is_refused(tmp_path):
    (tmp_path / "log.csv").write_bytes(text(columns()).replace("kappa", "κ").encode("iso-8859-7"))
    with pytest.raises(LogError, match=r"not UTF-8 text \(line 1\)"):
        read(tmp_path / "log.csv")


def test_a_byte_order_mark_and_windows_lines_are_fine(tmp_path):
    (tmp_path / "log.csv").write_bytes(b"\xef\xbb\xbf" + text(columns()).replace("\n", "\r\n").encode() + b"\r\n")
    assert len(read(tmp_path / "log.csv")[0]) == 40


@pytest.mark.parametrize("factor, hint", [(1e3, "milliseconds"), (1e6, "microseconds"), (1e-3, "seconds")])
def test_time_in_another_unit_is_refused(tmp_path, factor, hint):
    table = columns()
    table["t_s"] = table["t_s"] * factor
    with pytest.raises(LogError, match=hint):
        read(csv_file(tmp_path / "log.csv", table))


@pytest.mark.parametrize("factor", [100.0, 1e-3])
def test_signals_in_another_unit_are_refused(tmp_path, factor):
    table = columns()
    path = csv_file(tmp_path / "log.csv", {**table, "p": table["p"] * factor})
    limits = {"pressure": (0.0, 8.0), "output": (-1.0, 1.0)}
    with pytest.raises(LogError, match="pressure reaches .* range is 0 to 8"):
        read(path, limits=limits)
    assert read(csv_file(path, table), limits=limits)


def test_an_unknown_kind_of_file_is_refused(tmp_path):
    with pytest.raises(LogError, match="give one of .csv"):
        read(tmp_path / "log.xlsx")
    with pytest.raises(LogError, match="at least one"):
        read([])


def test_vectors_of_different_lengths_are_refused(tmp_path):
    from scipy.io import savemat

    savemat(tmp_path / "log.mat", {**columns(), "y": np.zeros(7)})
    with pytest.raises(LogError, match="y 7"):
        read(tmp_path / "log.mat")
