"""Logs in .csv and .csv.gz: a header, commas between columns, points in decimals, UTF-8."""

from __future__ import annotations

import csv
import gzip
import io
import zlib
from pathlib import Path

from focgen.errors import LogError
from focgen.logs.table import LogTable


def read(path: Path) -> LogTable:
    """Read a file. Raises LogError naming the line, OSError where it cannot be opened."""
    text = _text(path)
    try:
        rows = [row for row in csv.reader(io.StringIO(text, newline=""), skipinitialspace=True)]
    except csv.Error as reason:
        raise LogError(str(path), f"is not CSV ({reason})", "save it as comma-separated text") from None
    numbers = [i for i, row in enumerate(rows, start=1) if any(cell.strip() for cell in row)]
    if not numbers:
        raise LogError(str(path), "is empty", "give a log with a header and one row a sample")
    header = _header(path, rows[numbers[0] - 1])
    body = [rows[i - 1] for i in numbers[1:]]
    for number, row in zip(numbers[1:], body):
        if len(row) != len(header):
            what = f"line {number} has {len(row)} cells, the header {len(header)}"
            raise LogError(
                str(path), what, "separate columns by ',', write decimals with '.', and complete the line"
            )
    columns = {name: [cell.strip() for cell in column] for name, column in zip(header, zip(*body))}
    return LogTable(str(path), columns, lambda row: f"line {numbers[1 + row]}")


def _text(path: Path) -> str:
    raw = path.read_bytes()
    if path.name.lower().endswith(".gz"):
        try:
            raw = gzip.decompress(raw)
        except (gzip.BadGzipFile, EOFError, zlib.error):
            raise LogError(str(path), "is not a whole gzip file", "pack it again") from None
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as reason:
        line = raw[: reason.start].count(b"\n") + 1
        raise LogError(str(path), f"is not UTF-8 text (line {line})", "save it as UTF-8") from None


def _header(path: Path, row: list[str]) -> list[str]:
    names = [name.strip() for name in row]
    for mark, word in ((";", "';'"), ("\t", "tabs")):
        if any(mark in name for name in names):
            raise LogError(
                str(path), f"separates its columns by {word}", "use ',' and write decimals with '.'"
            )
    if all(_looks_like_number(name) for name in names):
        raise LogError(
            str(path), "starts with numbers instead of a header", "put the columns' names in line 1"
        )
    doubled = next((name for name in names if names.count(name) > 1), None)
    if doubled is not None:
        raise LogError(str(path), f"has the column {doubled!r} twice", "give each column a name of its own")
    return names


def _looks_like_number(text: str) -> bool:
    try:
        float(text)
        return True
    except ValueError:
        return False
