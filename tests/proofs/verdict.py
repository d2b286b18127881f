"""What a verifier says."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Verdict:
    """``tool``, ``what`` was asked, how long it took (s), and every objection; proved where there is none."""

    tool: str
    what: str
    seconds: float
    found: tuple[str, ...]

    @property
    def proved(self) -> bool:
        """Whether nothing was found."""
        return not self.found
