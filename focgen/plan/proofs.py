"""No integer node can overflow: recomputed from the plan alone, in exact integers.

Nothing of how the formats were chosen is used here. Inputs are clamped to their ranges, v is saturated to its
type, z and I are clamped to theirs; every other node is a sum, product or shift of these, so its range
follows.
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from focgen.errors import PlanError
from focgen.plan.banks import departure, drive_error, driven_by, mean_of
from focgen.plan.counts import MOST
from focgen.plan.formats import Interval, limit, span, weighted
from focgen.plan.mode_sums import LAGS, Modes, Response, response_of
from focgen.plan.plan import Bank, Plan, Proof, Schedule, Sum, Tuning
from focgen.plan.stability import Inverse, inverse
from focgen.plan.sums import Count
from focgen.present import present


def prove(plan: Plan) -> tuple[Proof, ...]:
    """One proof for each integer node, in the order of a step; of floating arithmetic its integrals in
    counts.

    Raises PlanError naming the node that cannot be proved.
    """
    ledger = _Ledger(plan)
    if plan.floating:
        ledger.integrals()
        return tuple(ledger.proofs)
    ledger.inputs()
    p = ledger.combined()
    v = ledger.filtered(p)
    ledger.actuation(v, ledger.gain())
    return tuple(ledger.proofs)


class _Ledger:
    """Collects the proofs of one plan."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.proofs: list[Proof] = []

    def add(self, node: str, reach: Interval, ctype: str, how: str, spare: int = 0) -> Interval:
        """Note a node that reaches ``reach`` and, for a rounding, ``spare`` above it."""
        bound = limit(int(ctype.strip("u_int")))
        worst = reach.worst + spare
        if worst > bound:
            what = f"the node {node} reaches {worst}, beyond {bound} of {ctype}"
            raise PlanError(self.plan.name, what, "choose q31, f32 or f64, or narrower ranges")
        self.proofs.append(Proof(node, worst, ctype, bound, how))
        return reach

    def inputs(self) -> None:
        """e is the difference of two clamped inputs."""
        plan = self.plan
        reach = span(plan.reference) - span(plan.measurement)
        self.add("error", reach, plan.error.ctype, "range")
        if plan.set_point:
            made, far = plan.set_point, span(plan.reference) - span(plan.reference)
            self.add("set point product", far * Interval(0, int(made.rate)), "int64_t", "range")
            kept = Interval(int(made.low), int(made.high))
            self.add("set point", kept, "int64_t", "mean of its inputs", (1 << made.up) >> 1)

    def integrals(self) -> None:
        """Those that a floating plan has in counts; an increment beyond ``MOST`` is cut to it."""
        plan, each = self.plan, Interval(-MOST, MOST)
        for node, integral in (("inner sum", plan.inner), ("integrator sum", plan.integrator)):
            if integral and not integral.state.floating:
                reach = span(integral.state).hull(0) + each + each
                self.add(node, reach, integral.state.ctype, "clamp")

    def bank(self, name: str, bank: Bank, past: Interval) -> Interval:
        """What a mode keeps, how far u is from it, D, its product with the rate, and the sum of all."""
        u, half = driven_by(past, bank.differences), (1 << bank.to_drive) >> 1
        mean = mean_of(u, bank.up, bank.to_drive, bank.rate_shift, min(bank.real_rates))
        self.add(f"{name} mean", mean, bank.state.ctype, "mean of its inputs")
        far = departure(u, mean, bank.up)
        self.add(f"{name} departure", far, bank.state.ctype, "mean of its inputs", half)
        drive = self.add(f"{name} drive", far.shifted(bank.to_drive), bank.drive.ctype, "mean of its inputs")
        rate = _exactly(min(bank.rates)).hull(int(max(bank.rates)))
        half = (1 << bank.rate_shift) >> 1
        self.add(f"{name} rate product", drive * rate, bank.state.ctype, "mean of its inputs", half)
        half = (1 << bank.align) >> 1
        return self.add(f"{name} sum", weighted(bank.weights, drive), bank.sum.ctype, "l1 norm", half)

    def sum(self, table: Sum, each: Interval, past: Interval | None = None) -> Interval:
        """Every block and every partial total of a history sum; ``past`` is what modes are driven by, if not
        by ``each``.
        """
        total = Interval(0, 0)
        for block in table.blocks:
            node = f"{table.name}[{block.first}..{block.last}]"
            half = (1 << block.align) >> 1
            reach = self.add(node, weighted(block.weights, each), block.sum.ctype, "l1 norm", half)
            total = total + reach.shifted(block.align)
        for i, bank in enumerate(table.banks):
            past = each if past is None else past
            total = total + self.bank(f"{table.name} bank {i}", bank, past).shifted(bank.align)
        return self.add(f"{table.name} total", total, table.total.ctype, "l1 norm")

    def combined(self) -> Interval:
        """p, with the inner integral where there is one."""
        plan, each = self.plan, span(self.plan.error).hull(0)
        p = self.sum(plan.direct, each) if plan.direct else Interval(0, 0)
        if plan.inner:
            state, r = plan.inner.state, self.sum(plan.inner.rest, each)
            half = (1 << plan.inner.to_wide) >> 1
            self.add("inner sum", span(state) + r + r, state.ctype, "clamp", half)
            p = p + span(state).shifted(plan.inner.to_wide)
        return self.add("p", p, plan.wide.ctype, "l1 norm")

    def filtered(self, p: Interval) -> Interval:
        """x and v."""
        plan, half = self.plan, (1 << self.plan.narrow) >> 1
        if plan.feedback is None:
            return self.add("v", p.shifted(plan.narrow), plan.filtered.ctype, "l1 norm", 0)
        whole = span(plan.filtered)
        reach = math.ceil(filtered_reach(plan))
        s = self.sum(plan.feedback.table, whole, Interval(-reach, reach))
        self.add("x", p - s + Interval(-half, half), plan.wide.ctype, "clamp", half)
        self.add(
            "steady product",
            span(plan.error) * _both(plan.feedback.steady),
            _double(plan),
            "range",
            (1 << plan.feedback.steady_shift) >> 1,
        )
        self.add("v", Interval(-reach, reach), plan.filtered.ctype, "l1 norm of the recursion")
        return whole

    def gain(self) -> Interval:
        """g, over every segment of the schedule."""
        plan = self.plan
        if plan.tuning:
            return self.tuned_gain(plan.tuning)
        if plan.schedule is None:
            return Interval(int(plan.constant_gain), int(plan.constant_gain))
        reach, product, spare = _schedule(plan.schedule)
        self.add("slope product", product, _double(plan), "range", spare)
        return self.add("gain", reach, plan.gain.ctype, "range")

    def tuned_gain(self, box: Tuning) -> Interval:
        """g over the whole box of factors: what ``tune`` computes, then what a step makes of it.

        A gain between two breakpoints lies between those at them, but for the rounding of the slope.
        """
        plan, how = self.plan, "box of the parameters"
        factors = Interval(int(box.factor.low), int(box.factor.high))
        half, products = (1 << box.to_gain) >> 1, [factors * _exactly(n) for n in box.nominal]
        self.add("tuned gain product", _hull(products), "int64_t", how, half)
        ends = [product.shifted(box.to_gain) for product in products]
        self.add("tuned gain", _hull(ends), plan.gain.ctype, how)
        reach = _hull(ends)
        if plan.schedule:
            reach = _hull([reach, *self.slopes(box, ends)])
        return self.add("gain", reach, plan.gain.ctype, how)

    def slopes(self, box: Tuning, ends: list[Interval]) -> list[Interval]:
        """Of every segment: the reciprocal's product, the slope, its product in a step; what g can be."""
        schedule, products, slopes, steps, reach = present(self.plan.schedule), [], [], [], []
        spare, by_slope = 0, 0
        segments = zip(
            box.reciprocals,
            box.to_slopes,
            schedule.slope_shifts,
            np.diff(schedule.breakpoints),
        )
        for i, (per, to_slope, by, run) in enumerate(segments):
            rise = ends[i + 1] - ends[i]
            products.append(rise * _exactly(per))
            slopes.append(products[-1].shifted(to_slope))
            steps.append(slopes[-1] * Interval(0, int(run) - 1))
            spare, by_slope = max(spare, (1 << to_slope) >> 1), max(by_slope, (1 << by) >> 1)
            beyond = _beyond(rise, to_slope, by, int(run))
            reach.append(_hull([ends[i], ends[i + 1]]) + Interval(-beyond, beyond))
        how = "box of the parameters"
        self.add("tuned slope product", _hull(products), "int64_t", how, spare)
        self.add("tuned slope", _hull(slopes), self.plan.gain.ctype, how)
        self.add("slope product", _hull(steps).hull(0), _double(self.plan), how, by_slope)
        return reach

    def actuation(self, v: Interval, g: Interval) -> None:
        """Product, increment, integrator and output."""
        plan = self.plan
        half = (1 << plan.gain_shift) >> 1
        product = self.add("gain product", v * g, plan.product.ctype, "l1 norm", half)
        d = self.add("increment", product.shifted(plan.gain_shift), plan.increment.ctype, "l1 norm")
        if plan.integrator:
            state = plan.integrator.state
            half = (1 << plan.integrator.to_output) >> 1
            self.add("integrator sum", span(state).hull(0) + d + d, state.ctype, "clamp", half)
        self.add("output", span(plan.output), plan.output.ctype, "clamp")


