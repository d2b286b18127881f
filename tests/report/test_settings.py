"""Bokeh's own settings: a page is the same whatever they are, and none of them stops it.

Red when an environment variable or a file of settings changes a page, or ends in a fault of the program.
"""

import os
import subprocess
import sys

import pytest

import focgen
from focgen.control.files import write_controller
from tests.conftest import paper_controller

pytest.importorskip("bokeh")
NAMES = ("BOKEH_MINIFIED", "BOKEH_LOG_LEVEL", "BOKEH_PY_LOG_LEVEL", "BOKEH_SIMPLE_IDS", "BOKEH_RESOURCES")


def page(folder, **more):
    command = [
        sys.executable,
        "-m",
        "focgen",
        "report",
        str(folder / "c.toml"),
        "--out",
        str(folder / "p.html"),
    ]
    return subprocess.run(command, env={**os.environ, **more}, capture_output=True, text=True)


@pytest.fixture
def folder(tmp_path):
    write_controller(paper_controller(), tmp_path / "c.toml")
    return tmp_path


def test_settings_that_bokeh_does_not_understand_change_no_page(folder):
    focgen.report(folder / "c.toml", folder / "p.html")
    plain = (folder / "p.html").read_bytes()
    done = page(folder, **dict.fromkeys(NAMES, "junk"))
    assert done.returncode == 0, done.stderr
    assert (folder / "p.html").read_bytes() == plain


@pytest.mark.long
def test_a_file_of_settings_that_bokeh_does_not_understand_is_one_line(folder):
    (folder / ".bokeh").mkdir()
    (folder / ".bokeh" / "bokeh.yaml").write_text("py_log_level: junk\nminified: junk\n")
    done = page(folder, HOME=str(folder))
    assert done.returncode == 0 or ("bokeh.yaml" in done.stderr and done.stderr.count("\n") == 1)
    assert "fault" not in done.stderr
