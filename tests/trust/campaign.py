"""One run: every fault in a loop of its own, side by side, with the same C."""

from __future__ import annotations

import math
import re
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from focgen import load
from focgen.codegen.generate import generate
from focgen.control.controller import ControllerRanges
from focgen.control.equilibrium import Equilibrium
from focgen.loop.chain import chain
from focgen.loop.run import LoopRun, run_loop
from tests.conftest import paper_controller, paper_rig
from tests.trust.faults import FAULTS, LEVEL, Fault
from tests.trust.seat import Seat

BEGIN, REST, LAST = 5.0, 8.0, 6.0
"""s: ahead of a fault, after it until everything is started anew by ``reset``, and from there to the end."""
BAND = 0.001
"""Recovered is what stays so near to its set point, 1/mm: 5 % of the range."""
LIMITS = (0.0, 2.0)
"""Of the output, V: what the set point of saturation does not reach."""


@dataclass(frozen=True)
class Row:
    """What one fault did to one arithmetic.

    ``recovery``: s from the fault's end until the loop is within ``BAND`` for good; inf where it never is.
    ``windup``: s in which the command stays at a limit though the output is beyond its set point.
    ``compared`` samples have a reference, of which ``wrong`` differ in a bit. ``owed``: whether these times
    are to be short.
    """

    fault: str
    arithmetic: str
    samples: int
    finite: bool
    within: bool
    compared: int
    wrong: int
    recovery: float
    windup: float
    owed: bool = True

    @property
    def holds(self) -> bool:
        """Finite, within limits, equal; and recovered without windup where that is owed."""
        sound = self.finite and self.within and self.wrong == 0 and self.compared > 0
        return sound and (not self.owed or (self.recovery < REST and self.windup < 0.1))


def controller(memory: str = "short"):
    """The paper's, its output limited to ``LIMITS``."""
    made = paper_controller(100 if memory == "short" else 1000)
    spans = made.ranges
    ranges = ControllerRanges(spans.reference, spans.measurement, LIMITS, spans.schedule)
    return replace(made, ranges=ranges)


class _Crew:
    """All seats, as the loop's stepper; column i has fault i."""

    def __init__(self, seats: list[Seat], faults: list[Fault], again: int):
        self.seats, self.faults, self.again, self.k = seats, faults, again, 0

    def step(self, reference, measurement, schedule):
        triples = zip(self.seats, self.faults, reference, measurement, schedule)
        applied = np.array([self._one(*map(_plain, triple)) for triple in triples])
        self.k += 1
        return applied

    def _one(self, seat: Seat, fault: Fault, ref: float, y: float, p: float) -> float:
        k = self.k
        fault.before(k, seat, ref, y)
        if k == self.again:
            seat.reset(ref, y, seat.u)
        seen = fault.measured(k, y)
        floating = seat.plan.floating
        if fault.called(k):
            seat.step(ref, seen, fault.scheduled(k, p, floating))
        return fault.applied(k, seat.u, seat)


def _plain(value):
    return value if isinstance(value, (Seat, Fault)) else float(value)


def campaign(arithmetic: str, seconds: float, seed: int, memory: str = "short") -> list[Row]:
    """All faults, each for ``seconds``, in one arithmetic. Raises nothing: what fails is in the rows."""
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as folder:
        generate(controller(memory), folder, arithmetic, memory)
        loaded = load(folder)
        header = (Path(folder) / "spba.h").read_text(encoding="utf-8")
    h = loaded.plan.sample_time
    begin, end = round(BEGIN / h), round((BEGIN + seconds) / h)
    again, samples = end + round(REST / h), end + round((REST + LAST) / h)
    _declare(loaded)
    size = int(re.search(r"SPBA_SAVED_BYTES\s+\(?(\d+)", header)[1])
    faults = [kind(begin, end, np.random.default_rng(rng.integers(1 << 32))) for kind in FAULTS]
    seats = [Seat(loaded, size) for _ in faults]
    times = np.arange(samples)
    plain = np.where(times < begin // 2, 0.5 * LEVEL, np.where(times < again + 200, LEVEL, 0.6 * LEVEL))
    wanted = np.array([[f.reference(k, r) for f in faults] for k, r in enumerate(plain.tolist())])
    ready = chain(paper_rig(), h, samples)
    rest = Equilibrium(0.0, 0.0, 0.0)
    run = run_loop(ready, _Crew(seats, faults, again), wanted, rest, 1, True, False)
    rows = [_row(run, i, seats[i], fault, arithmetic, again) for i, fault in enumerate(faults)]
    return [replace(row, owed=memory in fault.owed) for row, fault in zip(rows, faults)]


def _declare(loaded) -> None:
    """Save and restore beside what a loaded controller calls anyway."""
    machine, name = loaded._machine, loaded.name
    machine._ffi.cdef(
        f"void {name}_save(const void *, uint8_t *); uint8_t {name}_restore(void *, const uint8_t *);"
    )
    machine._library_save = getattr(machine._library, f"{name}_save")
    machine._library_restore = getattr(machine._library, f"{name}_restore")


def _row(run: LoopRun, i: int, seat: Seat, fault: Fault, arithmetic: str, again: int) -> Row:
    raw = np.array([u for lane in seat.lanes for u, _ in lane.answers], dtype=float)
    form, h = seat.plan.output, run.sample_time
    off = np.abs(run.output[fault.end : again, i] - run.reference[fault.end : again, i]) > BAND
    recovery = (np.flatnonzero(off)[-1] + 1) * h if off.any() else 0.0
    return Row(
        fault.about,
        arithmetic,
        len(raw),
        bool(np.isfinite(raw).all()),
        bool(((raw >= form.low) & (raw <= form.high)).all()),
        *seat.compared(),
        math.inf if off[-1] else float(recovery),
        h * wound_up(*(signal[fault.end : again, i] for signal in (run.command, run.output, run.reference))),
    )


def wound_up(command: np.ndarray, output: np.ndarray, reference: np.ndarray) -> int:
    """The most samples in a row in which the command stays at a limit, although the output is beyond its set
    point by more than ``BAND`` and asks for the other way; arrays (m,)."""
    near = 1e-3 * (LIMITS[1] - LIMITS[0])
    high = (command > LIMITS[1] - near) & (output > reference + BAND)
    low = (command < LIMITS[0] + near) & (output < reference - BAND)
    longest = now = 0
    for one in high | low:
        now = now + 1 if one else 0
        longest = max(longest, now)
    return longest


def table(rows: list[Row]) -> str:
    """The rows as a table of Markdown: recovery by fault and arithmetic, and what else was asked."""
    names = list(dict.fromkeys(row.arithmetic for row in rows))
    lines = [f"| fault | {' | '.join(names)} | windup | samples compared | differing |"]
    lines.append("|" + "---|" * (len(names) + 4))
    for fault in dict.fromkeys(row.fault for row in rows):
        of = [row for row in rows if row.fault == fault]
        cells = [_cell([row for row in of if row.arithmetic == name]) for name in names]
        windup, compared = max(row.windup for row in of), sum(row.compared for row in of)
        wrong = sum(row.wrong for row in of)
        lines.append(f"| {fault} | {' | '.join(cells)} | {windup:.2f} s | {compared} | {wrong} |")
    return "\n".join(lines)


def _cell(rows: list[Row]) -> str:
    worst = max(row.recovery for row in rows)
    said = f"{worst:.2f} s" if math.isfinite(worst) else "never"
    finite, within = all(row.finite for row in rows), all(row.within for row in rows)
    return said + ("" if finite else ", NOT FINITE") + ("" if within else ", BEYOND ITS LIMITS")
