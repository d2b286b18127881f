"""``focgen study memory``: what it writes, which rig it finds, and what it says.

Red when a study lacks a file, takes the wrong rig, or says another thing than its rows.
"""

import hashlib
import json
from dataclasses import replace
from importlib.util import find_spec

import pytest

import focgen
from focgen.cli.main import main
from focgen.control.controller import Source
from focgen.control.files import read_controller, write_controller
from focgen.fractional.transfer import TransferFunction
from focgen.loop.simulate import simulate
from focgen.rig.files import write_rig
from focgen.studies import study, write
from focgen.studies.jobs import Job, answer, read_row
from focgen.studies.results import Setup, Variant
from focgen.studies.spectrum import band_of
from tests.conftest import paper_controller, paper_rig
from tests.studies.here import answered_here

OPTIONS = [
    "--lengths",
    "20",
    "100",
    "--tolerances",
    "0.1",
    "0.001",
    "--arithmetic",
    "f64",
    "q31",
    "--sample-times",
    "0.01",
    "0.02",
    "--setpoints",
    "0.004",
    "0.01",
    "--jobs",
    "1",
]


def _made(folder):
    """A rig, and a controller that says it was designed from it."""
    write_rig(paper_rig(), folder / "rig.toml")
    source = Source("rig.toml", hashlib.sha256((folder / "rig.toml").read_bytes()).hexdigest())
    write_controller(paper_controller(200, designed_from=source), folder / "controller.toml")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A finished study of the paper's controller beside its rig."""
    folder = tmp_path_factory.mktemp("study")
    _made(folder)
    argv = ["study", "memory", str(folder / "controller.toml"), "--out", str(folder / "out"), *OPTIONS]
    with answered_here():
        assert main(argv) == 0
    return folder


@pytest.fixture(scope="module")
def found(folder):
    """Its study.json."""
    return json.loads((folder / "out" / "study.json").read_text(encoding="utf-8"))


def test_the_folder_holds_numbers_pictures_and_a_page(folder):
    names = {p.name for p in (folder / "out").iterdir()}
    pictures = {"accuracy.png", "pareto.png", "frequency.png", "loops.png", "plant.png"}
    assert names == {"rows", "study.json", "curves.json", "report.html"} | pictures
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    shown = pictures if find_spec("bokeh") is None else {f'id="figure{i}-plot"' for i in range(1, 7)}
    assert all(name in page for name in shown)


def test_every_variant_has_its_row(found):
    short = [r for r in found["rows"] if r["memory"] == "short"]
    assert {(r["arithmetic"], r["length"]) for r in short if r["sample_time"] == 0.01} >= {
        (a, n) for a in ("f64", "q31") for n in (20, 100)
    }
    assert {r["arithmetic"] for r in found["rows"] if r["sample_time"] == 0.02} == {"q31"}
    exponential = [r for r in found["rows"] if r["memory"] == "exponential"]
    assert {r["tolerance"] for r in exponential} == {0.1, 0.001} and all(
        r["dc_bias"] == 0.0 for r in exponential
    )
    for row in found["rows"]:
        taps = 2 * row["states"] + 2 if row["states"] else row["length"] + 1
        assert row["error"] <= row["bound"] and row["multiplies"] == taps
        assert row["settling_s"] > 0.0 and row["margin_deg"] > 0.0 and row["flash_bytes"] > row["table_bytes"]
    errors = [r["error"] for r in sorted(short, key=lambda r: r["length"]) if r["arithmetic"] == "f64"]
    assert errors == sorted(errors, reverse=True)


def test_the_closed_loop_is_the_one_simulate_shows(found):
    row = next(
        r
        for r in found["rows"]
        if r["length"] == 20 and r["arithmetic"] == "q31" and r["sample_time"] == 0.01
    )
    duration = 12.0 / found["band"]["crossover_low"]
    loop = simulate(paper_rig(), paper_controller(20), (0.004, 0.01), duration=duration)
    assert row["settling_s"] == pytest.approx(sum(s.settling_s for s in loop.setpoints) / 2, rel=1e-9)
    assert row["overshoot_pct"] == pytest.approx(max(s.overshoot_pct for s in loop.setpoints), rel=1e-9)
    ideal = next(i for i in found["ideal"] if i["sample_time"] == 0.01)["loop"]
    assert ideal["settling_s"] == pytest.approx(sum(s.ideal.settling_s for s in loop.setpoints) / 2, rel=1e-9)


