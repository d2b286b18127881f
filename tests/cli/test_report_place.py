"""``--report`` beside ``--out``: both are written, or neither, and not into one another.

Red when one of them takes the other's place, or a command ends in an error and has replaced a file.
"""

import os
from pathlib import Path

import pytest

from focgen.cli import shown
from focgen.cli.main import main
from focgen.control.files import write_controller
from focgen.errors import InputError
from focgen.output import check_writable
from focgen.rig.files import write_rig
from tests.conftest import paper_controller, paper_rig


@pytest.fixture
def place(tmp_path, monkeypatch):
    pytest.importorskip("bokeh")
    monkeypatch.chdir(tmp_path)
    write_rig(paper_rig(), "rig.toml")
    return tmp_path


COMMANDS = {
    "design": ["design", "rig.toml"],
    "identify": ["identify", "log.csv", "--rig", "rig.toml"],
}
FOLDERS = {
    "study": ["study", "memory", "controller.toml"],
    "diagnose": ["diagnose", "rig.toml", "log.csv"],
    "demo": ["demo"],
    "trial": ["trial", "score", "t"],
}


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("report", ["x.html", "./x.html", "sub/../x.html"])
def test_one_name_for_both_is_refused(place, command, report, capsys):
    (place / "sub").mkdir()
    assert main([*COMMANDS[command], "--out", "x.html", "--report", report]) == 2
    said = capsys.readouterr().err
    assert "is --out as well" in said and said.count("\n") == 1 and not (place / "x.html").exists()


def test_a_folder_of_pictures_is_another_name_too(place, capsys):
    assert main([*COMMANDS["design"], "--out", "x", "--report", "x"]) == 2
    assert "is --out as well" in capsys.readouterr().err and not (place / "x").exists()


@pytest.mark.parametrize("command", FOLDERS)
def test_a_folder_is_not_the_page(place, command, capsys):
    assert main([*FOLDERS[command], "--out", "x.html", "--report", "x.html"]) == 2
    assert "is --out as well" in capsys.readouterr().err and not (place / "x.html").exists()


@pytest.mark.parametrize("report", ["file/page.html", "file/pictures", "folder.html", "pipe.html", "file"])
@pytest.mark.parametrize("command", [*COMMANDS, *FOLDERS])
def test_a_report_that_cannot_be_written_is_told_before_anything_is(place, command, report, capsys):
    (place / "file").write_text("mine")
    (place / "folder.html").mkdir()
    os.mkfifo(place / "pipe.html")
    write_controller(paper_controller(), "earlier") if command == "design" else write_rig(
        paper_rig(), "earlier"
    )
    before, mine = sorted(place.iterdir()), (place / "earlier").read_text()
    asked = {**COMMANDS, **FOLDERS}[command]
    assert main([*asked, "--out", "earlier", "--report", report]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and report.partition("/")[0] in said
    assert sorted(place.iterdir()) == before and (place / "earlier").read_text() == mine


@pytest.mark.parametrize("path", ["/proc/x.html", "/proc/none/x.html"])
def test_a_system_that_takes_no_file_is_told(path):
    with pytest.raises(InputError, match="cannot be written"):
        check_writable(Path(path))


def test_a_controller_called_like_a_picture_is_refused(place):
    pytest.importorskip("matplotlib")
    with pytest.raises(InputError, match="is a picture's name"):
        shown.write_with_report("p/a.png", "text", "p", {"a.png": b"1"}, [])
    assert not (place / "p").exists()


def test_pictures_and_file_or_neither(place):
    with pytest.raises(InputError):
        shown.write_with_report("rig.toml/c.toml", "text", "p", {"a.png": b"1"}, [])
    assert not (place / "p").exists()
    shown.write_with_report("c.toml", "text", "p", {"a.png": b"1"}, [])
    assert (place / "c.toml").read_text() == "text" and (place / "p" / "a.png").read_bytes() == b"1"
