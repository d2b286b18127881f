"""The pages do what they say: every command runs and prints what is shown, every file is read.

Red when a command's option, output or example file changes and the page does not.
"""

import shutil
import subprocess
import sys

import pandas
import pytest

import focgen
from focgen.compiler import find_compiler
from tests.pages import ROOT, Block, blocks, check_shown, run_page, run_shell

DOCS = ROOT / "docs"
TUTORIALS = ("own-log", "tutorial-board", "tutorial-diagnosis", "tutorial-memory")
FURTHER = ("memory", "kernels", "targets", "report", "proofs")
# Pages whose commands go on from files that the reader has by then; SETUP makes them.
USES = ("README.md", "examples/README.md", *(f"docs/{name}.md" for name in FURTHER))
SETUP = """
focgen identify steps.csv --rig rig.toml --to 40 --out identified.toml
focgen design identified.toml --out controller.toml --settling 1.5
focgen generate controller.toml --out firmware --arithmetic q31 --memory exponential
focgen generate controller.toml --out firmware-before --arithmetic q31
focgen generate controller.toml --out build/demo/firmware/q31 --arithmetic q31
focgen study memory controller.toml --out memory
focgen diagnose rig.toml logs/steps.csv logs/sines.csv --out gap
"""


@pytest.fixture
def folder(tmp_path):
    """A folder in which a reader who has the project's examples stands."""
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    return tmp_path


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    """A folder with everything that the chain of the README has made by its end."""
    made = tmp_path_factory.mktemp("desk")
    (made / "examples").symlink_to(ROOT / "examples")
    shutil.copytree(ROOT / "examples" / "logs", made / "logs")
    shutil.copy(ROOT / "examples" / "rig.toml", made)
    shutil.copy(made / "logs" / "steps.csv", made / "steps.csv")
    shutil.copy(made / "logs" / "sines.csv", made / "other_log.csv")
    run_shell(Block(DOCS, 0, "sh", SETUP), made)
    return made


@pytest.mark.long
@pytest.mark.parametrize("name", TUTORIALS)
def test_a_tutorial_runs_from_its_first_line_to_its_last(name, folder):
    assert run_page(DOCS / f"{name}.md", folder) >= 4


@pytest.mark.long
@pytest.mark.parametrize("name", USES)
def test_the_commands_of_a_page_run(name, desk):
    run_page(ROOT / name, desk)


def test_a_line_that_is_not_printed_is_found():
    shown = Block(DOCS / "own-log.md", 1, "text", "T = 1.33 ± 0.02\n")
    check_shown(shown, "so T = 1.331 ± 0.0201 s\n")
    with pytest.raises(AssertionError, match="not printed"):
        check_shown(shown, "so T = 1.43 ± 0.02 s\n")


def test_a_command_that_fails_is_found(tmp_path):
    with pytest.raises(AssertionError, match="there-is-none"):
        run_shell(Block(DOCS / "own-log.md", 1, "sh", "ls there-is-none\n"), tmp_path)


@pytest.mark.parametrize("name", ["rig-file", "identification", "logs"])
def test_a_rig_that_is_shown_is_read(name, tmp_path):
    (shown,) = (block for block in blocks(DOCS / f"{name}.md") if block.language == "toml")
    text = shown.text if shown.text.startswith("name") else f'name = "rig"\nsample_time = 0.01\n{shown.text}'
    (tmp_path / "rig.toml").write_text(text, encoding="utf-8")
    assert focgen.read_rig(tmp_path / "rig.toml").signals.output


def test_a_controller_that_is_shown_is_read(tmp_path):
    (shown,) = (block for block in blocks(DOCS / "controller-file.md") if block.language == "toml")
    (tmp_path / "controller.toml").write_text(shown.text, encoding="utf-8")
    assert focgen.read_controller(tmp_path / "controller.toml").length == 1000


def test_a_frame_is_read_as_the_page_of_logs_says(folder, monkeypatch):
    monkeypatch.chdir(ROOT / "examples")
    monkeypatch.setattr(pandas, "read_excel", lambda name: pandas.read_csv("logs/steps.csv"))
    (shown,) = (block for block in blocks(DOCS / "logs.md") if block.language == "python")
    names = {"pandas": pandas, "focgen": focgen}
    exec("logs = " + shown.text.splitlines()[-1], names | {"frame": pandas.read_excel("bench.xlsx")}, names)
    assert len(names["logs"]) == 6


def test_the_c_that_is_shown_is_the_c_that_is_written(tmp_path):
    made = tmp_path / "valve"
    focgen.generate(
        ROOT / "examples" / "controller.toml", made, name="valve", memory="exponential", selftest=True
    )
    prototypes, loop, start, _ = (
        block.text for block in blocks(DOCS / "c-interface.md") if block.language == "c"
    )
    header = "".join((made / "valve.h").read_text(encoding="utf-8").split())
    for line in prototypes.replace("NAME", "valve").splitlines():
        assert "".join(line.split()) in header, line
    compiles(f"""#include "valve.h"
extern int32_t limit(int32_t u);
void loop(int32_t ref, int32_t meas, int32_t sched, int32_t u_manual);
void loop(int32_t ref, int32_t meas, int32_t sched, int32_t u_manual)
{{
    int32_t u, applied;
{loop}
}}
int start(void);
int start(void)
{{
    {start.replace("NAME", "valve").replace("}", "return 1; }")}
    return 0;
}}""", made)  # fmt: skip


def compiles(text, folder):
    """Compile one file beside the generated header; the compiler's words where it does not."""
    (folder / "page.c").write_text(text, encoding="utf-8")
    run = [*find_compiler(), "-std=c99", "-Wall", "-c", "page.c", "-o", "page.o"]
    done = subprocess.run(run, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.long
def test_the_site_is_built_without_a_warning(tmp_path):
    done = subprocess.run(
        [sys.executable, "tools/make_docs.py", tmp_path], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert 'href="own-log.html"' in page and '<script src="http' not in page
