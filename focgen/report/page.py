"""A report as one HTML page: beside its pictures and without scripts, or by itself with figures that move."""

from __future__ import annotations

from dataclasses import dataclass, field

from jinja2 import Environment, FileSystemLoader, StrictUndefined

import focgen
from focgen.errors import MissingExtra
from focgen.report.figures import MOST, Figure
from focgen.report.interactive import document, legend, library
from focgen.report.texts import data
from focgen.resources import shipped

LARGEST = 3_000_000
"""Bytes of a page with its figures."""
_LONGEST = 12  # rows of a table that stands open: the figures behind it are not far
_POINTS = (MOST, MOST // 2, MOST // 4, 500)  # of a curve


@dataclass(frozen=True)
class TableOf:
    """A table: column heads, and rows of text."""

    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""

    @property
    def words(self) -> tuple[bool, ...]:
        """Which columns hold words, not numbers: most of their cells that are not empty begin with a letter
        or a bracket."""
        columns = ([row[i] for row in self.rows if row[i]] for i in range(len(self.heads)))
        told = ([cell[0].isalpha() or cell[0] == "(" for cell in column] for column in columns)
        return tuple(2 * sum(column) > len(column) for column in told)


@dataclass(frozen=True)
class Picture:
    """A picture's path relative to the page, and what it shows."""

    path: str
    caption: str


@dataclass(frozen=True)
class Section:
    """One step of the chain: what was found, as sentences and tables, shown in pictures (files beside the
    page) or in figures (within it), and where the files are."""

    title: str
    sentences: tuple[str, ...] = ()
    tables: tuple[TableOf, ...] = ()
    pictures: tuple[Picture, ...] = ()
    files: tuple[str, ...] = ()
    figures: tuple[Figure, ...] = ()


@dataclass(frozen=True)
class Page:
    """A whole report. ``lead`` says in one paragraph what came out."""

    title: str
    lead: str
    sections: tuple[Section, ...] = field(default=())

    def html(self) -> str:
        """The page beside its pictures; equal pages give equal bytes."""
        return _environment().get_template("report.html").render(page=self, version=focgen.__version__)

    def self_contained(self) -> str:
        """The page with its figures in it, which fetches nothing; equal pages give equal bytes.

        Curves are thinned until the page has at most :data:`LARGEST` bytes, if need be, but not below 500
        points.
        Raises MissingExtra where Bokeh, which draws them, is not installed.
        """
        for most in _POINTS:
            text = self._with_figures(most)
            if len(text.encode("utf-8")) <= LARGEST:
                break
        return text

    def best(self) -> str:
        """The page with its figures where Bokeh is installed, else beside its pictures."""
        try:
            return self.self_contained()
        except MissingExtra:
            return self.html()

    def _with_figures(self, most: int) -> str:
        figures = [figure for section in self.sections for figure in section.figures]
        names = [f"figure{i}" for i in range(1, len(figures) + 1)]
        documents = {name: document(figure, most, name) for name, figure in zip(names, figures)}
        template = _environment().get_template("report/page.html")
        values = {"documents": data(documents), "library": library(), "most": most, "longest": _LONGEST}
        legends = [legend(figure) for figure in figures]
        return template.render(page=self, version=focgen.__version__, legends=legends, **values)


def _environment() -> Environment:
    """Whatever a template prints is escaped, unless it says that it is safe."""
    return Environment(
        loader=FileSystemLoader(shipped("templates")),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def text_table(table: TableOf) -> str:
    """The same table for a terminal: columns aligned, the first to the left, the others to the right."""
    grid = [table.heads, *table.rows]
    widths = [max(len(row[i]) for row in grid) for i in range(len(table.heads))]
    lines = [
        "  ".join(_padded(cell, width, i) for i, (cell, width) in enumerate(zip(row, widths))).rstrip()
        for row in grid
    ]
    lines.insert(1, "  ".join("-" * width for width in widths))
    return "\n".join(([table.caption] if table.caption else []) + lines)


def _padded(cell: str, width: int, column: int) -> str:
    return cell.ljust(width) if column == 0 else cell.rjust(width)
