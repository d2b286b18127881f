"""What a command hands back to the command line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Outcome:
    """``payload`` for ``--json``, ``text`` for people, ``holds``: whether what was checked does hold."""

    payload: Any
    text: str
    holds: bool = True
