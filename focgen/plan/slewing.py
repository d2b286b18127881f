"""How far an output may move a sample, in counts of its integral."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from focgen.errors import PlanError
from focgen.plan.formats import limit as limit_of
from focgen.plan.formats import nearest
from focgen.plan.plan import Plan
from focgen.present import present

_FEWEST = 16  # counts that a sample must at least be allowed, so that the limit is what was asked for


def with_slew(plan: Plan) -> Plan:
    """A plan whose integrator knows its controller's slew limit, where there is one.

    Raises PlanError where that is too slow to be counted.
    """
    limit = plan.controller.slew_limit
    if limit is None:
        return plan
    integrator, most = plan.integrator, limit * plan.sample_time
    if integrator is None:
        what = "has a slew_limit, which only an integrator can keep"
        raise PlanError(plan.name, what, "set integrator = true, or limit the output behind the controller")
    state = integrator.state
    if state.floating:
        slew = float((np.float32 if state.ctype == "float" else np.float64)(most))
    else:
        # a change that the type cannot hold never is: without this end, the constant in C would be another
        slew = min(nearest(most / state.lsb), int(state.high) - int(state.low), limit_of(state.bits))
        if slew < _FEWEST:
            what = f"has a slew_limit of {limit:g} a second, only {slew} counts a sample in {plan.arithmetic}"
            raise PlanError(plan.name, what, "choose a wider arithmetic or a longer sample_time")
    return replace(plan, integrator=replace(integrator, slew=slew))


def slewed(plan: Plan, change: Any) -> Any:
    """What of a change of the integral is let through, any shape; in the change's own type."""
    slew = present(plan.integrator).slew
    if slew is None:
        return change
    kind = np.asarray(change).dtype.type
    return np.minimum(np.maximum(change, kind(-slew)), kind(slew))
