"""No command writes over what it was given: not by another name, not through a link, not within a folder.

Red when a command overwrites one of its inputs by any path.
"""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import focgen
from focgen.cli.main import main
from focgen.codegen.generate import generate
from focgen.control.files import write_controller
from focgen.errors import InputError
from focgen.output import check_apart, write_file
from focgen.resources import shipped
from tests.conftest import paper_controller

SPELLINGS = ("itself", "relative", "through a folder", "symbolic link", "hard link", "linked folder")


def spelled(path: Path, how: str, monkeypatch) -> str:
    """Another name of the same file."""
    if how == "relative":
        monkeypatch.chdir(path.parent)
        return f"./{path.name}"
    if how == "through a folder":
        (path.parent / "below").mkdir()
        return str(path.parent / "below" / ".." / path.name)
    if how == "linked folder":
        (path.parent / "link").symlink_to(path.parent)
        return str(path.parent / "link" / path.name)
    if how in ("symbolic link", "hard link"):
        link = path.with_name("another")
        link.symlink_to(path) if how == "symbolic link" else os.link(path, link)
        return str(link)
    return str(path)


@pytest.fixture
def files(tmp_path) -> dict[str, Path]:
    """The inputs of every command, in a folder of their own."""
    place, given = tmp_path / "given", shipped("examples")
    place.mkdir()
    made = {name: place / name for name in ("rig.toml", "steps.csv", "controller.toml")}
    made["rig.toml"].write_bytes((given / "rig.toml").read_bytes())
    made["steps.csv"].write_bytes((given / "logs" / "steps.csv").read_bytes())
    write_controller(paper_controller(40), made["controller.toml"])
    return made


def refused(arguments: list, files: dict[str, Path], capsys) -> None:
    before = {name: path.read_bytes() for name, path in files.items()}
    assert main([str(part) for part in arguments]) == 2
    err = capsys.readouterr().err.splitlines()[-1]
    assert err.startswith("focgen: error: ") and "which would be lost" in err, err
    assert {name: path.read_bytes() for name, path in files.items()} == before


@pytest.mark.parametrize("how", SPELLINGS)
def test_an_output_that_is_an_input_is_refused_under_every_name(files, how, monkeypatch, capsys):
    out = spelled(files["steps.csv"], how, monkeypatch)
    refused(["identify", files["steps.csv"], "--rig", files["rig.toml"], "--out", out], files, capsys)
    with pytest.raises(InputError, match="is the input"):
        focgen.identify(files["rig.toml"], [files["steps.csv"]], out)


def test_a_rig_is_not_written_over_either(files, capsys):
    rig, log = files["rig.toml"], files["steps.csv"]
    refused(["identify", log, "--rig", rig, "--out", rig], files, capsys)
    unseen = rig.with_name("unseen.csv")
    unseen.write_bytes(log.read_bytes())
    refused(["identify", log, "--rig", rig, "--out", unseen, "--unseen", unseen], files, capsys)
    refused(["design", rig, "--out", rig], files, capsys)
    with pytest.raises(InputError, match="is the input"):
        focgen.design(rig, rig)


def test_nothing_is_computed_before_an_output_is_refused(files, monkeypatch):
    """A refusal after minutes of work would come too late."""
    from focgen.identification import identify as module

    monkeypatch.setattr(module, "rig_of", lambda path: pytest.fail("went on"))
    with pytest.raises(InputError, match="is the input"):
        focgen.identify(files["rig.toml"], [files["steps.csv"]], files["rig.toml"])


@pytest.mark.parametrize(
    "command",
    ("identify", pytest.param("design", marks=pytest.mark.long), "simulate"),
)
def test_a_picture_does_not_replace_an_input(files, command, tmp_path, capsys, monkeypatch):
    """The rig's file bears the name of a picture in the folder that the report goes to."""
    import focgen.cli.design
    import focgen.cli.identify
    import focgen.cli.simulate

    rig = files["rig.toml"].rename(files["rig.toml"].with_name("picture.png"))
    files["rig.toml"] = rig
    pictures = {"picture.png": b"a picture"}
    monkeypatch.setattr(focgen.cli.identify, "identification_pictures", lambda *a: pictures)
    monkeypatch.setattr(focgen.cli.design, "design_pictures", lambda *a: pictures)
    monkeypatch.setattr(focgen.cli.simulate, "simulation_pictures", lambda *a: pictures)
    out = tmp_path / "new.toml"
    asked = {
        "identify": ["identify", files["steps.csv"], "--rig", rig, "--out", out, "--to", "8", "--no-integer"],
        "design": ["design", rig, "--out", out],
        "simulate": ["simulate", rig, files["controller.toml"], "--setpoints", "0.005"],
    }
    if command != "identify":  # the example's rig is not identified yet
        from focgen.rig.files import write_rig
        from tests.conftest import paper_rig

        write_rig(paper_rig(), rig)
    refused([*asked[command], "--report", rig.parent], files, capsys)
    assert not out.exists(), "neither pictures nor rig"


