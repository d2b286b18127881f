"""What public functions are given, by the kinds that their signatures name.

A text for a number, or a list for a path, else fails wherever it is first used, in words of Python's.
"""

from __future__ import annotations

import errno
import inspect
import os
from collections.abc import Callable, Iterable, Mapping, Sized
from functools import wraps
from numbers import Integral, Real
from typing import Any, ParamSpec, TypeVar, cast

import numpy as np

from focgen.errors import InputError

P = ParamSpec("P")
R = TypeVar("R")
_NO_LIST = (str, bytes, bytearray, Mapping)
_LONGEST = 80  # characters of a value that is shown
_PATH = "str | Path"
Wanted = tuple[Callable[[Any], bool], str]  # whether a value is of a kind; the remedy where it is not


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """A function that raises InputError where a path, text, number, a sequence of them, or an object of
    our own is none.

    Other kinds, and values that only the function can judge, are its own affair.
    """
    signature, call_it = inspect.signature(function), cast(Callable[..., R], function)
    scope = getattr(function, "__globals__", {})
    found = {name: _wanted(kind, scope) for name, kind in _kinds(signature)}
    wanted = {name: one for name, one in found.items() if one is not None}

    @wraps(function)
    def call(*args: Any, **kwargs: Any) -> R:
        for name, value in signature.bind(*args, **kwargs).arguments.items():
            if name in wanted and not (value is None and signature.parameters[name].default is None):
                holds, remedy = wanted[name]
                if not holds(value):
                    raise InputError(f"{function.__name__}: {name}", f"is {_shown(value)}", remedy)
        return call_it(*args, **kwargs)

    return cast(Callable[P, R], call)


def _kinds(signature: inspect.Signature) -> Iterable[tuple[str, str]]:
    """Names of the arguments and what they are, without "or None"."""
    for name, parameter in signature.parameters.items():
        yield name, str(parameter.annotation).removesuffix(" | None")


def _wanted(kind: str, scope: Mapping[str, Any]) -> Wanted | None:
    """What an annotation asks for, its names being read in ``scope``; None where that is not known."""
    if kind in _WANTED:
        return _WANTED[kind]
    paths = kind.startswith(_PATH)
    names = kind.removeprefix(_PATH + " | ").split(" | ")
    classes: Any = tuple(scope.get(name) for name in names)
    if not all(map(_is_own, classes)):
        return None
    remedy = "give a " + " or a ".join([*(["path"] if paths else []), *names])
    return lambda value: isinstance(value, classes) or (paths and _is_path(value)), remedy


def _is_own(kind: Any) -> bool:
    """Whether this is a class of the package, and not only the shape that objects of any class may have."""
    own = isinstance(kind, type) and kind.__module__.startswith(f"{__package__}.")
    return own and not getattr(kind, "_is_protocol", False)


def _shown(value: Any) -> str:
    try:
        text = " ".join(repr(value).split())
    except Exception:  # noqa: BLE001 - whatever an object of the caller's does
        text = ""
    return text if 0 < len(text) <= _LONGEST else f"of the type {type(value).__name__}"


def _is_number(value: Any) -> bool:
    """Whether a value is one real number that a float can hold; a truth value is none."""
    if not isinstance(value, Real) or isinstance(value, bool):
        return False
    try:
        float(value)
    except OverflowError:
        return False
    return True


def _is_whole(value: Any) -> bool:
    return isinstance(value, Integral) and not isinstance(value, bool)


def _is_truth(value: Any) -> bool:
    return isinstance(value, (bool, np.bool_)) or (_is_whole(value) and value in (0, 1))


def _is_path(value: Any) -> bool:
    """Whether the system takes a text for a path, there or not; an empty one is none, and no current
    folder."""
    if not isinstance(value, (str, os.PathLike)) or value == "":
        return False
    try:
        os.lstat(cast(Any, os.fspath(value)))
    except OSError as reason:
        return reason.errno != errno.ENAMETOOLONG
    except (ValueError, TypeError):  # a null character; surrogates have none in some encodings
        return False
    return isinstance(os.fspath(value), str)


def _each(holds: Callable[[Any], bool]) -> Callable[[Any], bool]:
    """Whether a value is several of a kind; what can be gone through only once is none."""

    def all_hold(value: Any) -> bool:
        several = isinstance(value, Iterable) and isinstance(value, Sized) and not isinstance(value, _NO_LIST)
        one_dimension = not isinstance(value, np.ndarray) or value.ndim == 1
        return several and one_dimension and all(map(holds, value))

    return all_hold


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _is_text_or_several(value: Any) -> bool:
    return _is_text(value) or _each(_is_text)(value)


_WANTED: dict[str, Wanted] = {
    _PATH: (_is_path, "give a path"),
    "str": (_is_text, "give a text"),
    "float": (_is_number, "give a number"),
    "int": (_is_whole, "give a whole number"),
    "bool": (_is_truth, "give True or False"),
    "Sequence[float]": (_each(_is_number), "give a list of numbers"),
    "Sequence[int]": (_each(_is_whole), "give a list of whole numbers"),
    "Sequence[str]": (_each(_is_text), "give a list of texts"),
    "str | Sequence[str]": (_is_text_or_several, "give a text or several"),
}
