"""A verification as a JSON payload, and generated C, its verification and its costs as small tables."""

from __future__ import annotations

from typing import Any

from focgen.report.page import TableOf
from focgen.report.pages.parts import number
from focgen.targets.cost import Cost
from focgen.targets.selection import entry_of
from focgen.verification.costs import ControllerCost, Costs
from focgen.verification.verify import Verification


def verification_payload(found: Verification) -> dict[str, Any]:
    """What ``focgen verify --json`` carries."""
    return {
        "name": found.name,
        "arithmetic": found.arithmetic,
        "targets": {name: entry_of(result) for name, result in found.targets.items()},
        "differences": list(found.differences),
        "notes": list(found.notes),
        "files": dict(found.files),
        "holds": found.holds,
    }


def costs_table(found: Costs) -> TableOf:
    """A row for each controller and target."""
    heads = (
        "controller",
        "target",
        "instructions a step",
        "cycles a step",
        "flash (B)",
        "RAM (B)",
        "stack (B)",
    )
    rows = tuple(
        (controller_title(one), name, *_cells(cost))
        for one in found.controllers
        for name, cost in one.targets.items()
    )
    return TableOf(heads, rows, "What a step costs, the mean of all")


def controller_title(one: ControllerCost) -> str:
    """Which controller, in which arithmetic, with which memory."""
    length = f" {one.length}" if one.memory == "short" else ""
    return f"{one.name} {one.arithmetic} {one.memory}{length}"


def _cells(cost: Cost) -> tuple[str, ...]:
    if cost.skipped is not None:
        return ("skipped", *("–",) * 4)
    steps = [None if per is None else per.mean for per in (cost.instructions_per_step, cost.cycles_per_step)]
    return (
        *("–" if step is None else f"{step:.0f}" for step in steps),
        *(number(size) for size in (cost.flash_bytes, cost.ram_bytes, cost.stack_bytes)),
    )
