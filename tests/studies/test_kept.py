"""A study read back from its folder: equal, or refused.

Red when a study whose parts do not fit together is taken, and a page of it ends in a fault.
"""

import json
import shutil
from dataclasses import replace

import pytest

import focgen
from focgen.control.controller import GainSchedule
from focgen.control.files import write_controller
from focgen.errors import ControllerError, InputError
from focgen.studies.kept import read_study
from tests.conftest import paper_controller, paper_rig
from tests.studies.here import answered_here

SMALL = {"lengths": [5, 20], "memory": ["short"], "arithmetic": ["q15"], "sample_times": [0.01], "jobs": 1}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    write_controller(paper_controller(20), folder / "c.toml")
    with answered_here(pictures=False):
        focgen.study("memory", folder / "c.toml", folder / "study", rig=paper_rig(), **SMALL)
    return folder / "study"


def test_it_is_read_as_it_was_written(folder):
    found = read_study(folder)
    told = json.loads((folder / "study.json").read_text())
    assert [row.error for row in found.rows] == [row["error"] for row in told["rows"]]
    assert found.plant and len(found.plant.rows) == len(told["plant"]["rows"])


def row_without_an_error(told, kept):
    del told["plant"]["rows"][-1]["errors"][next(iter(told["plant"]["rows"][0]["errors"]))]


def shorter_time(told, kept):
    kept["plant"]["time"].pop()


def shorter_curve(told, kept):
    kept["rows"][0]["phase_deg"].pop()


def text_for_a_number(told, kept):
    told["rows"][0]["error"] = "small"


def front_without_row(told, kept):
    told["pareto"] = {"ram_bytes": [len(told["rows"])]}


def list_for_curves(told, kept):
    kept["rows"] = {"omega": []}


def band_of_one(told, kept):
    told["rows"][0]["band"] = [1.0]


def no_plant_drawn(told, kept):
    kept["plant"] = None


DAMAGES = (row_without_an_error, shorter_time, shorter_curve, text_for_a_number, front_without_row,
           list_for_curves, band_of_one, no_plant_drawn)  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda d: d.__name__)
def test_parts_that_do_not_fit_are_refused(folder, tmp_path, damage):
    told, kept = (json.loads((folder / name).read_text()) for name in ("study.json", "curves.json"))
    damage(told, kept)
    (tmp_path / "study.json").write_text(json.dumps(told))
    (tmp_path / "curves.json").write_text(json.dumps(kept))
    with pytest.raises(InputError, match="no study that can be read"):
        read_study(tmp_path)


@pytest.mark.parametrize(
    "part",
    (pytest.param("rows", marks=pytest.mark.long), "ideal", pytest.param("plant", marks=pytest.mark.long)),
)
def test_points_that_are_none_are_a_gap_of_their_curve(folder, tmp_path, part):
    """What JSON has for NaN, in every curve: once a fault of `report`."""
    shutil.copytree(folder, tmp_path / "study")
    kept = json.loads((folder / "curves.json").read_text())
    curves = [kept["plant"]] if part == "plant" else kept[part]
    for curve in curves:
        for values in curve.values():
            for one in values if isinstance(values, list) and isinstance(values[0], list) else [values]:
                if isinstance(one, list):
                    one[len(one) // 2] = None
    (tmp_path / "study" / "curves.json").write_text(json.dumps(kept))
    assert focgen.report(tmp_path / "study", out=tmp_path / "page.html")


def test_a_study_of_nothing_is_refused(tmp_path):
    """Of two gains a millionth of the range apart no variant has the bits for the slope."""
    steep = replace(paper_controller(20), gain=GainSchedule((0.0, 1e-7), (48.0, 42.0)))
    with answered_here(), pytest.raises(ControllerError, match="gives nothing to study: 2 rows"):
        focgen.study("memory", steep, tmp_path / "study", **SMALL)
    assert not (tmp_path / "study" / "study.json").exists()
