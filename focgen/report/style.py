"""One look for every picture: colours that colour-blind readers tell apart, one font, the same bytes every
time.

with figure(2, 1, sharex=True) as (fig, (top, bottom)):
    top.plot(time, curvature, color=COLOURS["measured"])
    picture = png(fig)
write_files(folder, {"steps.png": picture})
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from io import BytesIO
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from focgen.errors import MissingExtra

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

DPI = 150

# Okabe and Ito's palette: told apart under the three common colour deficiencies and in grey.
BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, SKY, BLACK, GREY = "#CC79A7", "#56B4E9", "#000000", "#7F7F7F"

CYCLE = (BLUE, RED, GREEN, ORANGE, PURPLE, SKY, BLACK)
"""For lines without a meaning of their own, in this order."""

COLOURS = {
    "measured": GREY,
    "model": BLUE,
    "ideal": BLACK,
    "running": RED,
    "reference": BLACK,
    "band": "#DDDDDD",
    "limit": RED,
    "command": BLUE,
    "pressure": ORANGE,
    "curvature": GREEN,
    "output": BLUE,
    "regulator": ORANGE,
    "actuator": BLUE,
    "sensor": GREEN,
    "controller": PURPLE,
    "good": GREEN,
    "bad": RED,
}
"""What means the same is drawn in the same colour everywhere: roles, stages, verdicts."""

_RC: dict[str, Any] = {
    "font.family": ["DejaVu Sans"],  # comes with matplotlib, so the same everywhere
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.use_mathtext": True,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.4,
    "lines.markersize": 4.5,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "figure.constrained_layout.use": True,
    "image.cmap": "cividis",
}

_NOT_OURS = ("backend", "interactive", "toolbar", "webagg", "tk.", "date.epoch", "docstring")
"""Settings of windows, which are the session's: no picture depends on them."""


@cache
def _notebooks() -> type[Figure]:
    """matplotlib's figure, which a notebook shows whether or not pyplot was ever imported."""
    from matplotlib import figure as drawing

    class Figure(drawing.Figure):
        def _repr_png_(self) -> bytes:
            return png(self)

    return Figure


def _matplotlib() -> ModuleType:
    try:
        import matplotlib
    except ImportError:
        raise MissingExtra.of("matplotlib", "plots", "pictures") from None
    return matplotlib


def _look() -> dict[str, Any]:
    """Every setting of matplotlib: its own defaults and those of this page. It takes a file ``matplotlibrc``
    of the current folder for the user's, which may be a stranger's and have a text drawn by LaTeX.
    """
    defaults = _matplotlib().rcParamsDefault
    ours = {name: value for name, value in dict.items(defaults) if not name.startswith(_NOT_OURS)}
    return ours | _RC


@contextmanager
def figure(
    rows: int = 1, columns: int = 1, size: tuple[float, float] | None = None, **subplots: Any
) -> Iterator[tuple[Figure, Any]]:
    """Yield a figure and its axes, as ``matplotlib.pyplot.subplots`` gives them; inside the block the style
    holds.

    ``size`` in inches (default 7 wide, 2.8 a row); ``subplots`` goes to ``Figure.subplots``. Nothing is
    shared between figures and no window is opened. Raises MissingExtra where matplotlib is not installed.
    """
    matplotlib = _matplotlib()
    with matplotlib.rc_context(_look() | {"axes.prop_cycle": matplotlib.cycler(color=CYCLE)}):
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        fig = _notebooks()(figsize=size or (7.0, 2.8 * rows + 0.4), dpi=DPI)
        FigureCanvasAgg(fig)
        yield fig, fig.subplots(rows, columns, **subplots)


def with_unit(name: str, unit: str) -> str:
    """A label: the quantity, and its unit in brackets where it is known."""
    return f"{name} ({unit})" if unit else name


def sparse_ticks(axis: Axis) -> None:
    """Label a logarithmic ``axis`` (``axes.xaxis`` or ``axes.yaxis``, with everything drawn) so that labels
    stay apart: decades; within two of them 1, 2 and 5; within one a few round numbers.
    """
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator

    axis.set_minor_formatter(NullFormatter())
    low, high = axis.get_view_interval()
    if not 0.0 < low < high < 100.0 * low:
        return
    if high < 6.0 * low:
        axis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
        axis.set_minor_locator(NullLocator())
    else:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def log_scales(axes: Axes, names: str = "xy") -> None:
    """Make the axes ``names`` logarithmic, each where something above 0 is drawn on it: else there is no such
    scale, and it stays as it is."""
    for name in names:
        drawn = [np.asarray(getattr(line, f"get_{name}data")(), float) for line in axes.lines]
        if any(np.any(values > 0.0) for values in drawn):
            getattr(axes, f"set_{name}scale")("log")


def png(fig: Figure) -> bytes:
    """The figure as a PNG without date or version inside: the same figure gives the same bytes."""
    stream = BytesIO()
    with _matplotlib().rc_context(_look()), warnings.catch_warnings():
        # where a legend took a second to place: that the computer is busy is no fault of the figure
        warnings.filterwarnings("ignore", "Creating legend with loc", UserWarning)
        _tame(fig)
        fig.savefig(stream, format="png", dpi=DPI, metadata={"Software": None})
    return stream.getvalue()


def _tame(fig: Figure) -> None:
    """Show as it stands what would be a formula and is none: a unit, or a column's name."""
    from matplotlib.mathtext import MathTextParser
    from matplotlib.text import Text

    parser = MathTextParser("path")
    for text in fig.findobj(Text):
        if text.get_text().count("$") > 1:
            try:
                parser.parse(text.get_text())
            except ValueError:
                text.set_parse_math(False)


def save(fig: Figure, path: str | Path) -> Path:
    """Write :func:`png` to ``path`` and return it."""
    path = Path(path)
    path.write_bytes(png(fig))
    return path
