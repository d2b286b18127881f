"""Constant tables of a generated source: weights, blocks, schedule."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from focgen.codegen.banks import BankText, bank_texts, inputs, ring_of
from focgen.codegen.expressions import bound, shifted
from focgen.codegen.literals import exponent, quantity, rows, scale, wrapped
from focgen.codegen.lookahead import LookAhead, Run
from focgen.codegen.state import plain_bytes, printed_blocks, size_of
from focgen.codegen.texts import comment
from focgen.plan.formats import runtime
from focgen.plan.plan import Block, Plan, Sum
from focgen.present import present


@dataclass(frozen=True)
class Group:
    """Rows of a table under one comment (none where empty)."""

    about: str
    rows: list[str]


@dataclass(frozen=True)
class TableText:
    """A constant table: comment lines, type, name, number of entries, rows."""

    about: list[str]
    ctype: str
    name: str
    count: int
    groups: list[Group]


@dataclass(frozen=True)
class NearText:
    """The near lags: the samples' type, how many there are, the call that finds them, their weights, and
    every block's sum as an expression in weights w and samples x."""

    ctype: str
    count: int
    samples: str
    weights: str
    parts: list[str]


@dataclass(frozen=True)
class SumText:
    """A history sum: its tables, and the function that computes it.

    Where it looks ahead: ``ahead`` is the call of each step, ``rest`` that of a reset, ``near`` what is left
    to its own step; else they are empty, and ``near`` None. ``banks`` remember what is beyond the taps,
    driven by what ``inputs`` declare.
    """

    tables: list[TableText]
    function: str
    ctype: str
    about: str
    call: str
    ahead: str = ""
    rest: str = ""
    near: NearText | None = None
    banks: list[BankText] = field(default_factory=list)
    inputs: list[str] = field(default_factory=list)


def sum_text(
    plan: Plan, table: Sum, name: str, about: list[str], ahead: LookAhead | None = None, prefix: str = "foc"
) -> SumText:
    """The sum ``table`` as C; its weights are called NAME_``name``, and ``about`` says what they are.

    Blocks in which every weight is zero leave nothing behind, but for one where all are. ``ahead`` is its
    layout where it looks ahead; ``prefix`` begins the names of the runtime's functions for the plain form.
    """
    if ahead is not None:
        return _ahead_text(plan, table, f"{plan.name}_{name}", about, ahead)
    blocks = printed_blocks(table)
    weights = f"{plan.name}_{name}"
    made = [_weights(plan, blocks, weights, about)]
    if len(blocks) > 1:
        made.append(_blocks(table, blocks, f"{weights}_blocks"))
    return SumText(
        made,
        f"{weights}_sum",
        table.total.ctype,
        _sum_about(table),
        _call(plan, table, blocks, weights, prefix),
        banks=bank_texts(plan, table),
        inputs=inputs(plan, table),
    )


def _sum_about(table: Sum) -> str:
    about = bound(table.total, "sum")
    return f"{about}, counts of {scale(table.total.lsb)}" if about else ""


def _call(plan: Plan, table: Sum, blocks: list[Block], weights: str, prefix: str) -> str:
    ring, size = ring_of(plan, table.history)
    history = f"s->{ring}, {size}, s->{ring}_now"
    if len(blocks) > 1:
        return (
            f"{prefix}_sum_{runtime(plan.arithmetic)}({weights}, {weights}_blocks, {len(blocks)}, {history})"
        )
    one = blocks[0]
    dot = f"{prefix}_dot_{runtime(plan.arithmetic)}({weights}, {len(one.weights)}, {history}, {one.last})"
    return shifted(dot, one.sum.ctype, one.align)


