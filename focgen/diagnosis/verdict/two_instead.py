"""Whether two other effects are there instead of one that leaves more than a right form does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.two import TwoOthers
from focgen.diagnosis.verdict.instead import Instead

_TOLD = 3  # pairs at most


@dataclass(frozen=True, eq=False)
class Two(Instead):
    """Any of these ``pairs``, the likeliest first."""

    pairs: tuple[TwoOthers, ...]

    @property
    def may_be(self) -> str:
        """As of :class:`Instead`."""
        pairs = ", or ".join(" and ".join(sorted(p.families)) for p in self.pairs[:_TOLD])
        return f"it may be ({self.sure:.0%}) two effects: {pairs}"


def two_instead(e: Explanation) -> Two | None:
    """What two effects may be there instead of the only one found; None where that explains its segment, or
    a rival has taken its place."""
    found = [c.rivals[0].effect for c in e.causes]
    if len(found) != 1 or not e.others or found != [e.others[0].instead]:
        return None
    odds = float(np.logaddexp.reduce([p.odds for p in e.others]))
    return Two(frozenset({e.others[0].instead}), odds, e.others)
