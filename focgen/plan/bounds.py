"""How far a plan can be from the same controller in exact arithmetic, and from infinite memory.

Notation: B, R and A are the exact weight tables (direct, rest with h/2 inside, feedback), M ≥ ‖1/A‖₁, N ≥
‖B/A‖₁ (1 and ‖B‖₁ without feedback), E, V the largest |e|, |v|. The machine's step is the exact one with
something added at each rounding, so with δ the error of v,

    A δ = (B̂ − B) ê + B (ê − e) + δz − (Â − A) v̂ + roundings,
    |δ| ≤ N |ê − e| + M (‖B̂ − B‖₁ E + ‖Â − A‖₁ V + roundings + |δz|),

for all time and from every reset, which takes the past as constant: its own rounding is one more constant
addend. Rounding that is carried (ρ_{k−1} − ρ_k) meets (1 − 1/z)/A instead of 1/A. The
reference computes in double itself, and its rounding is counted, too. What is taken for V, and for every sum,
is how far it gets for a history between its ends, not for one that has the largest magnitude on both sides.

The inputs' rounding, |ê − e|, is included: the bound holds against physical inputs, not only against those
that are whole counts.

The inner integral's error grows by 2 |δr| a sample until its clamp ends it, and clamps, which never lengthen
a distance, add nothing but the rounding of their own limits; likewise the integrator's. Before that, n
samples after a reset, the integral itself is at most n times what one sample can add. Whatever is rounded or
scaled in proportion to it is n times as much as after the first sample, at most, and so is all the error.
"""

from __future__ import annotations

from dataclasses import dataclass

from focgen.errors import PlanError
from focgen.fractional.elementary import exact_sum
from focgen.plan.account import Account
from focgen.plan.canonical import Tables
from focgen.plan.fixed_account import Fixed
from focgen.plan.floating_account import Floating
from focgen.plan.plan import ErrorBound, Plan
from focgen.plan.truncation import truncation
from focgen.plan.truncation_band import band_truncation

_MOST = 0.5  # of the signal that its own rounding may cost before a plan is refused
_SLACK = 1.0 + 1e-9  # over the rounding of these sums themselves


def error_bound(plan: Plan, tables: Tables) -> ErrorBound:
    """The bounds of a plan; ``tables`` are the exact weights it was made from."""
    kind = Floating if plan.floating else Fixed
    account = kind(plan, tables)
    found = _operator(account)
    _refuse_meaningless(plan, found, account.largest_gain * account.reach)
    first = _operator(kind(plan, tables, early=True)).first if found.ceiling else 0.0
    return ErrorBound(
        operator=found.settled + found.ceiling,
        output_per_sample=account.output(first or found.settled, found.settled + found.ceiling),
        truncation=band_truncation(plan) if plan.band else truncation(plan, tables),
        within_horizon=truncation(plan, tables, past_horizon=False) if plan.horizon else None,
        operator_per_sample=first,
        parts=tuple((cause, value) for cause, value in found.parts.items() if value)
        + (("inner integral", found.ceiling),) * bool(found.ceiling),
    )


@dataclass(frozen=True)
class _Found:
    """The error ahead of the integrator: ``parts`` of it in any sample by cause, what the inner integral's
    clamp lets through in any sample, and what it lets grow in one."""

    parts: dict[str, float]
    ceiling: float
    growth: float

    @property
    def settled(self) -> float:
        """What does not grow."""
        return exact_sum([*self.parts.values()]) * _SLACK

    @property
    def first(self) -> float:
        """After one sample."""
        return self.settled + self.growth


def _operator(account: Account) -> _Found:
    """Where in the schedule's range it is worst.

    The machine's own v is as far from what is exact for its own e and z as all that is settled; its z is
    within the same clamp.
    """
    v, found = account.filtered(), []
    reach = account.reach + v.settled
    for piece in account.pieces():
        parts = {cause: piece.largest * value for cause, value in v.static.items()}
        parts["gain"] = piece.error * reach
        parts["product"] = account.product_error(piece.largest * reach)
        found.append(_Found(parts, piece.largest * v.ceiling * _SLACK, piece.largest * v.growth * _SLACK))
    return max(found, key=lambda one: one.first if account.early else one.settled + one.ceiling)


def _refuse_meaningless(plan: Plan, found: _Found, reach: float) -> None:
    """Raise PlanError where the arithmetic itself may cost as much as the signal can be."""
    own = found.parts.get("weights", 0.0) + found.parts.get("rounding", 0.0)
    if not own <= _MOST * reach:
        what = f"rounding in {plan.arithmetic} may cost {own:.3g} of a signal that reaches {reach:.3g}"
        wider = {"q15": "q31, f32 or f64", "q31": "f64", "f32": "f64"}.get(plan.arithmetic)
        remedy = f"choose {wider}" if wider else "the recursion is nearly unstable: lengthen the sample time"
        raise PlanError(plan.name, what, remedy)
