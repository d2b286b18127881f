"""Logs in text: .csv, .txt, .tsv, packed or not, in the dialects that instruments write.

Columns are separated by commas, semicolons, tabs, bars or blanks; decimals have a point or a comma; a row of
units may follow the header, comments and settings may come before it; the text is UTF-8, UTF-16 with a mark,
or Windows-1252.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from pathlib import Path

from focgen.errors import LogError
from focgen.logs.dialect import Dialect, is_number, rows_of, sniffed
from focgen.logs.table import LogTable
from focgen.textfile import read_log_bytes

_MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))
MOST_COLUMNS = 4096
_IN_BRACKETS = re.compile(r"(.+?)\s*[\[(]([^\[\]()]*)[\])]")


def read(path: Path) -> LogTable:
    """Read a file. Raises LogError naming the line, OSError where it cannot be opened."""
    text, encoding = decoded(read_log_bytes(path), path)
    return table_of(path, text, encoding)


def table_of(path: Path, text: str, encoding: str = "") -> LogTable:
    """A text as a table; ``encoding`` is said where it was guessed. Raises LogError naming the line."""
    try:
        dialect = sniffed(text)
        rows = rows_of(text, dialect.delimiter)
    except csv.Error as reason:
        raise LogError(str(path), f"is not CSV ({reason})", "save it as comma-separated text") from None
    if not any(rows):
        raise LogError(str(path), "is empty", "give a log with a header and one row a sample")
    header = _header(path, rows, dialect)
    numbers = _body(path, rows, dialect, len(header))
    columns = {name: [rows[i][j] for i in numbers] for j, name in enumerate(header)}
    units, aliases = _without_units(header, _units(rows, dialect, header))
    return LogTable(
        str(path),
        columns,
        lambda row: f"line {numbers[row] + 1}",
        decimal=dialect.decimal,
        units=units,
        aliases=aliases,
        notes=_taken(rows, dialect, encoding),
    )


def _taken(rows: list[list[str]], dialect: Dialect, encoding: str) -> tuple[str, ...]:
    """What the file was taken for, where it is not plain CSV."""
    words = [dialect.in_words(), f"text taken for {encoding}" if encoding else ""]
    if dialect.header is not None and any(rows[: dialect.header]):
        words.append(f"header in line {dialect.header + 1}")
    if dialect.units is not None:
        words.append(f"units in line {dialect.units + 1}")
    note = ", ".join(filter(None, words))
    return (f"read with {note}",) if note else ()


def decoded(raw: bytes, path: Path) -> tuple[str, str]:
    """The text, and the encoding where it is none that says so itself. Raises LogError for binary files."""
    marked = next((name for mark, name in _MARKS if raw.startswith(mark)), None)
    try:
        if marked or b"\0" not in raw:
            return raw.decode(marked or "utf-8"), ""
    except UnicodeDecodeError:
        if not marked:
            return raw.decode("cp1252", errors="replace"), "Windows-1252"
    raise LogError(str(path), "is not text", "save it as UTF-8") from None


def _header(path: Path, rows: list[list[str]], dialect: Dialect) -> list[str]:
    """The names of the columns. Raises LogError where there are none, or one twice."""
    if dialect.header is None or all(is_number(name, dialect.decimal) for name in rows[dialect.header]):
        raise LogError(
            str(path), "starts with numbers instead of a header", "put the columns' names in line 1"
        )
    names = list(rows[dialect.header])
    if len(names) > MOST_COLUMNS:
        what = f"has {len(names)} columns, of which {MOST_COLUMNS} can be read"
        raise LogError(str(path), what, "leave out those that the rig does not use")
    body = [row for row in rows[dialect.data :] if row]
    while names and not names[-1] and not any("".join(row[len(names) - 1 :]) for row in body):
        names.pop()  # a delimiter at the end of each line
    names = [name or f"column {number}" for number, name in enumerate(names, start=1)]
    doubled = next((name for name, count in Counter(names).items() if count > 1), None)
    if doubled is not None:
        raise LogError(str(path), f"has the column {doubled!r} twice", "give each column a name of its own")
    return names


def _body(path: Path, rows: list[list[str]], dialect: Dialect, width: int) -> list[int]:
    """The rows of readings; a header that is repeated is none. Raises LogError where one is incomplete."""
    ahead = [rows[i] for i in (dialect.header, dialect.units) if i is not None]
    found = [i for i in range(dialect.data, len(rows)) if rows[i] and rows[i] not in ahead]
    for i in found:
        cells = len(rows[i])
        if cells != width and not (cells > width and not any(rows[i][width:])):
            what = f"line {i + 1} has {cells} cells, the header {width}"
            raise LogError(
                str(path),
                what,
                "separate columns alike throughout, decimals unlike columns, and complete the line",
            )
    return found


def _units(rows: list[list[str]], dialect: Dialect, header: list[str]) -> dict[str, str]:
    if dialect.units is None:
        return {}
    cells = (cell.strip("[]() ") for cell in rows[dialect.units])
    return {name: unit for name, unit in zip(header, cells) if name and unit and unit != "-"}


def _without_units(names: list[str], units: dict[str, str]) -> tuple[dict[str, str], dict[str, str]]:
    """Units by column, those in names like "p (kPa)" among them; and such columns by their bare names."""
    split = {name: match for name in names if (match := _IN_BRACKETS.fullmatch(name))}
    units = {name: match[2].strip() for name, match in split.items() if match[2].strip()} | units
    bare, given = Counter(match[1] for match in split.values()), set(names)
    aliases = {m[1]: name for name, m in split.items() if bare[m[1]] == 1 and m[1] not in given}
    return units, aliases
