"""Unusable input and a machine that has run out of something: one line, exit 2, nothing half-written.

Red when bad input or a full disk brings a traceback, another exit status, or half a folder.
"""

import copy
import errno
import functools
import gzip
import io
import json
import operator
import os
import subprocess
import sys
import tomllib
from concurrent.futures import BrokenExecutor
from pathlib import Path

import pytest
import tomlkit

from focgen.cli import generate as command
from focgen.cli.faults import write_out
from focgen.cli.main import main
from focgen.codegen.generate import generate
from focgen.errors import InputError, LogError
from focgen.jsontext import to_json
from focgen.logs.table import read_table
from focgen.plan.formats import exponent_for
from focgen.textfile import read_regular
from tests.controllers import seed_controller
from tests.fuzz import seeds

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LEAD = """name = "lead"
sample_time = 0.01
length = 50
gain = 1.0
integrator = false
[transfer]
num = [[{coefficient}, {order}], [1.0, 0.0]]
[ranges]
reference = [0.0, 1.0]
measurement = [0.0, 1.0]
output = [-10.0, 10.0]
"""


@pytest.fixture
def scratch(tmp_path, monkeypatch) -> Path:
    """A temporary folder of one's own, to find what a fault has left in."""
    import tempfile

    place = tmp_path / "temporary"
    place.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(place))
    return place


def line(capsys) -> str:
    """The one line on stderr, and nothing on stdout."""
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and err.startswith("focgen: error: "), err
    return err


def raising(monkeypatch, error):
    def fails(*arguments, **options):
        raise error

    monkeypatch.setattr(command, "generate", fails)
    return main(["generate", "secret.toml", "--out", "out"])


def test_a_fault_that_nobody_foresaw_is_a_line_and_a_file(scratch, monkeypatch, capsys):
    assert raising(monkeypatch, KeyError("the cause")) == 2
    (left,) = scratch.iterdir()
    said, text = line(capsys), left.read_text()
    assert str(left) in said and "KeyError" in said and "send in" in said
    assert "KeyError: 'the cause'" in text and "secret.toml" in text and "Python" in text
    assert left.stat().st_mode & 0o077 == 0


def test_a_fault_on_a_full_disk_still_is_a_line(scratch, monkeypatch, capsys):
    scratch.rmdir()
    assert raising(monkeypatch, KeyError("the cause")) == 2
    assert "test_faults.py:" in line(capsys)


@pytest.mark.parametrize(
    "error, said",
    [
        (MemoryError(), "more memory"),
        (RecursionError(), "nested too deeply"),
        (OSError(28, "No space left on device", "out/x.c"), "out/x.c: cannot be written"),
        (OSError(28, "No space left on device"), "make room"),
        (OSError(24, "Too many open files"), "ulimit"),
        (BrokenExecutor("terminated abruptly"), "fewer --jobs"),
        (BrokenPipeError(errno.EPIPE, "Broken pipe"), "fewer --jobs"),
        (UnicodeEncodeError("utf-8", "/tmp/\udcff", 5, 6, "surrogates"), "set TMPDIR"),
        (ImportError("x.so: failed to map segment from shared object"), "ulimit -v"),
        (PermissionError(13, "Permission denied", "/etc/x"), "/etc/x: cannot be used"),
    ],
)
def test_what_a_machine_runs_out_of_is_foreseen(scratch, monkeypatch, capsys, error, said):
    assert raising(monkeypatch, error) == 2
    assert said in line(capsys) and not list(scratch.iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="a folder that one stands in stays")
def test_a_folder_that_is_gone_is_no_fault(scratch, monkeypatch, capsys, tmp_path):
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    with pytest.raises(FileNotFoundError) as found:
        Path("x.png").absolute()
    assert raising(monkeypatch, found.value) == 2
    assert "the folder one stands in: is gone; cd to another one" in line(capsys)


def run(shell: str) -> subprocess.CompletedProcess:
    program = f"{sys.executable} -m focgen generate {EXAMPLES / 'controller.toml'} --length 5 --json --out"
    return subprocess.run(shell.replace("FOCGEN", program), shell=True, capture_output=True, text=True)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_result_that_cannot_be_written_is_no_success(tmp_path):
    done = run(f"FOCGEN {tmp_path}/fw >/dev/full")
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "No space left" in done.stderr
    assert run(f"FOCGEN {tmp_path}/fw >&- 2>&-").returncode == 2


