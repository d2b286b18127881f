"""The open loop: the memory operator alone, and the controller ahead of its integrator."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from focgen.arrays import Array
from focgen.control.controller import Controller
from focgen.fractional.exponential import ExponentialMemory
from focgen.fractional.transfer import Term, TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.canonical import realise
from focgen.plan.execute import execute
from focgen.plan.ideal import ideal
from focgen.plan.plan import Plan
from focgen.plan.response import filtered_response
from focgen.plan.scenario import Scenario, physical_trace, to_raw
from focgen.studies.results import INPUTS, Variant
from focgen.studies.signals import Inputs, exact_power, inputs, relative_errors, signed


@dataclass(frozen=True)
class OpenLoop:
    """See :class:`focgen.studies.results.Row` for each number."""

    errors: dict[str, float]
    bound: float | None
    error_ahead: float | None
    error_s: float

    @property
    def error(self) -> float:
        """The worst of the four."""
        return max(self.errors.values())


def fractional_terms(controller: Controller) -> tuple[Term, ...]:
    """The powers that need memory, as they are realised: for each order the term that weighs most."""
    form = realise(controller)
    found: dict[float, Term] = {}
    for term in form.direct + form.rest + form.den:
        weighs_more = abs(term.coefficient) > abs(found.get(term.order, term).coefficient)
        if not term.order.is_integer() and (term.order not in found or weighs_more):
            found[term.order] = term
    return tuple(found[order] for order in sorted(found))


def variant_of(controller: Controller, variant: Variant) -> Controller:
    """The controller as ``variant`` has it."""
    given = {key: getattr(variant, key) for key in ("length", "tolerance", "horizon")}
    return replace(
        controller,
        sample_time=variant.sample_time,
        memory=variant.memory,
        arithmetic=variant.arithmetic,
        operator=variant.operator,
        band=variant.band,
        **{key: value for key, value in given.items() if value is not None},
    )


def measure(controller: Controller, plan: Plan, own: float, samples: int, omega: Array) -> OpenLoop:
    """Run the operator and the controller's ``plan`` on the four inputs.

    ``controller`` is the variant; ``own`` and ``samples`` as :func:`focgen.studies.signals.inputs` has them;
    ``omega`` (rad/s): where the operator is compared with (jω)^α.
    Raises PlanError where the operator alone has no plan in this arithmetic.
    """
    both = signed(controller)
    plan = plan if both is controller else build_plan(both)
    controller, given = both, inputs(both, own, samples)
    each = [_power(controller, term, given, omega) for term in fractional_terms(controller)]
    errors = {name: max(found[name] for found, _, _ in each) for name in INPUTS}
    bounds = [bound for _, bound, _ in each]
    exact = ideal(controller, given.scenario).d
    ahead = max(relative_errors(_ahead(plan, given.scenario), exact).values(), default=None)
    proved = [bound for bound in bounds if bound is not None]
    return OpenLoop(
        errors, max(proved) if len(proved) == len(bounds) else None, ahead, max(s for _, _, s in each)
    )


def _ahead(plan: Plan, scenario: Scenario) -> Array:
    """The signal ahead of the integrator, physical, shape (lanes, samples)."""
    return physical_trace(plan, execute(plan, to_raw(plan, scenario))).d


def operator_alone(controller: Controller, term: Term) -> Controller:
    """The controller with nothing but one power of s, and its largest gain."""
    gains = controller.gains
    return replace(
        controller,
        transfer=TransferFunction([term]),
        gain=max(gains, key=abs),
        ranges=replace(controller.ranges, schedule=None),
    )


def _power(
    controller: Controller, term: Term, given: Inputs, omega: Array
) -> tuple[dict[str, float], float | None, float]:
    """The errors of one power by input, what proves that they are no larger, and the error against s^α."""
    alone = operator_alone(controller, term)
    plan = build_plan(alone)
    exact = alone.gains[0] * term.coefficient * exact_power(term.order, alone.sample_time, given.error)
    scenario = replace(given.scenario, sched=None)
    errors = relative_errors(_ahead(plan, scenario), exact)
    return errors, _proved(plan, np.abs(exact)), _continuous(plan, term, omega)


def _continuous(plan: Plan, term: Term, omega: Array) -> float:
    """The largest |H(e^jωh) / (jω)^α − 1| of a power that stands alone."""
    exact = term.coefficient * (1j * omega) ** term.order
    return float(np.abs(filtered_response(plan, omega) / exact - 1.0).max())


def _kernels(plan: Plan) -> list[float]:
    """What is proved of the kernels of memories below the order 1."""
    fitted = (m for m in plan.memories if isinstance(m, ExponentialMemory))
    return [m.certificate.kernel for m in fitted if m.differences == 1]


def _proved(plan: Plan, sizes: Array) -> float | None:
    """The largest relative error that plan and certificate allow for the inputs whose exact outputs are
    ``sizes``; None where nothing is proved.

    An exponential memory's certificate knows more of step and ramp: they only rise, so that behind one
    difference their relative error is at most that of the weights.
    """
    if plan.band:
        return None  # what is proved of it is against s^α, not against the weights
    proved, samples = plan.error_bound, sizes.shape[1]
    left_out = proved.truncation
    if plan.exponential and samples <= plan.horizon:
        left_out = proved.within_horizon
    if left_out is None:
        return None
    found = {}
    for name, largest in zip(INPUTS, sizes.max(axis=1)):
        memory = left_out / largest
        if name in ("step", "ramp"):
            memory = min([memory, *_kernels(plan)])
        found[name] = memory + proved.operator / largest
    return float(max(found.values()))