@pytest.fixture
def plainly(monkeypatch):
    """Without pictures, which take longer than the rest."""
    monkeypatch.setattr(write, "files_of", lambda study: {})


def test_it_says_what_its_json_says(folder, found, capsys, plainly):
    argv = ["study", "memory", str(folder / "controller.toml"), "--out", str(folder / "out"), *OPTIONS]
    assert main([*argv, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == found
    assert main(argv) == 0
    said = capsys.readouterr().out
    assert (
        found["recommendation"] in said
        and "keeps the phase within 2°" in said
        and "The exponential form does it in" in said
    )


def test_the_result_is_dataclasses(folder, found, plainly):
    result = focgen.study(
        "memory",
        folder / "controller.toml",
        folder / "out",
        lengths=(20, 100),
        tolerances=(0.1, 0.001),
        arithmetic=("f64", "q31"),
        sample_times=(0.01, 0.02),
        setpoints=(0.004, 0.01),
        jobs=1,
    )
    assert [row.error for row in result.rows] == [row["error"] for row in found["rows"]]
    assert {cost: list(front) for cost, front in result.pareto.items()} == found["pareto"]


FEW = dict(lengths=(20,), memory=("short",), arithmetic=("f64",), sample_times=(0.05,), jobs=1)


def _lost(folder):
    (folder / "rig.toml").unlink()


def _changed(folder):
    with open(folder / "rig.toml", "a") as file:
        file.write("# another state\n")


def _unnamed(folder):
    write_controller(paper_controller(20), folder / "controller.toml")


@pytest.mark.parametrize(
    "fault, said",
    [(_lost, "is not beside it"), (_changed, "has changed since"), (_unnamed, "no rig is named")],
)
def test_a_rig_that_is_not_the_one_is_not_taken(tmp_path, fault, said):
    _made(tmp_path)
    path = tmp_path / "controller.toml"
    assert study._rig(None, read_controller(path), path) == (paper_rig(), [])
    fault(tmp_path)
    rig, notes = study._rig(None, read_controller(path), path)
    assert rig is None and said in notes[0] and "--rig" in notes[0]


def test_without_its_rig_the_open_loop_still_comes(tmp_path):
    _made(tmp_path)
    _lost(tmp_path)
    with answered_here():
        found = study.study("memory", tmp_path / "controller.toml", tmp_path / "out", **FEW)
    assert found.rows[0].error > 0.0 and found.rows[0].settling_s is None and found.rig is None
    assert "--rig" in found.notes[0] and not (tmp_path / "out" / "loops.png").exists()


def test_faults_are_one_line(tmp_path, capsys):
    whole = paper_controller(transfer=TransferFunction([(1.0, 1.0), (1.0, 0.0)]))
    write_controller(whole, tmp_path / "whole.toml")
    _made(tmp_path)
    for argv in (
        ["memory", str(tmp_path / "controller.toml"), "--jobs", "-1"],
        ["memory", str(tmp_path / "whole.toml")],
        ["memory", str(tmp_path / "controller.toml"), "--setpoints", "7"],
        ["memory", str(tmp_path / "none.toml")],
        ["memory", str(tmp_path / "controller.toml"), "--rig", str(tmp_path / "none.toml")],
        ["weather", str(tmp_path / "controller.toml")],
    ):
        assert main(["study", *argv, "--out", str(tmp_path / "out")]) == 2
        said = capsys.readouterr().err
        assert said.startswith("focgen: error: ") and said.count("\n") == 1
        assert not (tmp_path / "out").exists()


def test_a_length_that_is_unstable_in_the_denominator_is_a_note():
    """1/(s^1.6 + 1) cut off early is said in its row; the others come."""
    lag = paper_controller(
        transfer=TransferFunction([(1.0, 0.0)], [(1.0, 1.6), (1.0, 0.0)]), integrator=False
    )
    lag = replace(lag, gain=1.0, ranges=replace(lag.ranges, output=(-1.0, 1.0), schedule=None))
    setup = Setup(lag, None, band_of(lag, None, ()), 500, ())
    short, longer = (
        read_row(answer(Job("row", setup, Variant("short", "f64", 0.01, length=n))))[0] for n in (2, 400)
    )
    assert "unstable" in short.note and short.error is None and longer.error > 0.0
