"""Many controllers: strict compilation by gcc and clang, and tables that read back as the plan's weights.

Red when a compiler warns, or a table holds another weight than the plan.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from focgen.cli.main import main
from focgen.codegen.generate import folder_files
from focgen.control.controller import Controller
from focgen.control.files import controller_text
from focgen.errors import PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.plan.plan import Plan
from tests.c_code import STRICT, compiler, run
from tests.conftest import paper_controller
from tests.controllers import random_controller, simple

ARITHMETICS = ("f64", "f32", "q31", "q15")
RANDOM = range(400, 410)  # one of each kind


def planned(controller: Controller, label: str) -> list[Plan]:
    """A plan in every arithmetic that can carry the controller."""
    plans = []
    for arithmetic in ARITHMETICS:
        try:
            plans.append(build_plan(controller, arithmetic, name=f"{label}_{arithmetic}"))
        except PlanError:
            assert label != "paper"
    return plans


@pytest.fixture(scope="module")
def plans() -> list[Plan]:
    """The paper's controller and ten random ones."""
    random = [plan for seed in RANDOM for plan in planned(random_controller(seed, 90), f"c{seed}")]
    assert len(random) >= 30
    return planned(paper_controller(200), "paper") + random


@pytest.fixture(scope="module")
def folder(plans, tmp_path_factory) -> Path:
    """All of them side by side."""
    folder = tmp_path_factory.mktemp("strict")
    for plan in plans:
        write_files(folder, folder_files(plan, controller_text(plan.controller).encode()))
    return folder


@pytest.mark.parametrize("part", [0, *(pytest.param(p, marks=pytest.mark.long) for p in (1, 2))])
def test_not_a_warning(part, plans, folder, tmp_path):
    """Each by itself, so that none lacks what another one includes."""
    sources = [folder / f"{plan.name}.c" for plan in plans[part::3]]
    for source in sources:  # one at a time: not every driver takes several
        run(*compiler("gcc"), *STRICT, "-O2", "-c", source, cwd=tmp_path)
    assert len(list(tmp_path.glob("*.o"))) == len(sources)


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_not_a_warning_by_clang(arithmetic, plans, folder, tmp_path):
    """All of an arithmetic in one file, since the compiler starts for longer than it compiles. Its warnings
    do not depend on optimisation, as gcc's may.
    """
    sources = [folder / f"{plan.name}.c" for plan in plans if plan.arithmetic == arithmetic]
    (tmp_path / "all.c").write_text("".join(f'#include "{source}"\n' for source in sources))
    run(*compiler("clang"), *STRICT, "-c", tmp_path / "all.c", "-o", tmp_path / "x.o")
    assert len(sources) >= 7


def test_the_strict_flags_see_what_they_should(tmp_path):
    """Were they ignored, nothing above could fail."""
    (tmp_path / "loose.c").write_text("short f(int x);\nshort f(int x) { return x; }\n")
    for name in ("gcc", "clang"):
        with pytest.raises(AssertionError, match="conversion"):
            run(*compiler(name), *STRICT, "-c", tmp_path / "loose.c", "-o", tmp_path / "x.o")


def table(text: str, name: str) -> list[str]:
    """The numbers of a C table, as text."""
    body = re.search(rf"\b{name}\[\d+\] = \{{\n(.*?)\n\}};", text, re.DOTALL)[1]
    return re.findall(r"[^\s,]+(?=,)", re.sub(r"/\*.*?\*/", "", body))


def test_tables_read_back_as_the_weights(plans, folder):
    """Every digit: float("…") and np.float32("…") are correctly rounded readers, like a C compiler's."""
    seen = 0
    for plan in plans:
        text = (folder / f"{plan.name}.c").read_text()
        inner = plan.inner and plan.inner.rest
        sums = {
            "numerator": plan.direct,
            "integrand": inner,
            "denominator": plan.feedback and plan.feedback.table,
        }
        read = {"f64": float, "f32": lambda t: float(np.float32(t.rstrip("f")))}.get(plan.arithmetic, int)
        for name, one in sums.items():
            if one is not None:
                weights = [w for block in one.blocks if any(block.weights) for w in block.weights[::-1]]
                assert [read(t) for t in table(text, f"{plan.name}_{name}")] == weights
                seen += len(weights)
    assert seen > 3000


@pytest.mark.parametrize(
    "name",
    [
        "RT",
        "foc",
        pytest.param("FOC", marks=pytest.mark.long),
        pytest.param("INT16", marks=pytest.mark.long),
        "state",
        pytest.param("sig", marks=pytest.mark.long),
    ],
)
def test_names_near_the_runtime_s_own(name, tmp_path):
    """The header's guard and the generated names stay clear of foc_rt.h's and stdint.h's."""
    controller = simple(TransferFunction([(1.0, 0.5), (1.0, -0.5)], [(0.1, 0.9), (1.0, 0.0)]), length=8)
    write_files(tmp_path, folder_files(build_plan(controller, "q15", name=name), b""))
    run(*compiler("gcc"), *STRICT, "-c", tmp_path / f"{name}.c", "-o", tmp_path / "x.o")


def test_no_sentence_is_cut_short_where_there_are_no_units(tmp_path):
    """Controllers without units, in every arithmetic: no comment with a hole in it."""
    controller = simple(TransferFunction([(1.0, 0.5), (1.0, -0.5)], [(0.1, 0.9), (1.0, 0.0)]), length=8)
    for plan in planned(controller, "bare"):
        for name, text in folder_files(plan, b"").items():
            if name.endswith(".c") or name == f"{plan.name}.h":
                assert not re.search(r"; \.|, \*/|: \*/|\(\) |\bNone\b", text), (plan.name, name)


def test_an_unstable_memory_names_one_that_works(tmp_path, capsys):
    """10 s^1.2 + 1 at 10 ms, cut off after 64 samples, diverges: refused, with a length that works."""
    controller = simple(TransferFunction([(1.0, 0.0)], [(10.0, 1.2), (1.0, 0.0)]), name="slow", length=64)
    (tmp_path / "slow.toml").write_text(controller_text(controller))
    command = ["generate", str(tmp_path / "slow.toml"), "--out", str(tmp_path / "out"), "--arithmetic", "f64"]
    assert main(command) == 2 and not (tmp_path / "out").exists()
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "unstable" in error
    length = re.search(r"length of (\d+)", error)[1]
    assert int(length) > 64 and main([*command, "--length", length]) == 0
    assert main([*command, "--length", str(int(length) - 1)]) == 2
