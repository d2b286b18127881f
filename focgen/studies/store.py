"""Answers kept in the study's folder, so that an interrupted study goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from focgen.errors import InputError
from focgen.jsontext import fits, read_json
from focgen.output import check_within, write_file
from focgen.progress import say
from focgen.studies.jobs import Job

_SHAPE = {"sha256": str, "answer": dict}


class Store:
    """One file an answer in ``folder``/rows, named by the hash of everything the answer depends on.

    A changed controller, rig, setting or version asks for other names, so nothing stale is ever used. Each
    file carries the hash of its name and its answer, so nothing edited, cut or renamed is used either.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder / "rows"

    def find(self, job: Job) -> dict[str, Any] | None:
        """The answer, or None where there is none that stands as it was kept; that is said."""
        place = self._place(job)
        if not place.exists():
            return None
        try:
            kept = read_json(place, "")
            if fits(kept, _SHAPE) and kept["sha256"] == _seal(job, kept["answer"]):
                answer: dict[str, Any] = kept["answer"]
                return answer
        except (InputError, ValueError, RecursionError):  # none, or nothing that was written from an answer
            pass
        say(f"study: {place} is not as it was kept, so it is made anew")
        return None

    def keep(self, job: Job, found: dict[str, Any]) -> dict[str, Any]:
        """Write an answer, whole or not at all, and return it as it will be read."""
        made: dict[str, Any] = json.loads(_text(found))
        check_within(self.folder.parent, [self._place(job)])
        write_file(self._place(job), _text({"sha256": _seal(job, made), "answer": made}) + "\n")
        return made

    def _place(self, job: Job) -> Path:
        return self.folder / f"{job.key}.json"


def _text(value: dict[str, Any]) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def _seal(job: Job, answer: dict[str, Any]) -> str:
    """A hash of a job and its answer."""
    return hashlib.sha256(f"{job.key}\n{_text(answer)}".encode()).hexdigest()
