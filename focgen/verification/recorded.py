"""What a manifest says that its folder was made with, checked before any of it becomes a path or a plan."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import focgen
from focgen.codegen.kernels import TARGETS, Kernels
from focgen.codegen.names import check_name
from focgen.codegen.packages.package import PLAIN, Package, check_package
from focgen.control.controller import ARITHMETICS, MEMORIES
from focgen.errors import InputError, check_choice
from focgen.fractional.continuous import OPERATORS
from focgen.fractional.exponential import HORIZONS, TOLERANCES
from focgen.jsontext import fits, read_json
from focgen.plan.plan import LONGEST, ErrorBound

AGAIN = "run focgen generate again"
_QUANTISATION = {"operator": float, "output_per_sample": float, "operator_per_sample?": float}
_SHAPE = {
    "generator": re.compile(r"focgen [0-9A-Za-z.+!-]{1,60}"),
    "name": str,
    "arithmetic": str,
    "memory": str,
    "length": int,
    "operator": str,
    "error_bound": {"quantisation": _QUANTISATION, "truncation": {"operator": (float, None)}},
    "kernels?": {"target": str},
    "selftest?": dict,
    "no_float?": bool,
    "package?": {"for": str, "fmi?": int},
    "tunable?": dict,
    "inputs": dict,
    "files": dict,
}
_EXPONENTIAL = {"tolerance": float, "horizon": int}
_CONTINUOUS = {"tolerance": float, "band": list}


@dataclass(frozen=True, eq=False)
class Recorded:
    """A manifest: the ``name`` of the C, the options of the plan and of its C (``floats``: whether its header
    has conversions), the ``bound`` it claims, and ``content``, all of it.

    ``length`` is None with an exponential memory, ``tolerance`` and ``horizon`` are with a short one. The
    ``operator`` "continuous" has a ``band`` (rad/s) and no horizon.
    """

    name: str
    arithmetic: str
    memory: str
    length: int | None
    tolerance: float | None
    horizon: int | None
    kernels: Kernels
    selftest: bool
    bound: ErrorBound
    floats: bool
    content: Mapping[str, Any]
    operator: str = "gl"
    band: tuple[float, float] | None = None
    package: Package = PLAIN
    tunable: bool = False


def read_recorded(folder: Path) -> Recorded:
    """Read the manifest of a generated folder.

    Raises InputError where the folder is none, its manifest is not as one is written, or another version of
    focgen has made it.
    """
    path = folder / "manifest.json"
    if not path.is_file():
        what = "has no manifest.json" if folder.is_dir() else "is no folder"
        raise InputError(str(folder), what, "name a folder that focgen generate has written")
    found = read_json(path, AGAIN)
    _check_shape(path, found, _SHAPE)
    _check_version(path, found["generator"])
    where = str(path)
    check_choice(f"{where} [arithmetic]", found["arithmetic"], ARITHMETICS)
    check_choice(f"{where} [memory]", found["memory"], MEMORIES)
    check_choice(f"{where} [operator]", found["operator"], OPERATORS)
    target = found["kernels"]["target"] if "kernels" in found else None
    if target is not None:
        check_choice(f"{where} [kernels]", target, TARGETS)
    name = _name(where, found)
    options = found["arithmetic"], found["memory"], *_memory(path, found)
    bound, floats = _bound(found["error_bound"]), not found.get("no_float", False)
    recorded = Recorded(name, *options, Kernels(target), "selftest" in found, bound, floats, found)
    package, tunable = _package(path, found.get("package")), "tunable" in found
    band = _band(path, found)
    return replace(recorded, operator=found["operator"], band=band, package=package, tunable=tunable)


def _package(path: Path, entry: dict[str, Any] | None) -> Package:
    if entry is None:
        return PLAIN
    try:
        return check_package(entry["for"], entry.get("fmi"))
    except InputError as fault:
        raise InputError(f"{path} [package]", fault.what, AGAIN) from None


def _check_shape(path: Path, found: Any, shape: dict[str, Any]) -> None:
    """Name the first key that is missing or is not what it was written as."""
    if not isinstance(found, dict):
        raise InputError(str(path), "is no JSON object", AGAIN)
    for key, part in shape.items():
        if not fits(found, {key: part}):
            name = key.rstrip("?")
            raise InputError(str(path), f"lacks {name!r} as it was written", AGAIN)


def _name(where: str, found: dict[str, Any]) -> str:
    """Of the C, which has files of this name."""
    try:
        name = check_name(found["name"], where)
    except InputError as fault:
        raise InputError(where, fault.what, AGAIN) from None
    if f"{name}.c" not in found["files"]:
        raise InputError(where, f"has the name {name!r}, and files of another", AGAIN)
    return name


def made_here(generator: str) -> bool:
    """Whether this version of focgen has written what names ``generator``."""
    return generator.removeprefix("focgen ") == focgen.__version__


def _check_version(path: Path, generator: str) -> None:
    made_by, here = generator.removeprefix("focgen "), focgen.__version__
    if not made_here(generator):
        what = f"was written by focgen {made_by}, and this is {here}"
        raise InputError(str(path), what, f"use focgen {made_by}, or run focgen generate again with this one")


def _memory(path: Path, found: dict[str, Any]) -> tuple[int | None, float | None, int | None]:
    """Length, or tolerance and, where there is one, horizon."""
    if found["memory"] == "short":
        _check_span(path, "length", found["length"], (1, LONGEST))
        return found["length"], None, None
    continuous = found["operator"] == "continuous"
    _check_shape(path, found, _CONTINUOUS if continuous else _EXPONENTIAL)
    _check_span(path, "tolerance", found["tolerance"], TOLERANCES)
    if continuous:
        return None, found["tolerance"], None
    _check_span(path, "horizon", found["horizon"], HORIZONS)
    return None, found["tolerance"], found["horizon"]


def _band(path: Path, found: dict[str, Any]) -> tuple[float, float] | None:
    """Of the operator "continuous"; whether it can be fitted is the plan's to say."""
    if found["operator"] == "gl":
        return None
    band = found["band"] if found["memory"] == "exponential" else None
    if not (isinstance(band, list) and len(band) == 2 and all(type(end) is float for end in band)):
        raise InputError(str(path), "lacks 'band' as it was written", AGAIN)
    return band[0], band[1]


def _check_span(path: Path, key: str, value: float, span: tuple[float, float]) -> None:
    if not span[0] <= value <= span[1]:
        raise InputError(f"{path} [{key}]", f"is {value:g}, beyond {span[0]:g} to {span[1]:g}", AGAIN)


def _bound(bound: dict[str, Any]) -> ErrorBound:
    quantisation, truncation = bound["quantisation"], bound["truncation"]["operator"]
    operator, output = float(quantisation["operator"]), float(quantisation["output_per_sample"])
    return ErrorBound(operator, output, truncation, float(quantisation.get("operator_per_sample", 0.0)))
