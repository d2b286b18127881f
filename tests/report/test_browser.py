"""The page in a real Chromium without a network: draws, zooms, hovers, hides, links, prints, fits a phone.

Red when a page does not draw or answer in a browser, or loads something from outside.
"""

import shutil

import numpy as np
import pytest

from focgen.report.figures import Axis, Figure, Line, Panel
from focgen.report.page import Page, Section, TableOf
from focgen.report.pages.diagnosis import diagnosis_page
from tests.report_samples import NAMES, diagnosis, signals

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_QUIET = (
    "--no-sandbox",
    "--disable-gpu",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-sync",
)
_PLOTS = "figures.figure5.model.children"  # of the session's figure


@pytest.fixture(scope="module")
def chromium():
    pytest.importorskip("bokeh", reason="Bokeh, which draws on pages, is not installed")
    api = pytest.importorskip(
        "playwright.sync_api", reason="playwright, which drives a browser, is not installed"
    )
    path = next(filter(None, map(shutil.which, _NAMES)), None)
    if path is None:
        pytest.skip("no Chromium on this machine")
    with api.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=list(_QUIET))
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    pytest.importorskip("bokeh")
    path = tmp_path_factory.mktemp("page") / "gap.html"
    path.write_text(diagnosis_page(diagnosis(), signals(), NAMES[0]).self_contained(), encoding="utf-8")
    return path


def opened(chromium, file, width, scheme="light", touch=False):
    """The page, drawn, and all that the browser complained of or asked for besides it."""
    view = {"width": width, "height": 800}
    context = chromium.new_context(viewport=view, color_scheme=scheme, has_touch=touch, offline=True)
    page, heard = context.new_page(), []
    page.on("console", lambda said: said.type in ("error", "warning") and heard.append(said.text))
    page.on("pageerror", lambda fault: heard.append(str(fault)))
    page.on("dialog", lambda box: (heard.append(box.message), box.dismiss()))
    page.on("request", lambda asked: asked.url.startswith(("file", "data:")) or heard.append(asked.url))
    page.goto(file.as_uri())
    page.wait_for_selector("html[data-drawn]", timeout=30_000)
    return page, heard


@pytest.fixture(scope="module")
def wide(chromium, file):
    return opened(chromium, file, 1400)


def ends(page):
    """Where the x axis of the session's figure begins and ends."""
    return page.evaluate(f"(({{start, end}}) => [start, end])({_PLOTS}[0].x_range)")


def centre(page, figure, panel=0):
    """The middle of the place where a figure's panel draws, in the window."""
    place = page.locator(f"#figure{figure}-plot")
    place.scroll_into_view_if_needed()
    return page.evaluate(
        f"""(() => {{
          const view = figures.figure{figure}.child_views[{panel}];
          const box = view.el.getBoundingClientRect(), frame = view.frame.bbox;
          return {{x: box.x + frame.x_center, y: box.y + frame.y_center, w: frame.width, h: frame.height,
                   left: box.x + frame.left, top: box.y + frame.top}};
        }})()"""
    )


def test_it_opens_offline_without_a_word(wide):
    page, heard = wide
    assert heard == []
    assert (
        page.evaluate("document.documentElement.dataset.drawn") == str(page.locator(".plot").count()) == "6"
    )


def test_every_figure_has_ink_on_its_canvas(wide):
    page, _ = wide
    counts = page.evaluate(
        """Object.values(figures).map((view) => {
          const canvas = view.export("png", true).canvas;
          const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
          let coloured = 0;
          for (let i = 0; i < pixels.length; i += 4) {
            const [r, g, b, a] = pixels.slice(i, i + 4);
            if (a > 200 && Math.max(r, g, b) - Math.min(r, g, b) > 60) coloured += 1;
          }
          return coloured;
        })"""
    )
    assert len(counts) == 6 and min(counts) > 300


def test_users_names_are_text_and_nothing_else(wide):
    page, heard = wide
    assert NAMES[0] in page.title() and NAMES[0] in page.locator("main").inner_text()
    page.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    assert NAMES[1] in page.locator("main").inner_text()
    assert heard == [] and page.locator("main script").count() == 0


def test_dragging_zooms_all_panels_and_the_button_resets(wide):
    page, _ = wide
    before, at = ends(page), centre(page, 5)
    page.mouse.move(at["left"] + 0.3 * at["w"], at["top"] + 0.2 * at["h"])
    page.mouse.down()
    page.mouse.move(at["left"] + 0.6 * at["w"], at["top"] + 0.8 * at["h"], steps=8)
    page.mouse.up()
    page.wait_for_timeout(200)
    after = ends(page)
    assert after[0] > before[0] and after[1] < before[1]
    assert after[1] - after[0] == pytest.approx(0.3 * (before[1] - before[0]), rel=0.05)
    ranges = page.evaluate(f"{_PLOTS}.map((plot) => plot.x_range.start)")
    assert len(ranges) == 3 and len(set(ranges)) == 1
    page.evaluate("figures.figure5.child_views[0].reset()")
    assert ends(page) == pytest.approx(before)