def _ahead_text(plan: Plan, table: Sum, name: str, about: list[str], ahead: LookAhead) -> SumText:
    """Far tables, the runs over them, and the near sum with tables of its own."""
    member = f"s->{name.removeprefix(plan.name + '_')}_ahead"
    ring, size = ring_of(plan, table.history)
    far = f"{member}, {name}_far, {name}_runs, {name}_slices, s->{ring}, {size}"
    near = ahead.near
    history = f"s->{ring}, {size}, s->{ring}_now"
    nearer = (
        [_weights(plan, list(near.blocks), f"{name}_near", ["The lags nearer than those."])] if near else []
    )
    return SumText(
        [*_far_tables(plan, table, name, about, ahead), *nearer],
        f"{name}_sum",
        table.total.ctype,
        _sum_about(table),
        f"{member}[s->{ring}_now & 3u]",
        f"foc_ahead_{runtime(plan.arithmetic)}({far}, s->{ring}_now);",
        f"foc_rest_{runtime(plan.arithmetic)}({far});",
        _near(plan, near, f"{name}_near", history) if near else None,
    )


def _near(plan: Plan, near: Sum, weights: str, history: str) -> NearText:
    count, at, parts = near.last + 1, 0, []
    for block in near.blocks:
        wide = f"({block.sum.ctype})" if not block.sum.floating else ""
        products = [f"{wide}w[{at + i}] * x[{near.last - block.last + i}]" for i in range(len(block.weights))]
        parts += products if plan.floating else [_shifted_sum(products, block)]
        at += len(block.weights)
    call = f"foc_latest_{runtime(plan.arithmetic)}(copy, {count}, {history})"
    return NearText(plan.error.ctype, count, call, weights, parts)


def _shifted_sum(products: list[str], block: Block) -> str:
    """Their sum, three to a line below each other, as it stands behind "sum += "."""
    begins = shifted("", block.sum.ctype, block.align).split(",")[0].rstrip(")")
    beside = "\n" + " " * (len("    sum += ") + len(begins))
    lines = [" + ".join(products[i : i + 3]) for i in range(0, len(products), 3)]
    return shifted(f"{beside}+ ".join(lines), block.sum.ctype, block.align)


def _far_tables(plan: Plan, table: Sum, name: str, about: list[str], ahead: LookAhead) -> list[TableText]:
    ctype = plan.error.ctype
    groups = [
        Group(_block_about(plan, block), rows(weights, ctype))
        for block, weights in zip(ahead.far, ahead.weights)
    ]
    count = sum(map(len, ahead.weights))
    word, held = size_of(ctype), size_of(ahead.far[0].sum.ctype)
    costs = (
        f"{ahead.table_bytes(word)} bytes of tables and {ahead.state_bytes(held)} of state beside the ring"
    )
    more = "Zeros fill up every block for the four sums that look ahead."
    plain = f"This takes {costs}; the plain form {plain_bytes(plan, table)} and none."
    lines = [f"{_run_text(run):<28} /* step {_step(ahead, i)} */" for i, run in enumerate(ahead.runs)]
    slices = [", ".join(map(str, ahead.slices))]
    return [
        TableText([*about, more, plain], f"FOC_WORDS {ctype}", f"{name}_far", count, groups),
        TableText(
            ["What each step of a group of four does of it."],
            "foc_run",
            f"{name}_runs",
            len(lines),
            [Group("weights from, tiles, tiles back, shift, whether the block ends", lines)],
        ),
        TableText(
            ["The run with which each of the four steps begins, and where the last of them ends."],
            "uint8_t",
            f"{name}_slices",
            len(ahead.slices),
            [Group("", slices)],
        ),
    ]


def _run_text(run: Run) -> str:
    return f"{{{run.weights}, {run.tiles}, {run.back}, {run.shift}, {int(run.ends)}}},"


def _step(ahead: LookAhead, run: int) -> int:
    return sum(first <= run for first in ahead.slices[1:-1])


def _weights(plan: Plan, blocks: list[Block], name: str, about: list[str]) -> TableText:
    ctype = plan.error.ctype
    groups = [Group(_block_about(plan, block), rows(block.weights[::-1], ctype)) for block in blocks]
    return TableText(about, ctype, name, sum(len(block.weights) for block in blocks), groups)


def _block_about(plan: Plan, block: Block) -> str:
    if plan.floating:
        return ""
    lags = f"lag {block.last}" if block.first == block.last else f"lags {block.last} ... {block.first}"
    return f"{lags}: counts of 2^{exponent(block.lsb)}"


