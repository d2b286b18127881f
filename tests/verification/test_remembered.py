"""``cost.json``: what a folder remembers of its costs is read as that, or not at all.

Red when something else of that name is lost, is passed over by ``verify``, or ends in a fault.
"""

import json

import pytest

from focgen.codegen.generate import generate
from focgen.present import present
from focgen.targets.cost import Cost, PerStep
from focgen.targets.selection import entry_of
from focgen.verification import costs
from focgen.verification.folder import read_folder
from focgen.verification.remembered import remembered
from tests.controllers import seed_controller

STEP = PerStep(10.0, 12.0, 100, "counted")
COST = Cost("cc", STEP, STEP, 100, {"code": 100}, 20, 30, ("f 30",), 30)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A generated folder, whose costs are counted without a compiler."""
    monkeypatch.setattr(costs, "_on", lambda name, given, compiler: COST)
    generate(seed_controller(5), tmp_path / "fw", "q15")
    return tmp_path / "fw"


def counted(folder):
    return costs.cost(folder, "cortex-m3").controllers[0]


def test_what_was_counted_before_is_read_back(folder):
    assert not counted(folder).previous
    generate(seed_controller(6), folder, "q15")
    assert counted(folder).previous == {"cortex-m3": COST}
    assert present(remembered(folder / "cost.json")).keys() == {"zig"}
    assert read_folder(folder).notes == ()


BENT = [
    ("flash_bytes", "many"),
    ("flash_bytes", [1]),
    ("flash", 3),
    ("flash", {"code": "x"}),
    ("instructions_per_step", 3),
    ("instructions_per_step", {"mean": "x", "worst": 1.0, "steps": 1, "how": ""}),
    ("cycles_per_step", {"mean": 1.0}),
    ("stack_path", 3),
    ("calls", {"init": {"instructions": "x", "cycles": None}}),
    ("runtimes", 3),
    ("unknown", 3),
]


@pytest.mark.parametrize(
    "key, value",
    [pytest.param(*b, marks=pytest.mark.long if turn % 2 else ()) for turn, b in enumerate(BENT)],
)
@pytest.mark.parametrize("part", ["targets", "previous"])
def test_a_damaged_memory_is_none(folder, key, value, part):
    entry = entry_of(COST) | {key: value}
    whole = {"made_from": "0", "targets": {}, "previous": {}} | {part: {"cortex-m3": entry}}
    (folder / "cost.json").write_text(json.dumps({"zig": whole}))
    (note,) = read_folder(folder).notes
    assert note == "cost.json: does not belong to the folder"
    assert not counted(folder).previous and read_folder(folder).notes == ()


@pytest.mark.parametrize("text", ["my table of costs", "[]", '{"mine": 1}', "", "\x00"])
def test_somebody_elses_file_stays_and_is_named(folder, text, capsys):
    (folder / "cost.json").write_text(text)
    assert read_folder(folder).notes == ("cost.json: does not belong to the folder",)
    assert counted(folder).targets == {"cortex-m3": COST}
    assert (folder / "cost.json").read_text() == text
    assert "cost.json is no memory of costs, so it stays" in capsys.readouterr().err


def test_a_folder_of_that_name_is_named(folder):
    (folder / "cost.json").mkdir()
    assert read_folder(folder).notes == ("cost.json: does not belong to the folder",)
    assert counted(folder).targets == {"cortex-m3": COST}
