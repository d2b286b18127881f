"""Whether the columns of what a sensor reads and of its reading were exchanged, instead of what was found.

No sensor answers ahead of what it reads, so nothing in the library does. A relaxation that overshoots comes
closest.
"""

from __future__ import annotations

from collections.abc import Sequence

from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.logs.experiment import Experiment
from focgen.rig.plausibility import exchanged
from focgen.rig.rig import Rig


def crossed(rig: Rig, logs: Sequence[Experiment], explanations: Sequence[Explanation]) -> list[Explanation]:
    """The segments on both sides of a signal that has another one's column."""
    if not exchanged(rig, logs):
        return []
    return [e for e in explanations if "curvature" in (e.segment.entry, e.segment.exit)]
