"""How a file of text writes its table: what separates columns, decimals, and where header and data are."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from focgen.logs.units import unit_named, unit_of

SAMPLE = 1000
"""Lines that the dialect is read off."""
_TAIL = 60  # of them, the last ones: surely data, behind whatever an instrument writes ahead
_LINE = 2000  # characters of a line that the library looks at: it takes long over many
_DELIMITERS = (",", ";", "\t", "|", " ")
_NAMES = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars", " ": "blanks"}
_COMMENTS = ("#", "%", "//")
_BETWEEN = "".join(_DELIMITERS) + "\r\n\v\f"
_COMMA_DECIMAL = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_POINT_DECIMAL = re.compile(r"[+-]?\d*\.\d+([eE][+-]?\d+)?")
_GROUPED = {mark: re.compile(rf"[+-]?[1-9]\d{{0,2}}(\{mark}\d{{3}})+") for mark in ",."}
_BRACKETED = re.compile(r"[\[(].*[\])]")
_UNIT = re.compile(
    r"[a-zA-Zµμ°Ω%Å]{1,4}([/*·^]?[-+0-9a-zA-Zµμ°²³⁻¹]{0,4}){0,3}|1/[a-zA-Zµμ°]{1,4}|-|\d/[a-z]+"
)
MISSING = frozenset(("", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--"))


@dataclass(frozen=True)
class Dialect:
    """``delimiter`` between columns, " " for any run of blanks; ``decimal`` the decimal mark; ``header`` and
    ``units`` the rows of names and of units, ``data`` the first row of readings, counted from 0. ``units`` is
    None where there is no such row, ``header`` where the file has no names."""

    delimiter: str
    decimal: str
    header: int | None
    units: int | None
    data: int

    def in_words(self) -> str:
        """What is not as in plain CSV; empty where all is."""
        said = []
        if self.delimiter != ",":
            said.append(f"columns separated by {_NAMES[self.delimiter]}")
        if self.decimal != ".":
            said.append("decimal commas")
        return ", ".join(said)


@dataclass
class Comments:
    """Comments that could be rows: ``count`` of them have ``width`` cells, the first in line ``first``,
    counted from 1. Nothing is counted before ``width`` is set, as the header is known.
    """

    delimiter: str
    width: int = 0
    count: int = 0
    first: int = 0

    def see(self, number: int, line: str) -> None:
        """A comment has been passed over."""
        if self.width < 2 or len(line.split(None if self.delimiter == " " else self.delimiter)) != self.width:
            return
        self.count += 1
        self.first = self.first or number


def rows_of(
    lines: Iterable[str], delimiter: str, comments: Comments | None = None, whole: bool = True
) -> Iterator[list[str]]:
    """Yield the cells of every line, without blanks around them; none for an empty line or a comment.

    Raises csv.Error where a quoted cell of several lines does not end as one: a lone quote makes what follows
    a part of its cell. A text that is not ``whole`` may end within a cell.
    """
    plain = _Plain(lines, comments or Comments(delimiter))
    if delimiter == " ":
        for line in plain:
            plain.row.clear()
            yield _unquoted(line) if '"' in line else line.split()
        return
    spaced = delimiter != "\t"
    for row in csv.reader(plain, delimiter=delimiter, skipinitialspace=spaced):
        if whole and len(plain.row) > 1:
            list(csv.reader(plain.row, delimiter=delimiter, skipinitialspace=spaced, strict=True))
            _check_cell(plain.row[1:], delimiter, len(row))
        plain.row.clear()
        cells = [cell.strip() for cell in row]
        yield cells if any(cells) else []


def _check_cell(lines: Sequence[str], delimiter: str, width: int) -> None:
    """Raise csv.Error where the further lines of a quoted cell look like rows: two lone quotes, as marks of
    "the same as above", take what stands between them for a cell."""
    for line in lines:
        first, *others = line.split(delimiter)
        if others and len(others) + 1 >= width and is_number(first.strip()):
            raise csv.Error("a quoted cell holds a whole row")


def _unquoted(line: str) -> list[str]:
    """The cells of a line between blanks, some of them in quotes."""
    spaced = " ".join(line.split())
    return next(csv.reader([spaced], delimiter=" ", skipinitialspace=True), [])


class _Plain:
    """Lines, empty ones in the place of comments. ``row``: those of the row that is being read; one that goes
    on with a quoted cell is no comment, whatever it begins with."""

    def __init__(self, lines: Iterable[str], comments: Comments) -> None:
        self._lines, self._comments = enumerate(lines, start=1), comments
        self.row: list[str] = []

    def __iter__(self) -> Iterator[str]:
        for number, line in self._lines:
            if not self.row and _is_comment(line):
                self._comments.see(number, line)
                line = "\n"
            self.row.append(line)
            yield line


def lines_of(text: str) -> Iterator[str]:
    """The lines of a text, with their ends, however those are written."""
    return iter(io.StringIO(text, newline=""))


def _rows(text: str, delimiter: str) -> list[list[str]]:
    return list(rows_of(lines_of(text), delimiter, whole=False))


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(_COMMENTS) or (line[:4].lower() == "sep=" and len(line.strip()) <= 5)


def is_bare(line: str) -> bool:
    """Whether a line holds no reading: it is empty, a comment, or nothing but marks between columns.

    >>> is_bare(" ; ;"), is_bare("# a word"), is_bare("0;;")
    (True, True, False)
    """
    rest = line.strip(_BETWEEN)
    return not rest or rest.startswith(_COMMENTS)


def sniffed(sample: str) -> Dialect:
    """The dialect of a file that begins with ``sample``. Raises csv.Error where quotes do not close."""
    delimiter = _delimiter(sample)
    rows = _rows(sample, delimiter)
    decimal = _decimal(rows, delimiter)
    return Dialect(delimiter, decimal, *_places(rows, decimal))


def _delimiter(sample: str) -> str:
    """Plain CSV is recognised without ado, for it is what most logs are; the rest is put to a library."""
    lines = [line for line in sample.splitlines() if line.strip() and not _is_comment(line)]
    tail = "\n".join(lines[-min(_TAIL, max(1, len(lines) - 1)) :])
    rows = [row for row in _rows(tail, ",") if row]
    if len({len(row) for row in rows}) == 1 and len(rows[0]) > 1 and _all_plain(rows):
        return ","
    found = _detected(tail)
    likely = [found, *_DELIMITERS] if found in _DELIMITERS else list(_DELIMITERS)
    if _is_between_tabs(tail):
        likely = [delimiter for delimiter in likely if delimiter != " "]
    return max(likely, key=lambda delimiter: _readable(tail, delimiter))  # the first of the best


def _is_between_tabs(text: str) -> bool:
    """Whether tabs separate the columns for sure, so that a blank stands within a date or a name: any run of
    white space would be a blank otherwise, and count the two parts of a date as two readings."""
    rows = [row for row in _rows(text, "\t") if row]
    whole = len({len(row) for row in rows}) == 1 and len(rows[0]) > 1
    return whole and not any(_are_numbers(cell) for row in rows for cell in row)


def _detected(text: str) -> str | None:
    """What the library takes for the delimiter; None where it finds none, for whatever reason of its own."""
    import clevercsv  # G. J. J. van den Burg et al., Data Min. Knowl. Disc. 33, 2019

    short = "\n".join(line[:_LINE] for line in text.split("\n"))
    try:
        return getattr(clevercsv.Detector().detect(short, delimiters=list(_DELIMITERS)), "delimiter", None)
    except Exception:  # noqa: BLE001 - it raises whatever its parsers meet
        return None


def _readable(text: str, delimiter: str) -> int:
    """How many tenths of the cells are numbers, dates or empty; 0 where rows differ in length or have one.

    The library knows text better than numbers: "0,0 1,5" looks to it like three columns.
    """
    rows = [row for row in _rows(text, delimiter) if row]
    cells = [cell for row in rows for cell in row]
    if not cells or len(rows[0]) < 2 or len({len(row) for row in rows}) > 1:
        return 0
    decimal = "." if delimiter == "," and '"' not in text else ","
    good = sum(is_number(cell, decimal) or is_stamp(cell) or cell.lower() in MISSING for cell in cells)
    return 10 * good // len(cells)


def _all_plain(rows: Sequence[Sequence[str]]) -> bool:
    cells = [cell for row in rows for cell in row]
    return sum(is_number(cell, ".") for cell in cells) >= 0.5 * len(cells) and not any(
        any(mark in cell for mark in ";\t|") or _are_numbers(cell) for cell in cells
    )


def _are_numbers(cell: str) -> bool:
    """Whether it holds several, with blanks between: "00 0" of "0,00 0,5"."""
    parts = cell.split() if " " in cell else ()
    return len(parts) > 1 and all(is_number(part) for part in parts)


def _decimal(rows: Sequence[Sequence[str]], delimiter: str) -> str:
    """A comma where cells have one inside a number, and none has a point there. One that may stand between
    thousands does not count; where all do, numbers with a comma are left to be refused."""
    if any(
        _POINT_DECIMAL.fullmatch(cell) and not grouped(cell, ".") for row in rows[-_TAIL:] for cell in row
    ):
        return "."
    commas = (cell for row in rows for cell in row if _COMMA_DECIMAL.fullmatch(cell))
    return "," if any(not grouped(cell, ",") for cell in commas) else "."


def grouped(cell: str, mark: str) -> bool:
    """Whether a number might have ``mark`` between its thousands: "1,600" might, "0,600" and "1,60" not.

    >>> grouped("1,600", ","), grouped("-12.000.000", "."), grouped("0,600", ","), grouped("1,60", ",")
    (True, True, False, False)
    """
    return _GROUPED[mark].fullmatch(cell) is not None


def _places(rows: Sequence[Sequence[str]], decimal: str) -> tuple[int | None, int | None, int]:
    """The rows of header, units, and the first of data.

    The header is the last row of words ahead of the first row of readings, or the one before that where the
    last holds units. What an instrument writes ahead of it (its settings, a title) is passed over.
    """
    filled = [i for i, row in enumerate(rows) if row]
    width = _width([rows[i] for i in filled])
    numeric = _numeric_columns([rows[i] for i in filled], width, decimal)
    full = [i for i in filled if len(rows[i]) == width and _is_data(rows[i], numeric, decimal)]
    if not full:
        return (filled[0] if filled else None), None, (filled[0] + 1 if filled else 0)
    words = [
        i
        for i in filled
        if i < full[0] and _same(rows[i], width) and not _any_number(rows[i], numeric, decimal)
    ]
    if not words:
        return None, None, full[0]
    last = words[-1]
    before = words[-2] if len(words) > 1 and filled.index(last) == filled.index(words[-2]) + 1 else None
    if before is not None and _are_units(rows[last]):
        return before, last, last + 1
    return last, None, last + 1


def _width(rows: Sequence[Sequence[str]]) -> int:
    """How many cells most of the last rows have."""
    counts = [len(row) for row in rows[-_TAIL:]]
    return max(set(counts), key=counts.count, default=0)


def _same(row: Sequence[str], width: int) -> bool:
    """Whether a row of names fits rows of readings: some instruments end one of them with a delimiter."""
    return len(row) == width or (
        abs(len(row) - width) == 1 and bool(row) and (not row[-1] or len(row) < width)
    )


def _numeric_columns(rows: Sequence[Sequence[str]], width: int, decimal: str) -> list[int]:
    tail = [row for row in rows[-_TAIL:] if len(row) == width]
    return [
        j
        for j in range(width)
        if 2 * sum(is_number(row[j], decimal) or is_stamp(row[j]) for row in tail) > len(tail)
    ]


def _is_data(row: Sequence[str], numeric: Sequence[int], decimal: str) -> bool:
    readings = [row[j] for j in numeric]
    known = [is_number(cell, decimal) or is_stamp(cell) for cell in readings]
    return any(known) and all(k or cell.lower() in MISSING for k, cell in zip(known, readings))


def _any_number(row: Sequence[str], numeric: Sequence[int], decimal: str) -> bool:
    return any(is_number(row[j], decimal) or is_stamp(row[j]) for j in numeric if j < len(row))


def _are_units(row: Sequence[str]) -> bool:
    """Whether a row behind another one of words may hold their units: one at least is a unit for sure."""
    cells = [cell for cell in row if cell]
    if not any(_BRACKETED.fullmatch(cell) or unit_of(cell) or unit_named(f"x_{cell}") for cell in cells):
        return False
    return all(_BRACKETED.fullmatch(cell) or _UNIT.fullmatch(cell) for cell in cells)


def is_number(cell: str, decimal: str = ".") -> bool:
    """Whether a cell is a finite number as this dialect writes it; "nan" is a reading that is missing."""
    try:
        value = float(cell.replace(",", ".") if decimal == "," else cell)
    except ValueError:
        return False
    return value == value and "_" not in cell


_DATE = re.compile(r"\d{4}-?\d{2}-?\d{2}([T ]\d{1,2}:?\d{2}.*)?")
_CLOCK = re.compile(r"\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?")


def is_stamp(cell: str) -> bool:
    """Whether a cell is an ISO 8601 date and time, or a time of day."""
    return bool(("-" in cell and _DATE.fullmatch(cell)) or _CLOCK.fullmatch(cell))
