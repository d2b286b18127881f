"""What results replace: files of their own kind, and nothing else.

Red when notes, a log or a rig is lost to a controller, a rig with a model to a proposal, or whatever has the
name of a page, a picture or a part of a result to that.
"""

from dataclasses import replace

import pytest

import focgen
from focgen.cli.main import main
from focgen.cli.shown import write_report, write_with_report
from focgen.control.files import write_controller
from focgen.diagnosis.diagnose import WRITTEN as DIAGNOSED
from focgen.diagnosis.proposals.next_experiment import NEXT
from focgen.diagnosis.write import PICTURES, write
from focgen.errors import InputError
from focgen.replaced import check_own
from focgen.report.page import Page
from focgen.report.style import figure, png
from focgen.resources import shipped
from focgen.rig.files import check_replaces_rig, write_rig
from focgen.studies.write import WRITTEN as STUDIED
from focgen.tomlfile import check_replaced
from tests.conftest import paper_controller, paper_rig
from tests.report_samples import diagnosis, signals

LOG = str(shipped("examples") / "logs" / "steps.csv")
COMMANDS = {
    "init": ["init", LOG, "--out", "OUT"],
    "identify": ["identify", LOG, "--rig", "rig.toml", "--out", "OUT"],
    "design": ["design", "rig.toml", "--out", "OUT"],
}
FOREIGN = {
    "notes": "what I found out in March\n",
    "log": "t,u,y\n0,1,2\n",
    "another's TOML": '[project]\nname = "mine"\n',
    "no text": b"\xff\xfe\x00",
}


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_rig(paper_rig(), "rig.toml")
    return tmp_path


def refused(command, capsys):
    capsys.readouterr()
    assert main(["out" if part == "OUT" else part for part in COMMANDS[command]]) == 2
    said = capsys.readouterr().err
    assert "would be replaced by one" in said and said.count("\n") == 1


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("what", FOREIGN)
def test_what_is_of_another_kind_stays(place, command, what, capsys):
    text = FOREIGN[what]
    (place / "out").write_bytes(text if isinstance(text, bytes) else text.encode())
    before = (place / "out").read_bytes()
    refused(command, capsys)
    assert (place / "out").read_bytes() == before


def test_neither_stands_for_the_other(place, capsys):
    write_controller(paper_controller(), "out")
    refused("init", capsys)
    refused("identify", capsys)
    write_rig(paper_rig(), "out")
    refused("design", capsys)


def test_a_rig_with_a_model_is_not_lost_to_a_proposal(place, capsys):
    """Somebody has put it there since."""
    assert main(["init", LOG, "--out", "out"]) == 0 == main(["init", LOG, "--out", "out"])
    proposed = (place / "out").read_text()
    (place / "out").write_text(proposed + "\n[actuator]\nT = 1.0\nalpha = 0.6\ngain = [1.0]\n")
    refused("init", capsys)
    check_replaces_rig("out")


def test_the_functions_ask_the_same(place):
    (place / "out").write_text("mine")
    for call in (
        lambda: focgen.init(LOG, "out"),
        lambda: focgen.identify("rig.toml", LOG, "out"),
        lambda: focgen.design("rig.toml", "out"),
    ):
        with pytest.raises(InputError, match="would be replaced by one"):
            call()


@pytest.mark.parametrize("text", ["", 'sample_time = 0.01\n[transfer]\nmine = "too"\n'])
def test_an_empty_file_and_one_of_the_kind_are_replaced(place, text):
    (place / "out").write_text(text)
    check_replaced("out", "controller", ("sample_time", "transfer"))
    check_replaced("nowhere", "controller", ("sample_time", "transfer"))


# ------------------------------------------------------------- pages, pictures, folders of results


@pytest.fixture
def results(place):
    write_controller(paper_controller(40), "c.toml")
    return place


OTHERS = {
    "report": ["report", "c.toml", "--out", "PLACE"],
    "simulate --report": ["simulate", "rig.toml", "c.toml", "--report", "PLACE"],
    "design --report": ["design", "rig.toml", "--out", "new.toml", "--report", "PLACE"],
    "identify --report": ["identify", LOG, "--rig", "rig.toml", "--out", "new.toml", "--report", "PLACE"],
    "diagnose": ["diagnose", "rig.toml", LOG, "--out", "FOLDER"],
    "study": ["study", "memory", "c.toml", "--out", "FOLDER"],
    "trial score": ["trial", "score", "t", "--out", "FOLDER"],
}
PAGES = [name for name in OTHERS if name == "report" or "--report" in name]


