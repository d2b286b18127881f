"""A report as one HTML page beside its pictures: readable from disk, no scripts, nothing fetched."""

from __future__ import annotations

from dataclasses import dataclass, field

from jinja2 import Environment, FileSystemLoader, StrictUndefined

import focgen
from focgen.resources import shipped


@dataclass(frozen=True)
class TableOf:
    """A table: column heads, and rows of text."""

    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""


@dataclass(frozen=True)
class Picture:
    """A picture's path relative to the page, and what it shows."""

    path: str
    caption: str


@dataclass(frozen=True)
class Section:
    """One step of the chain: what was found, as sentences, tables and pictures, and where the files are."""

    title: str
    sentences: tuple[str, ...] = ()
    tables: tuple[TableOf, ...] = ()
    pictures: tuple[Picture, ...] = ()
    files: tuple[str, ...] = ()


@dataclass(frozen=True)
class Page:
    """A whole report. ``lead`` says in one paragraph what came out."""

    title: str
    lead: str
    sections: tuple[Section, ...] = field(default=())

    def html(self) -> str:
        """The page as text; equal pages give equal bytes."""
        environment = Environment(
            loader=FileSystemLoader(shipped("templates")),
            autoescape=True,
            undefined=StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
            keep_trailing_newline=True,
        )
        return environment.get_template("report.html").render(page=self, version=focgen.__version__)


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
