"""Logs in .mat (version 5 to 7.3): vectors, the columns of matrices, and the fields of structures.

A structure's fields go by their own names, by "structure.field", and by the whole way; those of a
structure array by "structure(1).field"; a matrix x of k columns gives x_1 … x_k. A structure that Simulink
wrote ("with time") goes by the labels of its signals. A cell array of texts or numbers, one a sample, is a
column.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from focgen.arrays import Array
from focgen.errors import LogError, MissingExtra
from focgen.logs.cells import EXACT
from focgen.logs.table import Column, LogTable

_REMEDY = "save one vector a column"
_ALONE = "save the signals of one experiment alone, as in save('log.mat', 't', 'u', 'y')"
_WIDEST = 64  # columns: a wider matrix is no log
_Found = tuple[str, str, Column | str]  # the way to its owner, its name, and it, or why it is no column


def read(path: Path) -> LogTable:
    """Read a file. Raises LogError where it is damaged or holds no vectors, MissingExtra for version 7.3
    without h5py."""
    path.open("rb").close()  # loadmat would try other names
    try:
        content = loadmat(path, squeeze_me=True, struct_as_record=False)
    except NotImplementedError:
        content = _version_73(path)
    except (ValueError, TypeError, MatReadError, EOFError, KeyError, IndexError):
        raise LogError(str(path), "is not a whole MAT file", _REMEDY) from None
    named = {name: value for name, value in content.items() if not name.startswith(("__", "#"))}
    found, skipped = _parted(list(_vectors(named)))
    columns, aliases = _by_name(found, path)
    lengths = {len(column) for column in columns.values()}
    if not columns:
        raise _no_columns(path, skipped)
    if len(lengths) > 1:
        sizes = ", ".join(f"{name} {len(column)}" for name, column in columns.items())
        raise LogError(str(path), f"holds vectors of different lengths ({sizes})", _ALONE)
    return LogTable(str(path), columns, aliases=aliases, skipped=skipped)


def _no_columns(path: Path, skipped: Mapping[str, str]) -> LogError:
    """The error for a file without vectors; what it holds instead is named."""
    if not skipped:
        return LogError(str(path), "holds no vectors", _REMEDY)
    first, why = next(iter(skipped.items()))
    return LogError(str(path), f"holds no vectors: {first!r} {why}".replace(";", ","), _REMEDY)


def _version_73(path: Path) -> dict[str, Any]:
    """The content of an HDF5 file as nested dictionaries of arrays, as MATLAB has them."""
    try:
        import h5py
    except ImportError:
        raise MissingExtra.of("h5py", "mat", str(path)) from None
    try:
        with h5py.File(path, "r") as file:
            return _of_group(file, path)
    except OSError:
        raise LogError(str(path), "is not a whole MAT file", _REMEDY) from None


def _of_group(group: Any, path: Path) -> dict[str, Any]:
    """The parts of a group by name. Raises LogError for one that lies in another file: HDF5 can name any."""
    found = {}
    for name in group:
        elsewhere = hasattr(group.get(name, getlink=True), "filename")
        item = None if elsewhere else group.get(name)
        if elsewhere:
            raise _elsewhere(path, name)
        found[name] = _of_hdf5(item, path)
    return found


def _elsewhere(path: Path, name: str) -> LogError:
    return LogError(f"{path} [{name}]", "lies in another file", "save all of it in one")


def _lies_elsewhere(item: Any, path: Path) -> bool:
    stored = getattr(item, "external", None) or getattr(item, "is_virtual", False)
    return bool(stored) or Path(item.file.filename) != path


def _of_hdf5(item: Any, path: Path) -> Any:
    """A group as a dictionary; an array, whose axes HDF5 has in reverse, as MATLAB has it; cells, which are
    named elsewhere in the file, as an array of objects; else None."""
    if item is not None and _lies_elsewhere(item, path):
        raise _elsewhere(path, item.name)
    if item is None or not hasattr(item, "dtype"):
        return _of_group(item, path) if hasattr(item, "items") else None
    if item.dtype.metadata and "ref" in item.dtype.metadata:
        cells = np.empty(item.size, object)
        cells[:] = [_of_hdf5(item.file[to] if to else None, path) for to in item[()].T.flat]
        return cells
    values = item[()] if item.dtype.kind in "fiubV" else None
    if values is None or item.attrs.get("MATLAB_empty", 0):
        return None
    text = item.attrs.get("MATLAB_class", b"") == b"char"
    return "".join(map(chr, np.ravel(values))) if text else np.squeeze(np.asarray(values).T)


def _vectors(content: dict[str, Any], way: str = "") -> Iterator[_Found]:
    """Yield (way to its owner, name, column) of all inside; scalars (settings, counters) are left out."""
    label = content.get("label")
    for name, value in content.items():
        own = label if name == "values" and isinstance(label, str) and label else name
        yield from _within(value, way, own)


def _within(value: Any, way: str, name: str) -> Iterator[_Found]:
    """The same of one value: a structure, an array of structures or of cells, or an array of numbers."""
    if hasattr(value, "_fieldnames") or isinstance(value, dict):
        yield from _vectors(_fields(value), f"{way}.{name}" if way else name)
    elif isinstance(value, np.ndarray) and value.dtype == object:
        cells = _cells(value)
        if cells is not None:
            yield way, name, cells
            return
        for k, part in enumerate(value.ravel()):
            yield from _within(part, way, f"{name}({k + 1})")
    elif isinstance(value, np.ndarray):
        yield from ((way, name + mark, column) for mark, column in _columns(value))


def _fields(structure: Any) -> dict[str, Any]:
    if isinstance(structure, dict):
        return structure
    return {field: getattr(structure, field) for field in structure._fieldnames}


def _cells(value: Array) -> list[str] | None:
    """A cell array of texts or numbers as a column (m,), "" for an empty cell; None of anything else."""
    parts = [np.asarray(part) for part in value.ravel()]
    if len(parts) < 2 or any(part.size > 1 or part.dtype.kind not in "fiubUO" for part in parts):
        return None
    cells = [part.item() if part.size else None for part in parts]
    if not all(cell is None or isinstance(cell, str | float | int) for cell in cells):
        return None
    return ["" if cell is None or cell != cell else _text(cell) for cell in cells]


def _text(cell: str | float) -> str:
    """A text as it is; a number as the columns of numbers have it in text, whatever its type. Whole ones that
    no float has keep all their digits."""
    if isinstance(cell, int) and abs(cell) > EXACT:
        return str(cell)
    return cell if isinstance(cell, str) else repr(float(cell)).removesuffix(".0")


def _columns(value: Array) -> Iterator[tuple[str, Array | str]]:
    """Yield (mark of its name, column (m,)) of a vector or a matrix, or why it is no column."""
    if value.size < 2 and value.dtype.names is None:
        return
    if value.dtype.kind not in "fiubU":
        yield "", "is complex" if value.dtype.kind == "c" else "is complex, or an object of MATLAB"
        return
    value = value.astype(float) if value.dtype.kind == "b" else value
    if value.ndim == 1:
        yield "", value
    elif value.ndim == 2 and value.dtype.kind != "U" and value.shape[1] <= _WIDEST:
        yield from ((f"_{k + 1}", value[:, k]) for k in range(value.shape[1]))
    else:
        yield "", f"is an array of {' by '.join(map(str, value.shape))}"


def _parted(found: list[_Found]) -> tuple[list[tuple[str, str, Column]], dict[str, str]]:
    """What is a column, and of what is none why, by all its names. Cells are one where they have as many as
    the vectors: names of channels are often kept beside them."""
    counts = {len(value) for _, _, value in found if isinstance(value, np.ndarray)}
    columns: list[tuple[str, str, Column]] = []
    skipped: dict[str, str] = {}
    for way, name, value in found:
        if isinstance(value, np.ndarray) or (isinstance(value, list) and {len(value)} == counts):
            columns.append((way, name, value))
        else:
            beside = "unlike the vectors" if counts else "which are a column beside vectors only"
            why = value if isinstance(value, str) else f"has {len(value)} cells, {beside}"
            skipped |= dict.fromkeys(_names(way, name), why)
    return columns, skipped


def _by_name(found: list[tuple[str, str, Column]], path: Path) -> tuple[dict[str, Column], dict[str, str]]:
    """Columns by the shortest of their names that no other has, and the longer ones as aliases.

    Raises LogError where two have one name in full: neither could be asked for.
    """
    named = [(_names(way, name), column) for way, name, column in found]
    times = Counter(name for names, _ in named for name in names)
    columns: dict[str, Column] = {}
    aliases: dict[str, str] = {}
    for names, column in named:
        free = [name for name in names if times[name] == 1]
        if not free:
            what = f"holds two columns called {names[-1]!r}"
            raise LogError(str(path), what, "rename one; a matrix x has the columns x_1, x_2 …")
        columns[free[0]] = column
        aliases |= dict.fromkeys(free[1:], free[0])
    return columns, aliases


def _names(way: str, name: str) -> list[str]:
    """Its own name, "structure.field", and the whole way, each once."""
    whole = f"{way}.{name}" if way else name
    owner = way.rpartition(".")[2]
    return list(dict.fromkeys([name, f"{owner}.{name}" if owner else name, whole]))
