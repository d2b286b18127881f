"""Logs in .mat (up to version 7): one vector a column, on the top level or as the fields of one structure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from focgen.errors import LogError
from focgen.logs.table import LogTable

_REMEDY = "save one vector a column, with -v7"


def read(path: Path) -> LogTable:
    """Read a file. Raises LogError where it is damaged, of version 7.3, or holds no vectors."""
    path.open("rb").close()  # loadmat would try other names
    try:
        content = loadmat(path, squeeze_me=True, struct_as_record=False)
    except NotImplementedError:
        raise LogError(str(path), "is a MAT file of version 7.3", _REMEDY) from None
    except (ValueError, TypeError, MatReadError, EOFError, KeyError, IndexError):
        raise LogError(str(path), "is not a whole MAT file", _REMEDY) from None
    columns = _columns({name: value for name, value in content.items() if not name.startswith("__")})
    lengths = {len(column) for column in columns.values()}
    if not columns:
        raise LogError(str(path), "holds no vectors", _REMEDY)
    if len(lengths) > 1:
        sizes = ", ".join(f"{name} {len(column)}" for name, column in columns.items())
        raise LogError(
            str(path), f"holds vectors of different lengths ({sizes})", "save one experiment a file"
        )
    return LogTable(str(path), columns)


def _columns(content: dict) -> dict[str, np.ndarray]:
    """The vectors, those inside structures too; scalars (settings, counters) are left out."""
    found = {}
    for name, value in content.items():
        if hasattr(value, "_fieldnames"):
            found.update(_columns({field: getattr(value, field) for field in value._fieldnames}))
        elif isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "fiubU":
            found[name] = value.astype(float) if value.dtype.kind == "b" else value
    return found
