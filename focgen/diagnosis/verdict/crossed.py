"""Whether the columns of two signals were exchanged, or one was exported twice, instead of what was found.

No sensor answers ahead of what it reads, so nothing in the library does. A relaxation that overshoots comes
closest: it would undo a sensor that was left out, and another effect would stand for the sensor.
"""

from __future__ import annotations

from collections.abc import Sequence

from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.logs.experiment import Experiment
from focgen.rig.plausibility import copied, exchanged
from focgen.rig.rig import Rig


def crossed(rig: Rig, logs: Sequence[Experiment], explanations: Sequence[Explanation]) -> list[Explanation]:
    """The segments on both sides of a signal that has another one's column."""
    taken = copied(rig, logs) or (("curvature",) if exchanged(rig, logs) else ())
    return [e for e in explanations if {e.segment.entry, e.segment.exit} & {*taken}]