def test_generate_beside_its_controller_keeps_it(files, capsys):
    """The folder's copy is the controller's own bytes: nothing is lost. Other bytes are refused, and
    ``--force`` is no leave to lose the input."""
    controller = files["controller.toml"]
    before = controller.read_bytes()
    generate(controller, controller.parent)
    assert controller.read_bytes() == before and (controller.parent / "spba.c").is_file()
    other = controller.with_name("README.md")
    other.write_bytes(before)
    refused(["generate", other, "--out", other.parent, "--force"], {**files, "README.md": other}, capsys)
    runtime = controller.with_name("foc_rt.h")
    runtime.write_bytes(before)
    refused(["generate", runtime, "--out", runtime.parent, "--force"], {**files, "foc_rt.h": runtime}, capsys)


def test_generate_does_not_remove_its_controller(files, capsys):
    """A manifest that calls the controller a header of an earlier run."""
    import json

    from focgen.codegen.manifest import sha256

    own = files["controller.toml"].rename(files["controller.toml"].with_name("foc_own.h"))
    manifest = {"name": "spba", "inputs": {"foc_own.h": sha256(own.read_bytes())}}
    (own.parent / "manifest.json").write_text(json.dumps(manifest))
    files["controller.toml"] = own
    refused(["generate", own, "--out", own.parent], files, capsys)


def test_a_study_spares_its_inputs(tmp_path, monkeypatch):
    from focgen.studies import write as study_write

    monkeypatch.setattr(study_write, "payload", lambda study: {})
    monkeypatch.setattr(study_write, "files_of", lambda study: {})
    monkeypatch.setattr(study_write, "curves_text", lambda study: "{}")
    mine = tmp_path / "study.json"
    mine.write_text("mine")
    with pytest.raises(InputError, match="is the input"):
        study_write.write(None, tmp_path, [mine])
    assert mine.read_text() == "mine"


@pytest.mark.parametrize("name", ("diagnosis.json", "refitted.toml", "augmented.toml"))
def test_a_diagnosis_of_an_earlier_result_is_refused(files, name, capsys):
    """diagnose gap/refitted.toml … --out gap: the next rig would replace the one it was found from."""
    rig = files["rig.toml"].rename(files["rig.toml"].with_name(name))
    asked = ["diagnose", rig, files["steps.csv"], "--out", rig.parent]
    refused(asked, {**files, "rig.toml": rig}, capsys)
    assert sorted(p.name for p in rig.parent.iterdir()) == sorted((name, "controller.toml", "steps.csv"))


def test_what_a_diagnosis_writes_is_known_beforehand(tmp_path):
    """The names that are looked at before the work, and those that are written after it."""
    from focgen.diagnosis.diagnose import NEXT, WRITTEN
    from focgen.diagnosis.drawn import Drawn
    from focgen.diagnosis.proposals.limits import InputLimits
    from focgen.diagnosis.proposals.menu import Choice
    from focgen.diagnosis.write import write
    from tests.conftest import paper_rig
    from tests.report_samples import diagnosis

    rig = paper_rig()
    drawn = Drawn("command", {}, 0, 0, (), (), ("command", "output"), (), ())
    found = replace(diagnosis(), refitted=rig, augmented=rig, drawn=drawn)
    asked = Choice("a step", np.array([0.0, 1.0]), InputLimits(0.0, 2.0, 0.0, np.inf, 9.0, 1.0, 0.1, 2))
    write(tmp_path, found, asked, pictures=False)
    assert {path.name for path in tmp_path.iterdir()} == {*WRITTEN, NEXT}
    assert (tmp_path / NEXT).read_text().splitlines() == ["time_s,input", "0,0", "0.05,0", "0.1,2", "0.15,2"]
    mine = [tmp_path / "refitted.toml"]
    mine[0].write_text("mine")
    with pytest.raises(InputError, match="is the input"):
        write(tmp_path, found, asked, pictures=False, inputs=mine)
    assert mine[0].read_text() == "mine"


def test_what_is_no_path_is_no_file(tmp_path):
    check_apart([tmp_path / "new", tmp_path / "a\0b"], [None, 3, {"a": 1}, b"bytes", "", "\0", object()])


def test_a_link_in_the_way_of_writing_is_not_followed(tmp_path):
    """What is written first, beside the target, has a name that is new."""
    victim = tmp_path / "victim"
    victim.write_text("precious")
    for name in (".out.toml.part", ".focgen-out.part"):
        (tmp_path / name).symlink_to(victim)
    (tmp_path / "out.toml").symlink_to(victim)
    write_file(tmp_path / "out.toml", "new")
    assert victim.read_text() == "precious" and (tmp_path / "out.toml").read_text() == "new"
    assert not (tmp_path / "out.toml").is_symlink()
