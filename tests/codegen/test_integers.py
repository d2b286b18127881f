"""C of integer controllers: no floating point is left in it, and it goes together with C of floating ones.

Red when a float slips into integer C, or two controllers clash when they are linked.
"""

from __future__ import annotations

import re
from itertools import permutations
from pathlib import Path

import pytest

from focgen.cli.main import main
from tests.c_code import compiler, run
from tests.codegen.test_golden import CONTROLLER, EXPONENTIAL

FLOATING = re.compile(r"\b(float|double|_Float\w+)\b|\b\d+\.\d|\b\w*_f(?:32|64)\b")
FORMS = {
    "short": ["--selftest"],
    "core": ["--target", "cortex-m4", "--length", "64"],
    "m0plus": ["--target", "cortex-m0plus", "--length", "64"],
    "exponential": EXPONENTIAL,
    "tunable": ["--tunable", "--selftest"],
}


def generated(folder: Path, arithmetic: str, *options: str) -> str:
    """The name of a controller that is written into ``folder``."""
    name, controller = f"finger_{arithmetic}", folder.parent / f"{folder.name}.toml"
    controller.write_text(CONTROLLER.read_text() + "\n[tunable]\ngain = [0.5, 2.0]\n")
    command = ["generate", str(controller), "--out", str(folder), "--arithmetic", arithmetic]
    assert main([*command, "--name", name, *options]) == 0
    return name


def preprocessed(source: Path) -> str:
    """What the compiler reads, without markers of lines."""
    return run(*compiler("gcc"), "-std=c99", "-E", "-P", source)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("arithmetic", ["q31", "q15"])
def test_the_compiler_reads_no_floating_type(form, arithmetic, tmp_path):
    name = generated(tmp_path, arithmetic, "--no-float", *FORMS[form])
    sources = sorted(tmp_path.glob(f"{name}*.c"))
    assert len(sources) == 1 + ("--selftest" in FORMS[form])
    for source in sources:
        text = preprocessed(source)
        assert "int32_t" in text and FLOATING.findall(text) == [], source


def test_with_the_conversions_there_is_floating_point_but_in_them(tmp_path):
    """What the test above looks for is there to be found; and none of the runtime's comes with it."""
    name = generated(tmp_path, "q15")
    text = preprocessed(tmp_path / f"{name}.c")
    assert "float" in text and "double" not in text
    assert re.findall(r"\bfoc_\w+_f(?:32|64)\b", text) == []


ORDERS = [*permutations(["q31", "f32", "f64"])]


@pytest.mark.parametrize(
    "order",
    [pytest.param(o, marks=() if i == 5 else pytest.mark.long) for i, o in enumerate(ORDERS)],
    ids="-".join,
)
def test_several_in_one_file_in_any_order(order, tmp_path):
    names = [generated(tmp_path / arithmetic, arithmetic, *EXPONENTIAL) for arithmetic in order]
    lines = [f'#include "{kind}/{name}.c"' for kind, name in zip(order, names)]
    (tmp_path / "all.c").write_text("\n".join(lines) + "\n")
    run(*compiler("gcc"), "-std=c99", "-c", tmp_path / "all.c", "-o", tmp_path / "all.o")
