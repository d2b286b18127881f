"""Logs in text: .csv, .txt, .tsv, packed or not, in the dialects that instruments write.

Columns are separated by commas, semicolons, tabs, bars or blanks; decimals have a point or a comma; a row of
units may follow the header, comments and settings may come before it; the text is UTF-8, UTF-16 with a mark,
or Windows-1252.
"""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from pathlib import Path

from focgen.errors import LogError
from focgen.logs.cells import Gathered, Lines, marks_of
from focgen.logs.dialect import SAMPLE, Comments, Dialect, is_bare, is_number, lines_of, rows_of, sniffed
from focgen.logs.table import LogTable
from focgen.textfile import log_parts, open_log

_MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))
MOST_COLUMNS = 4096
_LONGEST_LINE = 1 << 18  # characters: of 4096 columns, 64 each
_MOST_LINES = 1 << 25
_BARE, _BARE_A_ROW = 1_000_000, 4  # lines without a reading: so many, and so many for each line with one
_AT_ONCE = 1 << 14  # characters whose lines are counted: the few that are cut do not count
_LOOKED_AT = 1 << 22  # characters
_IN_BRACKETS = re.compile(r"(.+?)\s*[\[(]([^\[\]()]*)[\])]")


def read(path: Path) -> LogTable:
    """Read a file, in parts: it takes the memory of its numbers. Raises LogError naming the line, OSError
    where it cannot be opened."""
    codec, guessed = _encoding(path)

    def lines() -> Iterator[str]:
        with open_log(path) as file, io.TextIOWrapper(file, codec, errors="replace", newline="") as text:
            yield from text

    return table_of(path, lines, guessed)


def table_of(path: Path, lines: Callable[[], Iterator[str]], guessed: str = "") -> LogTable:
    """A text as a table; ``lines`` gives its lines anew whenever it is asked, ``guessed`` is the encoding
    where the text does not say so itself. Raises LogError naming the line."""
    try:
        sample = "".join(_first(lines()))
        dialect = sniffed(sample)
        if not any(rows_of(lines_of(sample), dialect.delimiter, whole=False)):
            raise _without_rows(path, sample)
        comments = Comments(dialect.delimiter)
        rows = rows_of(lines(), dialect.delimiter, comments)
        ahead = list(islice(rows, dialect.data))
        header = _header(path, ahead, dialect)
        comments.width = len(header)
        numbers, gathered, header = _body(path, rows, ahead, dialect, header)
    except csv.Error as reason:
        raise LogError(str(path), f"is not CSV ({reason})", "save it as comma-separated text") from None
    cells = gathered.columns()
    seen = dict(zip(header, gathered.pointed))
    grouped, unsure = marks_of(seen, told=dialect.delimiter == ",")
    units, aliases = _without_units(header, _units(ahead, dialect, header))
    return LogTable(
        str(path),
        dict(zip(header, cells)),
        numbers.of,
        decimal=dialect.decimal,
        units=units,
        aliases=aliases,
        notes=(*_taken(ahead, dialect, guessed), *_left_out(comments)),
        grouped=grouped,
        unsure=unsure,
    )


def _without_rows(path: Path, sample: str) -> LogError:
    if sample.strip():
        what = "has nothing but lines that begin with #, % or //, which are comments"
        return LogError(str(path), what, 'write the first cell of a row in quotes, as in "#1"')
    return LogError(str(path), "is empty", "give a log with a header and one row a sample")


def _left_out(comments: Comments) -> tuple[str, ...]:
    """Rows that are switched off, or whose first cell only looks like a comment: both begin alike."""
    if not comments.count:
        return ()
    lines = f"{comments.count} line{'s' * (comments.count > 1)} as wide as the rows"
    what = (
        f"{lines}, the first being line {comments.first}, begin with #, % or // and were left out as comments"
    )
    return (f'{what}; write the first cell in quotes, as in "#1", where they are rows',)


def _first(lines: Iterable[str]) -> Iterator[str]:
    """Yield the first lines, as far as the dialect is looked for in them."""
    size = 0
    for line in islice(lines, SAMPLE):
        yield line
        size += len(line)
        if size > _LOOKED_AT:
            return


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
    codec, guessed = _encoding_of([raw], path)
    return raw.decode(codec, errors="replace"), guessed


def _encoding(path: Path) -> tuple[str, str]:
    return _encoding_of(log_parts(path), path)


