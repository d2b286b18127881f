"""The report page: everything it is given appears, escaped, and equal pages give equal bytes.

Red when something given does not appear, or appears as markup.
"""

from dataclasses import replace
from html.parser import HTMLParser

import pytest

from focgen.report.page import Page, Picture, Section, TableOf, text_table

TABLE = TableOf(("arithmetic", "state"), (("q31", "4 012 B"), ("q15", "2 006 B")), "Size")
PAGE = Page(
    "Actuator <1>",
    "It works & is small.",
    (Section("Model", ("K rises with p.",), (TABLE,), (Picture("fits.png", "Six steps"),), ("rig.toml",)),),
)


class _Collector(HTMLParser):
    def __init__(self):
        super().__init__()
        self.text, self.images, self.open = [], [], []

    def handle_starttag(self, tag, attrs):
        if tag == "img":
            self.images.append(dict(attrs))
        elif tag != "meta":
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def test_page_shows_everything_it_is_given():
    page = _Collector()
    page.feed(PAGE.html())
    shown = "".join(page.text)
    for piece in (
        "Actuator <1>",
        "It works & is small.",
        "K rises with p.",
        "4 012 B",
        "Six steps",
        "rig.toml",
    ):
        assert piece in shown
    assert page.images == [{"src": "fits.png", "alt": "Six steps", "loading": "lazy"}]
    assert not page.open


def test_page_fetches_nothing_and_is_reproducible():
    assert "http" not in PAGE.html() and "<script" not in PAGE.html()
    assert PAGE.html() == PAGE.html()


def test_text_table_aligns_columns():
    caption, *lines = text_table(TABLE).splitlines()
    assert caption == "Size"
    assert (
        len({len(line) for line in lines}) == 1
        and lines[2].startswith("q31 ")
        and lines[2].endswith(" 4 012 B")
    )


def test_a_long_table_is_folded_and_words_stand_to_the_left():
    rows = tuple((f"L = {i}", "q31", str(i), "" if i else "–") for i in range(13))
    long = TableOf(("memory", "arithmetic", "states", "bound"), rows, "sample time 0.01 s")
    assert long.words == (True, True, False, False)
    assert TableOf(("at", "gain"), (("p = 1", "inf"), ("p = 2", "20.1"), ("p = 3", "9"))).words == (
        True,
        False,
    )
    pytest.importorskip("bokeh")
    text = Page("p", "", (Section("s", tables=(long, replace(long, rows=rows[:12]))),)).self_contained()
    assert "<summary>sample time 0.01 s: 13 rows</summary>" in text and text.count("<summary>") == 1
    assert text.count('<td class="words">q31</td>') == 25
