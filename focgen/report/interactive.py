"""Figures as what BokehJS draws: a zoomable, hoverable document each, in JSON.

Text is drawn as it is: the library's own markup (TeX between dollar signs, which it would fetch a renderer
for) is never asked for.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from focgen.errors import InputError, MissingExtra
from focgen.logs.thinning import thinned
from focgen.report.figures import MOST, Area, Axis, Bars, Figure, Line, Mark, Panel, Rule
from focgen.report.style import COLOURS
from focgen.report.texts import drawn

if TYPE_CHECKING:
    pass

_TOOLS = ("pan", "box_zoom", "wheel_zoom", "reset", "save")
_SPARE = 0.06  # of the range, beyond what is drawn


def _bokeh() -> ModuleType:
    """The library, which looks at its settings as it is loaded. Raises MissingExtra where it is not
    installed, InputError where the user's own settings stop it."""
    try:
        with _unset():
            import bokeh
            import bokeh.document
            import bokeh.layouts
            import bokeh.plotting
    except ImportError:
        raise MissingExtra.of("bokeh", "report", "an HTML report") from None
    except (ValueError, RuntimeError) as reason:
        remedy = "correct or move away ~/.bokeh/bokeh.yaml"
        raise InputError("bokeh", f"cannot be loaded ({reason})", remedy) from None
    return bokeh


@contextmanager
def _unset() -> Iterator[None]:
    """Without Bokeh's own settings: a page is the same in every environment, and one that Bokeh does not
    understand stops none."""
    before = {name: value for name, value in os.environ.items() if name.startswith("BOKEH_")}
    for name in before:
        del os.environ[name]
    try:
        yield
    finally:
        os.environ.update(before)


def library() -> str:
    """The script that draws. Raises MissingExtra where Bokeh is not installed."""
    path = Path(str(_bokeh().__file__)).parent / "server" / "static" / "js" / "bokeh.min.js"
    return path.read_text(encoding="utf-8").replace("</script", "<\\/script")


def document(figure: Figure, most: int = MOST, name: str = "figure") -> dict[str, Any]:
    """The figure as a document of BokehJS, with about ``most`` points a curve; equal figures give equal
    documents. ``name`` tells its models from those of the page's other figures.
    Raises MissingExtra where Bokeh is not installed.
    """
    _bokeh()
    from bokeh.document import Document
    from bokeh.layouts import column

    with _unset():
        plots = _plots(figure, most)
        made = Document()
        made.add_root(column(*plots, sizing_mode="stretch_width", spacing=4))
        found: dict[str, Any] = _numbered(made.to_json(deferred=False), name)
    return found


def legend(figure: Figure) -> list[dict[str, str]]:
    """One entry a group of marks, in the order drawn: its ``name``, ``colour`` and ``dash``."""
    entries: dict[str, dict[str, str]] = {}
    for panel in figure.panels:
        for mark in panel.marks:
            if not isinstance(mark, Rule) and (name := _group(mark)):
                dash = mark.dash if isinstance(mark, Line) else "block"
                dash = "dot" if dash == "none" else dash
                entries.setdefault(name, {"name": name, "colour": colour_of(mark.colour), "dash": dash})
    return list(entries.values())


def colour_of(name: str) -> str:
    """A colour by its meaning, or itself."""
    return COLOURS.get(name, name)


def _group(mark: Line | Bars | Area) -> str:
    return drawn(mark.label if mark.group is None else mark.group)


# ------------------------------------------------------------------------------------------------ plots


def _plots(figure: Figure, most: int) -> list[Any]:
    from bokeh.models import CrosshairTool
    from bokeh.models.annotations import Span

    groups = [entry["name"] for entry in legend(figure)]
    cross, shared, plots = Span(dimension="height", line_width=1, line_dash="dotted"), None, []
    for panel in figure.panels:
        plot = _plot(panel, shared, groups, most)
        if figure.linked:
            shared = plot.x_range
            plot.add_tools(CrosshairTool(overlay=cross))
        plots.append(plot)
    for plot in plots[:-1] if figure.linked else ():
        plot.xaxis.visible = False
    for plot in plots[1:] if figure.linked else ():
        plot.toolbar_location = None
    return plots


