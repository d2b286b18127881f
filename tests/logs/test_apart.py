"""Binary logs are read in a process of their own: what ends the reader is an error of one line here.

Red when a damaged file takes the program down, or takes all of its memory.
"""

import os
import random
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from focgen.children import environment
from focgen.cli.main import main
from focgen.errors import LogError, MissingExtra
from focgen.logs import reader, subprocess_reader
from focgen.logs.table import read_table
from focgen.resources import shipped

TIME = np.arange(20.0)


def sound(path: Path, compressed: bool = False) -> bytes:
    """A MAT file of version 5 with vectors of several types and a structure."""
    inner = {"u": TIME, "p": TIME.astype(np.float32), "n": TIME.astype(np.int16), "s": "text"}
    savemat(path, {"t": TIME, "log": inner}, do_compression=compressed)
    return path.read_bytes()


def crashing(path: Path) -> None:
    """A MAT file that makes scipy's reader crash: the numbers of the first vector claim to be a matrix."""
    raw = bytearray(sound(path))
    assert raw[176] == 9, "the tag of float64 behind header, flags, shape and name"
    raw[176], raw[348:350], raw[880], raw[883] = 0, b"\x01\x00", 0, 128
    path.write_bytes(raw)


CHANNEL = """
class Channel:
    name, properties = 'u', {{}}
    def __getitem__(self, at):
        return {values}
class Group:
    name = 'g'
    channels = lambda self: [Channel()]
class TdmsFile:
    groups = lambda self: [Group()]
    read = classmethod(lambda cls, path: cls())
"""


def standing_in(folder: Path, monkeypatch, text: str) -> Path:
    """A package nptdms of our own, which the reader of .tdms finds first; its log."""
    (folder / "nptdms").mkdir()
    (folder / "nptdms" / "__init__.py").write_text(text)
    (folder / "nptdms" / "log.py").write_text(
        "class log_manager:\n    set_level = staticmethod(lambda level: None)\n"
    )
    monkeypatch.syspath_prepend(str(folder))
    (folder / "log.tdms").write_bytes(b"log")
    return folder / "log.tdms"


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the crash is tried in a forked process")
def test_a_file_that_ends_the_reader_is_an_error_of_one_line(tmp_path, capsys):
    path = tmp_path / "steps.mat"
    crashing(path)
    alone = "import sys, pathlib; from focgen.logs import mat_file; mat_file.read(pathlib.Path(sys.argv[1]))"
    command = [sys.executable, "-c", alone, str(path)]
    died = subprocess.run(command, capture_output=True, env=environment())
    if died.returncode >= 0:
        pytest.skip("this version of scipy does not crash on the file")
    rig = shipped("examples") / "rig.toml"
    assert main(["identify", str(path), "--rig", str(rig), "--out", str(tmp_path / "new.toml")]) == 2
    err = capsys.readouterr().err
    told = r"focgen: error: [^\n]*steps\.mat: is damaged: its reader ended with SIGSEGV; [^\n]+\n"
    assert re.fullmatch(told, err)
    assert not (tmp_path / "new.toml").exists()


@pytest.mark.parametrize("number", ("SIGSEGV", "SIGABRT", "SIGKILL"))
def test_a_reader_that_dies_is_told_of(tmp_path, monkeypatch, number):
    died = f"import os, signal\nos.kill(os.getpid(), signal.{number})\n"
    with pytest.raises(LogError, match=f"ended with {number}"):
        read_table(standing_in(tmp_path, monkeypatch, died))