def _blocks(table: Sum, blocks: list[Block], name: str) -> TableText:
    about = [
        (
            f"Its blocks, whose sums meet at counts of {scale(table.total.lsb)};"
            " beside each the most its sum can be."
        )
    ]
    lines = []
    for block in blocks:
        shifted("", block.sum.ctype, block.align)  # refuses what is too long
        entry = f"{{{block.last}, {len(block.weights)}, {block.align}}},"
        lines.append(f"{entry:<16} /* {bound(block.sum, 'sum')} */")
    head = "oldest lag, taps, shift"
    return TableText(about, "foc_block", name, len(blocks), [Group(head, lines)])


@dataclass(frozen=True)
class ScheduleText:
    """The gain schedule: what it is, its tables, the call that reads it, and when its signal is beyond its
    breakpoints (empty where it cannot be).
    """

    about: list[str]
    tables: list[TableText]
    call: str
    outside: str


def schedule_text(plan: Plan) -> ScheduleText:
    """The schedule of a plan that has one."""
    made = [
        TableText([], ctype, f"{plan.name}_{key}", len(values), [Group(about, rows(values, ctype))])
        for about, ctype, key, values in _columns(plan)
    ]
    names = ", ".join(table.name for table in made)
    signal = "sched" if plan.floating else "at"
    call = f"foc_schedule_{runtime(plan.arithmetic)}({signal}, {names}, {len(present(plan.schedule).gains)})"
    return ScheduleText(_schedule_about(plan), made, call, _outside(plan, signal))


def _schedule_about(plan: Plan) -> list[str]:
    schedule = present(plan.schedule)
    factor = 0.5 * plan.sample_time if plan.integrator else 1.0
    at = [quantity(point * schedule.signal.lsb) for point in schedule.breakpoints]
    gains = [quantity(gain * plan.gain.lsb / factor) for gain in schedule.gains]
    pairs = wrapped([f"{point}: {gain}" for point, gain in zip(at, gains)], separator=",  ")
    unit = f" ({comment(schedule.signal.unit)})" if schedule.signal.unit else ""
    half_step = " The table holds the gains times h/2." if plan.integrator and not plan.tuning else ""
    head = f"Gain schedule, linear between breakpoints{unit} and held beyond them.{half_step}"
    return [head, *(line + "," * (line != pairs[-1]) for line in pairs)]


def _columns(plan: Plan) -> list[tuple[str, str, str, tuple[Any, ...]]]:
    """(comment, type, name, values) of each table; the gains have one more entry than slopes and shifts."""
    schedule, ctype = present(plan.schedule), plan.gain.ctype
    if plan.tuning and plan.floating:
        return [("", ctype, "points", schedule.breakpoints)]
    if plan.floating:
        named = ("points", schedule.breakpoints), ("gains", schedule.gains), ("slopes", schedule.slopes)
        return [("", ctype, key, values) for key, values in named]
    held = scale(schedule.signal.lsb, schedule.signal.unit)
    points = (f"counts of {held}", ctype, "points", schedule.breakpoints)
    if plan.tuning:
        return [points, ("of the slopes", "uint8_t", "shifts", schedule.slope_shifts)]
    return [
        points,
        (f"counts of {scale(plan.gain.lsb)}", ctype, "gains", schedule.gains),
        ("from each breakpoint to the next, before its shift", ctype, "slopes", schedule.slopes),
        ("", "uint8_t", "shifts", schedule.slope_shifts),
    ]


def _outside(plan: Plan, signal: str) -> str:
    """The condition of the flag; what the clamp of the signal rules out is left out."""
    schedule, points = present(plan.schedule), f"{plan.name}_points"
    found = []
    if plan.floating or schedule.signal.low < schedule.breakpoints[0]:
        found.append(f"{signal} < {points}[0]")
    if plan.floating or schedule.signal.high > schedule.breakpoints[-1]:
        found.append(f"{signal} > {points}[{len(schedule.breakpoints) - 1}]")
    return " || ".join(found)
