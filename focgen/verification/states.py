"""The bytes of a controller's state beside what the reference leaves behind, member by member."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from focgen.arrays import Array, Numbers
from focgen.codegen.banks import means, rests
from focgen.codegen.kernels import PORTABLE, Kernels, named_sums
from focgen.codegen.lookahead import AHEAD, LookAhead
from focgen.codegen.state import Member, counts_limits, members, size_of
from focgen.plan.counts import taken_in
from focgen.plan.ending import Ending
from focgen.plan.formats import shift
from focgen.plan.plan import Plan
from focgen.present import present

_DTYPES = {"float": np.float32, "double": np.float64}


def wrong_member(plan: Plan, state: bytes, ending: Ending, kernels: Kernels = PORTABLE,
                 alignment: int = 8) -> str | None:  # fmt: skip
    """The first member of a state that is not the reference's, in words; None where all are. +0 and −0 are
    alike. Types are aligned to their size, but to no more than ``alignment`` bytes: 1 on an AVR.
    """
    expected, end = remembered(plan, ending, kernels), 0
    for member, place in _places(members(plan, kernels), alignment):
        kind = np.dtype(_DTYPES.get(member.ctype, member.ctype.removesuffix("_t")))
        end = place + kind.itemsize * member.count
        if end > len(state):
            return f"the state ends before its member {member.name}"
        found = np.frombuffer(state, kind, member.count, place)
        wanted = np.broadcast_to(np.asarray(expected[member.name]).astype(kind), found.shape)
        wrong = np.flatnonzero(found != wanted)
        if wrong.size:
            at, slot = wrong[0], f"[{wrong[0]}]" if member.array else ""
            return f"state.{member.name}{slot} is {found[at]}, the reference's {wanted[at]}"
    return None


def _places(found: tuple[Member, ...], alignment: int) -> Iterator[tuple[Member, int]]:
    """Every member and its offset in bytes."""
    at = 0
    for member in found:
        size = size_of(member.ctype)
        step = min(size, alignment)
        at = -(-at // step) * step
        yield member, at
        at += size * member.count


def remembered(plan: Plan, ending: Ending, kernels: Kernels = PORTABLE) -> dict[str, object]:
    """What every member of the state must be, by name."""
    found = {
        "integral": ending.integral,
        "increment": ending.increment,
        "resting": ending.filtered_rest,
        "starting": int(ending.starting),
        "inner": ending.inner,
        "inner_input": ending.r,
        "carry": ending.carry,
        "output": ending.output,
        "flags": ending.flags,
        **ending.aim,
    }
    if ending.applied:
        now = ending.applied
        found |= {"gains": now.gains, "slopes": now.slopes, "u_min": now.low, "u_max": now.high}
        if counts_limits(plan):
            ends = (taken_in(np.float32(end), present(plan.integrator).state) for end in (now.low, now.high))
            found |= dict(zip(("low", "high"), ends))
    for history, past, rest in (("error", ending.error, ending.error_rest),
                                ("filtered", ending.filtered, ending.filtered_rest)):  # fmt: skip
        size = kernels.slots(plan, history)
        start = size - 1 if kernels.grouped(plan, history) else 0
        found[history], found[f"{history}_now"] = _ring(past, rest, size, start)
    for table in plan.sums:
        for i in range(len(table.banks)):
            found[means(table, i)] = ending.means[table.name, i]
            found[rests(table, i)] = ending.rests[table.name, i]
    for name, table in named_sums(plan).items():
        ahead = kernels.ahead(plan, table)
        if ahead:
            of_error = table.history == "error"
            past = ending.error if of_error else ending.filtered
            rest = ending.error_rest if of_error else ending.filtered_rest
            found[f"{name}_ahead"] = looked_ahead(ahead, past, rest)
    return found


def _ring(past: Numbers, rest: Any, size: int, start: int) -> tuple[Numbers, int]:
    """A ring that held ``rest`` alone, and has taken the samples since from the slot after ``start`` on."""
    ring = np.full(size, rest)
    slots = (start + 1 + np.arange(len(past))) % size
    ring[slots[-size:]] = past[-size:]
    return ring, (start + len(past)) % size


def looked_ahead(ahead: LookAhead, past: Numbers, rest: Any) -> Numbers:
    """The sums that look ahead after the samples ``past``, before which all were ``rest``: of the present
    group, and as far as they have been made of the next.
    """
    group, phase = divmod(len(past) - 1, AHEAD)
    weights = np.array([w for block in ahead.weights for w in block], past.dtype)
    whole = _runs(ahead, weights, ahead.slices[AHEAD], AHEAD * group, past, rest)
    part = _runs(ahead, weights, ahead.slices[phase + 1], AHEAD * (group + 1), past, rest)
    return np.concatenate([whole[:AHEAD], part])


def _runs(ahead: LookAhead, weights: Array, count: int, begin: int, past: Numbers, rest: Any) -> Numbers:
    """The sums of a group that begins at sample ``begin`` after so many runs: of its complete blocks and, in
    fixed point, of the open one; floating sums are one block.
    """
    complete, work = (np.zeros(AHEAD, past.dtype) for _ in range(2))
    for run in ahead.runs[:count]:
        taken = begin - AHEAD * run.back + np.arange(AHEAD * run.tiles)
        x = np.where(taken < 0, rest, past[np.clip(taken, 0, None)] if len(past) else rest)
        for i in range(AHEAD):
            products = weights[run.weights + AHEAD - i :][: x.size] * x
            work[i] = np.add.accumulate(np.concatenate([work[i : i + 1], products]))[-1]
        if run.ends and past.dtype.kind != "f":
            complete, work = complete + shift(work, run.shift), np.zeros(AHEAD, past.dtype)
    return work if past.dtype.kind == "f" else np.concatenate([complete, work])
