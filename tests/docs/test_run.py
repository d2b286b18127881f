"""The pages do what they say: every command runs and prints what is shown, every file is read.

Red when a command's option, output or example file changes and the page does not.
"""

import re
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
FURTHER = ("memory", "packages", "kernels", "targets", "report", "proofs")
# Pages whose commands go on from files that the reader has by then; SETUP makes them.
PROJECTS = ("examples/cmake/README.md", "examples/fmu/README.md")
USES = ("examples/README.md", *PROJECTS, *(f"docs/{name}.md" for name in FURTHER))
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


def logs_in(made):
    """The folder with the logs that the README speaks of."""
    (made / "examples").symlink_to(ROOT / "examples")
    shutil.copytree(ROOT / "examples" / "logs", made / "logs")
    shutil.copy(made / "logs" / "steps.csv", made / "steps.csv")
    shutil.copy(made / "logs" / "sines.csv", made / "other_log.csv")
    return made


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    """A folder with everything that the chain of the README has made by its end."""
    made = logs_in(tmp_path_factory.mktemp("desk"))
    shutil.copy(ROOT / "examples" / "rig.toml", made)
    run_shell(Block(DOCS, 0, "sh", SETUP), made)
    return made


@pytest.mark.long
@pytest.mark.parametrize("name", TUTORIALS)
def test_a_tutorial_runs_from_its_first_line_to_its_last(name, folder):
    assert run_page(DOCS / f"{name}.md", folder) >= 3


@pytest.mark.long
@pytest.mark.parametrize("name", USES)
def test_the_commands_of_a_page_run(name, desk):
    run_page(ROOT / name, desk)


@pytest.mark.long
def test_the_chain_of_the_readme_runs_from_logs_alone(tmp_path):
    assert run_page(ROOT / "README.md", logs_in(tmp_path)) >= 1


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
    made, controller = tmp_path / "valve", tmp_path / "controller.toml"
    given = (ROOT / "examples" / "controller.toml").read_text(encoding="utf-8")
    controller.write_text(
        given + "\n[tunable]\ngain = [0.5, 2.0]\noutput_high = [5.0, 10.0]\n", encoding="utf-8"
    )
    focgen.generate(controller, made, name="valve", memory="exponential", selftest=True, tunable=True)
    shown = [b.text.replace("NAME", "valve") for b in blocks(DOCS / "c-interface.md") if b.language == "c"]
    prototypes, loop, declared, tuned, start, _ = shown
    header = "".join((made / "valve.h").read_text(encoding="utf-8").split())
    for line in re.findall(r"^.*\);", prototypes + declared, re.MULTILINE):
        assert "".join(line.split()) in header, line
    done = {
        "STARTED": start.replace("}", "return; }"),
        "TUNED": tuned.replace("&controller", "&s"),
        "LOOP": loop,
    }
    compiles(re.sub("|".join(done), lambda name: done[name.group()], FIRMWARE), made)


FIRMWARE = """#include "valve.h"
#include "valve_selftest.h"
extern int32_t limit(int32_t u);
void loop(int32_t ref, int32_t meas, int32_t sched, int32_t u_manual);
void tuned(valve_state s, float supply);
void started(void);
void loop(int32_t ref, int32_t meas, int32_t sched, int32_t u_manual)
{
    int32_t u, applied;
LOOP
}
void tuned(valve_state s, float supply)
{
TUNED
}
void started(void)
{
STARTED
}
"""


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
