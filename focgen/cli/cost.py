"""``focgen cost``: what a step of generated C costs on microcontrollers."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import Any

from focgen.cli.outcome import Outcome
from focgen.codegen.kernels import TARGETS
from focgen.present import present
from focgen.report.page import TableOf, text_table
from focgen.targets.calls import CallCost
from focgen.targets.cost import COUNTED, Cost, PerStep
from focgen.targets.selection import entry_of
from focgen.verification.costs import ControllerCost, cost
from focgen.verification.remembered import COMPILERS

EXAMPLE = """example:
  focgen cost firmware --target all
  focgen cost build/demo/firmware --target cortex-m4 --compiler gcc
  focgen cost firmware --against firmware-before

  compiles the folder's C for each core, runs it in an emulator and counts every instruction of every step.
  Cycles are a model, by Arm's published timings, where there are such. A folder that holds several generated
  ones gives one table of them all. What a controller's C has cost before stands in brackets: the folder
  remembers it in cost.json. Exit status 1 where nothing was counted: every core asked for was skipped."""

_HEADS = ("controller", "core", "instructions mean", "worst", "cycles mean", "worst", "flash B", "RAM B",
          "stack B")  # fmt: skip


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("folder", metavar="DIR", help="a generated folder, or one that holds several")
    parser.add_argument(
        "--target", default="all", choices=(*TARGETS, "all"), help="where it runs (default: all)"
    )
    parser.add_argument(
        "--compiler", default="zig", choices=COMPILERS, help="what compiles it (default: zig)"
    )
    parser.add_argument(
        "--edited", action="store_true", help="count a folder that is not as it was generated, too"
    )
    parser.add_argument("--against", metavar="DIR", help="another generated folder to compare with")


def run(args: Namespace) -> Outcome:
    found = cost(args.folder, args.target, args.compiler, args.against, args.edited)
    entries = [_entry(one) for one in found.controllers]
    payload = entries[0] if len(entries) == 1 else {"controllers": entries}
    if len(entries) == 1 and args.target != "all":
        payload = {**payload, **payload["targets"][args.target]}
    counted = any(one.skipped is None for each in found.controllers for one in each.targets.values())
    return Outcome(payload, _text(found.controllers), counted)


def _entry(one: ControllerCost) -> dict[str, Any]:
    """A controller in JSON."""
    targets = {}
    for name, counted in one.targets.items():
        targets[name] = entry_of(counted)
        if name in one.previous:
            targets[name]["previous"] = entry_of(one.previous[name])
    return {"folder": str(one.folder), "name": one.name, "arithmetic": one.arithmetic, "memory": one.memory,
            "length": one.length, "against": None if one.against is None else str(one.against),
            "targets": targets}  # fmt: skip


def _text(controllers: tuple[ControllerCost, ...]) -> str:
    """The costs for people: a table, and under it how they were counted."""
    rows, skipped, paths = [], {}, []
    compilers: dict[str, None] = {}
    hows: dict[str, None] = {}
    for one in controllers:
        length = f" {one.length}" if one.memory == "short" else ""
        title = f"{one.name} {one.arithmetic} {one.memory}{length}"
        for name, counted in one.targets.items():
            if counted.skipped is not None:
                skipped[name] = counted.skipped
                continue
            rows.append((title, name, *_cells(counted, one.previous.get(name))))
            compilers[present(counted.compiler)] = None
            if counted.cycles_per_step is not None:
                hows[counted.cycles_per_step.how] = None
            paths.append(f"{title}, {name}: {' > '.join(counted.stack_path or ())}")
    why = [f"{name} skipped: {reason}" for name, reason in skipped.items()]
    if not rows:
        return "\n".join(why)
    table = text_table(TableOf(_HEADS, tuple(rows)))
    table = "\n".join([table, *_calls(controllers), *_runtimes(controllers)])
    stacks = ["", "deepest stack, each function with its bytes:", *(f"  {path}" for path in paths)]
    how = ["", f"compiled by {', '.join(compilers)}", f"instructions: {COUNTED}"]
    how += [f"cycles: {one}" for one in hows]
    return "\n".join([table, *why, *stacks, *how])


_CALLS = ("init", "reset", "track", "tune", "save", "restore")


def _calls(controllers: tuple[ControllerCost, ...]) -> list[str]:
    """What the other calls cost, cycles where there is a model of them, else instructions."""
    rows = []
    for one in controllers:
        for name, counted in one.targets.items():
            if counted.calls:
                cells = [counted.calls.get(call) for call in _CALLS]
                unit = "instructions" if present(cells[0]).cycles is None else "cycles"
                rows.append((one.name, name, unit, *(_call(cell) for cell in cells)))
    return ["", text_table(TableOf(("controller", "core", "counted", *_CALLS), tuple(rows)))] if rows else []


def _call(cost: CallCost | None) -> str:
    return "-" if cost is None else f"{cost.instructions if cost.cycles is None else cost.cycles:.0f}"


def _runtimes(controllers: tuple[ControllerCost, ...]) -> list[str]:
    """The step with each compiler's own functions, on cores that need them."""
    lines = []
    for one in controllers:
        for name, counted in one.targets.items():
            for title, runtime in (counted.runtimes or {}).items():
                lacking = (runtime.skipped or "").partition(": ")[2]
                said = lacking or f"{runtime.instructions_per_step:.0f} instructions a step"
                lines.append(f"  {one.name}, {name}, functions of {title}: {said}")
    return ["", *lines] if lines else []


def _cells(now: Cost, before: Cost | None) -> list[str]:
    was = before or Cost()
    return [
        *_pair(now.instructions_per_step, was.instructions_per_step),
        *_pair(now.cycles_per_step, was.cycles_per_step),
        _change(now.flash_bytes, was.flash_bytes),
        _change(now.ram_bytes, was.ram_bytes),
        _change(now.stack_bytes, was.stack_bytes),
    ]


def _pair(now: PerStep | None, before: PerStep | None) -> list[str]:
    if now is None:
        return ["-", "-"]
    return [
        _change(getattr(now, key), None if before is None else getattr(before, key))
        for key in ("mean", "worst")
    ]


def _change(now: float | None, before: float | None) -> str:
    """A figure, and in brackets by how much it has changed."""
    if now is None:
        return "-"
    if not before or round(now) == round(before):
        return f"{now:.0f}"
    return f"{now:.0f} ({100.0 * (now / before - 1.0):+.0f} %)"