@pytest.mark.parametrize(
    "encoding", ["ascii", *(pytest.param(e, marks=pytest.mark.long) for e in ("cp1252", "iso8859-9"))]
)
def test_a_terminal_that_lacks_characters_loses_no_result(tmp_path, monkeypatch, encoding):
    """One of Windows or of an old locale: what is written is no failure for a minus sign that is shown."""
    text = (EXAMPLES / "controller.toml").read_text().replace('"V"', '"V−☃"')
    (tmp_path / "snow.toml").write_text(text, encoding="utf-8")
    own = f"{sys.executable} -m focgen generate {tmp_path}/snow.toml --length 5 --out {tmp_path}/fw"
    plain = run(f"PYTHONIOENCODING={encoding} {own} >{tmp_path}/said")
    assert plain.returncode == 0 and b"V-?" in (tmp_path / "said").read_bytes()
    stream = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
    monkeypatch.setattr(sys, "stdout", stream)
    write_out(to_json({"unit": "µV−☃😀"}), as_json=True)
    assert json.loads(stream.buffer.getvalue().decode(encoding)) == {"unit": "µV−☃😀"}


def test_a_compiler_may_say_what_is_no_text(tmp_path):
    """The name of a folder, for instance, as bytes that are no UTF-8."""
    compiler = tmp_path / "cc"
    compiler.write_text("#!/bin/sh\nprintf 'b\\377d.c: error: no' >&2\nexit 1\n")
    compiler.chmod(0o755)
    generate(seed_controller(5), tmp_path / "fw", "q15")
    done = run(f"CC={compiler} {sys.executable} -m focgen verify {tmp_path}/fw")
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "error: no" in done.stderr


def test_streams_that_are_closed_are_missed_by_nobody(tmp_path):
    """A daemon's: neither is asked, and the other takes no message."""
    assert run(f"FOCGEN {tmp_path}/fw <&- 2>&-").returncode == 0
    own = f"{sys.executable} -m focgen init {EXAMPLES / 'logs' / 'steps.csv'} --out {tmp_path}/rig.toml"
    assert run(f"{own} <&- 2>&-").returncode == 0 and (tmp_path / "rig.toml").exists()


