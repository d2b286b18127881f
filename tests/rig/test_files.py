"""rig.toml: what is read, and how each fault is reported.

Red when a key is read wrongly or silently ignored, or a fault does not name its place.
"""

from dataclasses import replace

import pytest

from focgen.codegen.generate import generate
from focgen.control.files import check_replaces_controller, controller_text
from focgen.errors import RigError
from focgen.fractional.transfer import TransferFunction
from focgen.rig import LinearActuator, read_rig, write_rig
from focgen.rig.files import check_replaces_rig
from focgen.rig.rig import UNITY
from focgen.verification.folder import read_folder
from tests.conftest import paper_controller

RIG = """
name = "spba"
sample_time = 0.01
[signals]
time = "t_s"
command = "u_V"
output = "kappa"
[regulator]
num = [[152.48, 0.0]]
den = [[1.0, 2.0], [53.39, 1.0], [1528.0, 0.0]]
[actuator]
T = 1.32
alpha = 0.6
gain = [0.0015, 0.345]
[ranges]
pressure = [0.0, 0.25]
"""


def rig_file(tmp_path, text):
    path = tmp_path / "rig.toml"
    path.write_text(text)
    return path


def test_reads_every_table(tmp_path):
    rig = read_rig(rig_file(tmp_path, RIG))
    assert rig.signals.columns() == {"command": "u_V", "output": "kappa"}
    assert rig.actuator.drive(0.1) == pytest.approx((0.0015 + 0.0345) * 0.1)
    assert rig.regulator.dc_gain == pytest.approx(152.48 / 1528)
    assert rig.ranges.pressure == (0.0, 0.25) and rig.ranges.output is None
    assert rig.sensor.dc_gain == 1.0


def test_a_mark_that_an_editor_puts_ahead_is_no_part_of_it(tmp_path):
    """Notepad's "UTF-8 with BOM": of every file of TOML, which still may be replaced."""
    plain = read_rig(rig_file(tmp_path, RIG))
    assert read_rig(rig_file(tmp_path, "\ufeff" + RIG)) == plain
    check_replaces_rig(tmp_path / "rig.toml")
    marked = tmp_path / "controller.toml"
    marked.write_text("\ufeff" + controller_text(paper_controller(8)), encoding="utf-8")
    check_replaces_controller(marked)
    generate(marked, tmp_path / "fw", "q15")
    assert (tmp_path / "fw" / "controller.toml").read_bytes() == marked.read_bytes()
    assert not read_folder(tmp_path / "fw").differences


def test_written_rig_reads_back_equal(tmp_path, paper_rig):
    linear = LinearActuator(TransferFunction([(2, 0)], [(0.3, 1.2), (1, 0)]), offset=0.5)
    effects = ({"name": "leak", "stage": "regulator", "strength": 0.1},)
    zeroed = replace(paper_rig, zero=-0.25)
    for rig in (
        paper_rig,
        zeroed,
        replace(zeroed, sensor=UNITY),
        replace(paper_rig, actuator=linear, effects=effects),
    ):
        write_rig(rig, tmp_path / "rig.toml")
        assert read_rig(tmp_path / "rig.toml") == rig


FAULTS = {
    "not TOML": ("name = ", "is not TOML"),
    "no signals": ('sample_time = 0.01\nname = "a"', "lacks the table [signals]"),
    "no output": (RIG.replace('output = "kappa"\n', ""), "lacks 'output'"),
    "no input": (RIG.replace('command = "u_V"\n', ""), "neither 'command' nor 'pressure'"),
    "sample time 0": (RIG.replace("sample_time = 0.01", "sample_time = 0"), "above 0"),
    "sample time beyond floats": (
        RIG.replace("sample_time = 0.01", f"sample_time = 1{'0' * 400}"),
        "not a finite number",
    ),
    "sample time NaN": (RIG.replace("sample_time = 0.01", "sample_time = nan"), "not a finite number"),
    "alpha too high": (RIG.replace("alpha = 0.6", "alpha = 2.0"), "order in (0, 2)"),
    "alpha 0": (RIG.replace("alpha = 0.6", "alpha = 0.0"), "above 0"),
    "T negative": (RIG.replace("T = 1.32", "T = -1.32"), "above 0"),
    "gain endless": (RIG.replace("[0.0015, 0.345]", str([0.001] * 257)), "at most 256"),
    "terms endless": (RIG.replace("[[152.48, 0.0]]", str([[1.0, 0.0]] * 257)), "at most 256"),
    "gain empty": (RIG.replace("[0.0015, 0.345]", "[]"), "list of finite numbers"),
    "gain infinite": (RIG.replace("[0.0015, 0.345]", "[inf]"), "list of finite numbers"),
    "misspelt key": (RIG.replace("alpha = 0.6", "alpha = 0.6\ngian = [1.0]"), "unknown key 'gian'"),
    "range reversed": (RIG.replace("[0.0, 0.25]", "[0.25, 0.0]"), "low < high"),
    "den zero": (RIG.replace("[[1.0, 2.0], [53.39, 1.0], [1528.0, 0.0]]", "[[0.0, 1.0]]"), "denominator"),
    "improper": (RIG.replace("[[152.48, 0.0]]", "[[1.0, 3.0]]"), "higher order"),
    "terms wrong": (RIG.replace("[[152.48, 0.0]]", "[152.48]"), "list of [coefficient, order of s]"),
    "terms of endless order": (
        RIG.replace("[53.39, 1.0]", "[53.39, 9223372036854775807]"),
        "orders from -20",
    ),
    "a term that is hardly there": (
        RIG.replace("[53.39, 1.0]", "[1e-320, 1.0]"),
        "[coefficient, order of s]",
    ),
    "one column for two roles": (RIG.replace('output = "kappa"', 'output = "u_V"'), "as 'output' is"),
    "the column of the time": (RIG.replace('output = "kappa"', 'output = "t_s"'), "as 'time' is"),
    "table as text": (RIG + 'sensor = "H"', "unknown key 'sensor'"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_name_where_what_and_remedy(tmp_path, fault):
    text, expected = FAULTS[fault]
    with pytest.raises(RigError) as caught:
        read_rig(rig_file(tmp_path, text))
    assert expected in str(caught.value)
    assert caught.value.where.startswith(str(tmp_path / "rig.toml"))
    assert caught.value.remedy


def test_missing_file_is_reported():
    with pytest.raises(RigError, match="cannot be read"):
        read_rig("nowhere.toml")


def test_a_lead_is_written_and_read(tmp_path):
    path, led = tmp_path / "rig.toml", RIG.replace('output = "kappa"', 'output = "kappa"\nlead = 0.0123')
    path.write_text(led)
    assert read_rig(path).lead == 0.0123
    write_rig(read_rig(path), tmp_path / "again.toml")
    assert read_rig(tmp_path / "again.toml").lead == 0.0123
    path.write_text(led.replace("0.0123", "0.05"))
    with pytest.raises(RigError, match="over 4 samples"):
        read_rig(path)
