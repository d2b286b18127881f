"""Logs in .mat (version 5 to 7.3): vectors, the columns of matrices, and the fields of structures.

A structure's fields go by their own names, and by "structure.field"; a matrix x of k columns gives x_1 … x_k.
A structure that Simulink wrote ("with time") goes by the labels of its signals.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from focgen.arrays import Array
from focgen.errors import LogError, MissingExtra
from focgen.logs.table import LogTable

_REMEDY = "save one vector a column"
_WIDEST = 64  # columns: a wider matrix is no log


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
    columns, aliases = _by_name(list(_vectors(named)))
    lengths = {len(column) for column in columns.values()}
    if not columns:
        raise LogError(str(path), "holds no vectors", _REMEDY)
    if len(lengths) > 1:
        sizes = ", ".join(f"{name} {len(column)}" for name, column in columns.items())
        raise LogError(
            str(path), f"holds vectors of different lengths ({sizes})", "save one experiment a file"
        )
    return LogTable(str(path), columns, aliases=aliases)


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
        if elsewhere or (item is not None and _lies_elsewhere(item, group)):
            raise LogError(f"{path} [{name}]", "lies in another file", "save all of it in one")
        found[name] = _of_hdf5(item, path)
    return found


def _lies_elsewhere(item: Any, group: Any) -> bool:
    stored = getattr(item, "external", None) or getattr(item, "is_virtual", False)
    return bool(stored) or item.file.filename != group.file.filename


def _of_hdf5(item: Any, path: Path) -> Any:
    """A group as a dictionary; an array, whose axes HDF5 has in reverse, as MATLAB has it; else None."""
    if item is None or not hasattr(item, "dtype"):
        return _of_group(item, path) if hasattr(item, "items") else None
    values = item[()] if item.dtype.kind in "fiub" else None
    if values is None or item.attrs.get("MATLAB_empty", 0):
        return None
    text = item.attrs.get("MATLAB_class", b"") == b"char"
    return "".join(map(chr, np.ravel(values))) if text else np.squeeze(np.asarray(values).T)


def _vectors(content: dict[str, Any], owner: str = "") -> Iterator[tuple[str, str, Array]]:
    """Yield (owner, name, column) of all that is inside; scalars (settings, counters) are left out."""
    label = content.get("label")
    for name, value in content.items():
        if hasattr(value, "_fieldnames"):
            value = {field: getattr(value, field) for field in value._fieldnames}
        if isinstance(value, dict):
            yield from _vectors(value, name)
        elif isinstance(value, np.ndarray) and value.dtype == object:
            for part in value.ravel():
                if hasattr(part, "_fieldnames"):
                    yield from _vectors({f: getattr(part, f) for f in part._fieldnames}, name)
        elif isinstance(value, np.ndarray):
            own = label if name == "values" and isinstance(label, str) and label else name
            yield from ((owner, own + mark, column) for mark, column in _columns(value))


def _columns(value: Array) -> Iterator[tuple[str, Array]]:
    """Yield (mark of its name, column (m,)) of a vector or a matrix."""
    if value.dtype.kind not in "fiubU" or value.size < 2:
        return
    value = value.astype(float) if value.dtype.kind == "b" else value
    if value.ndim == 1:
        yield "", value
    elif value.ndim == 2 and value.dtype.kind != "U" and value.shape[1] <= _WIDEST:
        yield from ((f"_{k + 1}", value[:, k]) for k in range(value.shape[1]))


def _by_name(found: list[tuple[str, str, Array]]) -> tuple[dict[str, Array], dict[str, str]]:
    """Columns by their own name where no other has it, else by "owner.name"; and the aliases."""
    names = [name for _, name, _ in found]
    columns: dict[str, Array] = {}
    aliases: dict[str, str] = {}
    for owner, name, column in found:
        whole = f"{owner}.{name}" if owner else name
        own = name if names.count(name) == 1 else whole
        columns[own] = column
        aliases |= {whole: own} if whole != own else {}
    return columns, aliases
