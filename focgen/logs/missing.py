"""Readings that are missing: which roles and rows of a run can be kept."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from focgen.arrays import Array, Bools
from focgen.logs.clock import SHORT
from focgen.logs.notes import Note

_INPUTS = {"command": "pressure", "pressure": "command"}  # each can stand in for the other


@dataclass(frozen=True)
class Kept:
    """``roles``: those kept; ``rows``: a mask (m,) of the rows kept; ``notes``: what was left out."""

    roles: tuple[str, ...]
    rows: Bools
    notes: tuple[str, ...]


def keep(values: Mapping[str, Array], time: Array) -> Kept:
    """What is kept of signals (m,) by role, some with readings missing (NaN).

    Short stretches are kept, to be bridged. Rows of a long one are cut out; or its role is, where another can
    do without it and more readings are left so. No row is kept without an output and an input.
    """
    gone = {role: long_stretches(y) for role, y in values.items()}
    roles = [role for role in values if not gone[role].all()]
    if "output" not in roles or not set(_INPUTS) & set(roles):
        return Kept(tuple(roles), np.zeros(len(time), bool), ())
    empty = [role for role in values if role not in roles]
    notes: list[str] = [f"{role} has no reading at all, taken as not logged" for role in empty]
    rows = np.ones(len(time), bool)
    for role in sorted((r for r in roles if gone[r].any()), key=lambda r: _dispensable(r, roles)):
        place = f"at {time[np.argmax(gone[role])]:g} s"
        left = rows & ~gone[role]
        if _dispensable(role, roles) and len(roles) * left.sum() < (len(roles) - 1) * rows.sum():
            roles.remove(role)
            place = f"{100.0 * np.mean(gone[role]):.0f} %, the first {place}"
            notes.append(Note(f"{role} left out, too many of its readings are missing", 1, place))
        else:
            rows, what = left, f"readings of {role} missing for long, their rows cut out"
            notes.append(Note(what, _stretches(gone[role]), place))
    return Kept(tuple(roles), rows, tuple(notes))


def long_stretches(y: Array) -> Bools:
    """Which of the missing readings of ``y`` (m,) cannot be bridged, as a mask (m,).

    More than ``SHORT`` of its own periods without a reading are long, and so is what has no reading on one
    side.
    """
    mask = np.isnan(y)
    if not mask.any():
        return mask
    there = np.flatnonzero(~mask)
    if len(there) < 2:
        return mask
    gaps = np.diff(there)
    longest = (SHORT + 1) * float(np.median(gaps))
    for begin, gap in zip(there[:-1][gaps > 1], gaps[gaps > 1]):
        mask[begin + 1 : begin + gap] = gap > longest
    return mask


def _dispensable(role: str, roles: Collection[str]) -> bool:
    return role in ("curvature", "reference") or _INPUTS.get(role) in roles


def _stretches(mask: Bools) -> int:
    return int(np.sum(np.diff(mask.astype(int), prepend=0) == 1))
