"""Logs → rig → controller → C: each says what it came from, and verify says what does not fit."""

import hashlib
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from focgen.cli.main import main
from focgen.control.controller import Source
from focgen.control.files import controller_from, write_controller
from focgen.rig.files import read_rig, rig_text
from focgen.verification.folder import read_folder

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """Logs, rig, identified rig, a controller that names it, and its C."""
    place = tmp_path_factory.mktemp("chain")
    (place / "logs").mkdir()
    shutil.copy(EXAMPLES / "logs" / "steps.csv", place / "logs")
    shutil.copy(EXAMPLES / "rig.toml", place)
    new = place / "identified.toml"
    asked = ["identify", str(place / "logs" / "steps.csv"), "--rig", str(place / "rig.toml"), "--to", "10"]
    assert main([*asked, "--no-integer", "--out", str(new)]) == 0
    source = Source("identified.toml", digest(new))
    controller = replace(controller_from(EXAMPLES / "controller.toml"), designed_from=source)
    write_controller(controller, place / "controller.toml")
    asked = ["generate", str(place / "controller.toml"), "--out", str(place / "fw"), "--length", "5"]
    assert main(asked) == 0
    return place


@pytest.fixture
def chain(made, tmp_path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "chain"))


def test_a_rig_says_what_it_was_identified_from(made):
    told = tomllib.loads((made / "identified.toml").read_text())["identified_from"]
    assert told["files"] == [
        {"file": name, "sha256": digest(made / name)} for name in ("logs/steps.csv", "rig.toml")
    ]
    assert told["options"] == {"to": 10.0, "gain_degree": 1, "stages": ["actuator"], "delay": False}
    assert "identified_from" not in rig_text(read_rig(made / "identified.toml"))  # a refit has its own


def test_a_whole_chain_has_nothing_to_say(chain):
    assert read_folder(chain / "fw").notes == ()


@pytest.mark.parametrize("name", ("logs/steps.csv", "rig.toml", "identified.toml"))
def test_any_link_that_does_not_fit_is_named(chain, name, capsys):
    (chain / name).write_bytes((chain / name).read_bytes() + b"\n")
    (note,) = read_folder(chain / "fw").notes
    assert note.startswith(f"{chain / name}: is not ")
    assert main(["verify", str(chain / "fw"), "--samples", "10"]) == 0  # the C is what its controller gives
    assert note in capsys.readouterr().out


@pytest.mark.parametrize("name", ("logs/steps.csv", "rig.toml", "identified.toml"))
def test_what_is_not_there_is_passed_over(chain, name):
    (chain / name).unlink()
    assert read_folder(chain / "fw").notes == ()


@pytest.mark.parametrize(
    "told",
    (
        "files = 3",
        "files = [1]",
        'files = [{ file = "/etc/passwd", sha256 = "x" }]',
        'files = [{ file = "a\\u0000" }]',
    ),
)
def test_a_strangers_table_leads_nowhere(chain, told):
    rig, own = chain / "identified.toml", chain / "fw" / "controller.toml"
    rig.write_text((EXAMPLES / "rig.toml").read_text() + f"\n[identified_from]\n{told}\n")
    before = tomllib.loads(own.read_text())["designed_from"]["sha256"]
    own.write_text(own.read_text().replace(before, digest(rig)))
    assert not [note for note in read_folder(chain / "fw").notes if "identified from" in note]
    assert read_rig(rig).name == read_rig(EXAMPLES / "rig.toml").name
