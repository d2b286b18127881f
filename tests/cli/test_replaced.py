"""What ``init``, ``identify`` and ``design`` replace: a file of their own kind, and nothing else.

Red when notes, a log or a rig is lost to a controller, or a rig with a model to a proposal.
"""

import pytest

import focgen
from focgen.cli.main import main
from focgen.control.files import write_controller
from focgen.errors import InputError
from focgen.resources import shipped
from focgen.rig.files import check_replaces_rig, write_rig
from focgen.tomlfile import check_replaced
from tests.conftest import paper_controller, paper_rig

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