def tooltip(page):
    """What hovering shows, as text."""
    return page.evaluate(
        """(function texts(node) {
          const below = [...(node.shadowRoot ? node.shadowRoot.children : []), ...node.children];
          const own = node.matches(".bk-Tooltip") ? [(node.shadowRoot ?? node).textContent] : [];
          return [...own, ...below.flatMap(texts)];
        })(document.body).join(" ")"""
    )


def test_pointing_at_a_curve_tells_its_numbers_and_its_name(wide):
    page, heard = wide
    at = centre(page, 1)
    page.mouse.move(at["left"] + 0.27 * at["w"], at["top"] + 0.8 * at["h"])
    page.wait_for_timeout(300)
    told = tooltip(page)
    assert "as given" in told and "pressure → output" in told and "10" in told and heard == []


@pytest.mark.parametrize("name", NAMES)
def test_a_curve_of_any_name_tells_it_as_it_is(chromium, tmp_path, name):
    x = np.array([0.0, 1.0])
    panel = Panel(Axis(name), Axis(name), (Line(name, x, x, "model"), Line("b", x, x + 9.0, "bad")), name)
    figure = Figure(name, name, name, (panel,), TableOf((name,), ((name,),), name))
    (tmp_path / "page.html").write_text(
        Page(name, name, (Section(name, figures=(figure,)),)).self_contained(), "utf-8"
    )
    page, heard = opened(chromium, tmp_path / "page.html", 900)
    at = centre(page, 1)
    page.mouse.move(at["left"] + 0.5 * at["w"], at["top"] + at["h"] * (1.0 - 1.1 / 11.2))
    page.wait_for_timeout(300)
    assert name in tooltip(page) and heard == []
    page.context.close()


def test_the_legend_hides_and_shows_a_curve(wide):
    page, _ = wide
    button = page.locator("#figure5 .legend button", has_text="measured")
    seen = f"{_PLOTS}[0].renderers.filter((one) => one.tags.includes('g0')).map((one) => one.visible)"
    assert page.evaluate(seen) == [True]
    button.click()
    assert page.evaluate(seen) == [False] and button.get_attribute("aria-pressed") == "false"
    button.click()
    assert page.evaluate(seen) == [True]


def test_links_lead_to_parts_that_are_there(wide):
    page, _ = wide
    links = page.locator("a[href]").evaluate_all("(all) => all.map((one) => one.getAttribute('href'))")
    assert len(links) >= 6
    assert all(href.startswith("#") and page.locator(href).count() == 1 for href in links)
    page.locator("nav a", has_text="How far").click()
    assert page.url.endswith("#part3")


def test_who_cannot_see_is_told(wide):
    page, _ = wide
    assert (
        page.locator("main, header, footer, nav[aria-label]").count() == 4
        and page.locator("html[lang]").count() == 1
    )
    alts = page.locator(".plot").evaluate_all("(all) => all.map((one) => one.getAttribute('aria-label'))")
    assert len(alts) == 6 and all(len(alt) > 20 for alt in alts)
    assert page.locator("figure").count() == page.locator("figure details table").count() == 6
    assert page.locator("th:not([scope])").count() == 0


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_nothing_is_cut_on_a_phone(chromium, file, scheme):
    page, heard = opened(chromium, file, 400, scheme, touch=True)
    assert page.evaluate("document.documentElement.scrollWidth") == 400
    out = page.evaluate(
        """[...document.querySelectorAll("main *")].filter((one) => !one.closest(".scroll, .plot"))
             .filter((one) => one.getBoundingClientRect().right > 400)
             .map((one) => one.outerHTML.slice(0, 80))"""
    )
    widths = page.evaluate("Object.values(figures).map((v) => v.el.getBoundingClientRect().right)")
    drags = page.evaluate(
        "Object.values(figures).flatMap((v) => v.model.children.map((p) => p.toolbar.active_drag))"
    )
    assert out == [] and max(widths) <= 400 and set(drags) == {None} and heard == []
    page.context.close()


def test_dark_figures_stand_on_dark_paper(chromium, file):
    page, _ = opened(chromium, file, 800, "dark")
    paper = page.evaluate("getComputedStyle(document.body).backgroundColor")
    ink = page.evaluate(f"JSON.stringify({_PLOTS}[0].left[0].axis_label_text_color)")
    assert paper == "rgb(20, 24, 27)" and "#e5e9ec" in ink
    page.emulate_media(color_scheme="light")
    page.wait_for_timeout(200)
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    page.context.close()


def test_paper_gets_pictures_of_the_figures(chromium, file):
    page, heard = opened(chromium, file, 1000, "dark")
    paper = page.pdf(format="A4")
    assert paper[:4] == b"%PDF" and paper.count(b"/Subtype /Image") >= 6 and heard == []
    page.context.close()
