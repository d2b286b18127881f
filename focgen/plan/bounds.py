"""How far a plan can be from the same controller in exact arithmetic, and from infinite memory.

Notation: B, R and A are the exact weight tables (direct, rest with h/2 inside, feedback), M ≥ ‖1/A‖₁, N ≥
‖B/A‖₁ (1 and ‖B‖₁ without feedback), E, V the largest |e|, |v|. The machine's step is the exact one with
something added at each rounding, so with δ the error of v,

    A δ = (B̂ − B) ê + B (ê − e) + δz − (Â − A) v̂ + roundings,
    |δ| ≤ N |ê − e| + M (‖B̂ − B‖₁ E + ‖Â − A‖₁ V + roundings + |δz|),

for all time and from every reset, which takes the past as constant: its own rounding is one more constant
addend. Rounding that is carried (ρ_{k−1} − ρ_k) meets (1 − 1/z)/A instead of 1/A. In floating arithmetic
every operation adds u times its result; in any order, a sum of n products adds at most γ_n Σ|w x|, γ_n = n u
/ (1 − n u) (Higham, Accuracy and Stability of Numerical Algorithms, 2002, §3.1 and §4.2). The reference
computes in double itself, and its rounding is counted, too.

The inputs' rounding, |ê − e|, is included: the bound holds against physical inputs, not only against those
that are whole counts.

The inner integral's error grows by 2 |δr| a sample until its clamp ends it, and clamps, which never lengthen
a distance, add nothing but the rounding of their own limits; likewise the integrator's.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from focgen.arrays import Array, Ints
from focgen.errors import PlanError
from focgen.fractional.elementary import exact_sum, l1
from focgen.plan.banks import drive_error
from focgen.plan.canonical import Table, Tables, inner_limits
from focgen.plan.gains import largest_gain, longest_segment, steepest, table_error, tuned_error
from focgen.plan.plan import Bank, ErrorBound, Plan, Sum
from focgen.plan.proofs import at_rest, reset_error
from focgen.plan.setpoint import set_point_error
from focgen.plan.stability import inverse_of
from focgen.plan.truncation import largest_error, truncation
from focgen.plan.truncation_band import band_truncation
from focgen.present import present

_UNIT = {"f64": 2.0**-53, "f32": 2.0**-24}
_DOUBLE = 2.0**-53
_TINY = {"f64": 2.0**-1022, "f32": 2.0**-126}
_MOST = 0.5  # of the signal that its own rounding may cost before a plan is refused
_SLACK = 1.0 + 1e-9  # over the rounding of these sums themselves


def gamma(count: float, unit: float) -> float:
    """γ_n = n u / (1 − n u)."""
    return count * unit / (1.0 - count * unit)


def error_bound(plan: Plan, tables: Tables) -> ErrorBound:
    """The bounds of a plan; ``tables`` are the exact weights it was made from."""
    account = _Floating(plan, tables) if plan.floating else _Fixed(plan, tables)
    v = account.filtered()
    g, gain_error = account.largest_gain, account.gain_error()
    parts = {cause: g * value for cause, value in v.static.items()}
    parts["gain"] = gain_error * (account.reach + v.total)
    parts["product"] = account.product_error(g * account.reach)
    static = exact_sum([*parts.values()]) * _SLACK
    growth, ceiling = g * v.growth * _SLACK, g * v.ceiling * _SLACK
    operator = static + ceiling
    _refuse_meaningless(plan, parts, g * account.reach)
    return ErrorBound(
        operator=operator,
        output_per_sample=account.output(static, growth, operator),
        truncation=band_truncation(plan) if plan.band else truncation(plan, tables),
        within_horizon=truncation(plan, tables, past_horizon=False) if plan.horizon else None,
        operator_per_sample=static + growth if growth else 0.0,
        parts=tuple((cause, value) for cause, value in parts.items() if value)
        + (("inner integral", ceiling),) * bool(ceiling),
    )


def _refuse_meaningless(plan: Plan, parts: dict[str, float], reach: float) -> None:
    """Raise PlanError where the arithmetic itself may cost as much as the signal can be."""
    own = parts.get("weights", 0.0) + parts.get("rounding", 0.0)
    if not own <= _MOST * reach:
        what = f"rounding in {plan.arithmetic} may cost {own:.3g} of a signal that reaches {reach:.3g}"
        wider = {"q15": "q31, f32 or f64", "q31": "f64", "f32": "f64"}.get(plan.arithmetic)
        remedy = f"choose {wider}" if wider else "the recursion is nearly unstable: lengthen the sample time"
        raise PlanError(plan.name, what, remedy)


@dataclass(frozen=True)
class FilteredError:
    """The error of v: ``static`` by cause in any sample; ``growth`` a sample and ``ceiling`` of the inner
    integral's."""

    static: dict[str, float]
    growth: float = 0.0
    ceiling: float = 0.0

    @property
    def total(self) -> float:
        """All of it."""
        return exact_sum([*self.static.values()]) + self.ceiling


