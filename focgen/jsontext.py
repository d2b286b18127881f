"""Results as JSON, and JSON read from files whose content has to be checked."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from focgen.errors import InputError
from focgen.textfile import LARGEST_JSON, read_regular

_INTEGERS = -(2**63), 2**64  # what an array can hold: nothing that is written here is beyond

UNWRITTEN = {"json": False}
"""Metadata of a dataclass field that :func:`plain` leaves out."""


def plain(value: Any) -> Any:
    """Turn dataclasses, arrays and paths into what JSON can carry; what is not finite becomes null."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        written = (f for f in dataclasses.fields(value) if f.metadata.get("json", True))
        return {f.name: plain(getattr(value, f.name)) for f in written}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def to_json(value: Any) -> str:
    """JSON text, indented, with a final newline."""
    return json.dumps(plain(value), indent=2, ensure_ascii=False) + "\n"


def read_json(path: Path, remedy: str) -> Any:
    """The content of a JSON file. Raises InputError with ``remedy`` where it cannot be read or is no JSON."""
    try:
        return json.loads(read_regular(path, LARGEST_JSON).decode("utf-8"))
    except OSError as reason:
        raise InputError(str(path), f"cannot be read ({reason.strerror})", remedy) from None
    except (ValueError, RecursionError):  # no UTF-8, no JSON, endless digits, brackets without end
        raise InputError(str(path), "is no JSON", remedy) from None


_OF = "of"


def tied(text: str, told: str) -> str:
    """The JSON object ``text`` with the SHA-256 of ``told``, the file beside which it lies."""
    begun, rest = f'{{"{_OF}":"{hashlib.sha256(told.encode()).hexdigest()}"', text.lstrip()[1:]
    return f"{begun}{'' if rest.lstrip().startswith('}') else ','}{rest}"


def check_tied(value: Any, path: Path, told: Path, remedy: str) -> None:
    """Raise InputError where ``value``, read from ``path``, is a part of another file than ``told`` as it
    stands. What an earlier version wrote does not say."""
    found = value.get(_OF) if isinstance(value, dict) else None
    try:
        same = found is None or found == hashlib.sha256(_as_written(told)).hexdigest()
    except OSError:
        same = False
    if not same:
        raise InputError(str(path), f"is not of {told.name} beside it, or that was edited since", remedy)


def _as_written(path: Path) -> bytes:
    """A file's bytes with the ends of lines that it was written with: a checkout may have others."""
    return read_regular(path, LARGEST_JSON).replace(b"\r\n", b"\n")


ANY = "*"
"""Stands for every key of an object, in a shape."""


def shape_of(kind: Any) -> Any:
    """The shape, as :func:`fits` takes it, of what :func:`plain` writes of a type: of a dataclass, or of what
    its fields are annotated with. Fields with a default may be absent."""
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        hints = get_type_hints(kind)
        given = (
            f"{f.name}{'' if f.default is dataclasses.MISSING else '?'}" for f in dataclasses.fields(kind)
        )
        return {name: shape_of(hints[name.rstrip("?")]) for name in given}
    parts = get_args(kind)
    if get_origin(kind) is tuple:
        return [shape_of(part) for part in parts if part is not Ellipsis]
    if get_origin(kind) is dict:
        return {ANY: shape_of(parts[1])}
    return tuple(map(shape_of, parts)) if parts else None if kind is type(None) else kind


def fits(value: Any, shape: Any) -> bool:
    """Whether a value from JSON has a shape.

    A shape is a type (``float`` takes any finite number, and none takes a truth value for a number), a
    pattern for a whole text, None, a tuple of alternatives, ``[shape]`` for a list of it, ``[shape, shape]``
    for one of just these, or ``{key: shape}`` for an object that has these keys at least. A key with a
    question mark may be absent; ``{ANY: shape}`` is an object of any keys.
    """
    if isinstance(shape, dict) and ANY in shape:
        return isinstance(value, dict) and all(fits(item, shape[ANY]) for item in value.values())
    if isinstance(shape, dict):
        return isinstance(value, dict) and all(_has(value, key, part) for key, part in shape.items())
    if isinstance(shape, list):
        each = shape if len(shape) > 1 else shape * len(value) if isinstance(value, list) else []
        return isinstance(value, list) and len(value) == len(each) and all(map(fits, value, each))
    if isinstance(shape, tuple):
        return any(fits(value, one) for one in shape)
    if isinstance(shape, re.Pattern):
        return isinstance(value, str) and shape.fullmatch(value) is not None
    if shape in (int, float):
        return _is_number(value, shape)
    return value is None if shape is None else isinstance(value, shape)


def _has(value: dict[str, Any], key: str, shape: Any) -> bool:
    name = key.rstrip("?")
    return fits(value[name], shape) if name in value else name != key


def _is_number(value: Any, kind: type) -> bool:
    if isinstance(value, bool) or not isinstance(value, int if kind is int else (int, float)):
        return False
    return _INTEGERS[0] <= value < _INTEGERS[1] if isinstance(value, int) else math.isfinite(value)