def spared(place, command, name, capsys):
    """That somebody's file of this name stays, before anything takes time, and nothing is written."""
    (place / "f").mkdir(exist_ok=True)
    mine = place / "f" / name
    mine.write_text("what I found out in March\n")
    before = sorted(place.rglob("*"))
    parts = [{"PLACE": str(mine), "FOLDER": "f"}.get(part, part) for part in OTHERS[command]]
    capsys.readouterr()
    assert main(parts) == 2
    said = capsys.readouterr().err
    assert name in said and "and would be lost" in said and said.count("\n") == 1
    assert mine.read_text() == "what I found out in March\n" and sorted(place.rglob("*")) == before
    mine.unlink()


@pytest.mark.parametrize("command", PAGES)
def test_no_page_takes_the_place_of_somebodys(results, command, capsys):
    spared(results, command, "notes.html", capsys)
    spared(results, command, "NOTES.HTM", capsys)


def test_a_report_takes_the_place_of_no_log(results, capsys):
    spared(results, "report", "other.csv", capsys)


def test_a_page_takes_the_place_of_no_result_of_another_kind(results, capsys):
    """A study's own file, a diagnosis's rig and its pictures are focgen's, and no pages."""
    found = replace(diagnosis(), drawn=signals(), refitted=paper_rig(), augmented=paper_rig())
    write(results / "f", found, None, pictures=False)
    with figure() as (fig, _):
        (results / "f" / "loops.png").write_bytes(png(fig))
    for name in ("diagnosis.json", "signals.json", "refitted.toml", "loops.png"):
        before = (results / "f" / name).read_bytes()
        assert main(["report", "c.toml", "--out", f"f/{name}"]) == 2
        assert "and would be lost" in capsys.readouterr().err
        assert (results / "f" / name).read_bytes() == before


@pytest.mark.parametrize(("command", "names"), [
    ("diagnose", (*DIAGNOSED, NEXT, *PICTURES)),
    ("study", STUDIED),
    ("trial score", ("scores.md", "reliability.png", "confusion_C_full.png")),
])  # fmt: skip
def test_no_folder_of_results_does(results, command, names, capsys):
    for name in names:
        spared(results, command, name, capsys)


def test_no_picture_does(results):
    """A photograph has the name; the folder's other picture is not written either."""
    (results / "setpoints.png").write_bytes(b"\x89PNG\r\n\x1a\nphotograph")
    for call in (
        lambda: write_report(".", {"other.png": b"2", "setpoints.png": b"2"}, ()),
        lambda: write_with_report("new.toml", "", ".", {"other.png": b"2", "setpoints.png": b"2"}, ()),
    ):
        with pytest.raises(InputError, match="setpoints.png: is nothing that focgen has written"):
            call()
    assert not (results / "other.png").exists() and not (results / "new.toml").exists()


def test_what_is_of_the_kind_is_replaced(place):
    found = replace(diagnosis(), drawn=signals(), refitted=paper_rig(), augmented=paper_rig())
    write(place, found, None, pictures=False)
    (place / "page.html").write_text(Page("title", "lead").html())
    (place / "moving.html").write_text(Page("title", "lead").self_contained())
    with figure() as (fig, axes):
        axes.plot([0.0, 1.0], [0.0, 1.0])
        (place / "setpoints.png").write_bytes(png(fig))
    (place / "empty.html").touch()
    ours = ("page.html", "moving.html", "empty.html", "setpoints.png", *DIAGNOSED)
    check_own(place / name for name in (*ours, "nowhere.png"))
    for name in ("setpoints.png", "diagnosis.json", "signals.json"):
        content = (place / name).read_bytes()
        (place / name).write_bytes(content[: len(content) // 3])
        with pytest.raises(InputError, match=name):
            check_own([place / name])


@pytest.mark.parametrize("word", ["--out", "--out="])
def test_an_empty_argument_is_no_current_folder(results, word, capsys):
    """A variable of the shell that is not set."""
    before = sorted(results.rglob("*"))
    for command in (["generate", "c.toml"], ["study", "memory", "c.toml"], ["report", "c.toml"]):
        assert main([*command, *([word, ""] if word == "--out" else [word])]) == 2
        assert "--out: is empty" in capsys.readouterr().err
    with pytest.raises(InputError, match="is ''; give a path"):
        focgen.generate("c.toml", "")
    with pytest.raises(InputError, match=r"^\.: is a folder where a file belongs"):
        focgen.report("c.toml", ".")
    assert sorted(results.rglob("*")) == before


@pytest.mark.parametrize("command", ["diagnose", "trial score"])
def test_a_folder_that_cannot_be_written_is_told_before_anything_is_done(results, command, capsys):
    (results / "f").write_text("a file")
    parts = ["f/out" if part == "FOLDER" else part for part in OTHERS[command]]
    assert main(parts) == 2
    said = capsys.readouterr().err
    assert "/f: is a file where a folder belongs" in said and said.count("\n") == 1
