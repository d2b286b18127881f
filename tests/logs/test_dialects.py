"""Logs as instruments write them: dialects of text, waveforms, MATLAB's formats, frames, units.

Each file holds the numbers of one table in another spelling, and has to give them back.

Red when one spelling of the table gives other numbers.
"""

import gzip
import io
import json

import numpy as np
import pytest

from focgen.cli.main import main
from focgen.errors import LogError, MissingExtra, RigError
from focgen.logs import read_logs
from focgen.logs.scales import Scale
from focgen.logs.table import read_table
from focgen.rig.files import read_rig, rig_text, write_rig
from focgen.rig.rig import Signals
from tests.conftest import paper_rig

STEP, COUNT = 0.01, 80
TIME = np.round(STEP * np.arange(COUNT), 2)
COLUMNS = {
    "t_s": TIME,
    "u_V": np.where(TIME >= 0.1, 1.5, 0.0),
    "p_bar": np.round(0.15 * (1 - np.exp(-8 * np.maximum(TIME - 0.1, 0))), 5),
    "kappa_per_mm": np.round(0.008 * (1 - np.exp(-3 * np.maximum(TIME - 0.1, 0))), 7),
}
SIGNALS = Signals("t_s", "kappa_per_mm", "u_V", "p_bar")


def spelled(delimiter=",", decimal=".", ahead="", units=None, end="", stamps=None, names=None) -> str:
    """The table as text."""
    rows = [
        [f"{value!r}".replace(".", decimal) for value in row]
        for row in zip(*(c.tolist() for c in COLUMNS.values()))
    ]
    if stamps is not None:
        rows = [[stamp, *row[1:]] for stamp, row in zip(stamps, rows)]
    head = [names or list(COLUMNS)] + ([units] if units else [])
    return ahead + "".join(delimiter.join(row) + end + "\n" for row in head + rows)


ISO = [
    str(np.datetime64("2026-03-29T00:59:59.700", "ms") + np.timedelta64(10 * k, "ms")) for k in range(COUNT)
]
MIDNIGHT = [f"{(86399700 + 10 * k) // 3600000 % 24:02}:{(86399700 + 10 * k) // 60000 % 60:02}:"
            f"{(86399700 + 10 * k) / 1000 % 60:06.3f}" for k in range(COUNT)]  # fmt: skip
SETTINGS = "Instrument;XR-7\nOperator;Max\nRate;100\n\n"
TEXTS = {
    "plain": (spelled(), ""),
    "semicolons": (spelled(";"), "semicolons"),
    "semicolons, decimal commas": (spelled(";", ","), "semicolons, decimal commas"),
    "tabs": (spelled("\t"), "tabs"),
    "tabs, decimal commas": (spelled("\t", ","), "tabs, decimal commas"),
    "bars": (spelled("|"), "bars"),
    "blanks": (spelled("   "), "blanks"),
    "blanks, decimal commas": (spelled(" ", ","), "blanks, decimal commas"),
    "commas and blanks": (spelled(", "), ""),
    "quoted decimal commas": (
        spelled('","', ",").replace("\n", '"\n"')[:-1].join(('"', "")),
        "decimal commas",
    ),
    "a delimiter at the end": (spelled(";", end=";"), "semicolons"),
    "a row of units": (spelled(units=["s", "V", "bar", "1/mm"]), "units in line 2"),
    "units in brackets": (spelled(";", ",", units=["[s]", "[V]", "[bar]", "[1/mm]"]), "units in line 2"),
    "comments": (spelled(ahead="# rig A, 3 bar; new valve\n# 2026-03-01\n"), ""),
    "settings ahead": (spelled(";", ",", ahead=SETTINGS), "header in line 5"),
    "settings and units": (spelled(";", ahead=SETTINGS, units=["s", "V", "bar", "1/mm"]), "units in line 6"),
    "ISO times": (spelled(stamps=ISO), ""),
    "ISO times of a zone": (spelled(stamps=[f"{stamp}+02:00" for stamp in ISO]), ""),
    "times of day past midnight": (spelled(stamps=MIDNIGHT), ""),
    "a header repeated": (spelled() + ",".join(COLUMNS) + "\n", ""),
    "Windows lines": (spelled().replace("\n", "\r\n"), ""),
}


