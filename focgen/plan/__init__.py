"""The plan: from physical to machine, the reference that executes it, and the ideal that needs none."""

from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.ideal import ideal
from focgen.plan.plan import Plan
from focgen.plan.response import designed_response, running_response
from focgen.plan.scenario import Reset, Scenario, Trace, Track, physical_trace, to_physical, to_raw
from focgen.plan.worst import worst_case_input

__all__ = [
    "Plan",
    "Reset",
    "Scenario",
    "Trace",
    "Track",
    "build_plan",
    "designed_response",
    "execute",
    "ideal",
    "physical_trace",
    "running_response",
    "to_physical",
    "to_raw",
    "worst_case_input",
]
