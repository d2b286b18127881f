"""controller.toml: what is read, and how each fault is reported.

Red when a key is read wrongly or silently ignored, or a fault does not name its place.
"""

from dataclasses import replace

import pytest

from focgen.codegen.generate import generate
from focgen.control import Source, read_controller, write_controller
from focgen.control.controller import NOTHING
from focgen.control.files import controller_text
from focgen.errors import ControllerError
from focgen.plan.build import build_plan
from focgen.verification.verify import verify

CONTROLLER = """
name = "lead"
sample_time = 0.001
length = 64
[transfer]
num = [[1.0, 0.5], [2.0, 0.0]]
den = [[0.1, 0.5], [1.0, 0.0]]
[gain]
breakpoints = [0.0, 1.0]
gains = [1.0, 3.0]
[ranges]
reference = [-1.0, 1.0]
measurement = [-1.0, 1.0]
output = [0.0, 5.0]
schedule = [0.0, 2.0]
"""


def controller_file(tmp_path, text):
    path = tmp_path / "controller.toml"
    path.write_text(text)
    return path


def test_reads_a_hand_written_controller(tmp_path):
    controller = read_controller(controller_file(tmp_path, CONTROLLER))
    assert controller.gain_at(0.5) == 2.0 and controller.gain_at(9.0) == 3.0
    assert not controller.integrator and controller.length == 64 and controller.memory == "short"


def test_written_controller_reads_back_equal(tmp_path, paper_controller):
    for controller in (
        paper_controller,
        replace(
            paper_controller,
            gain=2.5,
            ranges=replace(paper_controller.ranges, schedule=None),
            designed_from=Source("rig.toml", "ab" * 32),
        ),
    ):
        write_controller(controller, tmp_path / "controller.toml")
        assert read_controller(tmp_path / "controller.toml") == controller


def test_equal_controllers_give_equal_bytes(paper_controller):
    assert controller_text(paper_controller) == controller_text(replace(paper_controller))


FAULTS = {
    "no transfer": (CONTROLLER.replace("[transfer]", "[transfr]"), "lacks the table [transfer]"),
    "length 0": (CONTROLLER.replace("length = 64", "length = 0"), "at least 1 sample"),
    "length true": (CONTROLLER.replace("length = 64", "length = true"), "at least 1 sample"),
    "breakpoints fall": (
        CONTROLLER.replace("breakpoints = [0.0, 1.0]", "breakpoints = [1.0, 0.0]"),
        "rising strictly",
    ),
    "one gain short": (CONTROLLER.replace("gains = [1.0, 3.0]", "gains = [1.0]"), "one gain for each"),
    "no schedule range": (CONTROLLER.replace("schedule = [0.0, 2.0]\n", ""), "lacks 'schedule'"),
    "NaN": (CONTROLLER.replace("[1.0, 0.5], [2.0", "[nan, 0.5], [2.0"), "list of [coefficient, order of s]"),
    "no output": (CONTROLLER.replace("output = [0.0, 5.0]\n", ""), "lacks 'output'"),
    "memory": (CONTROLLER.replace("length = 64", 'memory = "long"'), "choose one of"),
    "unknown": (CONTROLLER.replace("length = 64", "lenght = 64"), "unknown key 'lenght'"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_name_where_what_and_remedy(tmp_path, fault):
    text, expected = FAULTS[fault]
    with pytest.raises(ControllerError) as caught:
        read_controller(controller_file(tmp_path, text))
    assert expected in str(caught.value) and caught.value.remedy


def test_schedule_range_without_schedule_is_refused(tmp_path):
    text = CONTROLLER.replace("[gain]\nbreakpoints = [0.0, 1.0]\ngains = [1.0, 3.0]\n", "")
    with pytest.raises(ControllerError, match="not scheduled"):
        read_controller(controller_file(tmp_path, text))


FILTER = """name = "lead"
sample_time = 0.005
length = 24
gain = 3.0
[transfer]
num = [[0.4, 0.5], [1.0, 0.0]]
[ranges]
reference = [-1.0, 1.0]
output = [-20.0, 20.0]
"""


@pytest.mark.parametrize("arithmetic", ["q15", "f32"])
def test_a_pure_filter_needs_no_range_of_a_measurement(tmp_path, arithmetic):
    """As fine as the reference allows, and no coarser for a measurement that there is not."""
    lead = read_controller(controller_file(tmp_path, FILTER))
    write_controller(lead, tmp_path / "again.toml")
    assert read_controller(tmp_path / "again.toml") == lead and lead.ranges.measurement == NOTHING
    made = generate(lead, tmp_path / "lead", arithmetic)
    doubled = replace(lead, ranges=replace(lead.ranges, measurement=(-1.0, 1.0)))
    invented = build_plan(doubled, arithmetic)
    assert made.plan.error.lsb * (1 + (arithmetic == "q15")) == invented.error.lsb
    assert verify(tmp_path / "lead", samples=2000).holds