def _encoding_of(parts: Iterable[bytes], path: Path) -> tuple[str, str]:
    """The codec of a text, and its name where it was guessed. Raises LogError for binary files."""
    codec, lines = "", _Counted(path)
    decoder: codecs.IncrementalDecoder = codecs.getincrementaldecoder("utf-8")()
    for part in parts:
        if not codec:
            codec = next((name for mark, name in _MARKS if part.startswith(mark)), "utf-8")
            decoder = codecs.getincrementaldecoder(codec)()
        text = _decoded_part(decoder, part, False)
        if text is None and codec == "utf-8":
            codec, decoder = "cp1252", codecs.getincrementaldecoder("cp1252")(errors="replace")
            text = decoder.decode(part)
        if text is None or "\0" in text:
            raise LogError(str(path), "is not text", "save it as UTF-8")
        _check_lines(text, path)
        lines.see(text)
    if _decoded_part(decoder, b"", True) is None:  # ends within a character
        if codec != "utf-8":
            raise LogError(str(path), "is not text", "save it as UTF-8")
        codec = "cp1252"
    return codec or "utf-8", "Windows-1252" if codec == "cp1252" else ""


class _Counted:
    """Lines so far, and those of them that are bare: empty, comments, or nothing but marks between columns.
    Packed they take next to no room."""

    def __init__(self, path: Path) -> None:
        self.path, self.lines, self.bare = path, 0, 0

    def see(self, text: str) -> None:
        """A part has been read. Raises LogError for more lines, or bare ones, than a log has."""
        for at in range(0, len(text), _AT_ONCE):
            found = text[at : at + _AT_ONCE].splitlines()
            self.lines += len(found)
            self.bare += sum(is_bare(line) for line in found if not line[:1].isdigit())
        if self.bare > _BARE + _BARE_A_ROW * (self.lines - self.bare):
            what = f"has {self.bare} lines without a reading among its first {self.lines}"
            raise LogError(str(self.path), what, "leave out empty lines and comments")
        if self.lines > _MOST_LINES:
            what = f"has more than {_MOST_LINES} lines"
            raise LogError(str(self.path), what, "split it into smaller files")


def _check_lines(text: str, path: Path) -> None:
    """Raise LogError for a line that no log has: taken apart it would take all memory and time."""
    for at in range(0, len(text) - _LONGEST_LINE + 1, _LONGEST_LINE):
        part = text[at : at + _LONGEST_LINE]
        if "\n" not in part and "\r" not in part:
            what = f"has a line of more than {_LONGEST_LINE >> 10} KiB"
            raise LogError(str(path), what, "give one row a sample, in a line of its own")


def _decoded_part(decoder: codecs.IncrementalDecoder, part: bytes, final: bool) -> str | None:
    try:
        return decoder.decode(part, final)
    except UnicodeDecodeError:
        return None


def _header(path: Path, rows: list[list[str]], dialect: Dialect) -> list[str]:
    """The cells that name the columns, "" where one does not. Raises LogError where there are none."""
    if dialect.header is None or all(is_number(name, dialect.decimal) for name in rows[dialect.header]):
        raise LogError(
            str(path),
            "starts with numbers instead of a header",
            "put the columns' names in line 1, without # or % ahead",
        )
    names = list(rows[dialect.header])
    if len(names) > MOST_COLUMNS:
        what = f"has {len(names)} columns, of which {MOST_COLUMNS} can be read"
        raise LogError(str(path), what, "leave out those that the rig does not use")
    return names


def _body(
    path: Path, rows: Iterable[list[str]], ahead: list[list[str]], dialect: Dialect, names: list[str]
) -> tuple[Lines, Gathered, list[str]]:
    """The lines of the readings, their columns, and the names of those to keep; a repeated header is none.

    Columns at the end without a name and a reading are delimiters at the end of lines. Raises LogError where
    a row is incomplete, or two columns have one name.
    """
    told = [ahead[i] for i in (dialect.header, dialect.units) if i is not None]
    width = len(names)
    named = max((i for i, name in enumerate(names, start=1) if name), default=0)
    gathered, lines, short, filled = Gathered(width, dialect.decimal), Lines(), None, False
    counted = named == width
    for i, row in enumerate(rows, start=dialect.data):
        if not row or row in told:
            continue
        cells = len(row)
        if cells != width:
            if cells < named or any(row[width:]):
                raise _incomplete(path, i, cells, width)
            short = i if cells < width and short is None else short
            row = (row + [""] * width)[:width]
        counted = counted and cells == width + 1 and row[0] in (str(len(lines)), str(len(lines) + 1))
        filled = filled or (named < width and any(row[named:]))
        gathered.add(row)
        lines.add(i)
    if filled and short is not None:
        raise _incomplete(path, short, named, width)
    if counted and len(lines):
        what = "counts its rows in a first cell that may have no name: each has a cell more than the header"
        raise LogError(str(path), what, "name every column, or end the header as the rows end")
    kept = width if filled else named
    found = [name or f"column {number}" for number, name in enumerate(names[:kept], start=1)]
    doubled = next((name for name, count in Counter(found).items() if count > 1), None)
    if doubled is not None:
        raise LogError(str(path), f"has the column {doubled!r} twice", "give each column a name of its own")
    return lines, gathered, found


def _incomplete(path: Path, row: int, cells: int, width: int) -> LogError:
    remedy = "separate columns alike throughout, decimals unlike columns, and complete the line"
    return LogError(str(path), f"line {row + 1} has {cells} cells, the header {width}", remedy)


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
