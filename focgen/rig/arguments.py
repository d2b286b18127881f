"""What a function takes for a rig: a :class:`Rig`, its file, or a dictionary; and in which order."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from focgen.errors import RigError
from focgen.logs.experiment import Experiment
from focgen.rig.files import read_rig
from focgen.rig.rig import Rig
from focgen.spelling import Call, respelled

P = ParamSpec("P")
R = TypeVar("R")
RigLike = Rig | str | Path | Mapping[str, Any]
"""A rig, the path of its rig.toml, or a dictionary of the same shape."""


def rig_of(given: RigLike) -> Rig:
    """The rig that an argument is. Raises RigError where it is none, or cannot be used."""
    if isinstance(given, Rig):
        return given
    if not isinstance(given, (str, os.PathLike, Mapping)):
        raise RigError("rig", f"is {type(given).__name__}", "give a Rig, a rig.toml or a dictionary like it")
    return read_rig(given)


def file_of(given: object) -> Path | None:
    """The file that an argument names; None for what is in memory."""
    return Path(given) if isinstance(given, (str, os.PathLike)) else None


def rig_then_logs(function: Callable[P, R]) -> Callable[P, R]:
    """A function of a rig and its logs, in this order.

    The other order is told by the arguments' types and works, with a warning; so do ``first`` and ``last``,
    the former names of ``from_`` and ``to``.
    """
    return respelled({"first": "from_", "last": "to"}, _rig_first, "(rig, logs, …)")(function)


def _rig_first(args: tuple[Any, ...], kwargs: dict[str, Any]) -> Call | None:
    """The arguments with the rig first, where the logs came first."""
    if len(args) == 1 and "rig" in kwargs and "logs" not in kwargs:
        return (), {**kwargs, "logs": args[0]}
    if len(args) < 2 or not _turned(*args[:2]):
        return None
    return (args[1], args[0], *args[2:]), kwargs


def _turned(first: object, second: object) -> bool:
    """Whether the arguments are logs and a rig. Of two paths, the one to a .toml is the rig."""
    told = _is_logs(first) or _is_rig(second)
    return told and not (_is_rig(first) or _is_logs(second))


def _is_rig(given: object) -> bool:
    if isinstance(given, Mapping):
        return isinstance(given.get("signals"), Mapping)
    file = file_of(given)
    return isinstance(given, Rig) or (file is not None and file.suffix.lower() == ".toml")


def _is_logs(given: object) -> bool:
    """Whether an argument is logs for sure; a path may be anything."""
    return isinstance(given, Experiment) or not (isinstance(given, (str, os.PathLike)) or _is_rig(given))
