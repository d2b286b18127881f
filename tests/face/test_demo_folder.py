"""The demo replaces what an earlier one has written, and nothing else.

Red when a log, a rig or a controller of the user's is lost to the example's of the same name.
"""

import json

import pytest

from focgen import demonstration
from focgen.cli.main import main
from focgen.errors import InputError
from focgen.resources import shipped


class Begun(Exception):
    """As far as the chain: nothing was refused."""


@pytest.fixture
def chain(monkeypatch):
    def begun(folder):
        raise Begun

    monkeypatch.setattr(demonstration, "_chain", begun)


def put(folder, files):
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


@pytest.mark.parametrize(
    "name",
    ["logs/steps.csv", "logs/sines.csv", "rig.toml", "identified.toml", "controller.toml", "demo.json"],
)
def test_what_the_user_has_is_named_before_anything_is_done(tmp_path, chain, name, capsys):
    put(tmp_path, {name: "mine"})
    assert main(["demo", "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert f"{name} would be replaced" in said and "--force" in said and said.count("\n") == 1
    assert [path.read_text() for path in tmp_path.rglob("*") if path.is_file()] == ["mine"]
    with pytest.raises(Begun):
        demonstration.demo(tmp_path, force=True)


def record(folder):
    files = demonstration._digests(folder)
    put(folder, {"demo.json": json.dumps({"focgen": "0.1.0", "files": files})})


def test_a_demo_replaces_a_demo(tmp_path, chain):
    examples = shipped("examples")
    put(tmp_path, {name: (examples / name).read_text() for name in demonstration._GIVEN})
    put(tmp_path, {"identified.toml": "of an earlier version", "firmware/q31/spba.c": "as well"})
    record(tmp_path)
    with pytest.raises(Begun):
        demonstration.demo(tmp_path)


@pytest.mark.parametrize("name", ["rig.toml", "firmware/q31/spba.c"])
def test_what_was_edited_in_a_demo_stays(tmp_path, chain, name):
    put(tmp_path, {"rig.toml": "as it was", "firmware/q31/spba.c": "as it was"})
    record(tmp_path)
    put(tmp_path, {name: "mine"})
    with pytest.raises(InputError, match=f"{name} would be replaced"):
        demonstration.demo(tmp_path)


def test_what_came_meanwhile_stays(tmp_path):
    """Looked at once more, with every name, as the files take their places."""
    put(tmp_path / "made", {"pictures/fits.png": "new", "rig.toml": "same"})
    put(tmp_path / "there", {"pictures/fits.png": "mine", "rig.toml": "same"})
    with pytest.raises(InputError, match="pictures/fits.png would be replaced"):
        demonstration._going(tmp_path / "made", tmp_path / "there")
