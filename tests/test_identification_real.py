"""Identification of a real two-chamber actuator, pressure to bending angle, load and release of chamber 1."""

import json

from focgen.cli.main import main

RIG = """
name = "pump"
sample_time = 0.04
[signals]
run = "run_V"
time = "t_s"
pressure = "p1_kPa"
output = "angle_deg"
"""


def test_mean_gof_and_better_than_one_pole(open_data, tmp_path, capsys):
    (tmp_path / "rig.toml").write_text(RIG)
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
