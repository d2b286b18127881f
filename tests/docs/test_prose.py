"""No sentence of a page, a help, a message or a public docstring has more than 35 words.

Red when a page, a help, an error, a note or a docstring of a public function says too much in one breath, and
when the splitter no longer sees where a sentence ends. Red, too, when a test file does not say what would
have to break for it to fail.
"""

import re

import pytest

import focgen
from tests.pages import ROOT
from tests.prose import LONGEST, of_docstrings, of_page, of_source, pages, split, too_long

PAGES = pages(ROOT)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_a_page_says_one_thing_at_a_time(page):
    said = list(of_page(page.read_text(encoding="utf-8"), page.name))
    assert said and not too_long(said), "\n".join(too_long(said))


def test_helps_and_messages_say_one_thing_at_a_time():
    files = sorted((ROOT / "focgen").rglob("*.py"))
    said = [s for file in files for s in of_source(file.read_text(encoding="utf-8"), file.name)]
    assert len(said) > 20 and not too_long(said), "\n".join(too_long(said))


def test_public_docstrings_say_one_thing_at_a_time():
    said = []
    for home, names in focgen._HOMES.items():
        file = ROOT / "focgen" / f"{home.replace('.', '/')}.py"
        said += of_docstrings(file.read_text(encoding="utf-8"), names)
    assert len(said) > 50 and not too_long(said), "\n".join(too_long(said))


TESTED = sorted({file.parent for file in (ROOT / "tests").rglob("test_*.py")})
LONG = " ".join(["word"] * (LONGEST + 1))


@pytest.mark.parametrize(
    "text",
    [
        f"Short. {LONG}.",
        f"- short\n- {LONG}\n",
        f"| short | {LONG} |\n|---|---|\n",
        "# Title\n\nwords over\n" + "\n".join(LONG.split()),
        f"See eq. (3) and {LONG}",
        f"({LONG}) `code`. [link](page.md).",
    ],
)
def test_a_sentence_too_long_is_found(text):
    assert len(too_long(of_page(text, "page"))) == 1


HALF = " ".join(["word"] * (LONGEST // 2 + 2))


@pytest.mark.parametrize(
    "text",
    [
        f"{HALF}. Then {HALF}.",
        f"{HALF}? `Code` {HALF}.",
        f"{HALF}.) And {HALF}.",
        f"- {HALF}\n- {HALF}\n",
        f"| {HALF} | {HALF} |\n",
        f"## {HALF}\n{HALF}\n",
        f"{HALF}\n\n    {LONG}\n\n{HALF}",
        f"{HALF}\n```sh\n{LONG}\n```\n",
        f"`{LONG}` {HALF} + = · | and [{HALF[:20]}](a/page.md)",
    ],
)
def test_what_ends_a_sentence_is_seen(text):
    assert not too_long(of_page(text, "page"))


def test_strings_are_read_as_they_are_printed():
    short = f'x = ("{HALF} "\n     f"{{value}}. Then {HALF}.")\n'
    assert not too_long(of_source(short, "file.py"))
    assert len(too_long(of_source(short.replace(". Then", ", then"), "file.py"))) == 1
    assert not too_long(of_source(f'def f():\n    """{LONG}\n    """\n', "file.py"))
    assert not too_long(of_source(f'x = ("{LONG} "\n  "{LONG}").split()\n', "file.py"))
    assert not too_long(of_source(f'x = """\n{HALF}\n\n  focgen {LONG}\n{HALF}"""\n', "file.py"))


def test_an_abbreviation_ends_no_sentence():
    (one,) = split("as eq. (4) says, e.g. Here, of Fig. 9", "page")
    assert one.words == 9


@pytest.mark.parametrize("folder", TESTED, ids=lambda folder: folder.name)
def test_a_test_file_says_what_would_have_to_break(folder):
    said = {f.name: f.read_text(encoding="utf-8").split('"""')[1] for f in folder.glob("test_*.py")}
    telling = re.compile(r"\b(Red|Fails) (when|where|with)\b")
    assert not [name for name, text in said.items() if not telling.search(text)]