@pytest.mark.parametrize("dialect", TEXTS)
@pytest.mark.parametrize("kind", ["csv", "txt.gz"])
def test_every_dialect_carries_the_same_numbers_and_says_what_it_was_taken_for(tmp_path, dialect, kind):
    text, said = TEXTS[dialect]
    path = tmp_path / f"steps.{kind}"
    raw = text.encode()
    path.write_bytes(gzip.compress(raw) if kind.endswith("gz") else raw)
    (log,) = read_logs([path], SIGNALS, STEP)
    assert log.name == "steps" and len(log) == COUNT
    assert np.allclose(log.time, TIME, atol=1e-6)
    for role, column in SIGNALS.columns().items():
        assert np.array_equal(log[role], COLUMNS[column]), role
    assert said in "".join(log.notes) and (said or not any("read with" in note for note in log.notes))


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp1252"])
def test_encodings(tmp_path, encoding):
    names = ["t_s", "Stellgröße_V", "Druck °", "κ" if encoding != "cp1252" else "Krümmung"]
    path = tmp_path / "steps.csv"
    path.write_bytes(spelled(";", ",", names=names).encode(encoding))
    (log,) = read_logs([path], Signals(names[0], names[3], names[1], names[2]), STEP)
    assert np.array_equal(log["output"], COLUMNS["kappa_per_mm"])
    assert any("Windows-1252" in note for note in log.notes) == (encoding == "cp1252")


def test_a_bad_cell_is_found_in_every_dialect(tmp_path):
    """The line is the file's, whatever stands ahead of the header."""
    lines = spelled(";", ",", ahead=SETTINGS, units=["s", "V", "bar", "1/mm"]).splitlines()
    lines[6] = lines[6].replace("0,0;", "zero;", 1)
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines))
    with pytest.raises(LogError, match="'zero' in line 7"):
        read_logs([path], SIGNALS, STEP)
    lines[6] = "0,1;3"
    path.write_text("\n".join(lines))
    with pytest.raises(LogError, match="line 7 has 2 cells, the header 4"):
        read_logs([path], SIGNALS, STEP)


def test_names_with_units_in_brackets_serve_with_and_without(tmp_path):
    names = ["t (s)", "u [V]", "p (kPa)", "kappa (1/mm)"]
    (tmp_path / "log.csv").write_text(spelled(names=names))
    units = {"pressure": "bar"}
    for signals in (
        Signals("t", "kappa", "u", "p", units=units),
        Signals(*(names[k] for k in (0, 3, 1, 2)), units=units),
    ):
        (log,) = read_logs([tmp_path / "log.csv"], signals, STEP)
        assert np.array_equal(log["pressure"], COLUMNS["p_bar"])
        assert any("in kPa, pressure is taken as bar" in note for note in log.notes)


LVM = """LabVIEW Measurement\t
Writer_Version\t2
Reader_Version\t2
Separator\tTab
Decimal_Separator\t{decimal}
Multi_Headings\tNo
X_Columns\t{columns}
Time_Pref\tRelative
***End_of_Header***\t
"""
SEGMENT = """\t
Channels\t3\t\t\t
Samples\t{count}\t{count}\t{count}\t
Y_Unit_Label\tV\tbar\t1/mm\t
X_Dimension\tTime\tTime\tTime\t
X0\t0,0\t0,0\t0,0\t
Delta_X\t0,01\t0,01\t0,01\t
***End_of_Header***\t\t\t\t
X_Value\tu_V\tp_bar\tkappa_per_mm\tComment
"""


def lvm(decimal: str, columns: str, segments: int) -> str:
    body = "".join(
        "\t".join(
            ["" if columns == "No" and k == 0 else f"{v!r}".replace(".", decimal) for k, v in enumerate(row)]
        )
        + "\n"
        for row in zip(*(c.tolist() for c in COLUMNS.values()))
    )
    head = SEGMENT.format(count=COUNT).replace(",", decimal)
    return LVM.format(decimal=decimal, columns=columns) + segments * (head + body)


