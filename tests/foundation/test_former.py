"""A result in the folder of a former one: what that left and this one lacks would look like a part of it.

Red when a picture or a table of another diagnosis, study or trial stays beside the new one, or when
something of the user's goes.
"""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from focgen.cli import trial
from focgen.diagnosis import write as diagnosed
from focgen.output import former, write_files
from focgen.report import diagnosis as pictures
from focgen.studies import write as studied
from tests.conftest import paper_rig
from tests.report_samples import diagnosis, signals


def names(folder):
    return {path.name for path in folder.iterdir()}


def test_what_the_former_has_left_goes_and_the_rest_stays(tmp_path):
    write_files(tmp_path, {"told.json": "1", "a.png": "1", "b.png": "1", "mine.png": "1"})
    new = {"told.json": "2", "a.png": "2"}
    write_files(tmp_path, new, old=former(tmp_path, "told.json", ("a.png", "b.png", "c.png"), new))
    assert names(tmp_path) == {"told.json", "a.png", "mine.png"}


def test_where_nothing_was_told_of_all_is_somebodys(tmp_path):
    write_files(tmp_path, {"b.png": "mine"})
    new = {"told.json": "2", "a.png": "2"}
    write_files(tmp_path, new, old=former(tmp_path, "told.json", ("a.png", "b.png"), new))
    assert names(tmp_path) == {"told.json", "a.png", "b.png"}


def test_a_diagnosis_knows_all_that_is_drawn_of_it(tmp_path, monkeypatch):
    for name in ("ladder", "residual", "loops", "waterfall", "candidates"):
        monkeypatch.setattr(pictures, name, lambda *given: b"1")
    drawn = pictures.diagnosis_pictures(SimpleNamespace(drawn=SimpleNamespace(residual=1, rivals=[1])))
    assert set(drawn) == set(diagnosed.PICTURES)
    write_files(tmp_path, {"diagnosis.json": "{}", diagnosed.NEXT: "t\n", **drawn, "mine.png": "mine"})
    found = replace(diagnosis(), drawn=signals(), refitted=paper_rig(), augmented=paper_rig())
    diagnosed.write(tmp_path, found, None, pictures=False)
    kept = {"diagnosis.json", "signals.json", "refitted.toml", "augmented.toml", "mine.png"}
    assert names(tmp_path) == kept


def test_a_study_too(tmp_path, monkeypatch):
    study = SimpleNamespace()
    monkeypatch.setattr(studied, "payload", lambda study: {})
    monkeypatch.setattr(studied, "curves_text", lambda study: "{}")
    monkeypatch.setattr(studied, "files_of", lambda study: {"pareto.png": b"2"})
    write_files(tmp_path, {"study.json": "{}", "plant.png": "1", "pareto.png": "1", "mine.png": "mine"})
    studied.write(study, tmp_path)
    assert names(tmp_path) == {"study.json", "curves.json", "pareto.png", "mine.png"}


@pytest.mark.parametrize(
    "name, own", [("confusion_A_full.png", True), ("reliability.png", True), ("my.png", False)]
)
def test_a_trial_knows_its_pictures(name, own):
    assert bool(trial._DRAWN.fullmatch(name)) == own