def _exactly(count: Count) -> Interval:
    return Interval(int(count), int(count))


def _hull(parts: list[Interval]) -> Interval:
    return Interval(min(part.low for part in parts), max(part.high for part in parts))


def _beyond(rise: Interval, to_slope: int, by: int, run: int) -> int:
    """By how many counts a segment's line can leave its ends: slope · n / 2^by is rise · n / run, but for the
    reciprocal, which is off by less than half a count, the slope's rounding and the last one.
    """
    off = Fraction(rise.worst * run, 2 << (to_slope + by)) + Fraction(run, 2 << by)
    return math.ceil(off + Fraction(1, 2))


def _both(count: Count) -> Interval:
    return Interval(-abs(int(count)), abs(int(count)))


def _double(plan: Plan) -> str:
    """The type of a product of two samples."""
    return f"int{2 * plan.error.bits}_t"


def _schedule(schedule: Schedule) -> tuple[Interval, Interval, int]:
    """The ranges of g and of the slope product, and the largest rounding of the latter."""
    gains, points = [int(g) for g in schedule.gains], [int(p) for p in schedule.breakpoints]
    reach, product, spare = Interval(min(gains), max(gains)), Interval(0, 0), 0
    for i, (slope, by) in enumerate(zip(schedule.slopes, schedule.slope_shifts)):
        last = int(slope) * (points[i + 1] - 1 - points[i])
        product = product.hull(last)
        spare = max(spare, (1 << by) >> 1)
        reach = reach.hull(gains[i] + Interval(last, last).shifted(by).low)
    return reach, product, spare


