"""Figures as data, drawn by matplotlib: what a page lets zoom stands still here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from focgen.report.figures import Area, Axis, Bars, Figure, Line, Mark, Panel, Rule
from focgen.report.interactive import colour_of
from focgen.report.style import figure as styled
from focgen.report.style import sparse_ticks
from focgen.report.texts import pictured

_PER_INCH = 100.0  # of the pixels that a panel's height is given in
_WIDE = 7.0  # inches
_DASHES = {"solid": "-", "dashed": "--", "dotted": ":", "dotdash": "-.", "none": ""}
_MOST = 12  # entries of a legend


def still(figure: Figure) -> Any:
    """The figure as ``matplotlib.figure.Figure``, which a notebook shows.

    Raises MissingExtra where matplotlib is not installed.
    """
    heights = [panel.height / _PER_INCH for panel in figure.panels]
    shared = figure.linked and len(heights) > 1
    size, named = (_WIDE, sum(heights) + 0.4), set[str]()
    with styled(len(heights), 1, size, sharex=shared, height_ratios=heights, squeeze=False) as (fig, grid):
        for panel, axes in zip(figure.panels, grid[:, 0]):
            _panel(axes, panel, named)
            if not shared or panel is figure.panels[-1]:
                axes.set_xlabel(pictured(panel.x.label))
        _legend(fig, grid[:, 0])
        fig.suptitle(pictured(figure.title), fontsize=10, fontweight="bold", x=0.02, ha="left")
    return fig


def _panel(axes: Any, panel: Panel, named: set[str]) -> None:
    for axis, which in ((panel.x, "x"), (panel.y, "y")):
        if axis.log:
            getattr(axes, f"set_{which}scale")("log")
    for mark in panel.marks:
        _draw(axes, mark, _entry(mark, named))
    for axis, which in ((panel.x, "x"), (panel.y, "y")):
        _reach(axes, axis, which)
    axes.set_ylabel(pictured(panel.y.label))
    if panel.title:
        axes.set_title(pictured(panel.title), fontsize=9)


def _legend(fig: Any, every: Sequence[Any]) -> None:
    """What is drawn in all panels, below them; nothing where there is but one thing."""
    pairs = [pair for axes in every for pair in zip(*axes.get_legend_handles_labels())]
    if len(pairs) > 1:
        handles, labels = zip(*pairs[:_MOST])
        fig.legend(handles, labels, loc="outside lower center", ncols=min(4, len(handles)))


def _entry(mark: Mark, named: set[str]) -> str | None:
    """The mark's name in a legend, which each group has once in a figure."""
    if isinstance(mark, Rule):
        return None
    name = pictured(mark.label if mark.group is None else mark.group)
    if not name or name in named:
        return None
    named.add(name)
    return name


def _draw(axes: Any, mark: Mark, label: str | None) -> None:
    colour = colour_of(mark.colour)
    if isinstance(mark, Line):
        _line(axes, mark, colour, label)
    elif isinstance(mark, Bars):
        _bars(axes, mark, colour, label)
    elif isinstance(mark, Area):
        axes.fill_between(mark.x, mark.low, mark.high, color=colour, alpha=0.2, lw=0, label=label)
    else:
        rule = axes.axvline if mark.upright else axes.axhline
        rule(mark.value, color=colour, lw=0.8, ls=_DASHES.get(mark.dash, "--"))


def _line(axes: Any, mark: Line, colour: str, label: str | None) -> None:
    how: dict[str, Any] = {"color": colour, "lw": 0.75 * mark.width, "ls": _DASHES.get(mark.dash, "--")}
    if mark.dots:
        how |= {"marker": "o", "ms": 0.7 * mark.dots}
    if mark.steps:
        how["drawstyle"] = "steps-post"
    axes.plot(mark.x, mark.y, label=label, **how)


def _bars(axes: Any, mark: Bars, colour: str, label: str | None) -> None:
    bottoms = np.zeros(len(mark.tops)) if mark.bottoms is None else mark.bottoms
    long = mark.tops - bottoms
    if mark.across:
        axes.barh(mark.places, long, mark.width, left=bottoms, color=colour, label=label)
    else:
        axes.bar(mark.places, long, mark.width, bottom=bottoms, color=colour, label=label)


def _reach(axes: Any, axis: Axis, which: str) -> None:
    """The axis' ends and the names along it."""
    limits = getattr(axes, f"set_{which}lim")
    if axis.log:
        sparse_ticks(getattr(axes, f"{which}axis"))
    low, high = getattr(axes, f"get_{which}lim")()
    if axis.from_zero:
        limits(min(low, 0.0), max(high, 0.0))
    if axis.low is not None:
        limits(axis.low, None)
    if axis.high is not None:
        limits(None, axis.high)
    if axis.places:
        names = [pictured(name) for name in axis.places]
        turned = {"rotation": 90} if which == "x" and sum(map(len, names)) > 70 else {}
        getattr(axes, f"set_{which}ticks")(range(len(names)), names, **turned)
