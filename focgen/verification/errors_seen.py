"""How far a running controller is from the ideal one, against the bounds of its manifest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from focgen.arrays import Numbers
from focgen.plan.ideal import ideal
from focgen.plan.plan import ErrorBound, Plan
from focgen.plan.scenario import Scenario, Trace, physical_trace, to_raw
from focgen.plan.usable import limits_of


@dataclass(frozen=True)
class MaxError:
    """The largest errors seen, in physical units: of the signal ahead of the integrator and of the output."""

    operator: float
    output: float


@dataclass(frozen=True)
class ErrorsSeen:
    """The largest errors and the largest shares of their bounds (above 1: exceeded)."""

    largest: MaxError
    operator_share: float
    output_share: float

    @property
    def within(self) -> bool:
        """Whether every bound holds."""
        return self.operator_share <= 1.0 and self.output_share <= 1.0


def errors_seen(plan: Plan, physical: Scenario, trace: Trace, bound: ErrorBound) -> ErrorsSeen:
    """Compare a raw ``trace`` of the plan's controller with the same memory in float64 on the same inputs.

    Without an integrator only the clamped output is seen. It errs no more than what is clamped where both are
    clamped to the same limits: the machine's, whose own rounding is a part of the output's error alone.
    """
    reference = ideal(plan.controller, physical, plan.length, plan.memories)
    seen = physical_trace(plan, trace)
    since = _samples_since_reset(physical)
    output = np.abs(seen.u - reference.u)
    if plan.integrator:
        operator = np.abs(seen.d - reference.d)
    else:
        operator = np.abs(seen.u - _clamped(plan, physical, reference.d))
    allowed = np.full(since.shape, bound.operator)
    if bound.operator_per_sample:
        allowed = np.minimum(allowed, since * bound.operator_per_sample)
    largest = MaxError(float(operator.max()), float(output.max()))
    return ErrorsSeen(largest, _share(operator, allowed), _share(output, since * bound.output_per_sample))


def _clamped(plan: Plan, physical: Scenario, d: Numbers) -> Numbers:
    """``d`` within the limits as the arithmetic holds them, both in physical units."""
    low, high = limits_of(plan, to_raw(plan, physical))
    made: Numbers = np.clip(d, *(end.astype(float) * plan.output.lsb for end in (low, high)))
    return made


def _share(errors: Numbers, allowed: Numbers) -> float:
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.max(np.where(errors > 0.0, errors / allowed, 0.0)))


def _samples_since_reset(scenario: Scenario) -> Numbers:
    """1 at the first sample after init or a reset, and so on; shape (lanes, samples)."""
    count = np.tile(np.arange(1, scenario.samples + 1), (scenario.lanes, 1))
    for r in sorted(scenario.resets, key=lambda r: r.sample):
        count[r.lane, r.sample :] = np.arange(1, scenario.samples - r.sample + 1)
    return count