@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize("columns", ["One", "No"])
@pytest.mark.parametrize("segments", [1, 2])
def test_lvm(tmp_path, decimal, columns, segments):
    """With a column of X values or X0 and Delta_X; every segment is an experiment."""
    (tmp_path / "steps.lvm").write_text(lvm(decimal, columns, segments))
    logs = read_logs([tmp_path / "steps.lvm"], Signals("X_Value", "kappa_per_mm", "u_V", "p_bar"), STEP)
    assert len(logs) == segments
    for log in logs:
        assert np.allclose(log.time, TIME, atol=1e-12) and log.sample_time == STEP
        assert np.array_equal(log["pressure"], COLUMNS["p_bar"])
    assert read_table(tmp_path / "steps.lvm").unit("p_bar") == "bar"


def test_lvm_that_is_cut_is_refused(tmp_path):
    text = lvm(".", "One", 1)
    for fault, message in ((text[:-10], "line 98 has 3 values"), (LVM, "no segment"), ("", "empty")):
        (tmp_path / "log.lvm").write_text(fault)
        with pytest.raises(LogError, match=message):
            read_table(tmp_path / "log.lvm")


def write_tdms(path, groups, waveform):
    nptdms = pytest.importorskip("nptdms")
    properties = {"wf_increment": STEP, "wf_start_offset": 0.0, "unit_string": "bar"} if waveform else {}
    with nptdms.TdmsWriter(str(path)) as writer:
        for group, columns in groups.items():
            writer.write_segment(
                [nptdms.ChannelObject(group, k, v, properties=properties) for k, v in columns.items()]
            )


def test_waveforms_of_tdms_carry_their_clock(tmp_path):
    waveforms = {name: column for name, column in COLUMNS.items() if name != "t_s"}
    write_tdms(tmp_path / "steps.tdms", {"daq": waveforms}, waveform=True)
    (log,) = read_logs([tmp_path / "steps.tdms"], SIGNALS, STEP)
    assert np.allclose(log.time, TIME, atol=1e-12) and np.array_equal(log["output"], COLUMNS["kappa_per_mm"])
    assert any("no column 't_s': time is the log's own, 0.01 s" in note for note in log.notes)


def test_one_rig_serves_tdms_files_of_any_number_of_groups(tmp_path):
    """One group, a group a run, and channels over several groups; "group/channel" always works."""
    other = {"camera": {"kappa_cam": COLUMNS["u_V"]}}
    files = {"one": {"a": COLUMNS}, "runs": {"a": COLUMNS, "b": COLUMNS}, "over": {"a": COLUMNS, **other}}
    found = {}
    for name, groups in files.items():
        write_tdms(tmp_path / f"{name}.tdms", groups, waveform=False)
        found[name] = read_logs([tmp_path / f"{name}.tdms"], SIGNALS, STEP)
        assert all(np.array_equal(log["pressure"], COLUMNS["p_bar"]) for log in found[name])
    assert [len(logs) for logs in found.values()] == [1, 2, 1] and [log.name for log in found["runs"]] == [
        "a",
        "b",
    ]
    whole = Signals("a/t_s", "a/kappa_per_mm", "a/u_V", "a/p_bar")
    for name in ("one", "over"):
        assert len(read_logs([tmp_path / f"{name}.tdms"], whole, STEP)) == 1


