"""How a result is shown outside a page: in a line, in a notebook's cell, as a figure, as a data frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, Generic, TypeVar

from focgen.errors import InputError, MissingExtra
from focgen.report.figures import Figure
from focgen.report.page import TableOf
from focgen.report.still import still
from focgen.report.texts import drawn

R = TypeVar("R")
Rows = Sequence[dict[str, Any]]
_MOST = 20  # rows of a table in a cell
_SAID = 4  # warnings and notes there


def _nothing(found: Any) -> tuple[str, ...]:
    return ()


def _no_files(found: Any) -> dict[str, str | bytes]:
    return {}


@dataclass(frozen=True)
class View(Generic[R]):
    """What there is to show of a result of one kind.

    ``line``: its figures that matter, behind its kind and name; ``lead``: what came out, in a sentence;
    ``table``: a small one, or None; ``rows``: all numbers, one dictionary a row, by column; ``figures``:
    those of its page; ``said``: warnings and notes; ``files``: what is drawn of it for the folder that it is
    written to.
    """

    line: Callable[[R], str]
    lead: Callable[[R], str]
    table: Callable[[R], TableOf | None]
    rows: Callable[[R], Rows]
    figures: Callable[[R], Sequence[Figure]]
    said: Callable[[R], Sequence[str]] = _nothing
    files: Callable[[R], dict[str, str | bytes]] = _no_files

    def text(self, found: R) -> str:
        """One line, in the brackets of Python's objects."""
        return drawn(f"<{type(found).__name__} {self.line(found)}>")

    def html(self, found: R) -> str:
        """The lead, the table and what has to be said; whatever a user named is escaped."""
        parts = [f"<p>{_text(self.lead(found))}</p>"]
        if table := self.table(found):
            parts.append(_html_table(table))
        said = list(self.said(found))
        parts += [f"<p><small>{_text(one)}</small></p>" for one in said[:_SAID]]
        if len(said) > _SAID:
            parts.append(f"<p><small>… and {len(said) - _SAID} more</small></p>")
        return f'<div class="focgen">{"".join(parts)}</div>'

    def figure(self, found: R, which: int) -> Any:
        """Figure number ``which``, as matplotlib's. Raises InputError where there is no such one."""
        figures = self.figures(found)
        kind = type(found).__name__
        if not figures:
            raise InputError(kind, "has no figure", "look at its numbers: to_frame()")
        if isinstance(which, bool) or not isinstance(which, int) or not 0 <= which < len(figures):
            there = ", ".join(f"{i} ({figure.title})" for i, figure in enumerate(figures))
            raise InputError(f"{kind}.plot", f"has no figure {which!r}", f"choose one of {there}")
        return still(figures[which])

    def frame(self, found: R) -> Any:
        """The rows as a pandas data frame. Raises MissingExtra where pandas is not installed."""
        try:
            import pandas
        except ImportError:
            raise MissingExtra.of("pandas", "frames", "a data frame") from None
        return pandas.DataFrame(list(self.rows(found)))


def _text(text: str) -> str:
    return escape(drawn(text))


def _html_table(table: TableOf) -> str:
    """At most so many rows, and how many more there are."""
    head = "".join(f"<th>{_text(cell)}</th>" for cell in table.heads)
    rows = ["".join(f"<td>{_text(cell)}</td>" for cell in row) for row in table.rows[:_MOST]]
    body = "".join(f"<tr>{row}</tr>" for row in rows)
    left = len(table.rows) - _MOST
    more = f"<p><small>… and {left} more rows in to_frame()</small></p>" if left > 0 else ""
    caption = f"<caption>{_text(table.caption)}</caption>" if table.caption else ""
    return f"<table>{caption}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{more}"
