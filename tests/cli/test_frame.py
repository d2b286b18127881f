"""The frame of the command line: one line an error, statuses, JSON, whole-or-nothing output.

Red when an error takes two lines or another exit status, or a command leaves half of its output.
"""

import json
import subprocess
import sys

import numpy as np
import pytest

import focgen
from focgen.cli.main import commands, main, parser
from focgen.errors import InputError
from focgen.jsontext import to_json
from focgen.output import new_folder, write_file, write_files
from focgen.progress import bar, led_by, say, step


@pytest.mark.parametrize("argv", [["nonsense"], ["design"], ["design", "missing.toml", "--out", "x.toml"]])
def test_unusable_input_is_one_line_and_status_2(argv, capsys):
    assert main(argv) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("focgen: error: ") and captured.err.count("\n") == 1
    assert "Traceback" not in captured.err


def test_alone_it_says_what_there_is(capsys):
    assert main([]) == 0
    printed = capsys.readouterr()
    assert printed.err == "" and all(f"\n  {name} " in printed.out for name in commands())


@pytest.mark.parametrize(
    "argv, meant",
    [
        (["identfy"], "did you mean identify?"),
        (["design", "rig.toml", "--out", "c.toml", "--setling", "1"], "did you mean --settling?"),
        (["verify", "--sample=9", "--tarmac=all"], "did you mean --target?"),
    ],
)
def test_a_mistyped_word_gets_the_one_that_was_meant(argv, meant, capsys):
    assert main(argv) == 2
    line = capsys.readouterr().err
    assert meant in line and line.count("\n") == 1


def test_a_word_like_none_gets_no_guess(capsys):
    assert main(["xyzzy"]) == 2
    assert "did you mean" not in capsys.readouterr().err


def test_what_follows_two_dashes_is_no_option(capsys):
    assert main(["replay", "--", "--nothing.toml", "--log.csv"]) == 2
    assert "--nothing.toml: cannot be read" in capsys.readouterr().err


def test_every_command_shows_a_worked_example(capsys):
    for name in commands():
        with pytest.raises(SystemExit):
            parser().parse_args([name, "--help"])
        assert f"focgen {name}" in capsys.readouterr().out.split("\n\n", 1)[1]


def test_every_command_is_a_function_of_its_name():
    parser()  # loads them all: no file of the package may stand in a function's place
    for name in commands():
        assert callable(getattr(focgen, name)), name


@pytest.mark.parametrize("word", ["--help", "-h", "--version"])
def test_what_focgen_is_is_said_at_once(word):
    """The libraries of all commands took seconds to load for it."""
    told = (
        f"import sys; from focgen.cli.main import main\ntry: main(['{word}'])\nfinally: print([*sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True)
    assert done.returncode == 0 and "focgen" in done.stdout
    assert "'scipy'" not in done.stdout


def test_a_closed_pipe_is_no_error():
    shell = f"{sys.executable} -m focgen --help | head -1"
    done = subprocess.run(shell, shell=True, capture_output=True, text=True)
    assert done.stdout.startswith("usage:") and done.stderr == ""


def test_json_carries_numbers_and_null_only():
    text = to_json({"a": np.float64(1.5), "b": float("nan"), "c": np.arange(2), "d": (1, None)})
    assert json.loads(text) == {"a": 1.5, "b": None, "c": [0, 1], "d": [1, None]}


def test_a_failure_leaves_nothing_behind(tmp_path):
    target = tmp_path / "out"
    with pytest.raises(RuntimeError), new_folder(target) as folder:
        (folder / "half.c").write_text("int x;")
        raise RuntimeError
    assert not target.exists()


def test_files_of_others_stay(tmp_path):
    (tmp_path / "mine.txt").write_text("keep")
    write_files(tmp_path, {"a/b.txt": "text", "c.bin": b"\x00"})
    assert (tmp_path / "a" / "b.txt").read_text() == "text" and (tmp_path / "mine.txt").read_text() == "keep"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "c.bin", "mine.txt"]


def test_an_unwritable_place_is_reported(tmp_path):
    (tmp_path / "file").write_text("")
    for write in (
        lambda: write_files(tmp_path / "file", {"a": "b"}),
        lambda: write_file(tmp_path / "file" / "x", "b"),
    ):
        with pytest.raises(InputError, match="cannot be written"):
            write()


def test_what_stands_in_the_way_is_reported_before_anything_is_written(tmp_path):
    (tmp_path / "out" / "z.c").mkdir(parents=True)
    with pytest.raises(InputError, match="is a folder where a file belongs"):
        write_files(tmp_path / "out", {"a.c": "text", "z.c": "text"})
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["z.c"]
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "sub").write_text("")
    with pytest.raises(InputError, match="is a file where a folder belongs"):
        write_files(tmp_path / "other", {"a.c": "text", "sub/b.c": "text"})
    assert [p.name for p in (tmp_path / "other").iterdir()] == ["sub"]


def test_a_step_leads_the_lines_of_its_parts(capsys):
    with led_by("  from "):
        say("command to pressure")
    say("next")
    assert capsys.readouterr() == ("", "  from command to pressure\nnext\n")


def test_progress_is_for_terminals(capsys, monkeypatch):
    step("command to pressure")
    assert capsys.readouterr() == ("", "")
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    step("command to pressure")
    assert capsys.readouterr() == ("", "command to pressure\n")


def test_a_bar_shows_how_far_and_how_long():
    assert bar("study", 0, 48, 0.0) == f"study {'░' * 24} 0/48"
    assert bar("study", 12, 48, 10.0) == f"study {'█' * 6}{'░' * 18} 12/48, 30 s left"
    assert bar("study", 48, 48, 10.0) == f"study {'█' * 24} 48/48, 0 s left"
    assert bar("files", 3, None, 9.0) == "files 3"
