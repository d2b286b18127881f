"""What was done to a log, in one line a kind, whatever the number of places and experiments."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Protocol

_NAMED = 4  # experiments named in one line; of more only the first few


class Noted(Protocol):
    """What has a name and notes (an ``Experiment``)."""

    @property
    def name(self) -> str:
        """What the notes are of."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What there is to say, one sentence each."""


class Note(str):
    """A note on what happened at several places: ``what``, how often, and where ``first`` ("at 1.2 s")."""

    what: str
    count: int  # type: ignore[assignment]  # of places; nobody counts a note's letters
    first: str

    def __new__(cls, what: str, count: int, first: str) -> Note:
        """The text, and what it was made of."""
        note = super().__new__(cls, f"{what} ({_places(count, first)})")
        note.what, note.count, note.first = what, count, first
        return note

    def __getnewargs__(self) -> tuple[Any, ...]:  # notes cross process boundaries
        return self.what, self.count, self.first


def notes_of(experiments: Sequence[Noted]) -> tuple[str, ...]:
    """The notes of all experiments, each kind in one line that names the experiments.

    >>> from types import SimpleNamespace as Log
    >>> both = [Log(name="7", notes=(Note("bridged", 2, "at 1.2 s"),)),
    ...         Log(name="9", notes=(Note("bridged", 1, "at 3 s"),))]
    >>> notes_of(both)
    ('7 and 9: bridged (3, the first at 1.2 s of 7)',)
    """
    kinds: dict[str, list[tuple[str, str]]] = {}
    for experiment in experiments:
        for note in experiment.notes:
            kinds.setdefault(getattr(note, "what", note), []).append((experiment.name, note))
    return tuple(_line(what, found, len(experiments)) for what, found in kinds.items())


def _line(what: str, found: list[tuple[str, str]], of: int) -> str:
    names = list(dict.fromkeys(name for name, _ in found))
    whose = "all experiments" if 1 < len(names) == of else listed(names)
    counted = [(name, note) for name, note in found if isinstance(note, Note)]
    if not counted:
        return f"{whose}: {what}"
    name, first = counted[0]
    total = sum(note.count for _, note in counted)
    place = first.first if len(names) == 1 else f"{first.first} of {name}"
    return f"{whose}: {what} ({_places(total, place)})"


def _places(count: int, first: str) -> str:
    return first if count == 1 else f"{count}, the first {first}"


def listed(names: Iterable[str]) -> str:
    """Names as one says them: "7, 9 and 11"."""
    names = list(names)
    if len(names) > _NAMED:
        return f"{len(names)} experiments ({', '.join(names[: _NAMED - 1])}, …)"
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
