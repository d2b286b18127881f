"""The banks of an exponential memory as C: their tables, their state, how they are called and settled."""

from __future__ import annotations

import math
from dataclasses import dataclass

from focgen.codegen.expressions import bound, converted, scaled_up, shifted
from focgen.codegen.literals import literal, scale
from focgen.plan.formats import runtime
from focgen.plan.plan import Bank, Plan, Sum

NAMES = {"direct": "numerator", "rest": "integrand", "feedback": "denominator"}
"""What a plan's sums are called in C."""


@dataclass(frozen=True)
class BankText:
    """One bank: its table (``kind``, ``name``, ``rows`` under ``about``), its state, and the code that uses
    them.

    ``settled`` is what every mean is set to for a history that has been constant for ever; ``compensated``
    has rests beside the means.
    """

    name: str
    kind: str
    count: int
    about: list[str]
    rows: list[str]
    means: str
    rests: str
    call: str
    call_about: str
    settled: str
    zero: str


def bank_texts(plan: Plan, table: Sum) -> list[BankText]:
    """The banks of a sum."""
    return [_text(plan, table, bank, i) for i, bank in enumerate(table.banks)]


def label(table: Sum, index: int, what: str = "modes") -> str:
    """The bank's name within the controller's: its sum, whether it is the slower one of its term, and the
    number of the term where there are several.
    """
    orders = list(dict.fromkeys(bank.order for bank in table.banks))
    number = f"_{orders.index(table.banks[index].order) + 1}" if len(orders) > 1 else ""
    return f"{NAMES[table.name]}_{'slow_' if _second(table, index) else ''}{what}{number}"


def _second(table: Sum, index: int) -> bool:
    """Whether the bank holds the slower modes of a term that has two banks."""
    return index > 0 and table.banks[index - 1].order == table.banks[index].order


def means(table: Sum, index: int) -> str:
    """The member that holds its means."""
    return label(table, index, "means")


def rests(table: Sum, index: int) -> str:
    """The member that holds what compensation keeps."""
    return label(table, index, "rests")


def time_constant(plan: Plan, rate: float) -> float:
    """−h / ln p, in s: how long a mode remembers."""
    return -plan.sample_time / math.log1p(-rate)


def _text(plan: Plan, table: Sum, bank: Bank, index: int) -> BankText:
    name = f"{plan.name}_{label(table, index)}"
    return BankText(
        name=name,
        kind=_kind(plan, bank),
        count=bank.modes,
        about=_about(plan, table, index),
        rows=_rows(plan, bank),
        means=means(table, index),
        rests=rests(table, index) if bank.compensated else "",
        call=_call(plan, table, bank, index, name),
        call_about=bound(bank.sum, "sum of the modes"),
        settled=_settled(plan, table, bank),
        zero=literal(0, bank.state.ctype),
    )


def _slow(plan: Plan, bank: Bank) -> bool:
    """Whether this is the bank of slow modes of an arithmetic that has a type for them."""
    return bank.compensated or (runtime(plan.arithmetic) == "q15" and bank.state.bits == 64)


def _kind(plan: Plan, bank: Bank) -> str:
    slow = "slow_" if _slow(plan, bank) and runtime(plan.arithmetic) == "q15" else ""
    return f"foc_{slow}mode_{runtime(plan.arithmetic)}"


def _about(plan: Plan, table: Sum, index: int) -> list[str]:
    bank = table.banks[index]
    which = "slow modes" if _second(table, index) else "modes"
    of = "the change of its history" if bank.differences == 2 else "its history"
    head = f"How the {NAMES[table.name]}'s s^{bank.order:g} remembers {of}:"
    lines = [head, f"{which} with their rate and weight, and beside each its time constant."]
    if plan.floating:
        return lines
    return [
        *lines,
        f"Rates are counts of {scale(bank.rate.lsb)}, weights of {scale(bank.lsb)};",
        f"{bound(bank.state, 'mean')}, {bound(bank.drive, 'drive')}.",
    ]


def _rows(plan: Plan, bank: Bank) -> list[str]:
    pairs = [
        (literal(rate, bank.rate.ctype), literal(weight, bank.drive.ctype))
        for rate, weight in zip(bank.rates, bank.weights)
    ]
    first, second = (max(len(pair[i]) for pair in pairs) for i in (0, 1))
    times = [f"{time_constant(plan, q):.4g} s" for q in bank.real_rates]
    return [f"{{{a:>{first}}, {b:>{second}}}}, /* {t} */" for (a, b), t in zip(pairs, times)]


def ring_of(plan: Plan, history: str) -> tuple[str, str]:
    """The member that keeps a history, and the macro of how many samples it holds."""
    member, size = ("error", "ERRORS") if history == "error" else ("filtered", "FILTERED")
    return member, f"{plan.name.upper()}_{size}"


def _past(plan: Plan, table: Sum, lag: int) -> str:
    ring, size = ring_of(plan, table.history)
    return f"s->{ring}[foc_ring_slot(s->{ring}_now, {size}, {lag})]"


def inputs(plan: Plan, table: Sum) -> list[str]:
    """Declarations of what drives the banks of a sum: the sample before, and for orders above 1 its
    change."""
    ctype, needed = plan.error.ctype, {bank.differences for bank in table.banks}
    lines = [f"const {ctype} past = {_past(plan, table, 1)};"] if needed else []
    if 2 in needed:
        wide = {"q31": "int64_t", "q15": "int32_t"}.get(runtime(plan.arithmetic), ctype)
        lines.append(f"const {wide} change = {converted('past', ctype, wide)} - {_past(plan, table, 2)};")
    return lines


def _call(plan: Plan, table: Sum, bank: Bank, index: int, name: str) -> str:
    slow = "slow_" if _slow(plan, bank) else ""
    states = f"s->{means(table, index)}" + (f", s->{rests(table, index)}" if bank.compensated else "")
    both = f", {bank.up}, {bank.to_drive}"
    shifts = {"q31": f"{both}, {bank.rate_shift}", "q15": both}.get(runtime(plan.arithmetic), "")
    u = "past" if bank.differences == 1 else "change"
    call = f"foc_{slow}modes_{runtime(plan.arithmetic)}({name}, {states}, {bank.modes}, {u}{shifts})"
    return shifted(call, bank.sum.ctype, bank.align)


def _settled(plan: Plan, table: Sum, bank: Bank) -> str:
    """The mean of what has been constant for ever: differences of it are 0."""
    value, ctype = ("e" if table.history == "error" else "v"), plan.error.ctype
    if bank.differences == 2:
        return literal(0, bank.state.ctype)
    if plan.floating:
        return value
    return converted(value, ctype, bank.state.ctype) + scaled_up(bank.state.ctype, bank.up)


def state_about(plan: Plan, table: Sum, bank: Bank) -> str:
    """What the means are, for the header."""
    unit = "" if plan.floating else f", counts of {scale(bank.state.lsb, plan.error.unit)}"
    of = "error" if table.history == "error" else "filtered error"
    change = "change of the " if bank.differences == 2 else ""
    return f"the modes' means of the {change}{of}{unit}"
