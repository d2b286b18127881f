"""What a log's own clock counts in.

Red when the steps of an .lvm are taken for seconds where the file has minutes, or what the rig says of the
time is passed over without a word.
"""

import numpy as np
import pytest

from focgen.logs import read_logs
from focgen.logs.scales import Scale
from focgen.rig.rig import Signals

COUNT = 60
PRESSURE = np.repeat([0.0, 0.1, 0.2, 0.05], COUNT // 4)


def signals(**scale):
    return Signals("X_Value", "y", None, "p", scales={"time": Scale(**scale)} if scale else {})


def lvm(path, step, unit):
    head = [
        "LabVIEW Measurement",
        "Separator\tTab",
        "X_Columns\tNo",
        "***End_of_Header***",
        "",
        "Channels\t2",
    ]
    head += [f"X_Unit_Label\t{unit}\t{unit}"] if unit else []
    head += ["X0\t0\t0", f"Delta_X\t{step!r}\t{step!r}", "***End_of_Header***", "X_Value\tp\ty"]
    rows = [f"\t{p}\t{k * 1e-4:.5f}" for k, p in enumerate(PRESSURE)]
    path.write_text("\n".join([*head, *rows]), encoding="utf-8")
    return path


def steps_and_notes(log, roles):
    (found,) = read_logs(log, roles, 0.6)
    return float(np.median(np.diff(found.time))), " ".join(found.notes)


@pytest.mark.parametrize(
    "unit, step", [("s", 0.6), ("", 0.6), ("min", 0.01), ("ms", 600.0), ("Minutes", 0.01)]
)
def test_the_unit_of_the_steps_is_the_files(tmp_path, unit, step):
    step, notes = steps_and_notes(lvm(tmp_path / "log.lvm", step, unit), signals())
    assert step == pytest.approx(0.6) and notes.endswith("time is the log's own, 0.6 s between samples")


def test_a_unit_that_is_not_known_is_told_of(tmp_path):
    step, notes = steps_and_notes(lvm(tmp_path / "log.lvm", 0.6, "Zeit"), signals())
    assert step == pytest.approx(0.6) and "'Zeit' is no unit of time that is known" in notes


@pytest.mark.parametrize("unit, step", [("s", 0.6), ("", 0.6)])
def test_what_the_rig_says_of_its_column_is_not_of_the_clock(tmp_path, unit, step):
    log = lvm(tmp_path / "log.lvm", step, unit)
    assert "not in min, as the rig has it for its column" in steps_and_notes(log, signals(unit="min"))[1]
    assert "not multiplied by 60, as the rig" in steps_and_notes(log, signals(scale=60.0))[1]


@pytest.mark.parametrize("told", [{"unit": "min"}, {"scale": 60.0}, {}])
def test_where_the_file_says_the_same_there_is_nothing_to_say(tmp_path, told):
    step, notes = steps_and_notes(lvm(tmp_path / "log.lvm", 0.01, "min"), signals(**told))
    assert step == pytest.approx(0.6) and "as the rig has it" not in notes