def filtered_reach(plan: Plan) -> float:
    """Bound on |v| in counts: ‖B/A‖₁ of the integer weights times the range of e, and what rounding adds.
    Raises PlanError where the recursion's integer weights cannot be proved stable.
    """
    own = inverse_of_recursion(plan)
    if own is None:
        raise PlanError(plan.name, "the integer recursion cannot be proved stable", "choose q31, f32 or f64")
    unit = plan.filtered.lsb
    reach = 0.0
    if plan.direct:
        b = sum_response(plan.direct)
        reach += own.norm_after(b.weights, b.left_out) * span(plan.error).worst * plan.error.lsb / unit
    if plan.inner:
        reach += own.norm * span(plan.inner.state).worst * plan.inner.state.lsb / unit
    return reach + rounding_reach(plan, own)


def inverse_of_recursion(plan: Plan) -> Inverse | None:
    """The integer recursion, inverted."""
    response = sum_response(present(plan.feedback).table)
    return inverse(np.concatenate([[1.0], response.weights[1:]]), response.left_out)


def sum_response(made: Sum, lags: int = LAGS) -> Response:
    """What a sum, with its quantised weights, answers to a unit sample, by lag from 0 on."""
    modes = [Modes(b.order, np.array(b.real_rates), np.array(b.values)) for b in made.banks]
    return response_of(made.values, made.first, modes, lags)


def rounding_reach(plan: Plan, own: Inverse) -> float:
    """What alignments, the drives of modes, the carried rounding and the reset's can add to v, in counts."""
    unit = plan.wide.lsb / plan.filtered.lsb
    sums = [s for s in (plan.direct, present(plan.feedback).table) if s]
    rounded = sum(bool(b.align) for s in sums for b in s.blocks) + sum(
        bool(b.align) for s in sums for b in s.banks
    )
    each = 0.5 * unit * (rounded + bool(plan.inner)) + unit * math.fsum(map(drive_error, sums))
    carried = 0.5 * own.norm_after(np.array([1.0, -1.0]))
    return own.norm * each + carried + reset_error(plan) * max(1.0, own.norm * at_rest(plan))


def reset_error(plan: Plan) -> float:
    """How far a reset's v can be from the integer recursion's own rest, in counts."""
    feedback = present(plan.feedback)
    direct = math.fsum(plan.direct.values) if plan.direct else 0.0
    exact = direct / at_rest(plan) * plan.error.lsb / plan.filtered.lsb
    return 0.5 + abs(exact - feedback.steady * 2.0**-feedback.steady_shift) * span(plan.error).worst


def at_rest(plan: Plan) -> float:
    """A(1): positive for a stable recursion."""
    return 1.0 + math.fsum(present(plan.feedback).table.values)
