"""Fronts of error against cost, the shortest memory that serves, and the sentence that says so."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from focgen.control.controller import Controller
from focgen.present import present
from focgen.studies.results import Band, Ideal, Row
from focgen.studies.spectrum import PHASE

SETTLING = 0.03  # of the ideal's
COSTS = ("multiplies", "ram_bytes", "flash_bytes", "instructions", "cycles")
_ROUNDS = 7


def pareto(rows: Sequence[Row], sample_time: float) -> dict[str, tuple[int, ...]]:
    """For each cost the rows at ``sample_time`` that none beats in it and in error, cheapest first."""
    return {cost: _front(rows, sample_time, cost) for cost in COSTS}


def _length(row: Row) -> int:
    """Of a row of short memory."""
    return present(row.length)


def _front(rows: Sequence[Row], sample_time: float, cost: str) -> tuple[int, ...]:
    def place(i: int) -> tuple[float, float]:
        return getattr(rows[i], cost), present(rows[i].error)

    able = [
        i
        for i, row in enumerate(rows)
        if row.sample_time == sample_time and row.error is not None and getattr(row, cost) is not None
    ]
    found: list[int] = []
    for i in sorted(able, key=place):
        if not found or present(rows[i].error) < present(rows[found[-1]].error):
            found.append(i)
    return tuple(found)


@dataclass(frozen=True)
class Requirement:
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
        if row.settling_s is None or not row.stable:
            return False
        return abs(row.settling_s - loop.settling_s) <= SETTLING * loop.settling_s

    def __str__(self) -> str:
        said = f"the phase within {PHASE:g}° above {self.band.low:.2g} rad/s"
        if self.ideal.loop is not None and self.ideal.loop.settling_s is not None:
            said += f" and the settling within {100 * SETTLING:.0f} % of ideal"
        return said


def shortest(
    rows: Sequence[Row], requirement: Requirement, more: Callable[[int], Row]
) -> tuple[Row | None, tuple[Row, ...]]:
    """The shortest short memory that keeps the requirement, found by halving between ``rows``.

    ``rows``: short memories of one arithmetic and sample time; ``more`` measures another length. The second
    result are the rows that it took.
    """
    tried = sorted((r for r in rows if r.error is not None), key=_length)
    best = next((r for i, r in enumerate(tried) if all(map(requirement.kept, tried[i:]))), None)
    if best is None:
        return None, ()
    low, made = max((_length(r) for r in tried if _length(r) < _length(best)), default=0), []
    for _ in range(_ROUNDS):
        middle = _round(low, _length(best))
        if middle is None:
            break
        made.append(more(middle))
        low, best = (low, made[-1]) if requirement.kept(made[-1]) else (middle, best)
    return best, tuple(made)


def _round(low: int, high: int) -> int | None:
    """A length between, of two digits at most; None where none is left."""
    unit = 10 ** max(0, len(str(high - 1)) - 2)
    middle = round(0.5 * (low + high) / unit) * unit
    return middle if low < middle < high else None


def leanest(rows: Sequence[Row], requirement: Requirement) -> Row | None:
    """The row with the fewest bytes of state that keeps the requirement."""
    able = [row for row in rows if row.ram_bytes is not None and requirement.kept(row)]
    return min(able, key=lambda row: (row.ram_bytes, row.multiplies), default=None)


def sentence(
    controller: Controller,
    requirement: Requirement,
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
        other = f"exponential form does it in {price}."
    where = f"in {controller.arithmetic} at {controller.sample_time:g} s"
    if short is not None:
        first = f"L = {short.length} keeps {requirement} ({where}), at {short.ram_bytes} B and {_work(short)}"
        return f"{first}. The {other}" if other else f"{first}."
    if "short" in asked and other:
        return f"No length up to L = {longest} keeps {requirement} ({where}). The {other}"
    if other:
        return f"To keep {requirement} ({where}), the {other}"
    looked_at = " and ".join(sorted(asked & set(able)))
    return f"None of the {looked_at} memories looked at keeps {requirement} ({where})."


def _work(row: Row) -> str:
    """Multiplications, and cycles where they are known."""
    cycles = "" if row.cycles is None else f", {row.cycles:.0f} cycles"
    return f"{row.multiplies} multiplies{cycles}"
