"""A verification on a page speaks of the C that stands beside it, and of no other.

Red when a page says of C that was never compared that the comparison holds.
"""

import hashlib
import json
import shutil
from dataclasses import replace

import pytest

import focgen
from focgen.cli.main import main
from focgen.control.controller import Source
from focgen.control.files import read_controller, write_controller
from focgen.errors import InputError
from focgen.report import paths
from focgen.report.page import Section
from focgen.report.pages.chain import controller_section
from focgen.report.verified import read_verified
from focgen.rig.files import write_rig
from tests.conftest import paper_controller, paper_rig

pytest.importorskip("bokeh")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A generated folder, what verify printed of it, and its controller."""
    place = tmp_path_factory.mktemp("verified")
    focgen.generate(paper_controller(), place / "fw", "q15", length=8)
    (place / "v.json").write_text(json.dumps(printed(place / "fw")))
    shutil.copy(place / "fw" / "controller.toml", place)
    return place


def printed(folder, edited=False):
    from focgen.report.firmware_summary import verification_payload

    return verification_payload(focgen.verify(folder, samples=20, edited=edited))


@pytest.fixture
def given(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "given")


def page_of(given, *names):
    return focgen.report([given / name for name in names], given / "p.html").read_text(encoding="utf-8")


def test_a_verification_names_its_folder(given):
    text = page_of(given, "v.json", "fw", "controller.toml")
    assert "with the reference holds" in text and f"in {given / 'fw'}" in text
    assert "another controller.toml" not in text


def test_alone_it_names_what_it_speaks_of(given):
    digest = json.loads((given / "v.json").read_text())["files"]["manifest.json"]
    assert digest in page_of(given, "v.json")


@pytest.mark.parametrize("name", ["spba.c", "spba.h", "foc_rt.h", "controller.toml", "manifest.json"])
def test_a_verification_of_another_folder_is_refused(given, name, capsys):
    path = given / "fw" / name
    path.write_bytes(path.read_bytes() + b"\n")
    asked = ["report", str(given / "v.json"), str(given / "fw"), "--out", str(given / "p.html")]
    assert main(asked) == 2 and not (given / "p.html").exists()
    line = capsys.readouterr().err
    assert f"{name} is another" in line and "focgen verify" in line and line.count("\n") == 1


def test_one_of_before_is_refused(given):
    focgen.generate(paper_controller(), given / "fw", "q15", length=9)
    with pytest.raises(InputError, match="is not of .*fw as it stands"):
        page_of(given, "fw", "v.json")


def test_one_that_names_no_files_is_refused_beside_a_folder(given):
    found = json.loads((given / "v.json").read_text())
    del found["files"]
    (given / "v.json").write_text(json.dumps(found))
    assert "does not say which files" in page_of(given, "v.json")
    with pytest.raises(InputError, match="does not say which files"):
        page_of(given, "v.json", "fw")


def test_texts_and_examples_are_the_users(given):
    (given / "fw" / "README.md").write_text("mine")
    (given / "fw" / "example" / "main.c").write_text("mine")
    assert "with the reference holds" in page_of(given, "v.json", "fw")


def test_an_edited_folder_that_was_verified_as_such_is_shown(given):
    path = given / "fw" / "spba.c"
    path.write_bytes(path.read_bytes() + b"\n")
    (given / "v.json").write_text(json.dumps(printed(given / "fw", edited=True)))
    assert "does NOT hold" in page_of(given, "v.json", "fw")


@pytest.mark.parametrize(
    "key, value",
    [
        ("mismatches", 1),
        ("samples", 0),
        ("within", False),
        ("header", ["x"]),
        ("selftest", 3),
        ("skipped", "why"),
    ],
)
def test_a_verdict_against_its_numbers_is_refused(given, key, value):
    found = json.loads((given / "v.json").read_text())
    found["targets"]["host"][key] = value
    (given / "v.json").write_text(json.dumps(found))
    with pytest.raises(InputError, match="says that it holds, and its numbers do not"):
        read_verified(given / "v.json")


def test_a_folder_elsewhere_is_not_looked_into(given):
    found = json.loads((given / "v.json").read_text())
    found["files"]["../controller.toml"] = found["files"]["controller.toml"]
    (given / "v.json").write_text(json.dumps(found))
    with pytest.raises(InputError, match="controller.toml is another"):
        page_of(given, "v.json", "fw")


def test_c_of_another_controller_is_told_of(given):
    path = given / "controller.toml"
    path.write_bytes(path.read_bytes() + b"\n")
    assert "generated from another controller.toml" in page_of(given, "fw", "controller.toml")


CLAIM = "which is proved"


@pytest.mark.parametrize("name", ["spba.c", "foc_rt.h", "manifest.json"])
def test_c_that_was_edited_is_told_of_where_the_page_says_what_is_proved(given, name):
    text = page_of(given, "fw")
    assert CLAIM in text and "Warning: " not in text
    path = given / "fw" / name
    text = path.read_text()
    path.write_text(text.replace('"worst": ', '"worst": 1') if name == "manifest.json" else text + "\n")
    assert f"Warning: {name}" in page_of(given, "fw")


def test_a_folder_that_is_not_whole_is_told_of(given):
    (given / "fw" / "spba.c").unlink()
    assert "was not looked at: it lacks spba.c" in page_of(given, "fw")


def test_a_controller_of_another_rig_is_told_of(given, monkeypatch):
    write_rig(paper_rig(), given / "rig.toml")
    digest = hashlib.sha256((given / "rig.toml").read_bytes()).hexdigest()
    for of, told in ((digest, False), ("0" * 64, True)):
        made = replace(paper_controller(), designed_from=Source("rig.toml", of))
        write_controller(made, given / "c.toml")
        section = controller_section(read_controller(given / "c.toml"), digest)
        assert ("designed from another rig" in " ".join(section.sentences)) == told
    monkeypatch.setattr(paths, "rig_section", lambda rig: Section("Model"))  # each takes seconds
    monkeypatch.setattr(paths, "simulate", lambda *given: None)
    monkeypatch.setattr(paths, "simulation_sections", lambda found: [])
    assert "designed from another rig" in page_of(given, "rig.toml", "c.toml")