def test_a_reader_that_does_not_return_is_ended(tmp_path, monkeypatch):
    monkeypatch.setattr(subprocess_reader, "SECONDS", 1.5)
    path = standing_in(tmp_path, monkeypatch, "import time\ntime.sleep(600)\n")
    with pytest.raises(LogError, match="was not read within 1.5 s"):
        read_table(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no pipes with names")
def test_a_pipe_that_nobody_writes_is_refused(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "log.mat")
    with pytest.raises(LogError, match="is no regular file"):
        read_table(tmp_path / "log.mat")


def test_what_a_library_prints_is_no_answer(tmp_path, monkeypatch):
    noise = "import os\nprint('{\"columns\": []}')\nos.write(1, b'noise')\n"
    text = noise + CHANNEL.format(values="[1.0, 2.5]")
    found = read_table(standing_in(tmp_path, monkeypatch, text))
    assert list(found.columns) == ["u"] and found.columns["u"].tolist() == [1.0, 2.5]


def test_the_limits_hold_while_a_log_is_read(tmp_path, monkeypatch):
    resource = pytest.importorskip("resource")
    values = "[float(resource.getrlimit(n)[0]) for n in (resource.RLIMIT_AS, resource.RLIMIT_CORE)]"
    text = "import resource\n" + CHANNEL.format(values=values)
    found = read_table(standing_in(tmp_path, monkeypatch, text)).columns["u"].tolist()
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    assert found == [reader.MEMORY if hard < 0 else min(hard, reader.MEMORY), 0.0]


def test_a_missing_library_reaches_the_user_unchanged(tmp_path, monkeypatch):
    path = standing_in(tmp_path, monkeypatch, "raise ImportError('not there')\n")
    with pytest.raises(MissingExtra) as told:
        read_table(path)
    expected = MissingExtra.of("nptdms", "tdms", str(path))
    assert str(told.value) == str(expected) and type(told.value) is MissingExtra


def test_the_process_may_not_take_all_memory():
    pytest.importorskip("resource")
    code = (
        "from focgen.logs import reader; reader.MEMORY = 1 << 30; reader._limit(); bytearray(1 << 29)\n"
        "try:\n    bytearray(1 << 30)\nexcept MemoryError:\n    print('refused')"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, env=environment())
    assert done.stdout == "refused\n", done.stderr


def test_too_much_memory_is_told_of(tmp_path, monkeypatch):
    text = "class TdmsFile:\n    @staticmethod\n    def read(path):\n        bytearray(1 << 60)\n"
    with pytest.raises(LogError, match="takes more than 4 GB to read"):
        read_table(standing_in(tmp_path, monkeypatch, text))


def test_only_readers_of_logs_are_run():
    with pytest.raises(ValueError, match="os"):
        reader._read("os", Path("log"))


@pytest.mark.parametrize("compressed", (False, True))
def test_every_value_arrives_as_it_stood(tmp_path, compressed):
    from focgen.logs import mat_file

    path = tmp_path / "log.mat"
    sound(path, compressed)
    here, there = mat_file.read(path), read_table(path)
    assert list(here.columns) == list(there.columns) and len(there) == len(TIME)
    for name in here.columns:
        assert np.array_equal(here.numbers(name), there.numbers(name))
        assert here.texts(name) == there.texts(name)


def test_texts_gaps_and_times_arrive_as_they_stood(tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    from focgen.logs import parquet_file

    names = ["eins", None, "drei ü", "4"]
    table = {
        "name": names,
        "gap": [1.5, None, 2.5, float("nan")],
        "flag": [True, False, None, True],
        "when": np.array(["2024-05-01T00:00:00", "NaT", "2024-05-01T00:00:02", "2024-05-02"], "M8[ms]"),
        "count": np.array([1, 2, 3, 2**53 + 1]),
    }
    parquet.write_table(pyarrow.table(table), tmp_path / "log.parquet")
    here, there = parquet_file.read(tmp_path / "log.parquet"), read_table(tmp_path / "log.parquet")
    assert list(there.columns) == list(table)
    assert there.texts("name") == ["eins", "", "drei ü", "4"]
    for name in ("gap", "flag", "when", "count"):
        assert np.array_equal(here.numbers(name), there.numbers(name), equal_nan=True), name


def test_a_page_of_parquet_against_its_checksum_is_refused(tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    path, reading = tmp_path / "log.parquet", np.linspace(0.1, 0.2, 100)
    written = pyarrow.table({"t": 0.01 * np.arange(100), "p": reading})
    parquet.write_table(written, path, write_page_checksum=True, compression="none", use_dictionary=False)
    raw = path.read_bytes()
    at = raw.index(reading[40:42].tobytes())
    path.write_bytes(raw[: at + 6] + bytes([raw[at + 6] ^ 1]) + raw[at + 7 :])
    with pytest.raises(LogError, match="is not a whole Parquet file"):
        read_table(path)


def test_damaged_files_never_reach_the_caller(tmp_path):
    """Mutations of sound files: each is read, or an error of one line."""
    rng, read, refused = random.Random(5), 0, 0
    seeds = [sound(tmp_path / "seed.mat", compressed) for compressed in (False, True)]
    for _ in range(10):
        raw = bytearray(rng.choice(seeds))
        for _ in range(rng.randint(1, 4)):
            at = rng.randrange(len(raw))
            by = rng.choice((bytes([rng.randrange(256)]), b"\xff\xff\xff\xff"))
            raw[at : at + rng.choice((0, 1, 4))] = by
        (tmp_path / "log.mat").write_bytes(raw)
        try:
            read += len(read_table(tmp_path / "log.mat")) > 0
        except LogError as error:
            assert "\n" not in str(error)
            refused += 1
    assert read + refused == 10 and refused > 2


# ------------------------------------------------------------------------------------- what HDF5 can name


def seventy_three(path: Path, fill) -> Path:
    """A MAT file of version 7.3: HDF5 behind MATLAB's header."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        file["t"] = TIME
        fill(file, h5py)
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    return path


def _virtual(file, h5py):
    layout = h5py.VirtualLayout((20,), "f8")
    layout[:] = h5py.VirtualSource("secret.mat", "u", (20,))
    file.create_virtual_dataset("y", layout)


def _celled(file, h5py):
    _virtual(file, h5py)
    file.move("y", "#refs#/a")
    file["cells"] = np.array([file["#refs#/a"].ref], dtype=h5py.ref_dtype)


def _linked(file, h5py):
    file["out"] = h5py.ExternalLink("secret.mat", "/")
    file["y"] = h5py.SoftLink("/out/u")


ELSEWHERE = {
    "an external link": lambda file, h5py: file.__setitem__("y", h5py.ExternalLink("secret.mat", "/u")),
    "a link to that": _linked,
    "raw numbers of any file": lambda file, h5py: file.create_dataset(
        "y", (20,), "f8", external=[("secret.bin", 0, 160)]
    ),
    "a virtual array": _virtual,
    "a cell that is one": _celled,
}


@pytest.mark.parametrize("what", ELSEWHERE)
def test_a_log_holds_nothing_of_other_files(tmp_path, what, monkeypatch):
    """Sent on, a result would hold numbers of a file that nobody has named."""
    monkeypatch.chdir(tmp_path)
    seventy_three(tmp_path / "secret.mat", lambda file, h5py: file.__setitem__("u", TIME))
    TIME.tofile(tmp_path / "secret.bin")
    path = seventy_three(tmp_path / "log.mat", ELSEWHERE[what])
    with pytest.raises(LogError, match="lies in another file"):
        read_table(path)


def test_links_within_a_log_lead_where_they_lead(tmp_path):
    def fill(file, h5py):
        file["group/u"] = TIME
        file["again"], file["nowhere"] = h5py.SoftLink("/group/u"), h5py.SoftLink("/nothing")

    found = read_table(seventy_three(tmp_path / "log.mat", fill))
    assert np.array_equal(found.numbers("again"), TIME) and "nowhere" not in found

    def circular(file, h5py):
        file["group/u"] = TIME
        file["group/group"] = file["group"]

    with pytest.raises(LogError, match="RecursionError"):
        read_table(seventy_three(tmp_path / "loop.mat", circular))
