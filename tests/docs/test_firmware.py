"""The examples of firmware: each compiles without a warning, runs, and says itself whether it holds.

Red when an example of firmware does not compile, or finds its own answers wrong.
"""

from pathlib import Path

import pytest

import focgen
from tests.c_code import STRICT, compiler, run

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples" / "firmware"


@pytest.fixture(scope="module")
def firmware(tmp_path_factory):
    folder = tmp_path_factory.mktemp("firmware")
    for controller in ("controller.toml", "port/controller.toml"):
        focgen.generate(ROOT / "examples" / controller, folder)
    return folder


@pytest.mark.parametrize("name", ("timer", "power_fail", "two", "task"))
def test_it_runs_and_holds(name, firmware, tmp_path):
    sources = [EXAMPLES / f"{name}.c", EXAMPLES / "board_host.c", firmware / "spba.c"]
    sources += [firmware / "port.c"] if name == "two" else []
    program = tmp_path / f"{name}.exe"
    run(*compiler("gcc"), *STRICT, "-O2", "-I", firmware, "-I", EXAMPLES, *sources, "-o", program)
    assert run(program).count("\n") == 1


def test_every_example_is_tried():
    assert {p.stem for p in EXAMPLES.glob("*.c")} == {
        *("timer", "power_fail", "two", "task", "supply"),
        *("board_host", "board_m4"),
    }
