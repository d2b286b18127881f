"""Results that show themselves: a line, a table in a notebook, a figure, a data frame."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


class Shown:
    """What the result of a command can do besides being data.

    How it looks is said in the room of pictures and tables, which is asked when something is to be shown.
    """

    def __repr__(self) -> str:
        return str(_room().line_of(self))

    def _repr_html_(self) -> str:
        """For notebooks: what came out in a sentence, and a small table."""
        return str(_room().html_of(self))

    def plot(self, which: int = 0) -> Figure:
        """Figure number ``which`` of those that the result's page has, drawn by matplotlib.

        Raises InputError where there is none of that number, MissingExtra without matplotlib.
        """
        drawn: Figure = _room().figure_of(self, which)
        return drawn

    def to_frame(self) -> DataFrame:
        """The numbers as a pandas data frame, one row for each of what the result has several of.

        Raises MissingExtra without pandas.
        """
        return _room().frame_of(self)


def files_of(found: Shown) -> dict[str, str | bytes]:
    """What is drawn of a result for the folder that it is written to, by file name.

    Pictures where matplotlib is installed, and a page where the result has one of its own.
    """
    files: dict[str, str | bytes] = _room().files_of(found)
    return files


def _room() -> Any:
    return import_module("focgen.report.results")
