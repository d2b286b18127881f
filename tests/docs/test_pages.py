"""The pages: every link leads somewhere, every command named exists, nothing of one machine stands in
them.

Red when a link leads nowhere, a page names a command that is not there, or a result of the page of Python
differs.
"""

import doctest
import re
import typing
from importlib import import_module
from pathlib import Path

import pytest

import focgen
from focgen.cli.main import commands
from tests.prose import pages

ROOT = Path(__file__).resolve().parents[2]
PAGES = pages(ROOT)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_leads_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)", page.read_text(encoding="utf-8")):
        assert target.startswith("http") or (page.parent / target).exists(), target


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_command_named_exists(page):
    lines = re.findall(r"^focgen ([a-z]+)", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert set(lines) <= set(commands())


def test_the_page_of_python_is_true(monkeypatch):
    monkeypatch.chdir(ROOT)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    failed, tried = doctest.testfile(str(ROOT / "docs" / "python.md"), module_relative=False)
    import_module("matplotlib.pyplot").close("all")
    assert tried > 50 and not failed


def test_every_function_has_its_row_on_the_page_of_python():
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `([a-z]+)\([^|]*` \| (?:the )?`([A-Z][A-Za-z]+)`", page, re.MULTILINE))
    assert set(rows) == set(commands())
    for name in set(rows) - {"report", "trial"}:  # a room that is called, and one of three results
        assert typing.get_type_hints(getattr(focgen, name))["return"].__name__ == rows[name]


def test_readme_begins_with_what_it_is_and_how_to_start():
    screen = "\n".join((ROOT / "README.md").read_text(encoding="utf-8").splitlines()[:30])
    for piece in ("make demo", "make test", "What it does not do", ".png", "microcontroller"):
        assert piece in screen


def test_every_attack_names_a_test_that_is_there():
    """And says so where it is no part of the short suite."""
    page = (ROOT / "docs" / "attacks.md").read_text(encoding="utf-8")
    rows = [line for line in page.splitlines() if line.startswith("|") and not set(line) <= set("|- ")]
    named = [re.search(r"`(tests/[\w/]+\.py)::(\w+)`( \(long\))? \|$", row) for row in rows]
    assert len(named) > 60 and [row for row, found in zip(rows, named) if not found] == [
        "| attack | ends as | test |"
    ] * page.count("\n## ")
    for file, test, long in filter(None, (found and found.groups() for found in named)):
        marks = re.search(rf"((?:^@.*\n)*)^def {test}\(", (ROOT / file).read_text("utf-8"), re.MULTILINE)
        assert marks, f"{file} has no {test}"
        assert ("mark.long" in marks[1]) == bool(long), test