class _Account(ABC):
    """What the fixed and the floating account share. ``M``, ``N`` and ``reach`` (V) as in the module's
    notation."""

    @property
    @abstractmethod
    def input_error(self) -> float:
        """Of e, beyond its inputs' own rounding."""

    @abstractmethod
    def sum_error(self, made: Sum | None, table: Table | None, largest: float) -> float:
        """The rounding in a sum over a history of up to ``largest``."""

    @abstractmethod
    def inner_edge(self) -> float:
        """Of a limit of the inner integral."""

    @abstractmethod
    def inner_rounding(self) -> float:
        """Of the inner integral in one sample."""

    def __init__(self, plan: Plan, tables: Tables) -> None:
        self.plan, self.tables, controller = plan, tables, plan.controller
        self.half_step = 0.5 * plan.sample_time if plan.integrator else 1.0
        self.largest_gain = largest_gain(controller)
        self.E = self.input_error + largest_error(plan.controller)
        self.own = inverse_of(tables.feedback) if tables.feedback else None
        self.M = self.own.norm if self.own else 1.0
        self.N = self.norm_after(tables.direct)
        clamp = [x / tables.normaliser for x in inner_limits(controller)] if tables.rest else [0.0]
        self.Z, self.width = max(map(abs, clamp)), max(clamp) - min(clamp)
        self.reach = self.N * self.E + self.M * self.Z

    def norm_after(self, table: Table | None) -> float:
        """‖table/A‖₁."""
        if table is None:
            return 0.0
        whole = table.response
        return self.own.norm_after(whole.weights, whole.left_out) if self.own else whole.l1

    def weight_error(self, made: Sum | None, table: Table | None, first: int = 0) -> float:
        """Σ |ŵ − w|, with what the exact weights themselves are uncertain by. A mode's response has a sum of
        magnitudes of at most 2.
        """
        if made is None:
            return 0.0
        exact, size = present(table).weights[first:], present(table).size[first:]
        lags = np.arange(first, first + len(exact))
        taps = l1(np.array(made.values) - exact) + exact_sum(self.recursion(lags) * size)
        held, exact = np.array(_mode_weights(made)), np.array(_exact_weights(present(table)))
        return taps + 2.0 * exact_sum(np.abs(held - exact) + 16.0 * _DOUBLE * np.abs(exact))

    def recursion(self, lags: Ints) -> Array:
        """Relative error of a double's weights by the recursion of eq. (11), the reference's, in 4 roundings
        a lag."""
        return (4.0 * lags + 20.0) * _DOUBLE

    def inner(self) -> FilteredError:
        """The inner integral alone, as if it were all there is of v."""
        made = self.plan.inner
        if made is None:
            return FilteredError({})
        each = (
            present(self.tables.rest).l1 * self.input_error
            + self.weight_error(made.rest, self.tables.rest) * self.E
        )
        each += self.sum_error(made.rest, self.tables.rest, self.E)
        edge = self.inner_edge()
        growth = 2.0 * each + self.inner_rounding()
        return FilteredError({"inner": edge}, self.M * growth, self.M * (self.width + edge))


