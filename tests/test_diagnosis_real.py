"""Rigs measured by others, whose missing effect is known; skipped where the data are absent."""

from pathlib import Path

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose

OPEN = Path(__file__).resolve().parents[1] / ".." / "shared" / "data" / "open"

RIGS = {
    "dryer": ("hair_dryer_delay.csv", """
sample_time = 0.08
[signals]
time = "t_s"
command = "u_V"
output = "y_V"
[actuator]
num = [[0.9, 0.0]]
den = [[0.4, 1.0], [1.0, 0.0]]
"""),
    "damper": ("friction_damper_backlash.csv", """
sample_time = 0.00390625
[signals]
run = "run"
time = "t_s"
command = "disp_in"
output = "force_kip"
[actuator]
num = [[0.1, 0.0]]
den = [[0.002, 1.0], [1.0, 0.0]]
"""),
    "drives": ("coupled_electric_drives.csv", """
sample_time = 0.02
[signals]
run = "run"
time = "t_s"
command = "u_V"
output = "y_speed"
[actuator]
num = [[100.0, 0.0]]
den = [[1.0, 2.0], [5.0, 1.0], [50.0, 0.0]]
"""),
    "pump": ("spba_pump_two_chamber_steps.csv", """
sample_time = 0.04
[signals]
run = "run_V"
time = "t_s"
command = "u1_V"
output = "p1_kPa"
[regulator]
num = [[6.0, 0.0]]
den = [[2.6, 1.0], [1.0, 0.0]]
"""),
}


def rig_and_log(name: str, folder: Path):
    file, text = RIGS[name]
    if not (OPEN / file).exists():
        pytest.skip(f"the open data ({file}) are not here")
    (folder / "rig.toml").write_text(f'name = "{name}"\n{text}')
    return folder / "rig.toml", OPEN / file


def names(diagnosis):
    return [{c.effect for c in f.candidates} for f in diagnosis.causes]


def test_hair_dryer_has_a_transport_delay(tmp_path):
    rig, log = rig_and_log("dryer", tmp_path)
    rows = np.genfromtxt(log, delimiter=",", names=True)  # about its working point, so that it starts near rest
    shifted = np.column_stack([rows["t_s"], rows["u_V"] - 5.0, rows["y_V"] - 4.9])
    np.savetxt(tmp_path / "log.csv", shifted, delimiter=",", header="t_s,u_V,y_V", comments="")
    found = diagnose(rig, [tmp_path / "log.csv"])
    first = found.causes[0].candidates[0]
    assert first.effect == "transport_delay"
    assert first.parameters["delay"].value == pytest.approx(0.24, abs=0.03)


def test_friction_damper_has_hysteresis(tmp_path):
    found = diagnose(*[a if i == 0 else [a] for i, a in enumerate(rig_and_log("damper", tmp_path))])
    assert "hysteresis" in names(found)[0]


def test_coupled_drives_fold_the_speed_or_are_unknown(tmp_path):
    found = diagnose(*[a if i == 0 else [a] for i, a in enumerate(rig_and_log("drives", tmp_path))])
    assert found.verdict == "unknown" or "sensor_nonlinearity" in set().union(*names(found))


def test_pump_vents_slowly(tmp_path):
    rig, log = rig_and_log("pump", tmp_path)
    found = diagnose(rig, [log], last=58.0)
    assert "valve_asymmetry" in set().union(*names(found))
