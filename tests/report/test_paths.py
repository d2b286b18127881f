"""``focgen report``: what it reads back is what was written, and what it cannot use is one line.

Red when a path is shown as what it is not, or a damaged one brings a traceback.
"""

import json
import sys

import numpy as np
import pytest

import focgen
from focgen.cli.main import main
from focgen.control.files import write_controller
from focgen.diagnosis.drawn import drawn_text, read_drawn
from focgen.errors import InputError
from focgen.jsontext import plain, to_json
from focgen.report.pages.files import read_diagnosis
from focgen.rig.files import write_rig
from tests.conftest import paper_controller, paper_rig
from tests.report_samples import NAMES, diagnosis, signals


@pytest.fixture
def gap(tmp_path):
    """A folder as `focgen diagnose` leaves it."""
    folder = tmp_path / "gap"
    folder.mkdir()
    (folder / "diagnosis.json").write_text(to_json(diagnosis()), encoding="utf-8")
    (folder / "signals.json").write_text(drawn_text(signals()), encoding="utf-8")
    return folder


def test_what_is_drawn_is_read_back(gap):
    given, found = signals(), read_drawn(gap / "signals.json")
    assert (found.entry, found.units, found.worst) == (given.entry, given.units, given.worst)
    assert (found.segments, [r.effects for r in found.rivals]) == (
        given.segments,
        [r.effects for r in given.rivals],
    )
    for one, other in zip(found.traces, given.traces, strict=True):
        assert (one.name, one.start) == (other.name, other.start)
        for key in ("time", "input", "measured", "as_given", "refitted", "explained"):
            np.testing.assert_allclose(getattr(one, key), getattr(other, key), rtol=1e-5, atol=1e-9)


def test_a_diagnosis_is_read_back(gap):
    assert plain(read_diagnosis(gap / "diagnosis.json")) == plain(diagnosis())


@pytest.mark.parametrize("file", ["diagnosis.json", "signals.json"])
@pytest.mark.parametrize(
    "spoil",
    [
        "{",
        pytest.param("[]", marks=pytest.mark.long),
        '{"verdict": 1}',
        pytest.param("null", marks=pytest.mark.long),
    ],
)
def test_what_is_damaged_is_one_line(gap, file, spoil, capsys):
    pytest.importorskip("bokeh")
    (gap / file).write_text(spoil)
    assert main(["report", str(gap), "--out", str(gap.parent / "out.html")]) == 2
    line = capsys.readouterr().err
    assert file in line and line.count("\n") == 1 and not (gap.parent / "out.html").exists()


@pytest.mark.parametrize(
    "key, value",
    [("shrink_interval", [1.0]), ("causes", [{}]), ("where", {}), ("shrink", None), ("unexplained", [3])],
)
def test_a_diagnosis_with_a_wrong_part_is_none(gap, key, value):
    whole = json.loads((gap / "diagnosis.json").read_text(encoding="utf-8"))
    (gap / "diagnosis.json").write_text(json.dumps(whole | {key: value}))
    with pytest.raises(InputError, match="is no diagnosis"):
        read_diagnosis(gap / "diagnosis.json")


def test_curves_of_unequal_length_are_refused(gap):
    whole = json.loads((gap / "signals.json").read_text(encoding="utf-8"))
    whole["traces"][0]["measured"].pop()
    (gap / "signals.json").write_text(json.dumps(whole))
    with pytest.raises(InputError, match="is no signals.json"):
        read_drawn(gap / "signals.json")


def test_the_command_and_the_function_write_the_same_page(gap, tmp_path, capsys):
    pytest.importorskip("bokeh")
    assert main(["report", str(gap), "--out", str(tmp_path / "a.html"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert focgen.report([gap], tmp_path / "b.html") == tmp_path / "b.html"
    page = (tmp_path / "a.html").read_bytes()
    assert page == (tmp_path / "b.html").read_bytes() and said["bytes"] == len(page) <= 3_000_000


def test_without_signals_the_page_says_so(gap, tmp_path):
    pytest.importorskip("bokeh")
    (gap / "signals.json").unlink()
    text = focgen.report(gap, tmp_path / "a.html").read_text(encoding="utf-8")
    assert "no signals.json" in text and "Output over input" not in text


def test_a_chain_is_shown_in_its_order(tmp_path):
    pytest.importorskip("bokeh")
    write_rig(paper_rig(), tmp_path / "rig.toml")
    write_controller(paper_controller(), tmp_path / "controller.toml")
    ran = {"samples": 100, "mismatches": 3, "max_error": {"operator": 0.5}, "error_bound": {"operator": 2.0}}
    found = {"name": NAMES[0], "arithmetic": "q31", "differences": [], "notes": [], "holds": False}
    targets = {"host": ran, "avr": {"skipped": "no simavr"}}
    (tmp_path / "v.json").write_text(json.dumps(found | {"targets": targets}))
    paths = [tmp_path / name for name in ("v.json", "controller.toml", "rig.toml")]
    text = focgen.report(paths, tmp_path / "a.html").read_text(encoding="utf-8")
    heads = [
        text.index(f">{head}</a></h2>") for head in ("Model", "Controller", "Closed loop", "Verification")
    ]
    assert heads == sorted(heads)
    assert "97 of 100" in text and "does NOT hold" in text and "Skipped on avr: no simavr" in text


@pytest.mark.parametrize(
    "name, content",
    [("none.toml", None), ("x.json", "{}"), ("x.png", "x"), ("log.csv", "t,y\n0,0\n"), ("empty", "folder")],
)
def test_what_no_page_is_made_of_is_one_line(tmp_path, name, content, capsys):
    pytest.importorskip("bokeh")
    path = tmp_path / name
    if content == "folder":
        path.mkdir()
    elif content is not None:
        path.write_text(content)
    assert main(["report", str(path), "--out", str(tmp_path / "out.html")]) == 2
    line = capsys.readouterr().err
    assert name in line and line.count("\n") == 1 and not (tmp_path / "out.html").exists()


def test_a_page_replaces_nothing_that_it_is_made_of(gap, capsys):
    pytest.importorskip("bokeh")
    before = (gap / "diagnosis.json").read_bytes()
    assert main(["report", str(gap), "--out", str(gap / "diagnosis.json")]) == 2
    assert "is the input" in capsys.readouterr().err and (gap / "diagnosis.json").read_bytes() == before


@pytest.mark.parametrize(
    "command", [["report", "gap"], ["design", "rig.toml", "--out", "c.toml", "--report", "r.html"]]
)
def test_without_the_library_the_remedy_is_one_line(command, monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "bokeh", None)
    out = [] if "--out" in command else ["--out", "r.html"]
    assert main([*command, *out]) == 2
    assert "pip install 'focgen[report]'" in capsys.readouterr().err and not list(tmp_path.iterdir())


def test_a_path_that_is_not_there_is_no_log(tmp_path):
    with pytest.raises(InputError, match="nothing: does not exist"):
        focgen.report([tmp_path / "nothing"], tmp_path / "page.html")
