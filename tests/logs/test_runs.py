"""Runs that the rig names are told apart, or it is said that they are not.

Red when a column of runs by another name, in cells of MATLAB, in an index or beside what cannot be read is
passed over without a word; or when a log of one run is said to have several.
"""

from itertools import pairwise

import numpy as np
import pytest
from scipy.io import savemat

from focgen.errors import LogError
from focgen.logs import read_logs
from focgen.logs.scales import Scale
from focgen.rig.rig import Signals

ROLES = Signals("t", "y", None, "p", curvature="cam", run="run")
COUNT = 60
TIME = 0.05 * np.arange(2 * COUNT)  # one clock that runs on
NAMES = ["0.10"] * COUNT + ["0.20"] * COUNT
LOG = {
    "t": TIME,
    "p": np.repeat([0.0, 0.1, 0.0, 0.2], COUNT // 2),
    "cam": 0.01 * np.sin(TIME),
    "y": 0.01 * np.sin(TIME),
}


def names_and_notes(log, signals=ROLES):
    found = read_logs(log, signals, 0.05)
    return [e.name for e in found], [note for e in found for note in e.notes if "'run'" in note]


def cells(values):
    made = np.empty(len(values), object)
    made[:] = values
    return made


def saved_73(path, log):
    """As MATLAB writes it: cells are references to what lies elsewhere in the file."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in log.items():
            if values.dtype != object:
                file[name] = np.atleast_2d(values)
                continue
            to = np.empty((1, len(values)), h5py.ref_dtype)
            for k, text in enumerate(values):
                each = file.create_dataset(f"#refs#/{name}{k}", data=np.array([[ord(c)] for c in text], "u2"))
                each.attrs["MATLAB_class"] = np.bytes_("char")
                to[0, k] = each.ref
            file.create_dataset(name, data=to, dtype=h5py.ref_dtype)
    head = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    with path.open("r+b") as file:
        file.write(head)


@pytest.mark.parametrize("save", [savemat, saved_73])
def test_names_of_runs_in_cells_of_matlab_are_a_column(tmp_path, save):
    save(tmp_path / "log.mat", LOG | {"run": cells(NAMES)})
    assert names_and_notes(tmp_path / "log.mat") == (["0.10", "0.20"], [])


@pytest.mark.parametrize("numbers", [[1.0] * COUNT + [2.0] * COUNT, [True] * COUNT + [2] * COUNT])
def test_numbers_in_cells_are_a_column_too(tmp_path, numbers):
    savemat(tmp_path / "log.mat", LOG | {"run": cells(numbers)})
    assert names_and_notes(tmp_path / "log.mat") == (["1", "2"], [])


def test_cells_that_name_the_channels_are_none(tmp_path):
    savemat(tmp_path / "log.mat", LOG | {"names": cells(["t", "p", "y"])})
    assert names_and_notes(tmp_path / "log.mat") == (["log"], [])
    savemat(tmp_path / "log.mat", LOG | {"run": cells(["t", "p", "y"])})
    _, notes = names_and_notes(tmp_path / "log.mat")
    assert len(notes) == 1 and "has 3 cells, unlike the vectors" in notes[0]


def test_a_vector_that_is_no_column_is_told_of_where_the_rig_names_it(tmp_path):
    savemat(tmp_path / "log.mat", LOG | {"cam": 1j * LOG["cam"]})
    (log,) = read_logs(tmp_path / "log.mat", ROLES, 0.05)
    assert any("no column 'cam' that can be read, for it is complex" in note for note in log.notes)
    savemat(tmp_path / "log.mat", LOG | {"y": 1j * LOG["cam"]})
    with pytest.raises(LogError, match="no column 'y' .output. that can be read: it is complex; save it as"):
        read_logs(tmp_path / "log.mat", ROLES, 0.05)


@pytest.mark.parametrize("name", ["Run", "RUN", "runs", "run_no", "Versuch", "trial"])
@pytest.mark.parametrize("values", [NAMES, [1] * COUNT + [2] * COUNT])
def test_runs_by_another_name_are_told_of(name, values):
    runs, notes = names_and_notes(LOG | {name: values})
    assert runs == ["log"] and notes == [f"no column 'run': no runs are told apart (is it {name!r}?)"]


ONE_RUN = {
    "nothing else": {},
    "one name in all rows": {"Run": ["7"] * (2 * COUNT)},
    "another time": {"runtime": TIME},
    "a count": {"run_s": TIME},
    "a reading that is held": {"test_voltage_V": [1.0] * COUNT + [2.0] * COUNT},
    "a state": {"status": ["idle"] * COUNT + ["step"] * COUNT},
    "names that are not held": {"Run": ["a", "b"] * COUNT},
    "some without a name": {"Run": [*NAMES[:-1], ""]},
}


@pytest.mark.parametrize("further", ONE_RUN.values(), ids=ONE_RUN)
def test_of_one_run_nothing_is_said(further):
    assert names_and_notes(LOG | further) == (["log"], [])


def test_a_level_of_an_index_of_pandas_is_a_column():
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(LOG)
    runs = {"0.10": frame[:COUNT], "0.20": frame[COUNT:]}
    assert names_and_notes(pandas.concat(runs, names=["run", None])) == (["0.10", "0.20"], [])
    both = frame.assign(run=NAMES).set_index(["run", "t"])
    assert names_and_notes(both)[0] == ["0.10", "0.20"]
    dated = frame.assign(run=NAMES, t=pandas.Timestamp("2026-01-31") + pandas.to_timedelta(TIME, unit="s"))
    minutes = Signals("t", "y", None, "p", run="run", scales={"time": Scale(unit="min")})
    first, second = read_logs(dated.set_index(["run", "t"]), minutes, 0.05)
    assert second.start - first.start == COUNT * 0.05 and "not in min" in " ".join(first.notes)


def test_comments_of_labview_are_told_of_where_the_rig_takes_them_for_runs(tmp_path):
    head = ["LabVIEW Measurement", "Separator\tTab", "X_Columns\tOne", "***End_of_Header***", ""]
    head += ["Channels\t2", "***End_of_Header***", "X_Value\tp\ty\tComment"]
    rows = [f"{t:.2f}\t{p}\t{y:.6f}\t{run}" for t, p, y, run in zip(TIME, LOG["p"], LOG["y"], NAMES)]
    (tmp_path / "log.lvm").write_text("\n".join([*head, *rows]), encoding="utf-8")
    (log,) = read_logs(tmp_path / "log.lvm", Signals("X_Value", "y", None, "p", run="Comment"), 0.05)
    assert any("'Comment' that can be read, for it holds LabVIEW's words" in note for note in log.notes)
    assert all(b > a for a, b in pairwise(log.time))


def unnamed(pandas, labels, ways):
    """A log with labels in an index that has no name, as it is and as it is kept."""
    one = pandas.DataFrame(LOG).set_index(pandas.Index(labels))
    frames = {
        "one": one,
        "two": one.set_index(np.arange(2 * COUNT) % COUNT, append=True),
        "reset": one.set_index(np.arange(2 * COUNT) % COUNT, append=True).reset_index(),
        "reset one": one.reset_index(),
    }
    return frames[ways]


@pytest.mark.parametrize(
    "ways, where",
    [
        ("one", "its index"),
        ("two", "level 0 of its index"),
        ("reset", "the column 'level_0'"),
        ("reset one", "the column 'index'"),
    ],
)
@pytest.mark.parametrize("labels", [NAMES, [1] * COUNT + [2] * COUNT, ["a"] * COUNT + ["b"] * COUNT])
def test_runs_in_an_index_without_a_name_are_told_of(ways, where, labels):
    """As ``pandas.concat({name: frame})`` leaves them."""
    pandas = pytest.importorskip("pandas")
    runs, notes = names_and_notes(unnamed(pandas, labels, ways))
    said = f"no runs are told apart, and {where} tells 2 parts apart: name it 'run' where these are the runs"
    assert runs == ["log"] and notes == [f"no column 'run': {said}"]
    plain = Signals("t", "y", None, "p")
    assert not any("apart" in note for note in read_logs(unnamed(pandas, labels, ways), plain, 0.05)[0].notes)


@pytest.mark.parametrize("ending, where", [("csv", "column 1"), ("parquet", "__index_level_0__")])
def test_runs_that_were_saved_without_a_name_are_told_of(tmp_path, ending, where):
    pandas = pytest.importorskip("pandas")
    path = tmp_path / f"log.{ending}"
    getattr(unnamed(pandas, NAMES, "two"), f"to_{ending}")(path)
    runs, notes = names_and_notes(path)
    assert runs == ["log"] and f"the column {where!r} tells 2 parts apart" in notes[0]


NO_RUNS = {
    "a count": np.arange(5, 5 + 2 * COUNT),
    "a count that begins anew": np.arange(2 * COUNT) % COUNT,
    "one name": ["7"] * (2 * COUNT),
    "the time in whole seconds": np.floor(TIME),
    "a state that comes again": ["rest"] * 50 + ["step"] * 20 + ["rest"] * 50,
    "names that are not held": ["a", "b"] * COUNT,
    "some without a name": [*NAMES[:-1], None],
    "the time": TIME,
}


@pytest.mark.parametrize("labels", NO_RUNS.values(), ids=NO_RUNS)
@pytest.mark.parametrize("ways", ["one", "two", "reset", "reset one"])
def test_of_an_index_that_tells_no_runs_nothing_is_said(labels, ways):
    pandas = pytest.importorskip("pandas")
    assert names_and_notes(unnamed(pandas, labels, ways)) == (["log"], [])


def test_of_levels_without_a_name_behind_the_others_nothing_is_said(tmp_path):
    rows = zip(TIME, LOG["p"], LOG["y"], np.repeat([1, 2, 3], 2 * COUNT // 3))
    lines = ["t,p,y,", *(f"{t:.2f},{p},{y:.6f},{v}" for t, p, y, v in rows)]
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert names_and_notes(tmp_path / "log.csv", Signals("t", "y", None, "p", run="run")) == (["log"], [])


BIG = {
    "beyond 2^53": np.repeat([2**53, 2**53 + 1], COUNT),
    "beyond 2^63": np.repeat(np.array([2**63 + 5, 2**63 + 6], np.uint64), COUNT),
    "of one sign": np.repeat([-(2**60), -(2**60) - 1], COUNT),
}


@pytest.mark.parametrize("numbers", BIG.values(), ids=BIG)
def test_runs_by_whole_numbers_that_no_float_has_are_told_apart(tmp_path, numbers):
    names = list(dict.fromkeys(map(str, numbers.tolist())))
    for held in (numbers, numbers.tolist(), numbers.astype(object), [None, *numbers.tolist()[1:]]):
        made = LOG | {"run": held}
        if held[0] is None:
            with pytest.raises(LogError, match="is empty"):
                names_and_notes(made)
        else:
            assert names_and_notes(made) == (names, [])
    for held in (cells(numbers.tolist()), numbers):
        savemat(tmp_path / "log.mat", LOG | {"run": held})
        assert names_and_notes(tmp_path / "log.mat") == (names, [])


def test_so_they_are_in_parquet(tmp_path):
    pandas = pytest.importorskip("pandas")
    pandas.DataFrame(LOG | {"run": BIG["beyond 2^53"]}).to_parquet(tmp_path / "log.parquet")
    assert len(names_and_notes(tmp_path / "log.parquet")[0]) == 2


def test_large_whole_numbers_stay_readings():
    for large in (10**17, 2**62):
        log = LOG | {"y": np.arange(large, large + 2 * COUNT)}  # many of one float
        (found,) = read_logs(log, Signals("t", "y", None, "p"), 0.05)
        assert np.array_equal(found["output"], np.asarray(log["y"], float))


def test_cells_alone_are_no_missing_vectors(tmp_path):
    savemat(tmp_path / "log.mat", {name: cells(list(values)) for name, values in LOG.items()})
    said = "holds no vectors: 't' has 120 cells, which are a column beside vectors only; save one vector"
    with pytest.raises(LogError, match=said):
        names_and_notes(tmp_path / "log.mat")
