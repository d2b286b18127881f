"""Fronts of error against cost, the shortest memory that serves, and the sentence that says so."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from focgen.control.controller import Controller
from focgen.studies.model import Band, Ideal, Row
from focgen.studies.spectrum import PHASE

SETTLING = 0.03  # of the ideal's
COSTS = ("multiplies", "ram_bytes", "flash_bytes", "instructions", "cycles")
_ROUNDS = 7


def pareto(rows: Sequence[Row], sample_time: float) -> dict[str, tuple[int, ...]]:
    """For each cost the rows at ``sample_time`` that none beats in it and in error, cheapest first."""
    return {cost: _front(rows, sample_time, cost) for cost in COSTS}


def _front(rows: Sequence[Row], sample_time: float, cost: str) -> tuple[int, ...]:
    def place(i: int) -> tuple[float, float]:
        return getattr(rows[i], cost), rows[i].error

    able = [
        i
        for i, row in enumerate(rows)
        if row.sample_time == sample_time and row.error is not None and getattr(row, cost) is not None
    ]
    found: list[int] = []
    for i in sorted(able, key=place):
        if not found or rows[i].error < rows[found[-1]].error:
            found.append(i)
    return tuple(found)


@dataclass(frozen=True)
class Wish:
    """What a memory must do: phase within 2° over the band, and where the loop is known the mean settling
    time within 3 % of ``ideal``.
    """

    band: Band
    ideal: Ideal

    def kept(self, row: Row) -> bool:
        """Whether ``row`` does it."""
        if row.phase_error_deg is None or row.phase_error_deg > PHASE:
            return False
        loop = self.ideal.loop
        if loop is None or loop.settling_s is None:
            return True
        settled = row.settling_s is not None and row.stable
        return bool(settled and abs(row.settling_s - loop.settling_s) <= SETTLING * loop.settling_s)

    def __str__(self) -> str:
        said = f"the phase within {PHASE:g}° above {self.band.low:.2g} rad/s"
        if self.ideal.loop is not None and self.ideal.loop.settling_s is not None:
            said += f" and the settling within {100 * SETTLING:.0f} % of ideal"
        return said


def shortest(
    rows: Sequence[Row], wish: Wish, more: Callable[[int], Row]
) -> tuple[Row | None, tuple[Row, ...]]:
    """The shortest short memory that keeps the wish, found by halving between ``rows``.

    ``rows``: short memories of one arithmetic and sample time; ``more`` measures another length. The second
    result are the rows that it took.
    """
    tried = sorted((r for r in rows if r.error is not None), key=lambda r: r.length)
    best = next((r for i, r in enumerate(tried) if all(map(wish.kept, tried[i:]))), None)
    if best is None:
        return None, ()
    low, made = max((r.length for r in tried if r.length < best.length), default=0), []
    for _ in range(_ROUNDS):
        middle = _round(low, best.length)
        if middle is None:
            break
        made.append(more(middle))
        low, best = (low, made[-1]) if wish.kept(made[-1]) else (middle, best)
    return best, tuple(made)


def _round(low: int, high: int) -> int | None:
    """A length between, of two digits at most; None where none is left."""
    unit = 10 ** max(0, len(str(high - 1)) - 2)
    middle = round(0.5 * (low + high) / unit) * unit
    return middle if low < middle < high else None


def leanest(rows: Sequence[Row], wish: Wish) -> Row | None:
    """The row with the fewest bytes of state that keeps the wish."""
    able = [row for row in rows if row.ram_bytes is not None and wish.kept(row)]
    return min(able, key=lambda row: (row.ram_bytes, row.multiplies), default=None)


def sentence(
    controller: Controller,
    wish: Wish,
    short: Row | None,
    exponential: Row | None,
    asked: set[str],
    longest: int,
) -> str:
    """The recommendation."""
    able = {"short": short, "exponential": exponential}
    other = ""
    if exponential is not None:
        price = f"{exponential.ram_bytes} B ({exponential.states} states, {_work(exponential)})"
        other = f"the exponential form does it in {price}"
    where = f"in {controller.arithmetic} at {controller.sample_time:g} s"
    if short is not None:
        first = f"L = {short.length} keeps {wish} ({where}), at {short.ram_bytes} B and {_work(short)}"
        return f"{first}; {other}." if other else f"{first}."
    if "short" in asked and other:
        return f"No length up to L = {longest} keeps {wish} ({where}); {other}."
    if other:
        return f"To keep {wish} ({where}), {other}."
    return f"None of the {' and '.join(sorted(asked & set(able)))} memories looked at keeps {wish} ({where})."


def _work(row: Row) -> str:
    """Multiplications, and cycles where they are known."""
    cycles = "" if row.cycles is None else f", {row.cycles:.0f} cycles"
    return f"{row.multiplies} multiplies{cycles}"
