"""Answers kept in the study's folder, so that an interrupted study goes on where it stopped."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from focgen.errors import InputError
from focgen.jsontext import read_json
from focgen.output import write_file
from focgen.studies.jobs import Job


class Store:
    """One file an answer in ``folder``/rows, named by the hash of everything the answer depends on.

    A changed controller, rig, setting or version asks for other names, so nothing stale is ever used.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder / "rows"

    def find(self, job: Job) -> dict[str, Any] | None:
        """The answer, or None where there is none that can be read."""
        try:
            found = read_json(self._place(job), "")
        except InputError:
            return None
        return found if isinstance(found, dict) else None

    def keep(self, job: Job, found: dict[str, Any]) -> dict[str, Any]:
        """Write an answer, whole or not at all, and return it as it will be read."""
        text = json.dumps(found, ensure_ascii=False, allow_nan=False)
        write_file(self._place(job), text + "\n")
        made: dict[str, Any] = json.loads(text)
        return made

    def _place(self, job: Job) -> Path:
        return self.folder / f"{job.key}.json"
