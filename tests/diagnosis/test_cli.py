"""``focgen diagnose`` and ``focgen replay`` from files to files.

Red when a file of a diagnosis is missing, or a replay of its rigs does not keep what it says.
"""

import json

import numpy as np
import pytest
import tomlkit

from focgen.cli.main import main
from focgen.rig.files import rig_table
from focgen.trials.closed_cases import make_closed_case
from focgen.trials.make import _write
from focgen.trials.plan import Assignment
from tests.diagnosis_rig import RIG, session


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("diagnose")
    (folder / "rig.toml").write_text(tomlkit.dumps(rig_table(RIG)))
    logs = []
    for log in session(4, vent=0.8):
        rows = np.column_stack(
            [log.start + log.time, *(log[r] for r in ("command", "pressure", "curvature", "output"))]
        )
        np.savetxt(
            folder / f"{log.name}.csv", rows, delimiter=",", header="t_s,u,p,k,y", comments="", fmt="%.9g"
        )
        logs.append(str(folder / f"{log.name}.csv"))
    return folder, logs


def test_diagnose_writes_what_it_says(made, capsys):
    folder, logs = made
    out = folder / "out"
    assert main(["diagnose", str(folder / "rig.toml"), *logs, "--out", str(out), "--json"]) == 0
    printed = capsys.readouterr()
    said = json.loads(printed.out)
    assert printed.err == ""  # no terminal, no progress
    assert said == json.loads((out / "diagnosis.json").read_text())
    assert said["verdict"] == "named" and said["where"]["stage"] == "regulator"
    cause = said["causes"][0]
    assert cause["stage"] == "regulator" and cause["candidates"][0]["effect"] == "valve_asymmetry"
    assert 0 < cause["candidates"][0]["confidence"] <= 1
    for estimate in cause["candidates"][0]["parameters"].values():
        assert set(estimate) == {"value", "ci95", "unit"}
    assert said["gap"]["floor"] <= said["gap"]["explained"] <= said["gap"]["refitted"]
    assert said["shrink_interval"][0] <= said["shrink"] <= said["shrink_interval"][1]
    assert sum(said["where"]["share"].values()) == pytest.approx(1.0)
    for name in ("ladder", "residual", "loops", "waterfall", "candidates"):
        assert (out / f"{name}.png").read_bytes()[:4] == b"\x89PNG"

    assert main(["replay", str(out / "augmented.toml"), logs[0], "--json"]) == 0
    with_effects = json.loads(capsys.readouterr().out)["logs"]
    assert main(["replay", str(out / "refitted.toml"), logs[0], "--json"]) == 0
    without = json.loads(capsys.readouterr().out)["logs"]
    name = next(iter(without))
    assert (
        with_effects[name]["rmse_by_signal"]["pressure"] < 0.5 * without[name]["rmse_by_signal"]["pressure"]
    )


@pytest.mark.parametrize(
    "arguments, told",
    [
        (["diagnose", "RIG"], "no log"),
        (["diagnose", "RIG", "LOG"], "--out"),
        (["diagnose", "RIG", "nowhere.csv", "--out", "OUT"], "nowhere.csv"),
        (["diagnose", "RIG", "LOG", "--out", "OUT", "--from", "1e6"], ""),
        (["diagnose", "RIG", "LOG", "--out", "OUT", "--bootstrap", "-5"], "bootstrap: is -5"),
        (["diagnose", "RIG", "LOG", "--out", "OUT", "--bootstrap", "1"], "at least 2"),
        (["replay", "nowhere.toml", "LOG"], "nowhere.toml"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(made, capsys, arguments, told):
    folder, logs = made
    place = {"RIG": str(folder / "rig.toml"), "LOG": logs[0], "OUT": str(folder / "never")}
    assert main([place.get(a, a) for a in arguments]) == 2
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert error.startswith("focgen: error:") and told in error
    assert not (folder / "never").exists()


def test_an_unknown_effect_in_a_rig_is_refused(made, capsys, tmp_path):
    _folder, logs = made
    table = rig_table(RIG) | {"effects": [{"name": "gremlins", "size": 1.0}]}
    (tmp_path / "rig.toml").write_text(tomlkit.dumps(table))
    assert main(["replay", str(tmp_path / "rig.toml"), logs[0]]) == 2
    assert "gremlins" in capsys.readouterr().err


def test_plan_needs_no_data(made, capsys):
    folder, _logs = made
    assert main(["diagnose", "--plan", str(folder / "rig.toml"), "--json"]) == 0
    effects = {e["effect"]: e for e in json.loads(capsys.readouterr().out)["effects"]}
    assert effects["hysteresis"]["survives"] > effects["creep"]["survives"]
    assert effects["creep"]["survives"] < 0.3


@pytest.mark.parametrize(
    "effect",
    [
        "fixed_point",
        *(pytest.param(e, marks=pytest.mark.long) for e in ("short_memory", "output_saturation")),
    ],
)
def test_the_controller_departs_by_what_was_done_to_it(tmp_path, capsys, effect):
    """A closed loop of the trials' generator: rig, logs, and the ideal controller."""
    rng = np.random.default_rng(7)
    case = make_closed_case(Assignment("single", (effect,), "mid"), "B", rng)
    _write(tmp_path, "0001", case, "")
    folder = tmp_path / "cases" / "0001"
    given = [str(folder / "rig.toml"), *map(str, sorted((folder / "logs").iterdir()))]
    ending = ["--controller", str(folder / "controller.toml"), "--out", str(tmp_path / "out"), "--to", "30"]
    assert main(["diagnose", *given, *ending]) == 0
    said = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert said["verdict"] == "named"
    assert said["where"] == {
        "stage": "controller",
        "inferred": False,
        "share": {"regulator": 0.0, "actuator": 0.0, "sensor": 0.0, "controller": 1.0},
        "regimes": {},
    }
    assert [c["effect"] for f in said["causes"] for c in f["candidates"]] == [effect]
    assert "of its departure from the described controller" in capsys.readouterr().out
