"""cppcheck with its MISRA addon: what it finds in runtime and generated code is what c_runtime/deviations.md
explains, no less and no more.

Red when the C gets a kind of finding that nobody has explained, or an explained one is gone.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from focgen.codegen.generate import folder_files
from focgen.codegen.kernels import Kernels
from focgen.control.files import controller_text
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.resources import shipped
from tests.proofs.spread import controllers, remembering

COMMAND = """cppcheck --std=c99 --enable=all --addon=misra --quiet --template={id}|{file}:{line}
    --suppress=missingIncludeSystem --suppress=unmatchedSuppression""".split()
CASES = {"all": ("q15", "f64"), "inverse": ("f32",), "filter": ("q31",)}
KERNELS = {"cortex-m4": ("q15", "f32"), "cortex-m0plus": ("q31",)}  # looking ahead, and by halves
MODES = ("q31", "f32")  # an exponential memory
DEVIATIONS = shipped("c_runtime") / "deviations.md"


def cppcheck(folder: Path, *files: str) -> dict[str, list[str]]:
    """The places of every kind of finding."""
    if not shutil.which("cppcheck"):
        pytest.skip("cppcheck is not on this machine (Debian: apt install cppcheck)")
    done = subprocess.run([*COMMAND, *files], cwd=folder, capture_output=True, text=True)
    if "misra.py" in done.stderr:
        pytest.skip("cppcheck's MISRA addon is not on this machine")
    assert done.returncode == 0, done.stderr
    found: dict[str, list[str]] = {}
    for line in done.stderr.splitlines():
        kind, _, place = line.partition("|")
        found.setdefault(kind, []).append(place)
    return found


def explained() -> set[str]:
    rows = re.findall(r"^\| (\S+) \|.*?\|.*?\| (.*) \|$", DEVIATIONS.read_text(), re.MULTILINE)
    assert all(len(why) > 20 for kind, why in rows if kind not in ("finding", "---|---|---|---"))
    return {kind for kind, _ in rows if kind != "finding"}


@pytest.fixture(scope="module")
def found(tmp_path_factory) -> dict[str, list[str]]:
    """The findings in every kind of controller, its self-test included."""
    folder = tmp_path_factory.mktemp("misra")
    for name, arithmetics in CASES.items():
        for arithmetic in arithmetics:
            plan = build_plan(controllers(12)[name], arithmetic, name=f"{name}_{arithmetic}")
            write_files(folder, folder_files(plan, controller_text(plan.controller).encode(), selftest=True))
    for arithmetic in MODES:
        plan = build_plan(remembering()["inverse_modes"], arithmetic, name=f"modes_{arithmetic}")
        write_files(folder, folder_files(plan, b"", selftest=True))
    for target, arithmetics in KERNELS.items():
        for arithmetic in arithmetics:
            plan = build_plan(controllers(64)["all"], arithmetic, name=f"{arithmetic}_{target[7:]}")
            kernels = Kernels(target)
            write_files(folder, folder_files(plan, b"", selftest=True, kernels=kernels))
    return cppcheck(folder, *sorted(path.name for path in folder.glob("*.c")))


def test_nothing_is_found_that_is_not_explained(found):
    unexplained = {kind: places for kind, places in found.items() if kind not in explained()}
    assert not unexplained


def test_nothing_is_explained_that_is_not_found(found):
    """Otherwise the list would only ever grow; other versions find other things."""
    version = subprocess.run(["cppcheck", "--version"], capture_output=True, text=True).stdout.split()[-1]
    if f"Seen with cppcheck {version}." not in DEVIATIONS.read_text():
        pytest.skip(f"the list was made with another cppcheck than {version}")
    assert explained() == set(found)


def test_it_sees_what_it_should(tmp_path):
    """An index out of bounds, and what MISRA forbids."""
    bad = "int f(void);\nint f(void)\n{\n    int a[2] = {0, 1};\n    return a[2];\n}\n"
    (tmp_path / "bad.c").write_text(bad)
    (tmp_path / "goto.c").write_text("void g(void);\nvoid g(void)\n{\nagain:\n    goto again;\n}\n")
    assert "arrayIndexOutOfBounds" in cppcheck(tmp_path, "bad.c")
    assert "misra-c2012-15.1" in cppcheck(tmp_path, "goto.c")