class _Fixed(_Account):
    """The account in integers: every rounding is at most half a count, and none where nothing is shifted
    out."""

    @property
    def input_error(self) -> float:
        return self.plan.error.lsb + set_point_error(self.plan)

    def sum_error(self, made: Sum | None, table: Table | None, largest: float) -> float:
        """The alignments' rounding, and that of the modes' drives."""
        if made is None:
            return 0.0
        aligned = sum(bool(b.align) for b in made.blocks) + sum(bool(b.align) for b in made.banks)
        return (0.5 * aligned + drive_error(made)) * made.total.lsb

    def inner_edge(self) -> float:
        return 0.5 * present(self.plan.inner).state.lsb

    def inner_rounding(self) -> float:
        return 0.0

    def filtered(self) -> FilteredError:
        plan, tables = self.plan, self.tables
        inner = self.inner()
        half_wide = 0.5 * plan.wide.lsb * bool(plan.inner and plan.inner.to_wide)
        rounding = self.M * (self.sum_error(plan.direct, tables.direct, 0.0) + half_wide)
        static = {
            "inputs": self.N * self.input_error,
            "weights": self.M * self.weight_error(plan.direct, tables.direct) * self.E,
            "inner": self.M * exact_sum([*inner.static.values()]),
        }
        if plan.feedback is None:
            static["rounding"] = rounding + 0.5 * plan.filtered.lsb * bool(plan.narrow)
        else:
            reach = (plan_reach(plan) + 1) * plan.filtered.lsb
            static["weights"] += self.M * self.weight_error(plan.feedback.table, tables.feedback, 1) * reach
            static["rounding"] = (
                rounding + self.M * self.sum_error(plan.feedback.table, None, 0.0) + self.carried()
            )
        return FilteredError(static, inner.growth, inner.ceiling)

    def carried(self) -> float:
        """The rounding of v, which meets (1 − 1/z)/A, and that of a reset."""
        lsb = self.plan.filtered.lsb
        rounding = 0.5 * present(self.own).norm_after(np.array([1.0, -1.0])) * bool(self.plan.narrow)
        return lsb * (rounding + reset_error(self.plan) * max(1.0, self.M * at_rest(self.plan)))

    def gain_error(self) -> float:
        """In physical units, the h/2 taken out again."""
        plan, lsb = self.plan, self.plan.gain.lsb / self.half_step
        if plan.tuning:
            moved = 0.5 * plan.schedule.signal.lsb * steepest(plan.controller) if plan.schedule else 0.0
            return tuned_error(plan, lsb) + 0.5 * lsb + moved
        if plan.schedule is None:
            return abs(plan.constant_gain * lsb - plan.controller.gains[0])
        inputs = 0.5 * plan.schedule.signal.lsb * steepest(plan.controller)
        return table_error(plan, lsb) + 0.5 * lsb + inputs

    def product_error(self, reach: float) -> float:
        return 0.5 * self.plan.increment.lsb / self.half_step * bool(self.plan.gain_shift)

    def output(self, static: float, growth: float, operator: float) -> float:
        """An output's own rounding and that of a limit or a reset's u0 are half a count each."""
        if self.plan.integrator:
            slew = 0.5 * self.plan.integrator.state.lsb * (self.plan.integrator.slew is not None)
            return self.plan.sample_time * operator + self.plan.output.lsb + slew
        return max(static + growth, 0.5 * self.plan.output.lsb)


def _mode_weights(made: Sum) -> list[float]:
    return [c for bank in made.banks for c in bank.values]


def _exact_weights(table: Table) -> list[float]:
    return [w for modes in table.modes for w in modes.weights.tolist()]


def plan_reach(plan: Plan) -> float:
    """Proven |v| in counts."""
    return next(p.worst for p in plan.proofs if p.node == "v")


