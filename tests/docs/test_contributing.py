"""What CONTRIBUTING adds, by its steps alone: an effect, an arithmetic, a log format, a core, a template.

Red when a step of the page is missing or no longer fits the code: its blocks are written into a copy
of the package, and nothing else is.
"""

import json
import os
import re
import shutil
import subprocess
import sys

import pytest

from focgen.codegen.kernels import TARGETS
from focgen.logs.table import read_table
from focgen.rig.effects import library
from tests.pages import ROOT, blocks

RUN = """
import json, sys
from pathlib import Path
import numpy as np
import focgen
from focgen.logs.table import read_table
from focgen.rig.effects import Run, library
echo = library()["sensor_echo"]
run = Run.of([300], [0.0], 0.1)
steps = [form.act(np.ones(300), (0.25, 2.0), run)[[0, -1]].tolist() for form in echo.forms]
made = focgen.generate(sys.argv[1], "made", arithmetic="q15_too", length=100)
verified = focgen.verify("made", 500, target="cortex-m33").targets["cortex-m33"]
table = read_table("log.jsonl")
print(json.dumps({
    "package": focgen.__file__, "effect": steps, "arithmetic": made.manifest["arithmetic"],
    "fits": all(proof["worst"] <= proof["limit"] for proof in made.manifest["proofs"]),
    "log": table.numbers("y").tolist(), "samples": verified.samples, "mismatches": verified.mismatches,
    "template": Path("made/proofs.csv").read_text().splitlines(), "files": list(made.manifest["files"]),
    "nodes": len(made.manifest["proofs"]),
}))
"""


@pytest.fixture(scope="module")
def added(tmp_path_factory):
    """What a copy of the package does that has the page's blocks in it."""
    copy = tmp_path_factory.mktemp("copy")
    shutil.copytree(ROOT / "focgen", copy / "focgen", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "templates", copy / "templates")
    (copy / "c_runtime").symlink_to(ROOT / "c_runtime")
    for block in blocks(ROOT / "CONTRIBUTING.md"):
        if name := re.match(r"# ((?:focgen|templates)/\S+)\n", block.text):
            put(copy / name.group(1), block.text[name.end() :], block.language)
    (copy / "log.jsonl").write_text('{"t": 0.0, "y": 1.5}\n{"t": 0.1, "y": 2.5}\n', encoding="utf-8")
    here = {**os.environ, "PYTHONPATH": str(copy)}
    command = [sys.executable, "-c", RUN, str(ROOT / "examples" / "controller.toml")]
    done = subprocess.run(command, cwd=copy, env=here, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout) | {"copy": str(copy)}


def put(file, text, language):
    """A new file, or lines of one that are there exchanged for others."""
    if language != "diff":
        assert not file.exists(), file
        file.write_text(text, encoding="utf-8")
        return
    given, wanted = ("".join(re.findall(rf"^{mark}(.*\n)", text, re.MULTILINE)) for mark in ("-", r"\+"))
    old = file.read_text(encoding="utf-8")
    assert old.count(given) == 1, f"{file.name} has no line {given}"
    file.write_text(old.replace(given, wanted), encoding="utf-8")


def test_an_effect_is_one_file(added):
    assert "sensor_echo" not in library() and added["package"].startswith(added["copy"])
    for first, last in added["effect"]:
        assert 0.7 < first < 0.8 and last == pytest.approx(1.0, abs=1e-3)  # a jump, then a slow rest


def test_an_arithmetic_of_a_width_that_is_there_is_two_lines(added):
    assert added["arithmetic"] == "q15_too" and added["fits"]


def test_a_log_format_is_a_file_and_a_line(added, tmp_path):
    (tmp_path / "log.jsonl").write_text("{}", encoding="utf-8")
    with pytest.raises(Exception, match="not a kind of log"):
        read_table(tmp_path / "log.jsonl")
    assert added["log"] == [1.5, 2.5]


def test_a_core_is_an_entry_and_a_name(added):
    assert "cortex-m33" not in TARGETS and added["samples"] >= 500 and added["mismatches"] == 0


def test_a_template_is_three_places(added):
    head, *rows = added["template"]
    assert head == "node,worst,limit" and len(rows) == added["nodes"] and "proofs.csv" in added["files"]