def test_a_closed_stdout_is_said(monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdout", None)
    assert main([]) == 2
    assert "stdout: is closed" in capsys.readouterr().err


def test_a_pipe_that_goes_away_hides_no_failed_check(monkeypatch, tmp_path):
    """What did not hold does not hold, whoever reads of it."""
    from focgen.cli.outcome import Outcome

    reader, writer = os.pipe()
    os.close(reader)
    with open(writer, "w") as gone:
        monkeypatch.setattr(sys, "stdout", gone)
        monkeypatch.setattr(command, "run", lambda args: Outcome({}, "no", False))
        assert main(["generate", "c.toml", "--out", "x"]) == 1


# ------------------------------------------------------------------------------------ input of any size


@pytest.mark.parametrize(
    "spoilt",
    [
        *(
            "length = " + "9" * 5000 + "\n",
            "a = " + "[" * 3000,
            "a\0b",
            "\ufeff\ufeff",
            "length = 1e999\n",
            "[" * 70000,
        ),
        *(
            start + "a." * 10**6 + "b" + end
            for start, end in (("", " = 1\n"), ("[", "]\n"), ("x = {", " = 1}\n"))
        ),
        "\"a\" . 'b' . " * 10**5 + "c = 1\n",
    ],
    ids=range(10),
)
def test_no_toml_is_a_traceback(tmp_path, scratch, spoilt, capsys):
    path = tmp_path / "c.toml"
    path.write_text(spoilt + LEAD.format(coefficient=1.0, order=0.5))
    assert main(["generate", str(path), "--out", str(tmp_path / "out")]) == 2
    assert str(path) in line(capsys) and not list(scratch.iterdir()) and not (tmp_path / "out").exists()


@pytest.mark.parametrize("arithmetic", ("f64", "f32", "q31", "q15"))
@pytest.mark.parametrize(
    "coefficient, order", [("1e308", 0.6), ("1e-320", 0.6), (1.0, 1e-300), (1.0, 1e300), (-1e308, 7.9)]
)
def test_no_coefficient_is_a_traceback(tmp_path, scratch, coefficient, order, arithmetic, capsys):
    path = tmp_path / "c.toml"
    path.write_text(LEAD.format(coefficient=coefficient, order=order))
    status = main(["generate", str(path), "--arithmetic", arithmetic, "--out", str(tmp_path / "out")])
    assert status in (0, 2) and not list(scratch.iterdir())
    if status == 2:
        line(capsys)


@pytest.mark.parametrize("largest", (float("inf"), 1e308, 5e-324, 1e-320))
def test_no_format_reaches_the_ends_of_float64(largest):
    from focgen.errors import PlanError

    with pytest.raises(PlanError, match="which no fixed-point format covers"):
        exponent_for(largest, 32767, "here", "a weight")


def test_pipes_are_refused_not_waited_for(tmp_path, capsys):
    for name in ("p.csv", "p.toml", "p.mat", "p.csv.gz"):
        os.mkfifo(tmp_path / name)
    for asked in (["init", "p.csv"], ["init", "p.csv.gz"], ["init", "p.mat"]):
        assert main([asked[0], str(tmp_path / asked[1])]) == 2
        assert "is no regular file" in line(capsys)
    assert main(["generate", str(tmp_path / "p.toml"), "--out", str(tmp_path / "fw")]) == 2
    assert "is no regular file" in line(capsys)


def test_what_is_small_when_packed_is_bounded_unpacked(tmp_path, monkeypatch):
    import focgen.textfile as module

    monkeypatch.setattr(module, "LARGEST_LOG", 1 << 20)
    for size, fits in ((1 << 20, True), ((1 << 20) + 1, False)):
        for name, opened in (("log.csv.gz", gzip.open), ("log.csv", open)):
            with opened(tmp_path / name, "wb") as file:
                file.write((b"t,u,y\n" + b"0,1,2\n" * (1 << 18))[: size - 1] + b"\n")
            if fits:
                assert len(module.read_log_bytes(tmp_path / name)) == size
                continue
            with pytest.raises(LogError, match="more than 1 MiB"):
                read_table(tmp_path / name)


def test_a_setting_is_bounded(tmp_path):
    (tmp_path / "r.toml").write_bytes(b"#" * 101)
    with pytest.raises(InputError, match="has more than 0 MiB"):
        read_regular(tmp_path / "r.toml", 100)


def test_columns_are_bounded_and_cost_alike(tmp_path):
    for count in (4096, 4097):
        names = ",".join(f"c{i} (V)" for i in range(count))
        rows = "\n".join(",".join(["1.5"] * count) for _ in range(3))
        (tmp_path / "wide.csv").write_text(f"{names}\n{rows}\n")
        if count == 4096:
            assert len(read_table(tmp_path / "wide.csv").columns) == count
            continue
        with pytest.raises(LogError, match="has 4097 columns, of which 4096 can be read"):
            read_table(tmp_path / "wide.csv")


def test_samples_that_no_memory_holds_are_refused_at_once(tmp_path, capsys):
    generate(seed_controller(5), tmp_path / "fw", "q15")
    assert main(["verify", str(tmp_path / "fw"), "--samples", "1" + "0" * 11]) == 2
    assert "--samples" in line(capsys)


@pytest.mark.parametrize("name", ("log.csv", "log.csv.gz", "log.lvm"))
@pytest.mark.parametrize("line", (b"1,", b"1", b'"1,', b" "))
def test_a_line_without_end_is_refused_before_it_is_taken_apart(tmp_path, name, line):
    """Packed to a few kilobytes, its cells would take gigabytes, and hours to be told from another kind."""
    with (gzip.open if name.endswith("gz") else open)(tmp_path / name, "wb") as file:
        file.write(b"t,u,y\n" + line * (3 << 18))
    with pytest.raises(LogError, match="has a line of more than 256 KiB"):
        read_table(tmp_path / name)


def test_many_long_lines_are_looked_at_in_a_few(tmp_path):
    """Each below the limit, all of them beyond what the dialect is looked for in."""
    with open(tmp_path / "log.csv", "wb") as file:
        file.writelines(b"1," * (1 << 16) + b"\n" for _ in range(30))
    with pytest.raises(LogError, match="starts with numbers|columns, of which 4096"):
        read_table(tmp_path / "log.csv")


def test_cases_beyond_counting_are_refused_at_once(tmp_path, capsys):
    assert main(["trial", "make", str(tmp_path / "t"), "--cases", "9" * 20, "--suite", "short"]) == 2
    assert "at most 1000000 cases" in line(capsys) and not (tmp_path / "t").exists()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no pipes with names")
@pytest.mark.parametrize("how", ("a pipe", "a device"))
@pytest.mark.parametrize(
    "name", ("manifest.json", "spba.c", "controller.toml", "README.md", "b.manifest.json")
)
def test_no_file_of_a_folder_is_waited_for(tmp_path, name, how, capsys):
    """Nor read for ever: by verify, by report, by generate of another controller."""
    folder = tmp_path / "fw"
    generate(seed_controller(5), folder, "q15")
    (folder / name).unlink(missing_ok=True)
    os.mkfifo(folder / name) if how == "a pipe" else (folder / name).symlink_to("/dev/zero")
    assert main(["verify", str(folder), "--samples", "10"]) in (0, 2)
    assert main(["report", str(folder), "--out", str(tmp_path / "page.html")]) in (0, 2)
    other = ["generate", str(EXAMPLES / "controller.toml"), "--name", "other", "--length", "5", "--out"]
    assert main([*other, str(folder)]) in (0, 2)
    assert "Traceback" not in capsys.readouterr().err


def test_the_folder_one_stands_in_is_no_fault(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    controller, log = str(EXAMPLES / "controller.toml"), str(EXAMPLES / "logs" / "steps.csv")
    for asked in (["init", log], ["report", controller]):
        assert main([*asked, "--out", "."]) == 2
        assert line(capsys).startswith("focgen: error: .: is a folder where a file belongs; name another")
    assert main(["generate", controller, "--length", "5", "--out", "."]) == 0
    assert (tmp_path / "spba.c").is_file() and capsys.readouterr().err == ""


RIG = tomllib.loads(seeds.rig()[0].decode())
EXTREMES = (1e308, 1e60, 1e-60, 5e-324, -1e60, 0.0)


def numbers_of(table, way=()):
    """Yield the way to each number of a TOML file."""
    entries = (
        table.items() if isinstance(table, dict) else enumerate(table) if isinstance(table, list) else ()
    )
    for key, value in entries:
        if isinstance(value, float):
            yield (*way, key)
        yield from numbers_of(value, (*way, key))


@pytest.mark.parametrize(
    "way, extremes",
    [
        pytest.param(
            way,
            EXTREMES[half::2],
            id=f"{'.'.join(map(str, way))}-{half}",
            marks=() if turn % 3 == 0 and half == turn % 2 else pytest.mark.long,
        )
        for turn, way in enumerate(numbers_of(RIG))
        for half in (0, 1)
    ],
)
def test_no_number_of_a_rig_ends_as_nan(tmp_path, way, extremes, capsys):
    """Each of a rig's numbers as large and as small as can be: replayed, and used for a design. Every other
    extreme here, by turns, the others in the long suite.
    """
    (tmp_path / "log.csv").write_bytes(seeds.text(60)[0])
    for number in extremes:
        rig = copy.deepcopy(RIG)
        holder = functools.reduce(operator.getitem, way[:-1], rig)
        holder[way[-1]] = number
        (tmp_path / "rig.toml").write_text(tomlkit.dumps(rig))
        for asked in (["replay", "rig.toml", "log.csv"], ["report", "rig.toml", "--out", "page.html"]):
            words = [str(tmp_path / word) if "." in word else word for word in asked]
            status = main([*words, "--json"])
            out, err = capsys.readouterr()
            assert status in (0, 1, 2), err
            if status == 2:
                assert err.startswith("focgen: error: ") and err.count("\n") == 1
                # numpy's remarks are faults in tests only
                assert "fault of its own" not in err or "(RuntimeWarning)" in err, err
                continue
            json.loads(out, parse_constant=lambda word: pytest.fail(f"{word} at exit {status}"))


@pytest.mark.parametrize(
    "given", ["junk", "", *(pytest.param(g, marks=pytest.mark.long) for g in ("-1", "1e9", "9" * 400, "٣"))]
)
def test_a_date_of_the_surroundings_that_is_none_is_named(tmp_path, given):
    """Libraries read it as they are imported, so in a fresh interpreter."""
    steps = [*sorted((EXAMPLES / "logs").glob("*.csv")), "--rig", EXAMPLES / "rig.toml"]
    line = [sys.executable, "-m", "focgen", "identify", *map(str, steps), "--out", str(tmp_path / "rig.toml")]
    done = subprocess.run(
        line, env={**os.environ, "SOURCE_DATE_EPOCH": given}, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "unset it" in done.stderr, done.stderr
    assert "SOURCE_DATE_EPOCH" in done.stderr and not list(tmp_path.iterdir())
