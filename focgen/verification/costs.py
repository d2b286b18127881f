"""``cost``: what a step of generated C costs on microcontrollers, beside what it cost before."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from focgen.arguments import checked
from focgen.codegen.kernels import TARGETS
from focgen.errors import InputError, MissingExtra, check_choice
from focgen.output import write_file
from focgen.progress import say
from focgen.shown import Shown
from focgen.targets.cores import core
from focgen.targets.cost import Cost, cost_of, cost_on, cost_on_avr, with_runtimes
from focgen.targets.emulator import emulator_title
from focgen.targets.selection import entry_of, selected
from focgen.targets.toolchains import Toolchain, absent, toolchains
from focgen.textfile import LARGEST_CODE, read_regular
from focgen.verification.folder import GeneratedFolder, read_folder, sources
from focgen.verification.remembered import COMPILERS, REMEMBERED, is_own, remembered

_BY_FUNCTIONS = "cortex-m0plus"  # wide products, shifts and floating point are functions of the compiler's


@dataclass(frozen=True)
class ControllerCost:
    """One generated folder: ``targets`` by name, and the ``previous`` costs: those of ``against``, which is
    another folder, or this one before it was generated anew.
    """

    folder: Path
    name: str
    arithmetic: str
    memory: str
    length: int
    targets: dict[str, Cost]
    previous: dict[str, Cost]
    against: Path | None = None


@dataclass(frozen=True, repr=False)
class Costs(Shown):
    """The costs of every generated folder, by folder."""

    controllers: tuple[ControllerCost, ...]


@checked
def cost(folder: str | Path, target: str | Sequence[str] = "all", compiler: str = "zig",
         against: str | Path | None = None, edited: bool = False) -> Costs:  # fmt: skip
    """Count what a step costs on emulated cores, and what flash, RAM and stack are used.

    ``folder`` has been generated, or holds generated folders: then each of them is counted. ``target``: a
    name of ``TARGETS``, several, or "all". ``compiler``: "zig" or "gcc" (arm-none-eabi-gcc, where installed).
    ``against``: another generated folder to compare with; without it the costs are compared with those of the
    folder's previous C, which its cost.json remembers. ``edited``: compile a folder although it is not as it
    was generated.

    Raises InputError for a folder that is none, has been edited, or was made by another version of focgen,
    BuildError where the C does not compile.
    """
    names = selected(target, TARGETS)
    check_choice("--compiler", compiler, COMPILERS)
    folders = [_read(path, edited) for path in _generated(Path(folder))]
    other = None if against is None else _read(Path(against), edited)
    beside = {} if other is None else {name: _on(name, other, compiler) for name in names}
    return Costs(tuple(_counted(read, names, compiler, other, beside) for read in folders))


def _read(path: Path, edited: bool) -> GeneratedFolder:
    read = read_folder(path)
    if read.differences and not edited:
        changed = ", ".join(dict.fromkeys(one.partition(":")[0] for one in read.differences))
        remedy = "generate it again, or give --edited to compile it as it is"
        raise InputError(str(path), f"has been edited: {changed}", remedy)
    return read


def _generated(path: Path) -> list[Path]:
    """The folder itself, or the generated folders in it."""
    if not path.is_dir() or (path / "manifest.json").is_file():
        return [path]
    found = sorted(part.parent for part in path.glob("*/manifest.json"))
    return found or [path]


def _counted(read: GeneratedFolder, names: Sequence[str], compiler: str, other: GeneratedFolder | None,
             beside: dict[str, Cost]) -> ControllerCost:  # fmt: skip
    plan, found = read.plan, {name: _on(name, read, compiler) for name in names}
    before = _remember(read, compiler, found)
    previous = before if other is None else beside
    return ControllerCost(read.path, plan.name, plan.arithmetic, plan.memory, plan.length, found,
                          {name: previous[name] for name in names if name in previous},
                          None if other is None else other.path)  # fmt: skip


def _on(name: str, given: GeneratedFolder, compiler: str) -> Cost:
    with sources(given) as place:
        return _compiled(name, replace(given, path=place), compiler)


def _compiled(name: str, read: GeneratedFolder, compiler: str) -> Cost:
    if name == "avr":
        return cost_on_avr(read.plan, read.path)
    one = core(name)
    try:
        emulator_title()
        chain = _chain(name, compiler)
    except MissingExtra as missing:
        return Cost(skipped=f"{missing.what} ({missing.remedy})")
    if chain is None:
        return Cost(skipped=next(line for line in absent(one) if ("zig" in line) == (compiler == "zig")))
    found = cost_on(one, chain, read.plan, read.path)
    if name != _BY_FUNCTIONS:
        return found
    others = [c for c in toolchains(one) if c.title != chain.title]
    return with_runtimes(found, one, others, absent(one), read.plan, read.path)


def _chain(name: str, compiler: str) -> Toolchain | None:
    chains = toolchains(core(name))
    return next((c for c in chains if c.name.startswith("zig") == (compiler == "zig")), None)


def _remember(read: GeneratedFolder, compiler: str, found: dict[str, Cost]) -> dict[str, Cost]:
    """Write the costs down in the folder; return those of the C that was there before, same compiler."""
    path, made_from = read.path / REMEMBERED, _hash(read)
    stored = remembered(path) or {}
    mine = stored.get(compiler, {})
    same = mine.get("made_from") == made_from
    previous = mine.get("previous", {}) if same else mine.get("targets", {})
    counted = {name: entry_of(one) for name, one in found.items() if one.skipped is None}
    targets = {**(mine.get("targets", {}) if same else {}), **counted}
    stored[compiler] = {"made_from": made_from, "targets": targets, "previous": previous}
    if not is_own(path):
        say(f"{path} is no memory of costs, so it stays, and these are not remembered")
        return {}
    with suppress(InputError):  # a folder that cannot be written remembers nothing
        write_file(path, json.dumps(stored, indent=2) + "\n")
    return {name: cost_of(entry) for name, entry in previous.items()}


def _hash(read: GeneratedFolder) -> str:
    """Of the C: what else is in the folder costs nothing."""
    digest = hashlib.sha256()
    for path in sorted([*read.path.glob("*.c"), *read.path.glob("*.h")]):
        if "_selftest." not in path.name:
            digest.update(read_regular(path, LARGEST_CODE))
    return digest.hexdigest()