def _plot(panel: Panel, shared: Any, groups: Sequence[str], most: int) -> Any:
    from bokeh.models import HoverTool, PlainText
    from bokeh.plotting import figure as plain

    plot = plain(
        height=panel.height,
        sizing_mode="stretch_width",
        x_axis_type="log" if panel.x.log else "linear",
        y_axis_type="log" if panel.y.log else "linear",
        x_range=shared or _range(panel.x, _reach(panel, "x"), panel.x.places),
        y_range=_range(panel.y, _reach(panel, "y"), panel.y.places),
        tools=",".join(_TOOLS),
        active_drag="box_zoom",
        toolbar_location="above",
        min_border_right=12,
        min_border_left=58,
        background_fill_color=None,  # the page's own paper shows, light or dark
        border_fill_color=None,
    )
    plot.toolbar.logo = None
    if panel.title:
        plot.title = drawn_title(panel.title)
    for axis, said in ((plot.xaxis[0], panel.x), (plot.yaxis[0], panel.y)):
        axis.axis_label = PlainText(text=drawn(said.label))
        _places(axis, said.places)
    for mark in panel.marks:
        _draw(plot, _thin(mark, most), groups)
    plot.add_tools(HoverTool(tooltips=_tips(panel), renderers=_hovered(plot), line_policy="nearest"))
    return plot


def drawn_title(text: str) -> Any:
    """A panel's title, as it is."""
    from bokeh.models import PlainText
    from bokeh.models.annotations import Title

    return Title(text=PlainText(text=drawn(text)), text_font_size="13px", text_font_style="bold")


def _hovered(plot: Any) -> list[Any]:
    return [one for one in plot.renderers if one.name]


def _tips(panel: Panel) -> list[tuple[str, str]]:
    """What hovering shows: the mark's name, and the numbers under it."""
    tips = [("", "$name")]
    if any(isinstance(mark, Bars) for mark in panel.marks):
        return [*tips, ("", "@place"), ("", "@size")]
    return [*tips, (drawn(panel.x.label), "@x"), (drawn(panel.y.label), "@y")]


def _places(axis: Any, places: Sequence[str]) -> None:
    """Names instead of numbers; turned where they are long."""
    from bokeh.models import FixedTicker, PlainText

    if not places:
        return
    axis.ticker = FixedTicker(ticks=list(range(len(places))), minor_ticks=[])
    axis.major_label_overrides = {i: PlainText(text=drawn(name)) for i, name in enumerate(places)}
    axis.tags = ["places"]


def _range(axis: Axis, reach: tuple[float, float], places: Sequence[str]) -> Any:
    from bokeh.models import Range1d

    low, high = (-0.6, len(places) - 0.4) if places else reach
    if not places:
        low, high = _spread(low, high, axis)
    low = low if axis.low is None else axis.low
    high = high if axis.high is None else axis.high
    return Range1d(start=low, end=high)


def _spread(low: float, high: float, axis: Axis) -> tuple[float, float]:
    """The ends with room beside what is drawn; zero stays an end where it is one."""
    if axis.log:
        share = (high / low) ** _SPARE if high > low else 2.0
        return low / share, high * share
    if axis.from_zero:
        low, high = min(low, 0.0), max(high, 0.0)
    spare = _SPARE * (high - low) or 0.5 * abs(high) or 1.0
    bottom = 0.0 if axis.from_zero and low == 0.0 else low - spare
    return bottom, (0.0 if axis.from_zero and high == 0.0 else high + spare)


def _reach(panel: Panel, way: str) -> tuple[float, float]:
    """The smallest and largest number of the marks along "x" or "y"."""
    axis = panel.x if way == "x" else panel.y
    parts = [np.ravel(part) for mark in panel.marks for part in _numbers(mark, way)]
    values = np.concatenate([np.asarray(part, float) for part in parts]) if parts else np.array([0.0, 1.0])
    values = values[np.isfinite(values) & ((values > 0.0) | (not axis.log))]
    return (float(values.min()), float(values.max())) if len(values) else (0.1, 1.0)


