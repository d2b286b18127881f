"""What a verifier says."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace


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


def first_objection(verdicts: Iterable[Verdict]) -> Verdict:
    """The first verdict with an objection, or the last one, with the time of all until then."""
    seconds = 0.0
    for one in verdicts:
        seconds += one.seconds
        if one.found:
            break
    return replace(one, seconds=seconds)
