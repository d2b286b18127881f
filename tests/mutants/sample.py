"""Which changes are tried: drawn at random, as many of every room."""

from __future__ import annotations

import random
from itertools import zip_longest
from pathlib import Path

from tests.mutants import of_c, of_python
from tests.mutants.change import Change, read

_PRINTED = (
    "controller.c", "controller.h", "memory_exponential.c", "setpoint.c", "tuned.c", "selftest.c", "main.c",
)  # fmt: skip
ROOMS = {
    "fractional": ("focgen/fractional/*.py",),
    "plan": ("focgen/plan/*.py",),
    "templates": tuple(f"templates/{name}.jinja" for name in _PRINTED),
    "runtime": ("c_runtime/*.h",),
}  # fmt: skip
"""The rooms, and the files that end in somebody's firmware or decide what does."""


def files(root: Path, room: str) -> list[str]:
    """The files of a room, in the order of their names."""
    return sorted(str(p.relative_to(root)) for pattern in ROOMS[room] for p in root.glob(pattern))


def all_changes(root: Path, room: str) -> list[Change]:
    """Every change of every file of a room."""
    finder = of_python if room in ("fractional", "plan") else of_c
    return [c for file in files(root, room) for c in finder.changes(file, read(root, file))]


def drawn(
    root: Path, seed: int, count: int, rooms: tuple[str, ...] = tuple(ROOMS)
) -> list[tuple[str, Change]]:
    """``count`` changes, the rooms in turn. A place is drawn first, then one of its changes; a larger
    ``count`` of the same seed goes on where a smaller one ends."""
    each = [_of_room(root, seed, -(-count // len(rooms)), room) for room in rooms]
    return [change for turn in zip_longest(*each) for change in turn if change][:count]


def _of_room(root: Path, seed: int, count: int, room: str) -> list[tuple[str, Change]]:
    places: dict[tuple[str, int], list[Change]] = {}
    for change in all_changes(root, room):
        places.setdefault((change.file, change.begin), []).append(change)
    chance, found = random.Random(f"{seed} {room}"), []
    order = sorted(places)
    chance.shuffle(order)
    for place in order:
        change = chance.choice(places[place])
        if len(found) < count and _is_one(root, change):
            found.append((room, change))
    return found


def _is_one(root: Path, change: Change) -> bool:
    return not change.file.endswith(".py") or of_python.compiles(change.applied(read(root, change.file)))
