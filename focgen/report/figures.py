"""A figure as data: what is drawn where, in which colour, before any library draws it.

A figure has panels below each other, which may share the x axis; a panel has axes and marks. Colours are
names of :data:`focgen.report.style.COLOURS` or colours of :data:`focgen.report.style.CYCLE`; a label is a
user's text in no form yet, which the page gives one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Array
from focgen.logs.thinning import thinned

if TYPE_CHECKING:
    from focgen.report.page import TableOf

MOST = 4000
"""Points of a curve: what is longer is thinned to as many, its extremes kept."""


@dataclass(frozen=True)
class Axis:
    """What is along it, with the unit. ``low``, ``high``: its ends, None where the marks set them;
    ``places``: names at 0, 1, 2 … instead of numbers; ``from_zero``: zero is on it, whatever is drawn."""

    label: str
    log: bool = False
    low: float | None = None
    high: float | None = None
    places: tuple[str, ...] = ()
    from_zero: bool = False


@dataclass(frozen=True, eq=False)
class Line:
    """A curve through ``x`` and ``y``, (n,) both; NaN breaks it. ``label`` is what hovering tells; marks of
    one ``group`` have one entry of the legend, named so (None: the label; "": no entry). ``steps``: held from
    sample to sample; ``dots``: a dot at every point, and no line where ``dash`` is "none"."""

    label: str
    x: Array
    y: Array
    colour: str
    dash: str = "solid"
    width: float = 1.6
    steps: bool = False
    dots: float = 0.0
    group: str | None = None


@dataclass(frozen=True, eq=False)
class Bars:
    """Bars at ``places`` from ``bottoms`` (0) to ``tops``, all (n,), ``width`` wide; ``names`` (n,) for
    hovering; ``across``: to the right, not upwards."""

    label: str
    places: Array
    tops: Array
    colour: str
    bottoms: Array | None = None
    width: float = 0.8
    names: tuple[str, ...] = ()
    across: bool = False
    group: str | None = None


@dataclass(frozen=True, eq=False)
class Area:
    """What lies between ``low`` and ``high`` over ``x``, (n,) all: an interval or a tolerance."""

    label: str
    x: Array
    low: Array
    high: Array
    colour: str
    group: str | None = None


@dataclass(frozen=True)
class Rule:
    """A straight line at ``value``: ``upright`` at x = value, else at y = value."""

    value: float
    colour: str = "reference"
    dash: str = "dashed"
    upright: bool = False


Mark = Line | Bars | Area | Rule


@dataclass(frozen=True)
class Panel:
    """One pair of axes; ``height`` in pixels."""

    x: Axis
    y: Axis
    marks: tuple[Mark, ...]
    title: str = ""
    height: int = 300


@dataclass(frozen=True)
class Figure:
    """Panels and what they show. ``title`` and ``caption`` stand beside it, ``alt`` is for who cannot see it,
    ``numbers`` are the figures behind it. ``linked``: zooming one panel along x zooms all."""

    title: str
    caption: str
    alt: str
    panels: tuple[Panel, ...]
    numbers: TableOf
    linked: bool = True


def curve(label: str, x: ArrayLike, y: ArrayLike, colour: str, **how: Any) -> Line:
    """A :class:`Line` of at most :data:`MOST` points."""
    places, values = np.asarray(x, float), np.asarray(y, float)
    kept = thinned(values, most=MOST)
    return Line(label, places[kept], values[kept], colour, **how)
