"""What figures draw is of the result that it lies beside.

Red when the curves of one study or diagnosis are drawn beside the verdict of another.
"""

import json
import shutil
from dataclasses import replace

import pytest

from focgen.cli.main import main
from focgen.diagnosis.write import write
from focgen.errors import InputError
from focgen.jsontext import check_tied, tied
from focgen.report.pages.files import read_diagnosis
from tests.conftest import paper_rig
from tests.report_samples import diagnosis, signals


@pytest.fixture
def two(tmp_path):
    """Two diagnoses that are alike but for a number."""
    for name, shrink in (("a", 0.9), ("b", 0.85)):
        found = replace(
            diagnosis(), shrink=shrink, drawn=signals(40), refitted=paper_rig(), augmented=paper_rig()
        )
        write(tmp_path / name, found, None, pictures=False)
    return tmp_path


def shown(folder) -> int:
    return main(["report", str(folder), "--out", str(folder.parent / "page.html")])


def test_figures_of_another_diagnosis_are_not_drawn(two, capsys):
    assert shown(two / "a") == 0
    shutil.copy(two / "b/signals.json", two / "a")
    assert shown(two / "a") == 2
    assert "signals.json: is not of diagnosis.json beside it" in capsys.readouterr().err


def test_a_verdict_that_was_edited_is_not_shown_beside_its_figures(two, capsys):
    place = two / "a/diagnosis.json"
    place.write_text(place.read_text().replace('"confidence": 0.8', '"confidence": 0.99'))
    assert shown(two / "a") == 2
    assert "or that was edited since" in capsys.readouterr().err


@pytest.mark.parametrize(("before", "after"), [
    ('"confidence": 0.8', '"confidence": 5'), ('"confidence": 0.8', '"confidence": -0.1'),
    ('"verdict": "set"', '"verdict": "certain"'),
])  # fmt: skip
def test_what_no_diagnosis_says_is_none(two, before, after):
    place = two / "a/diagnosis.json"
    place.write_text(place.read_text().replace(before, after))
    with pytest.raises(InputError, match="is no diagnosis"):
        read_diagnosis(place)


def test_a_checkout_with_other_ends_of_lines_is_the_same_result(tmp_path):
    """Under Windows git may write them: each figure was one of another result."""
    told = tmp_path / "study.json"
    told.write_bytes(b'{\r\n "x": 1\r\n}\r\n')
    value = json.loads(tied("{}", '{\n "x": 1\n}\n'))
    check_tied(value, tmp_path / "curves.json", told, "again")


def test_a_part_knows_what_it_is_of(tmp_path):
    told = tmp_path / "study.json"
    told.write_text('{"x": 1}\n')
    for text in ("{}", '{"rows":[]}\n'):
        value = json.loads(tied(text, told.read_text()))
        check_tied(value, tmp_path / "curves.json", told, "again")
        check_tied(json.loads(text), tmp_path / "curves.json", told, "again")  # of an earlier version
        with pytest.raises(InputError, match="is not of"):
            check_tied(value, tmp_path / "curves.json", tmp_path / "nothing.json", "again")
    told.write_text('{"x": 2}\n')
    with pytest.raises(InputError, match="curves.json: is not of study.json beside it"):
        check_tied(value, tmp_path / "curves.json", told, "again")