def _drive_error(rates: Array, m: float, u: float, tiny: float, compensated: bool) -> Array:
    """How far a mode's D can be off for |u| ≤ m, shape of ``rates``.

    u_{k−1} itself is rounded where m = 2: u m, once, and as much in L. Each sample adds to L's error η ≤ q (2
    u |D|) + u |L|, and the rate takes η / q of it; D is rounded once more. Compensated, with r ≤ u |L| and t
    = r + q D: D is rounded twice, t once, and r loses at most 3 u |t| more where |t| > |L| (Dekker 1971 is
    exact otherwise): η ≤ q (4 u |D|) + 4 u |t|.
    """
    far = 2.0 * m
    twice = 2.0 * u * m * (m > 1.0)
    if not compensated:
        return twice + 3.0 * u * far + (u * m + 3.0 * tiny) / rates
    slow = 4.0 * u * (u * m) / rates
    return twice + (4.0 + 4.0 + 2.0) * u * far + slow + 6.0 * tiny / rates


class _Floating(_Account):
    """The account in float or double, and of the double reference it is compared with."""

    def __init__(self, plan: Plan, tables: Tables) -> None:
        self.u, self.tiny = _UNIT[plan.arithmetic], _TINY[plan.arithmetic]
        super().__init__(plan, tables)

    @property
    def input_error(self) -> float:
        """Both inputs' rounding to the type and that of their difference, here and in the reference."""
        ranges = self.plan.controller.ranges
        largest = max(map(abs, ranges.reference)) + max(map(abs, ranges.measurement))
        own = 0.0 if self.plan.arithmetic == "f64" else self.u * largest
        own += set_point_error(self.plan)
        return own + (self.u + _DOUBLE) * largest * 1.01

    def sum_error(self, made: Sum | None, table: Table | None, largest: float) -> float:
        """Here u for each product and each partial sum, which the order keeps small until the newest samples;
        in the reference, whose order is its own, γ_{n+1} Σ|w x|; and what underflow can take."""
        if made is None:
            return 0.0
        count, partial = made.taps + 2, np.cumsum(np.abs(made.weights)[::-1])
        here = self.u * (1.0 + gamma(count, self.u)) * (exact_sum(partial) + float(partial[-1]))
        there = gamma(count, _DOUBLE) * l1(present(table).weights)
        taps = 1.01 * (here + there) * largest + count * self.tiny * (1.0 + largest)
        banks = [self.bank_error(bank, float(partial[-1])) for bank in made.banks]
        return taps + exact_sum(banks) * largest

    def bank_error(self, bank: Bank, before: float) -> float:
        """Of a bank, for a history of at most 1, here and in the reference, which has no compensation.

        Each mode's D is off by what :func:`_drive_error` says; products, their sum, and adding it to what is
        ``before`` it at most round γ_{n+2} of their magnitudes. |u| ≤ m, |L| ≤ m, |D| ≤ 2 m.
        """
        m, c = float(bank.differences), np.abs(bank.values)
        rates = np.array(bank.real_rates)
        here = _drive_error(rates, m, self.u, self.tiny, bank.compensated)
        there = _drive_error(rates, m, _DOUBLE, _TINY["f64"], False)
        sums = gamma(bank.modes + 2, self.u) + gamma(bank.modes + 2, _DOUBLE)
        return 1.01 * (exact_sum(c * (here + there)) + sums * (2.0 * m * exact_sum(c) + before))

    def inner_edge(self) -> float:
        """Of its clamp; in counts also of what it gives."""
        state = present(self.plan.inner).state
        given = 0.0 if state.floating else self.u * self.Z * 1.01 + state.lsb
        return (self.u + _DOUBLE) * self.Z + given

    def inner_rounding(self) -> float:
        """r + r_prev, z + that, each rounded, here and in the reference; in counts r alone."""
        r, state = 2.0 * present(self.tables.rest).l1 * self.E, present(self.plan.inner).state
        each = _DOUBLE * (self.Z + 2.0 * r) * 1.01 + 2.0 * self.tiny
        made: float = each + (self.u * (self.Z + 2.0 * r) * 1.01 if state.floating else state.lsb)
        return made

    def filtered(self) -> FilteredError:
        plan, tables = self.plan, self.tables
        inner = self.inner()
        direct = self.sum_error(plan.direct, tables.direct, self.E)
        rounding = direct + (self.u + _DOUBLE) * 1.01 * (self.Z + self.reach)
        static = {
            "inputs": self.N * self.input_error,
            "weights": self.M * self.weight_error(plan.direct, tables.direct) * self.E,
            "inner": self.M * exact_sum([*inner.static.values()]),
        }
        if plan.feedback is None:
            static["rounding"] = rounding if plan.inner else direct
            return FilteredError(static, inner.growth, inner.ceiling)
        return self.recursive(static, rounding, inner)

    def recursive(self, static: dict[str, float], rounding: float, inner: FilteredError) -> FilteredError:
        """With feedback the errors scale with the machine's own v: solved for it. A reset's v is rounded as
        well."""
        plan, tables = self.plan, self.tables
        back = self.weight_error(present(plan.feedback).table, tables.feedback, 1)
        back += self.sum_error(present(plan.feedback).table, tables.feedback, 1.0) + (self.u + _DOUBLE) * 4.0
        if self.M * back >= 0.5:
            return FilteredError({"rounding": np.inf})
        reach = (self.reach + self.M * rounding) / (1.0 - self.M * back)
        rest = max(1.0, self.M * abs(present(tables.feedback).total))
        static["rounding"] = self.M * (rounding + back * reach) + rest * self.reset_rounding()
        return FilteredError(static, inner.growth, inner.ceiling)

    def reset_rounding(self) -> float:
        """Of v = e · B(1)/A(1): two roundings, those of the sums in double, and the reference's."""
        direct, back = self.tables.direct, present(self.tables.feedback)
        if direct is None:
            return 0.0
        count = len(direct.weights) + len(back.weights) + 8
        sums = direct.l1 / abs(back.total) * (1.0 + back.l1 / abs(back.total))
        ratio = abs(direct.total / back.total)
        made: float = self.E * (2.0 * (self.u + _DOUBLE) * ratio + 2.0 * gamma(count, _DOUBLE) * sums) * 1.01
        return made

    def gain_error(self) -> float:
        plan, g = self.plan, self.largest_gain
        if plan.tuning:
            return tuned_error(plan, 1.0 / self.half_step) * (1.0 + _DOUBLE / self.u)
        if plan.schedule is None:
            return 2.0 * (self.u + _DOUBLE) * g
        slope, reach = steepest(plan.controller), max(map(abs, present(plan.controller.ranges.schedule)))
        inputs = (2.0 * self.u + 2.0 * _DOUBLE) * slope * reach
        slopes = slope * longest_segment(plan.controller)
        return table_error(plan, 1.0 / self.half_step) + inputs + 4.0 * (self.u + _DOUBLE) * (g + slopes)

    def product_error(self, reach: float) -> float:
        return 2.0 * (self.u + _DOUBLE) * reach + self.tiny / self.half_step

    def output(self, static: float, growth: float, operator: float) -> float:
        """An integral in counts rounds each increment to half a count, and what it gives, a limit and an
        output that is set once."""
        plan, here = self.plan, self.u * 1.01
        largest = max(map(abs, plan.controller.ranges.output))
        edge = (here + _DOUBLE * 1.01) * largest
        if not plan.integrator:
            return static + growth + edge
        d = 2.0 * self.half_step * self.largest_gain * self.reach + plan.sample_time * operator
        state, each = plan.integrator.state, _DOUBLE * 1.01 * (largest + 2.0 * d)
        each += here * (largest + 2.0 * d) if state.floating else here * largest + 3.0 * state.lsb
        if plan.integrator.slew is not None:  # rounded, here and in the reference
            most = present(plan.controller.slew_limit) * plan.sample_time
            each += (here * most if state.floating else 0.5 * state.lsb) + _DOUBLE * 1.01 * most
        made: float = plan.sample_time * operator + each + 2.0 * edge + 4.0 * self.tiny
        return made
