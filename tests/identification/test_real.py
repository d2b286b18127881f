"""Identification of logs that others measured: a two-chamber actuator, pressure to bending angle, load and
release of chamber 1; a hair dryer.

Red when parameters of measured logs leave what was found of them.
"""

import json

import numpy as np
import pytest

from focgen.cli.main import main
from focgen.identification.excitation import prepare
from focgen.identification.fractional import _descended
from focgen.identification.identify import identify
from focgen.identification.problem import Problem
from focgen.logs.read import read_logs
from focgen.rig.files import read_rig

DRYER = 'name = "dryer"\nsample_time = 0.08\n[signals]\ntime = "t_s"\ncommand = "u_V"\noutput = "y_V"\n'
PUMP = """
name = "pump"
sample_time = 0.04
[signals]
run = "run_V"
time = "t_s"
pressure = "p1_kPa"
output = "angle_deg"
"""


def test_mean_gof_and_better_than_one_pole(open_data, tmp_path, capsys):
    (tmp_path / "rig.toml").write_text(PUMP)
    log = open_data / "spba_pump_two_chamber_steps.csv"
    argv = [
        "identify",
        str(log),
        "--rig",
        str(tmp_path / "rig.toml"),
        "--out",
        str(tmp_path / "new.toml"),
        "--from",
        "1",
        "--to",
        "57",
        "--json",
    ]
    assert main(argv) == 0
    gof = json.loads(capsys.readouterr().out)["gof"]
    runs = [name for name in gof["fom"] if name != "mean"]
    assert sorted(runs) == ["11", "7", "9"]
    assert gof["fom"]["mean"] >= 0.885
    assert all(gof["fom"][run] > gof["iom_1p"][run] for run in runs)
    assert "[actuator]" in (tmp_path / "new.toml").read_text()


def test_the_dead_time_of_a_hair_dryer(open_data, tmp_path, capsys):
    (tmp_path / "rig.toml").write_text(DRYER)
    argv = ["identify", str(open_data / "hair_dryer_delay.csv"), "--rig", str(tmp_path / "rig.toml")]
    argv += ["--out", str(tmp_path / "new.toml"), "--delay", "--gain-degree", "0", "--no-integer", "--json"]
    assert main(argv) == 0
    payload = json.loads(capsys.readouterr().out)
    assert 0.20 <= payload["rig"]["delay"] <= 0.26
    assert read_rig(tmp_path / "new.toml").delays.actuator == payload["rig"]["delay"]


def test_the_bending_actuator_of_a_pump(open_data, tmp_path):
    """All runs by one K(p), T and α; fits that begin elsewhere end at the same."""
    (tmp_path / "rig.toml").write_text(PUMP)
    log, rig = open_data / "spba_pump_two_chamber_steps.csv", read_rig(tmp_path / "rig.toml")
    found = identify(rig, [log], from_=1.0, to=57.0, integer=False)
    assert found.gof["rig"]["mean"] >= 0.940
    experiments = read_logs([log], rig.signals, rig.sample_time, 1.0, 57.0, {})
    problem = Problem([prepare(e, rig, 2) for e in experiments], (None,) * len(experiments), False)
    begun = [np.array([np.log(tau), alpha]) for tau in (0.2, 2.0, 20.0) for alpha in (0.5, 0.9, 1.3)]
    best = min((_descended(problem, x) for x in begun), key=lambda point: point.cost)
    assert found.joint.pasts == {} and best.x[1] == pytest.approx(found.joint.alpha, abs=2e-3)
    assert np.exp(best.x[0] * best.x[1]) == pytest.approx(found.joint.T, rel=5e-3)