def write_mat_73(path, content):
    """As MATLAB's -v7.3 has it: HDF5 with the axes in reverse, and its class beside."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in content.items():
            if isinstance(value, dict):
                group = file.create_group(name)
                group.attrs["MATLAB_class"] = np.bytes_("struct")
                for field, column in value.items():
                    group[field] = column[np.newaxis, :]
                    group[field].attrs["MATLAB_class"] = np.bytes_("double")
            else:
                file[name] = np.atleast_2d(value).T if np.ndim(value) == 2 else value[np.newaxis, :]
                file[name].attrs["MATLAB_class"] = np.bytes_("double")
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


@pytest.mark.parametrize("version", ["5", "7.3"])
@pytest.mark.parametrize("shape", ["vectors", pytest.param("struct", marks=pytest.mark.long), "matrix"])
def test_mat(tmp_path, version, shape):
    from scipy.io import savemat

    matrix = np.stack(list(COLUMNS.values()), axis=1)
    content = {"vectors": COLUMNS, "struct": {"log": COLUMNS}, "matrix": {"data": matrix}}[shape]
    signals = Signals("data_1", "data_4", "data_2", "data_3") if shape == "matrix" else SIGNALS
    path = tmp_path / "steps.mat"
    (write_mat_73 if version == "7.3" else savemat)(path, content)
    (log,) = read_logs([path], signals, STEP)
    assert np.array_equal(log["output"], COLUMNS["kappa_per_mm"]) and np.allclose(log.time, TIME)
    if shape == "struct":
        assert "log.p_bar" in read_table(path)


def write_cells_73(path, cells):
    """A structure array and cells, as MATLAB's -v7.3 has them: references to what stands in #refs#."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, columns in cells.items():
            for k, column in enumerate(columns):
                file[f"#refs#/{name.replace('/', '_')}{k}"] = column[np.newaxis, :]
            made = [file[f"#refs#/{name.replace('/', '_')}{k}"].ref for k in range(len(columns))]
            file.create_dataset(name, (len(made), 1), h5py.ref_dtype)[:, 0] = made
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


TWO = [{name: column + k for name, column in COLUMNS.items()} for k in (0.0, 100.0)]
"""Two experiments whose columns have the same names."""


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_experiments_in_an_array_of_structures_are_told_apart(tmp_path, version):
    from scipy.io import savemat

    path = tmp_path / "steps.mat"
    if version == "7.3":
        write_cells_73(path, {f"rec/{name}": [one[name] for one in TWO] for name in COLUMNS})
        names = "t_s(2)", "u_V(2)", "p_bar(2)", "rec.kappa_per_mm(2)"
    else:
        made = np.zeros(2, dtype=[(name, object) for name in COLUMNS])
        made[0], made[1] = (tuple(one.values()) for one in TWO)
        savemat(path, {"rec": made})
        names = "rec(2).t_s", "rec(2).u_V", "rec(2).p_bar", "rec(2).kappa_per_mm"
    found = read_table(path)
    for name, column in zip(names, ("t_s", "u_V", "p_bar", "kappa_per_mm"), strict=True):
        assert np.array_equal(found.numbers(name), TWO[1][column])
        assert np.array_equal(found.numbers(name.replace("(2)", "(1)")), TWO[0][column])
    assert "t_s" not in found and len(found.columns) == 2 * len(COLUMNS)


def test_fields_of_one_name_in_structures_of_one_name_are_told_apart(tmp_path):
    from scipy.io import savemat

    savemat(tmp_path / "log.mat", {f"exp{k}": {"data": one, "n": 3} for k, one in enumerate(TWO)})
    found = read_table(tmp_path / "log.mat")
    assert np.array_equal(found.numbers("exp0.data.p_bar"), TWO[0]["p_bar"])
    assert np.array_equal(found.numbers("exp1.data.p_bar"), TWO[1]["p_bar"]) and "data.p_bar" not in found


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_cells_of_vectors_are_columns(tmp_path, version):
    from scipy.io import savemat

    path, columns = tmp_path / "log.mat", list(COLUMNS.values())
    if version == "7.3":
        write_cells_73(path, {"data": columns})
    else:
        cells = np.empty(len(columns), object)
        cells[:] = columns
        savemat(path, {"data": cells})
    (log,) = read_logs([path], Signals("data(1)", "data(4)", "data(2)", "data(3)"), STEP)
    assert np.array_equal(log["output"], COLUMNS["kappa_per_mm"])


