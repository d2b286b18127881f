"""Where logs have to tell what a pump held as they began."""

from __future__ import annotations

from collections.abc import Sequence

from focgen.logs.begin import REST
from focgen.rig.effects import Run
from focgen.rig.rig import Rig


def tells_what_is_held(rig: Rig, stages: Sequence[str]) -> bool:
    """Whether what a pump holds is told through a stage behind it."""
    return rig.integrator == "regulator" and stages[0] == "regulator" and len(stages) > 1


def may_have_held(run: Run) -> tuple[bool, ...]:
    """By experiment: whether what a pump held as it began may be off; not where it began empty, at rest."""
    stands, begins = run.stands or (0.0,) * len(run.spans), run.begins or (REST,) * len(run.spans)
    return tuple(stood != 0.0 or not begin.at_rest for stood, begin in zip(stands, begins))
