"""Figures on a page: thinned with every peak, bars from zero, texts as given, equal bytes, a bound size.

Red when thinning loses a peak, or equal results give unequal bytes.
"""

import json
import re

import numpy as np
import pytest

from focgen.logs.thinning import thinned
from focgen.report.figures import Axis, Bars, Figure, Line, Panel, Rule
from focgen.report.page import LARGEST, Page, Section, TableOf
from focgen.report.pages.diagnosis import diagnosis_page
from focgen.report.texts import data
from focgen.report.texts import drawn as shown
from tests.report_samples import NAMES, diagnosis, signals

NUMBERS = TableOf(("curve", "last"), (("a", "1"),))


def figure(*marks, x=Axis("time (s)"), y=Axis("y")):
    return Figure("title", "caption", "alt", (Panel(x, y, marks),), NUMBERS)


def models(made, kind):
    """All models of a kind in a document of BokehJS."""
    found = []

    def look(part):
        if isinstance(part, dict):
            if part.get("type") == "object" and part.get("name") == kind:
                found.append(part)
            part = list(part.values())
        if isinstance(part, (list, tuple)):
            for one in part:
                look(one)

    look(made)
    return found


def test_thinning_keeps_every_peak_and_both_ends():
    rng = np.random.default_rng(1)
    signal = rng.normal(size=50_000)
    signal[[777, 31_313]] = 50.0, -60.0
    other = np.zeros(50_000)
    other[40_001] = 1.0
    kept = thinned(signal, other, most=1000)
    assert len(kept) <= 1000 and {0, 777, 31_313, 40_001, 49_999} <= set(kept.tolist())
    assert np.all(np.diff(kept) > 0)


def test_thinning_leaves_short_signals_and_breaks_alone():
    assert thinned(np.ones(10), most=10).tolist() == list(range(10))
    broken = np.ones(10_000)
    broken[5000:5010] = np.nan
    assert 5000 in thinned(broken, most=100)


@pytest.mark.parametrize("across", [False, True])
@pytest.mark.parametrize("tops, end", [([3.0, 7.0], "start"), ([-3.0, -7.0], "end")])
def test_bars_begin_at_zero(tops, end, across):
    pytest.importorskip("bokeh")
    from focgen.report.interactive import document

    size = Axis("size", from_zero=True)
    axes = {"x": size} if across else {"y": size}
    bars = Bars("b", np.arange(2.0), np.array(tops), "good", across=across)
    made = document(figure(bars, **axes))
    ranges = [r.get("attributes", {}) for r in models(made, "Range1d")]
    assert any(r.get(end, 0) == 0 and max(abs(r.get("start", 0)), abs(r.get("end", 1))) > 7 for r in ranges)


def test_equal_figures_give_equal_documents():
    pytest.importorskip("bokeh")
    from focgen.report.interactive import document

    one = figure(Line("a", np.arange(5.0), np.arange(5.0), "model"), Rule(1.0))
    assert json.dumps(document(one)) == json.dumps(document(one))


def test_no_text_is_left_to_the_librarys_own_markup():
    pytest.importorskip("bokeh")
    from focgen.report.interactive import document

    name = "$$\\alpha$$"
    made = document(figure(Line(name, np.arange(3.0), np.arange(3.0), "model"), y=Axis(name, places=(name,))))
    plain = [m.get("attributes", {}).get("text") for m in models(made, "PlainText")]
    assert plain.count(name) == 2  # the axis and its place
    assert not models(made, "TeX") and name not in [
        m.get("attributes", {}).get("text") for m in models(made, "Title")
    ]


@pytest.mark.parametrize("text", ["</script><script>alert(1)", "<!--<script>", "&lt;", "\u2028", '"\\'])
def test_data_in_a_script_cannot_end_it(text):
    made = str(data({text: text}))
    assert not re.search("[<>&\u2028\u2029]", made) and json.loads(made) == {text: text}


def test_drawn_text_is_one_visible_line():
    assert shown("a\n b\u202ec\x00") == "a b?c?"


def test_a_page_escapes_users_names_and_is_reproducible():
    pytest.importorskip("bokeh")
    page = diagnosis_page(diagnosis(), signals(), NAMES[0])
    text = page.self_contained()
    body = text[: text.index("<script>\n")]  # up to the library
    assert "<script>alert" not in text and "&lt;script&gt;alert(1)" in body
    assert NAMES[1] not in text and text == page.self_contained()
    assert not re.search(r'<(?:script|link|img|iframe)[^>]+(?:src|href)="(?!data:,|#)', text)


def test_a_page_stays_below_its_size():
    pytest.importorskip("bokeh")
    rng = np.random.default_rng(0)
    x = np.arange(4000.0)
    lines = tuple(Line(str(i), x, rng.normal(size=4000), "model") for i in range(80))
    text = Page("t", "l", (Section("s", figures=(figure(*lines),)),)).self_contained()
    assert len(text.encode()) <= LARGEST and "at most 2000 points" in text


def test_a_page_says_where_which_how_far_and_what_next():
    page = diagnosis_page(diagnosis(), signals(), "spba")
    assert [s.title for s in page.sections][:5] == [
        "Where",
        "Which",
        "How far",
        "What next",
        "What the numbers mean",
    ]
    which, ahead = page.sections[1], page.sections[3]
    row = ("hysteresis", "1", "actuator", "80%", "play: width", "0.4", "0.3 to 0.5", "bar")
    assert row in which.tables[0].rows
    assert "a slow sine" in ahead.sentences[0]
    assert all(figure.numbers.rows and figure.alt for section in page.sections for figure in section.figures)
    labels = [
        panel.y.label for section in page.sections for figure in section.figures for panel in figure.panels
    ]
    assert "output (mm)" in labels and "pressure (bar)" in labels


@pytest.mark.filterwarnings("error")
def test_a_number_that_a_page_cannot_draw_is_drawn_at_its_end():
    pytest.importorskip("bokeh")
    from focgen.report.interactive import _source

    drawn = _source(y=[1e308, -1e300, float("nan"), 1.0]).data["y"]
    assert np.isfinite(drawn[:2]).all() and drawn[0] > 1e38 and np.isnan(drawn[2]) and drawn[3] == 1.0
