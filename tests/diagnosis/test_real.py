"""Rigs measured by others, whose missing effect is known; skipped where the data are absent.

Red when the effect that those who measured it name is no longer found.
"""

from pathlib import Path

import numpy as np
import pytest

from focgen.cli.main import main
from focgen.diagnosis.diagnose import diagnose
from tests.records.benchmarks import DRIVES

OPEN = Path(__file__).resolve().parents[2] / ".." / "shared" / "data" / "open"

BESIDE = {("actuator", "hysteresis"), ("actuator", "dead_zone")}  # of the pump's bending actuator

RIGS = {
    "dryer": (
        "hair_dryer_delay.csv",
        """
sample_time = 0.08
[signals]
time = "t_s"
command = "u_V"
output = "y_V"
[actuator]
num = [[0.9, 0.0]]
den = [[0.4, 1.0], [1.0, 0.0]]
""",
    ),
    "damper": (
        "friction_damper_backlash.csv",
        """
sample_time = 0.00390625
[signals]
run = "run"
time = "t_s"
command = "disp_in"
output = "force_kip"
[actuator]
num = [[0.1, 0.0]]
den = [[0.002, 1.0], [1.0, 0.0]]
""",
    ),
    "drives": ("coupled_electric_drives.csv", DRIVES),
    "tank": (
        "spba_pump_pressure_steps.csv",
        """
sample_time = 0.05
[signals]
run = "run_V"
time = "t_s"
command = "u_V"
output = "p_kPa"
[regulator]
num = [[6.0, 0.0]]
den = [[2.0, 1.0], [1.0, 0.0]]
""",
    ),
    "pump": (
        "spba_pump_two_chamber_steps.csv",
        """
sample_time = 0.04
[signals]
run = "run_V"
time = "t_s"
command = "u1_V"
output = "p1_kPa"
[regulator]
num = [[6.0, 0.0]]
den = [[2.6, 1.0], [1.0, 0.0]]
""",
    ),
}


def rig_and_log(name: str, folder: Path):
    file, text = RIGS[name]
    if not (OPEN / file).exists():
        pytest.skip(f"the open data ({file}) are not here")
    named = text if text.lstrip().startswith("name") else f'name = "{name}"\n{text}'
    (folder / "rig.toml").write_text(named)
    return folder / "rig.toml", OPEN / file


def names(diagnosis):
    return [{c.effect for c in f.candidates} for f in diagnosis.causes]


@pytest.mark.long
def test_hair_dryer_has_a_transport_delay(tmp_path):
    rig, log = rig_and_log("dryer", tmp_path)
    rows = np.genfromtxt(
        log, delimiter=",", names=True
    )  # about its working point, so that it starts near rest
    shifted = np.column_stack([rows["t_s"], rows["u_V"] - 5.0, rows["y_V"] - 4.9])
    np.savetxt(tmp_path / "log.csv", shifted, delimiter=",", header="t_s,u_V,y_V", comments="")
    found = diagnose(rig, [tmp_path / "log.csv"])
    first = found.causes[0].candidates[0]
    assert first.effect == "transport_delay"
    assert first.parameters["delay"].value == pytest.approx(0.24, abs=0.03)


def diagnosed(name, folder, **options):
    rig, log = rig_and_log(name, folder)
    return diagnose(rig, [log], **options)


@pytest.mark.long
def test_friction_damper_has_hysteresis(tmp_path):
    """Dry friction: one stage, so where it sits is inferred; it explains more than four fifths of the gap. A
    loop behind the dynamics may as well be the reading's: nothing logged stands between."""
    found = diagnosed("damper", tmp_path)
    assert names(found) == [{"hysteresis", "sensor_hysteresis"}] and found.shrink > 0.8
    assert found.where.inferred


@pytest.mark.long
def test_coupled_drives_fold_the_speed_or_are_unknown(tmp_path):
    """The pulse counter cannot see the sign of the speed. That it is the sensor no log of one stage can
    tell."""
    found = diagnosed("drives", tmp_path)
    assert found.verdict == "unknown" or "sensor_nonlinearity" in set().union(*names(found))
    assert found.where.inferred and "sensor" not in [cause.stage for cause in found.causes]


def test_pump_vents_slowly(tmp_path):
    """Filling takes 2.3 to 2.8 s to 63 %, venting 5.5 to 6.1 s to 37 %, in the log itself. The regulator's
    gain is moved far from the file's, which takes a tenth of the confidence, and two others a twentieth."""
    found = diagnosed("pump", tmp_path, to=58.0)
    (cause,) = found.causes
    first = cause.candidates[0]
    assert (cause.stage, first.effect) == ("regulator", "valve_asymmetry") and first.confidence > 0.8
    assert any("moves the regulator's gain by +15" in note for note in found.notes)
    ratio = filling_by_venting(**{name: p.value for name, p in first.parameters.items()}, level=62.0)
    assert 2.3 / 6.1 < ratio < 2.8 / 5.5


def filling_by_venting(venting_speed, turbulent_above, level):
    """The time of a lag to 63 % by that of a throat from ``level`` to 37 %: by v = √(1 + 4 p/turbulent) − 1,
    v + ln v falls by one in every lag."""
    before, after = (np.sqrt(1.0 + 4.0 * p / turbulent_above) - 1.0 for p in (level, 0.37 * level))
    return venting_speed / (before - after + np.log(before / after))


@pytest.mark.long
def test_pump_vents_slowly_with_its_angle_logged_and_a_rig_from_the_log(tmp_path):
    """From the log alone, by the commands of the README: beside the valve nothing is named but what the
    actuator has by itself. That the pump becomes another at once in the last run is told."""
    log = OPEN / RIGS["pump"][0]
    if not log.exists():
        pytest.skip(f"the open data ({log.name}) are not here")
    rig, identified = tmp_path / "rig.toml", tmp_path / "identified.toml"
    assert main(["init", str(log), "--out", str(rig)]) == 0
    stages = ["--stages", "regulator,actuator", "--to", "58"]
    assert main(["identify", str(log), "--rig", str(rig), *stages, "--out", str(identified)]) == 0
    found = diagnose(identified, [log], to=58.0, pictures=False)
    first, *others = found.causes
    assert (first.stage, first.candidates[0].effect) == ("regulator", "valve_asymmetry")
    assert first.candidates[0].confidence > 0.6
    assert any("at once it becomes another" in note and "into 11" in note for note in found.notes)
    assert all((c.stage, c.candidates[0].effect) in BESIDE for c in others)


@pytest.mark.long
def test_pump_does_nothing_below_a_volt_or_two(tmp_path):
    """2 V give 2.9 kPa and each volt from 3 V on 10 more: a line that meets zero at 1.8 V."""
    rig, log = rig_and_log("tank", tmp_path)
    head, *lines = log.read_text().splitlines()
    low = [line for line in lines if float(line.split(",")[0]) <= 6.0]  # above, the pump's own curve bends
    (tmp_path / "low.csv").write_text("\n".join([head, *low]) + "\n")
    found = diagnose(rig, [tmp_path / "low.csv"])
    asked = [c for cause in found.causes for c in cause.candidates if c.effect == "dead_zone"]
    assert asked and asked[0].parameters["threshold"].value == pytest.approx(1.8, abs=0.7)
