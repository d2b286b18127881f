"""Whoever judges what stands in a folder has what a kill interrupted there finished first.

Red when files that were on their way are called somebody's, edited, missing or of no trial.
"""

import json
from pathlib import Path

import pytest

from focgen import demonstration, journal, output
from focgen.errors import InputError
from focgen.resources import shipped
from focgen.trials.facts import facts_of
from focgen.trials.make import make
from focgen.verification.folder import read_folder
from tests.conftest import paper_controller

SMALL = {"cases": 1, "seed": 1, "signals": "A", "suite": "short"}


class Died(BaseException):
    """As if the process had been killed."""


@pytest.fixture
def dying(monkeypatch):
    """The process dies once the new result counts, ahead of the first file's move."""

    def died(work):
        def carry_out(whole, plan, target):
            raise Died

        with monkeypatch.context() as patched, pytest.raises(Died):
            patched.setattr(journal, "_carry_out", carry_out)
            work()

    return died


def left(folder: Path) -> list[Path]:
    return list(folder.rglob(".focgen-*"))


def test_a_trial_that_lacks_its_last_move_is_made_by_the_same_command(tmp_path, dying, monkeypatch):
    clean, there = tmp_path / "clean", tmp_path / "there"
    made = make(clean, **SMALL)
    real = output.write_files

    def whole(folder, files, **options):
        if "trial.json" not in files:
            return real(folder, files, **options)
        return dying(lambda: real(folder, files, **options))

    with monkeypatch.context() as patched:
        patched.setattr("focgen.trials.make.write_files", whole)
        make(there, **SMALL)
    assert left(there) and not (there / "trial.json").exists()
    with pytest.raises(InputError, match="already holds a trial"):
        make(clean, **SMALL)
    assert make(there, **SMALL).commitments == made.commitments and not left(there)
    assert (there / "trial.json").read_bytes() == (clean / "trial.json").read_bytes()


def test_of_another_trial_it_is_finished_and_kept(tmp_path, dying):
    whole = json.dumps({"suite": "short", "signals": "A", "seed": 1, "commitments": {}})
    dying(lambda: output.write_files(tmp_path, {"trial.json": whole}))
    with pytest.raises(InputError, match="already holds a trial"):
        make(tmp_path, **SMALL)
    assert (tmp_path / "trial.json").read_text() == whole


def test_a_trial_is_run_and_scored_with_the_results_that_it_has(tmp_path, dying):
    facts = {"suite": "short", "signals": "A", "seed": 1, "commitments": {}}
    output.write_files(tmp_path, {"trial.json": json.dumps(facts)})
    for name, text in (("runs/0001", "old"), ("result", "new")):
        output.write_files(tmp_path / name, {"outcome.json": text})
    dying(lambda: output.replace_folder(tmp_path / "result", tmp_path / "runs" / "0001", tmp_path))
    facts_of(tmp_path)
    assert (tmp_path / "runs" / "0001" / "outcome.json").read_text() == "new" and not left(tmp_path)


def test_a_demo_that_was_killed_as_its_files_moved_is_nobodys_edit(tmp_path, dying, monkeypatch):
    class Begun(Exception):
        """As far as the chain: nothing was refused."""

    def begun(folder):
        raise Begun

    monkeypatch.setattr(demonstration, "_chain", begun)
    given = {name: (shipped("examples") / name).read_bytes() for name in demonstration._GIVEN}
    output.write_files(tmp_path, {**given, "report.html": "old"})
    old = json.dumps({"focgen": "0.1.0", "files": demonstration._digests(tmp_path)})
    output.write_files(tmp_path, {"demo.json": old})
    scratch = tmp_path / "scratch"
    output.write_files(scratch, {**given, "report.html": "new"})
    new = json.dumps({"focgen": "0.1.0", "files": demonstration._digests(scratch)})
    dying(lambda: output.write_files(tmp_path, {"demo.json": new, "report.html": "new"}))
    (tmp_path / "report.html").write_text("new")  # the first of the moves was done
    with pytest.raises(Begun):
        demonstration.demo(tmp_path)


def test_a_folder_within_one_that_is_on_its_way_is_finished_with_it(tmp_path, dying, generated):
    files = {f"a/b/{path.name}": path.read_bytes() for path in generated.iterdir() if path.is_file()}
    old = {name: text for name, text in files.items() if not name.endswith("README.md")}
    output.write_files(tmp_path, old)
    dying(lambda: output.write_files(tmp_path, files))
    folder = tmp_path / "a" / "b"
    assert not (folder / "README.md").exists()
    assert read_folder(folder).differences == read_folder(generated).differences
    assert (folder / "README.md").exists() and not left(tmp_path)


@pytest.fixture
def generated(tmp_path):
    from focgen.codegen.generate import generate

    folder = tmp_path / "generated"
    generate(paper_controller(20), folder, arithmetic="f64")
    return folder


def test_what_somebody_else_left_above_is_not_waited_for(tmp_path, monkeypatch):
    """In a shared folder anybody may lay something of the name there, and hold its lock."""
    (tmp_path / ".focgen-0123456789abcdef.whole").mkdir(mode=0o777)
    (tmp_path / ".focgen-0123456789abcdef.whole").chmod(0o777)
    (tmp_path / "here").mkdir()

    def waited(folder):
        raise AssertionError(folder)

    monkeypatch.setattr(journal, "waited_for", waited)
    assert not journal.finish(tmp_path / "here") and not journal.finish(tmp_path)