def test_a_vector_and_a_column_of_one_name_are_refused(tmp_path):
    """Which of the two is meant by y_1 nobody can know."""
    from scipy.io import savemat

    savemat(tmp_path / "log.mat", {"t": TIME, "y": np.stack([TIME, -TIME], axis=1), "y_1": 5.0 * TIME})
    with pytest.raises(LogError, match="holds two columns called 'y_1'.*rename one"):
        read_table(tmp_path / "log.mat")


def test_mat_73_without_h5py_names_the_extra(tmp_path, monkeypatch):
    import sys

    from focgen.logs import mat_file

    write_mat_73(tmp_path / "log.mat", COLUMNS)
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(MissingExtra, match=r"pip install 'focgen\[mat\]'"):
        mat_file.read(tmp_path / "log.mat")


def frames():
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    table = pandas.DataFrame(COLUMNS)
    stamped = table.drop(columns="t_s").set_index(
        pandas.to_datetime("2026-03-29") + pandas.to_timedelta(TIME, "s")
    )
    return {
        "dict": COLUMNS,
        "lists": {name: column.tolist() for name, column in COLUMNS.items()},
        "pandas": table,
        "pandas, index": table.set_index("t_s"),
        "pandas, times": stamped,
        "polars": polars.DataFrame(COLUMNS),
    }


@pytest.mark.parametrize("kind", ["dict", "lists", "pandas", "pandas, index", "pandas, times", "polars"])
def test_logs_in_memory(kind):
    frame = frames()[kind]
    for logs, names in (((frame), ["log"]), ([frame], ["log"]), ([frame, frame], ["log 1", "log 2"])):
        found = read_logs(logs, SIGNALS, STEP)
        assert [log.name for log in found] == names
        assert all(np.array_equal(log["output"], COLUMNS["kappa_per_mm"]) for log in found)
        assert np.allclose(found[0].time, TIME, atol=1e-6)


@pytest.mark.parametrize(
    "bad",
    [
        {},
        {"t_s": []},
        {**COLUMNS, "p_bar": np.ones(3)},
        {**COLUMNS, "p_bar": np.ones((COUNT, 2))},
        {**COLUMNS, "p_bar": 3},
    ],
)
def test_frames_that_are_no_table_are_refused(bad):
    with pytest.raises(LogError, match="log"):
        read_logs(bad, SIGNALS, STEP)


def rig_file(path, signals: str, units: str = "") -> None:
    text = rig_text(paper_rig())
    begin, end = text.index("[signals]"), text.index("[regulator]")
    path.write_text(f"{text[:begin]}[signals]\n{signals}\n{units}\n{text[end:]}")


CONVERTED = """time = { column = "t", unit = "ms" }
command = "u"
pressure = { column = "p", unit = "kPa" }
output = { column = "kappa", scale = 0.001, offset = 0.5 }"""


def test_units_scales_and_offsets(tmp_path):
    """Milliseconds, kilopascals, and an output with a scale of its own; the rig is written back as it was."""
    rig_file(tmp_path / "rig.toml", CONVERTED, '[units]\npressure = "bar"\noutput = "1/mm"')
    rig = read_rig(tmp_path / "rig.toml")
    log = {
        "t": 1e3 * TIME,
        "u": COLUMNS["u_V"],
        "p": 100 * COLUMNS["p_bar"],
        "kappa": 1e3 * (COLUMNS["kappa_per_mm"] - 0.5),
    }
    (found,) = read_logs(log, rig.signals, STEP)
    assert np.allclose(found.time, TIME) and np.allclose(found["pressure"], COLUMNS["p_bar"], rtol=1e-12)
    assert np.allclose(found["output"], COLUMNS["kappa_per_mm"], atol=1e-12)
    write_rig(rig, tmp_path / "again.toml")
    assert read_rig(tmp_path / "again.toml") == rig


