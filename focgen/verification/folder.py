"""A generated folder read back: its plan, made anew from its controller, and what its manifest claims."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from focgen.codegen.kernels import PORTABLE, Kernels, runtime_files
from focgen.codegen.manifest import manifest_of, sha256
from focgen.control.controller import Controller
from focgen.control.files import read_controller
from focgen.errors import InputError
from focgen.plan.build import build_plan
from focgen.plan.model import ErrorBound, Plan

_AGAIN = "run focgen generate again"


@dataclass(frozen=True, eq=False)
class GeneratedFolder:
    """``plan`` from the folder's own controller.toml; ``bound`` as the manifest claims it; ``differences``
    between what the manifest says and what the plan gives; ``selftest``: whether it has NAME_selftest.c;
    ``kernels``: how it computes its sums.
    """

    path: Path
    plan: Plan
    bound: ErrorBound
    differences: tuple[str, ...]
    selftest: bool = False
    kernels: Kernels = PORTABLE


def read_folder(path: str | Path) -> GeneratedFolder:
    """Read a generated folder. Raises InputError where it is none, or lacks a file."""
    path = Path(path)
    manifest = _manifest(path)
    try:
        controller = read_controller(path / "controller.toml")
        plan = _plan(controller, manifest)
        claimed = _claimed(manifest["error_bound"])
    except KeyError as reason:
        raise InputError(str(path / "manifest.json"), f"lacks {reason}", _AGAIN) from None
    except (TypeError, ValueError) as reason:
        raise InputError(
            str(path / "manifest.json"), f"is not as it was written ({reason})", _AGAIN
        ) from None
    test = [f"{plan.name}_selftest.{end}" for end in "hc"] if "selftest" in manifest else []
    kernels = Kernels(manifest["kernels"]["target"] if "kernels" in manifest else None)
    headers = runtime_files(plan, kernels)
    for name in (f"{plan.name}.h", f"{plan.name}.c", *headers, *test):
        if not (path / name).is_file():
            raise InputError(str(path), f"lacks {name}", _AGAIN)
    inputs = {name: sha256((path / name).read_bytes()) for name in ("controller.toml", *headers)}
    expected = json.loads(json.dumps(manifest_of(plan, inputs, "selftest" in manifest, kernels)))
    differences = tuple(_differences(expected, manifest, ""))
    return GeneratedFolder(path, plan, claimed, differences, bool(test), kernels)


def _plan(controller: Controller, manifest: dict[str, Any]) -> Plan:
    """As it was made: the form of the memory is the manifest's, whatever the controller's file prefers."""
    arithmetic, name, memory = manifest["arithmetic"], manifest["name"], manifest["memory"]
    if memory == "exponential":
        asked = manifest["tolerance"], manifest["horizon"]
        return build_plan(controller, arithmetic, None, name, memory, *asked)
    return build_plan(controller, arithmetic, manifest["length"], name, memory)


def _manifest(path: Path) -> dict[str, Any]:
    if not path.is_dir():
        raise InputError(str(path), "is no folder", "name a folder that focgen generate has written")
    try:
        manifest = json.loads((path / "manifest.json").read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(
            str(path), "has no manifest.json", "name a folder that focgen generate has written"
        ) from None
    except (OSError, ValueError) as reason:
        raise InputError(str(path / "manifest.json"), f"cannot be read ({reason})", _AGAIN) from None
    if not isinstance(manifest, dict):
        raise InputError(str(path / "manifest.json"), "is no JSON object", _AGAIN)
    return manifest


def _claimed(bound: dict[str, Any]) -> ErrorBound:
    quantisation, truncation = bound["quantisation"], bound["truncation"]["operator"]
    return ErrorBound(
        float(quantisation["operator"]),
        float(quantisation["output_per_sample"]),
        truncation,
        float(quantisation.get("operator_per_sample", 0.0)),
    )


def _differences(expected: Any, found: Any, place: str):
    """Yield every place where the manifest is not what the plan gives."""
    if isinstance(expected, dict) and isinstance(found, dict):
        for key in sorted(expected.keys() | found.keys()):
            where = f"{place}.{key}" if place else key
            if key == "generator":
                continue
            if key not in found or key not in expected:
                yield f"manifest.json: {where} is {'missing' if key in expected else 'unknown'}"
            else:
                yield from _differences(expected[key], found[key], where)
    elif isinstance(expected, list) and isinstance(found, list) and len(expected) == len(found):
        for i, (one, other) in enumerate(zip(expected, found)):
            yield from _differences(one, other, f"{place}[{i}]")
    elif not _same(expected, found):
        yield f"manifest.json: {place} is {_short(found)}, the controller gives {_short(expected)}"


def _same(expected: Any, found: Any) -> bool:
    """Equal in every digit and in type: every machine finds the same."""
    return type(expected) is type(found) and expected == found


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