def _numbers(mark: Mark, way: str) -> list[Any]:
    if isinstance(mark, Rule):
        return [[mark.value]] if mark.upright == (way == "x") else []
    if isinstance(mark, Bars):
        sizes = [mark.tops, np.zeros_like(mark.tops) if mark.bottoms is None else mark.bottoms]
        return sizes if mark.across == (way == "x") else [mark.places - 0.5, mark.places + 0.5]
    if isinstance(mark, Area):
        return [mark.x] if way == "x" else [mark.low, mark.high]
    return [getattr(mark, way)]


# ------------------------------------------------------------------------------------------------ marks


def _draw(plot: Any, mark: Mark, groups: Sequence[str]) -> None:
    from bokeh.models.annotations import Span

    if isinstance(mark, Rule):
        dimension: Literal["height", "width"] = "height" if mark.upright else "width"
        span = Span(location=mark.value, dimension=dimension, line_color=colour_of(mark.colour))
        span.update(line_dash=mark.dash, line_width=1)
        plot.add_layout(span)
        return
    drawers: dict[type, Callable[[Any, Any], Any]] = {Line: _line, Bars: _bars, Area: _area}
    draw = drawers[type(mark)]
    name = _group(mark)
    for renderer, named in draw(plot, mark):
        renderer.name = drawn(mark.label) if named else None
        renderer.tags = [f"g{groups.index(name)}"] if name else []
        renderer.nonselection_glyph = None
        renderer.muted_glyph = None


def _thin(mark: Mark, most: int) -> Mark:
    """The mark with fewer points, its peaks kept."""
    if not isinstance(mark, Line) or len(mark.x) <= most:
        return mark
    kept = thinned(mark.x, mark.y, most=most)
    return replace(mark, x=mark.x[kept], y=mark.y[kept])


def _line(plot: Any, mark: Line) -> Any:
    source, colour = _source(x=mark.x, y=mark.y), colour_of(mark.colour)
    if mark.dash != "none":
        how = dict(line_color=colour, line_width=mark.width, line_dash=mark.dash, source=source)
        yield (plot.step(mode="after", **how) if mark.steps else plot.line(**how)), True
    if mark.dots:
        dots = plot.scatter(size=mark.dots, fill_color=colour, line_color=None, source=source)
        yield dots, mark.dash == "none"


def _bars(plot: Any, mark: Bars) -> Any:
    bottoms = np.zeros_like(mark.tops) if mark.bottoms is None else mark.bottoms
    names = [drawn(name) for name in mark.names] or [""] * len(mark.tops)
    source = _source(at=mark.places, low=bottoms, high=mark.tops, size=mark.tops - bottoms)
    source.data["place"] = names
    how = dict(fill_color=colour_of(mark.colour), line_color=None, source=source)
    if mark.across:
        yield plot.hbar(y="at", left="low", right="high", height=mark.width, **how), True
    else:
        yield plot.vbar(x="at", bottom="low", top="high", width=mark.width, **how), True


def _area(plot: Any, mark: Area) -> Any:
    source = _source(x=mark.x, low=mark.low, high=mark.high)
    yield (
        plot.varea("x", "low", "high", source=source, fill_color=colour_of(mark.colour), fill_alpha=0.25),
        False,
    )


def _source(**columns: Any) -> Any:
    """The data, in single precision: more than a screen shows, at half the size."""
    from bokeh.models import ColumnDataSource

    most = np.finfo(np.float32).max  # what a page draws with
    clipped = {name: np.clip(np.asarray(part, float), -most, most) for name, part in columns.items()}
    return ColumnDataSource({name: part.astype(np.float32) for name, part in clipped.items()})


# ------------------------------------------------------------------------------------------------- JSON


def _numbered(value: Any, name: str) -> Any:
    """The same with the models numbered from 1 behind ``name``: Bokeh counts on from page to page."""
    numbers: dict[str, str] = {}

    def again(part: Any) -> Any:
        if isinstance(part, (list, tuple)):
            return [again(one) for one in part]
        if not isinstance(part, dict):
            return part
        found = {key: again(one) for key, one in part.items() if key != "id"}
        if "id" in part:
            return {"id": numbers.setdefault(part["id"], f"{name}-{len(numbers) + 1}")} | found
        return found

    return again(value)