@pytest.mark.parametrize(
    "unit, to, zero, one",
    [("kPa", "bar", 0, 0.01), ("psi", "bar", 0, 0.0689475729), ("degF", "degC", -160 / 9, -155 / 9),
     ("1/cm", "1/mm", 0, 0.1), ("mV", "V", 0, 1e-3), ("deg", "rad", 0, np.pi / 180), ("Nm", "mN*m", 0, 1000)],
)  # fmt: skip
def test_the_library_of_units(unit, to, zero, one):
    assert Scale(unit=unit).applied(np.array([0.0, 1.0]), to) == pytest.approx(
        [zero, one], rel=1e-9, abs=1e-15
    )


@pytest.mark.parametrize(
    "pressure, units, message",
    [
        ('{ column = "p", unit = "kPa" }', "", "does not say its own unit"),
        ('{ column = "p", unit = "mm" }', '[units]\npressure = "bar"', "mm cannot be turned into bar"),
        ('{ column = "p", unit = "blub" }', '[units]\npressure = "bar"', "blub is no unit"),
        ('{ column = "p", unit = "kPa", scale = 2.0 }', '[units]\npressure = "bar"', "beside 'scale'"),
        ('{ column = "p", scale = 0.0 }', "", "scale.* is 0"),
        ("{ scale = 2.0 }", "", "column"),
        ('{ column = "p", factor = 2.0 }', "", "factor"),
        ("{ column = 3 }", "", "not text"),
        ('"p"', '[units]\npresure = "bar"', "presure"),
        ('"p"', '[units]\ntime = "ms"', "time"),
    ],
)
def test_units_that_are_wrong_are_refused(tmp_path, pressure, units, message):
    rig_file(tmp_path / "rig.toml", f'time = "t"\ncommand = "u"\noutput = "y"\npressure = {pressure}', units)
    with pytest.raises(RigError, match=message):
        read_rig(tmp_path / "rig.toml")


def test_a_log_of_another_dialect_goes_through_a_command(tmp_path, capsys):
    from focgen.resources import shipped

    example = min((shipped("examples")).rglob("*.csv"))
    rig = read_rig(next((shipped("examples")).rglob("rig.toml")))
    (_log,) = (read_logs([example], rig.signals, rig.sample_time)[:1],)[0]
    text = example.read_text().replace(",", ";").replace(".", ",")
    (tmp_path / "log.txt").write_text(text)
    write_rig(rig, tmp_path / "rig.toml")
    assert main(["replay", str(tmp_path / "rig.toml"), str(tmp_path / "log.txt"), "--json"]) == 0
    found = json.load(io.StringIO(capsys.readouterr().out))
    assert len(found["logs"]) >= 1 and any("semicolons, decimal commas" in note for note in found["notes"])


def test_commands_take_a_frame_and_a_rig_as_a_dictionary(tmp_path):
    """As they take files, and with the same result."""
    import tomllib

    import focgen
    from focgen.resources import shipped

    pandas = pytest.importorskip("pandas")
    log, rig = shipped("examples") / "logs" / "steps.csv", shipped("examples") / "rig.toml"
    frame, given = pandas.read_csv(log), tomllib.loads(rig.read_text())
    ways = [(log, rig), ([str(log)], read_rig(rig)), (frame, given), ([frame.to_dict("series")], given)]
    found = [focgen.replay(rig, logs) for logs, rig in ways]
    assert (
        all(list(f.logs.values()) == list(found[0].logs.values()) for f in found) and len(found[0].logs) > 1
    )
    assert focgen.identify(given, frame, to=20.0, integer=False).joint.T > 0
    with pytest.raises(RigError, match="rig .*actuator"):
        read_rig({**given, "actuator": {"T": -1.0}})


def test_the_blank_within_a_date_separates_no_columns(tmp_path):
    """Split at blanks and tabs alike all rows are of one length, too, but not of the header's."""
    days = [f"2026-01-31 12:00:{0.05 * k:09.6f}\t{k % 7}\t0.{k:03d}\twarm" for k in range(60)]
    path = tmp_path / "log.csv"
    path.write_text("\r".join(["Zeit\tWeg\tDruck\tstate", *days]), encoding="utf-8")
    assert list(read_table(path).columns) == ["Zeit", "Weg", "Druck", "state"]
