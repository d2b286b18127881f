"""What each rounding of a step can cost, walked through the plan's description operation by operation.

Exact weights and norms are those of :mod:`tests.plan.derived`; of the plan only what its C is made of is
used. Each account gives the parts of a bound by cause, in the units of the signal ahead of the integrator.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from focgen.plan.plan import Bank, Plan, Sum
from tests.plan.derived import Truth, Weights
from tests.plan.gain_walk import U64, gamma, half_place, pieces


@dataclass
class Found:
    """``parts`` as the manifest names them; ``first``: after one sample; ``loose``: by how much more the
    doubles of the plan's own tables may be off, as its documentation says."""

    parts: dict[str, float]
    growth: float = 0.0
    ceiling: float = 0.0
    loose: dict[str, float] = field(default_factory=dict)

    @property
    def settled(self) -> float:
        return sum(self.parts.values())


def swing(low: float, high: float, norm: float, total: float) -> float:
    """max |Σ w x| for low ≤ x ≤ high, given Σ|w| and Σ w."""
    return (
        max(abs((high + low) * total + (high - low) * norm), abs((high + low) * total - (high - low) * norm))
        / 2
    )


class Walk:
    """What both kinds need. ``early``: just after a reset, the inner integral being what one sample adds."""

    def __init__(self, plan: Plan, true: Truth, early: bool, set_point: float) -> None:
        self.plan, self.true, self.early = plan, true, early
        ranges = plan.controller.ranges
        (r0, r1), (m0, m1) = ranges.reference, ranges.measurement
        self.refs, self.meas = max(abs(r0), abs(r1)), max(abs(m0), abs(m1))
        self.set_point = set_point
        self.far = max(abs(r0 - m1), abs(r1 - m0))
        self.off = self.input_error()
        self.low, self.high = min(r0 - m1, 0.0) - self.off, max(r1 - m0, 0.0) + self.off
        self.E = self.far + self.off
        self.unit = [1.0]
        self.M = true.norm(self.unit) if true.den else 1.0
        self.A1 = true.den.total if true.den else 1.0
        b = true.direct
        self.N = (true.norm(b.response() if b.modes else b.taps) if true.den else b.norm) if b else 0.0
        self.ok = self.M is not None and self.N is not None
        if not self.ok:
            return
        self.clamp = max(map(abs, true.limits))
        self.Z = self.clamp
        self.step = self.inner_step() if plan.inner else 0.0
        if early and plan.inner:
            self.Z = min(self.Z, 2.0 * true.rest.norm * self.E + self.step)
        still = b.total / self.A1 if b else 0.0
        self.reach = swing(self.low, self.high, self.N, still) + self.M * self.Z
        self.half = 0.5 * plan.sample_time if plan.integrator else 1.0
        self.G = max(map(abs, plan.controller.gains)) * plan.controller.factors[1]

    def weights(self, made: Sum, exact: Weights, low: float, high: float, first: int = 0, after=True):
        """What wrong weights cost, behind 1/A if ``after``, and what doubles of them may."""
        taps = exact.taps[first : first + made.taps]
        wrong = np.array([float(w) for w in made.values]) - taps
        size = float(np.abs(wrong).sum())
        norm, rest = 1.0, 1.0
        if after and self.true.den:
            norm, rest = self.M, self.A1
            size = min(self.true.norm(wrong) or np.inf, self.M * size)
        held = [(b.differences, q, c) for b in made.banks for q, c in zip(b.real_rates, b.values)]
        answers = sum((2.0 + 2.0 * q * (m - 1)) * abs(c - w[2]) for (m, q, c), w in zip(held, exact.modes))
        known = swing(low, high, size, float(wrong.sum()) / rest) + norm * answers * (high - low) / 2
        lags = np.arange(first, first + len(taps))
        own = float(((4 * lags + 20) * exact.sizes[first : first + made.taps]).sum()) * max(-low, high)
        own += sum(16 * (2.0 + 2.0 * q * (m - 1)) * abs(c) for m, q, c in exact.modes) * (high - low) / 2
        return known, norm * own * U64

    def inner_end(self) -> float:
        """The clamp as it is held, with the weights that run, of as much of it as is reached."""
        state = self.plan.inner.state
        off = max(abs(n * state.lsb - x) for n, x in zip((state.low, state.high), self.true.limits))
        return (off + 4.0 * U64 * self.clamp) * (self.Z / self.clamp if self.clamp else 0.0)

    def inner_loose(self) -> float:
        """What doubles of the denominator's weights may cost the clamp, at most, there and here."""
        if not self.true.den:
            return 0.0
        lags = np.arange(len(self.true.den.sizes))
        return 2.0 * self.M * self.Z * U64 * float(((4 * lags + 20) * self.true.den.sizes).sum()) / self.A1

    def inner_step(self) -> float:
        """By how much the inner integral's error grows in a sample: r is added twice."""
        rest = self.plan.inner.rest
        known, self.step_loose = self.weights(rest, self.true.rest, self.low, self.high, after=False)
        self.step_loose *= 2.0
        each = known + self.true.rest.norm * self.off + self.sum(rest, self.true.rest, self.low, self.high)
        return 2.0 * each + self.inner_rounding()

    def found(self) -> Found:
        """The worst piece of the schedule."""
        static, loose = self.static()
        growth = ceiling = 0.0
        if self.plan.inner:
            width = self.true.limits[1] - self.true.limits[0]
            growth, ceiling = self.M * self.step, self.M * (width + self.edge())
            loose["growth"] = self.M * self.step_loose
        reach, tried = self.reach + sum(static.values()), []
        for error, largest in self.pieces():
            parts = {cause: largest * value for cause, value in static.items()}
            parts["gain"] = error * reach
            parts["product"] = self.product(largest * reach)
            slack = {cause: largest * value for cause, value in loose.items()}
            tried.append(Found(parts, largest * growth, largest * ceiling, slack))
        return max(tried, key=lambda one: one.settled + (one.growth if self.early else one.ceiling))


class Whole(Walk):
    """In integers: half a count wherever something is shifted out."""

    def input_error(self) -> float:
        return 0.5 * (self.plan.reference.lsb + self.plan.measurement.lsb) + self.set_point

    def sum(self, made: Sum, exact, low: float, high: float) -> float:
        """Alignments, and drives: their own rounding, as much of the mean, and what its shift adds."""
        parts = [*made.blocks, *made.banks]
        total = 0.5 * made.total.lsb * sum(part.align > 0 for part in parts)
        for bank in made.banks:
            for q, c in zip(bank.real_rates, bank.values):
                total += abs(c) * (bank.drive.lsb + (0.5 * bank.state.lsb / q if bank.rate_shift else 0.0))
        return total

    def inner_rounding(self) -> float:
        return 0.0

    def edge(self) -> float:
        return self.inner_end()

    def static(self) -> tuple[dict[str, float], dict[str, float]]:
        plan, true = self.plan, self.true
        weights = loose = rounding = 0.0
        if plan.direct:
            weights, loose = self.weights(plan.direct, true.direct, self.low, self.high)
            rounding = self.M * self.sum(plan.direct, true.direct, self.low, self.high)
        if plan.inner and plan.inner.to_wide:
            rounding += self.M * 0.5 * plan.wide.lsb
        lsb = plan.filtered.lsb
        if plan.feedback is None:
            rounding += 0.5 * lsb if plan.narrow else 0.0
        else:
            back, proved = plan.feedback.table, next(p.worst for p in plan.proofs if p.node == "v")
            far = (proved + 1) * lsb
            known, own = self.weights(back, true.den, -far, far, 1)
            weights, loose = weights + known, loose + own
            rounding += self.M * self.sum(back, true.den, -far, far)
            if plan.narrow:
                rounding += 0.5 * lsb * self.true.norm([1.0, -1.0])
            rounding += lsb * self.at_reset() * max(1.0, self.M * (1.0 + sum(back.values)))
        inner = self.M * self.edge() if plan.inner else 0.0
        static = {"inputs": self.N * self.off, "weights": weights, "inner": inner, "rounding": rounding}
        return static, {"weights": loose, "inner": self.inner_loose() if plan.inner else 0.0}

    def output(self, first: float, operator: float) -> float:
        """Its own rounding, and a limit's or that of what it is set to; a slew limit's."""
        integrator, lsb = self.plan.integrator, self.plan.output.lsb
        if not integrator:
            return max(first, 0.5 * lsb)
        slew = 0.5 * integrator.state.lsb if integrator.slew else 0.0
        return self.plan.sample_time * operator + lsb + slew

    def at_reset(self) -> float:
        """In counts of v: the worst error of e, and half a count."""
        plan, back = self.plan, self.plan.feedback
        direct = sum(plan.direct.values) if plan.direct else 0.0
        exact = direct / (1.0 + sum(back.table.values)) * plan.error.lsb / plan.filtered.lsb
        return 0.5 + abs(exact - back.steady / 2**back.steady_shift) * max(-plan.error.low, plan.error.high)

    def pieces(self) -> list[tuple[float, float]]:
        return [(self.gain_error(), self.G)]

    def gain_error(self) -> float:
        """The table beside the controller's wherever either of them bends; the step rounds the slope's
        product, and the signal was rounded. With factors: theirs, the nominal gains', the products', and how
        far interpolation may leave its ends."""
        plan, controller, lsb = self.plan, self.plan.controller, self.plan.gain.lsb / self.half
        moved = 0.5 * plan.schedule.signal.lsb * self.steepest() if plan.schedule else 0.0
        if plan.tuning:
            box, most = plan.tuning, controller.factors[1]
            ends = [[f * n / 2**box.to_gain for f in (box.factor.low, box.factor.high)] for n in box.nominal]
            spare = plan.gain.high - math.floor(max(map(max, ends)) + 0.5)
            factor = 0.5 * box.factor.lsb * max(map(abs, controller.gains))
            nominal = 0.5 * most * box.nominal_lsb / self.half
            return factor + nominal + (1.0 + max(spare, 0)) * lsb + 2.0 * moved
        if plan.schedule is None:
            return abs(plan.constant_gain * lsb - controller.gains[0])
        return self.table() + 0.5 * lsb + moved

    def steepest(self) -> float:
        controller = self.plan.controller
        points, gains, factors = controller.schedule.breakpoints, controller.gains, controller.factors
        return max(
            max(abs(f * b - g * a) for f in factors for g in factors) / (q - p)
            for a, b, p, q in zip(gains, gains[1:], points, points[1:])
        )

    def table(self) -> float:
        """Both are straight between all breakpoints and the ends of the signal; those that it reaches."""
        plan, schedule, controller = self.plan, self.plan.schedule, self.plan.controller
        lsb, unit = schedule.signal.lsb, plan.gain.lsb / self.half
        points = [p * lsb for p in schedule.breakpoints]
        (a, b), worst = controller.ranges.schedule, 0.0
        ends = [a, b, schedule.signal.low * lsb, schedule.signal.high * lsb]
        for place in [*points, *controller.schedule.breakpoints, *ends]:
            if min(ends) <= place <= max(ends):
                wanted = float(controller.schedule(min(max(place, a), b)))
                for side in (True, False):
                    worst = max(worst, abs(self.held(points, place, side) * unit - wanted))
        return worst

    def held(self, points: list[float], place: float, above: bool) -> float:
        """The table's gain in counts; at a breakpoint that of the segment above or below."""
        schedule = self.plan.schedule
        index = sum(p <= place if above else p < place for p in points) - 1
        if index < 0 or index >= len(points) - 1:
            return schedule.gains[0 if index < 0 else -1]
        slope = schedule.slopes[index] / 2 ** schedule.slope_shifts[index] / schedule.signal.lsb
        return schedule.gains[index] + slope * (place - points[index])

    def product(self, reach: float) -> float:
        return 0.5 * self.plan.increment.lsb / self.half if self.plan.gain_shift else 0.0


class Real(Walk):
    """In float or double, each operation with the last place of its largest result; and the reference, in
    double, with γ of all magnitudes."""

    def __init__(self, plan: Plan, true: Truth, early: bool, set_point: float) -> None:
        self.u = 2.0**-24 if plan.arithmetic == "f32" else U64
        super().__init__(plan, true, early, set_point)

    def last(self, largest: float) -> float:
        return self.u * largest if self.early else half_place(largest, self.u)

    def input_error(self) -> float:
        own = self.set_point
        if self.plan.arithmetic == "f32":
            own += half_place(self.refs, self.u, 0.0) + half_place(self.meas, self.u, 0.0)
        return own + half_place(self.far + own, self.u) + U64 * (self.refs + self.meas)

    def sum(self, made: Sum, exact: Weights, low: float, high: float) -> float:
        """From the oldest tap to the newest, then bank by bank."""
        u, largest, weights = self.u, max(-low, high), [float(w) for w in made.weights][::-1]
        cost = top = bottom = size = before = 0.0
        used = [w for w in weights if w]
        for i, w in enumerate(used):
            if math.frexp(w)[0] not in (0.5, -0.5):
                cost += half_place(abs(w) * largest, u)
            top, bottom, size = (
                top + max(w * low, w * high),
                bottom + min(w * low, w * high),
                size + abs(w) * largest,
            )
            if i:
                cost += half_place(max(top, -bottom) + gamma(len(used) + 2, u) * size, u)
        cost += gamma(made.taps + 2, U64) * float(np.abs(exact.taps).sum()) * largest
        before = size * (1.0 + gamma(made.taps + 2, u))
        for bank in made.banks:
            error, reach = self.bank(bank, low, high)
            before += reach
            cost += error + half_place(before, u) + 2.0 * U64 * before
        return cost

    def bank(self, bank: Bank, low: float, high: float) -> tuple[float, float]:
        """Its error, here and in the reference, and how far it reaches."""
        if bank.differences == 2:
            low, high = low - high, high - low
        error = reach = there = 0.0
        up = 1.0 + gamma(bank.modes + 2, self.u)
        for i, (q, c) in enumerate(zip(bank.real_rates, map(abs, bank.values))):
            drive = self.drive(q, low, high, bank, self.u, bank.compensated)
            there += c * self.drive(q, low, high, bank, U64, False)
            product = c * (high - low + drive)
            reach += product
            error += c * drive + half_place(product, self.u) + (half_place(reach * up, self.u) if i else 0.0)
        return error + there + gamma(bank.modes + 2, U64) * reach, reach * up

    def drive(self, q: float, low: float, high: float, bank: Bank, u: float, pair: bool) -> float:
        """D's error: what L has gathered and has not forgotten, and D's own rounding."""
        slack = 1.0 + 2.0**-10
        far, largest = (high - low) * slack, max(-low, high) * slack
        own, made = half_place(far, u), half_place(q * far, u)
        own_u = 2.0 * half_place(largest, u) if bank.differences == 2 else 0.0
        if not pair:
            gathered = q * own + made + half_place(largest, u)
            return own_u + gathered / q + own
        t = q * far + u * largest
        gathered = 2.0 * q * own + made + half_place(t, u) + 3.0 * u * (1.1 * q * largest + u * largest)
        return own_u + gathered / q + 2.0 * own

    def inner_rounding(self) -> float:
        r, state = 2.0 * self.true.rest.norm * self.E, self.plan.inner.state
        own = U64 * (self.clamp + 2.0 * r)
        if not state.floating:
            return own + state.lsb
        return own + half_place(1.01 * r, self.u) + half_place(1.01 * (self.clamp + r), self.u)

    def edge(self) -> float:
        """Its ends, and the float that a count becomes."""
        return self.inner_end() + (0.0 if self.plan.inner.state.floating else self.last(self.Z))

    def static(self) -> tuple[dict[str, float], dict[str, float]]:
        plan, true = self.plan, self.true
        weights = loose = rounding = 0.0
        if plan.direct:
            weights, loose = self.weights(plan.direct, true.direct, self.low, self.high)
            rounding = self.sum(plan.direct, true.direct, self.low, self.high)
        if plan.inner and plan.direct:
            rounding += self.last(1.01 * (1.01 * true.direct.norm * self.E + self.Z))
        if plan.inner or plan.feedback:
            rounding += U64 * (self.Z + self.reach)
        inner = self.M * self.edge() if plan.inner else 0.0
        if plan.feedback:
            known, own, rounding = self.recursive(weights + inner, rounding)
            weights, loose = weights + known, loose + own
        static = {"inputs": self.N * self.off, "weights": weights, "inner": inner, "rounding": rounding}
        return static, {"weights": loose, "inner": self.inner_loose() if plan.inner else 0.0}

    def output(self, first: float, operator: float) -> float:
        """An addition here and in the reference; in counts what is taken in twice, and an output set."""
        plan, largest = self.plan, max(map(abs, self.plan.controller.ranges.output))
        edge = (self.u + U64) * largest
        if not plan.integrator:
            return first + edge
        state, grown = plan.integrator.state, self.plan.sample_time * operator
        far = largest + 2.0 * (2.0 * self.half * self.G * self.reach + grown)
        each = U64 * far + (self.u * far if state.floating else self.u * largest + 3.0 * state.lsb)
        if plan.integrator.slew:
            most = plan.controller.slew_limit * plan.sample_time
            each += U64 * most + (self.u * most if state.floating else 0.5 * state.lsb)
        return grown + each + 2.0 * edge

    def recursive(self, known: float, rounding: float) -> tuple[float, float, float]:
        """How far v gets with all its errors, then what each operation costs there."""
        back, true = self.plan.feedback.table, self.true
        one, own = self.weights(back, true.den, -1.0, 1.0, 1)
        linear = 2.0 * self.sum(back, true.den, -1.0, 1.0)
        share = one + own + self.M * (linear + 4.0 * (self.u + U64))
        reset = self.at_reset()
        far = (self.reach + known + self.M * (rounding + reset)) / (1.0 - share)
        step = rounding + self.last(far) + 4.0 * U64 * far
        step += linear * far if self.early else self.sum(back, true.den, -far, far)
        return one * far, own * far, self.M * max(step, reset)

    def at_reset(self) -> float:
        """What the recursion is off its rest by."""
        direct, back, true = self.plan.direct, self.plan.feedback, self.true
        rest, still = 1.0 + sum(back.table.values), sum(direct.values) if direct else 0.0
        made = (
            abs(rest * back.steady - still)
            + abs(rest) * half_place(abs(back.steady) * self.E, self.u) / self.E
        )
        made += 16.0 * U64 * (abs(rest) * (1.0 + abs(back.steady)) + abs(still))
        if direct:
            count = direct.taps + back.table.taps + 1 + 8
            made += (
                2.0
                * gamma(count, U64)
                * (true.direct.norm + abs(true.direct.total / self.A1) * true.den.norm)
            )
        return made * self.E

    def pieces(self) -> list[tuple[float, float]]:
        return pieces(self.plan, self.half, self.u)

    def product(self, reach: float) -> float:
        increment = self.plan.increment
        made = self.last(1.01 * reach * self.half)
        if not increment.floating:
            made += 0.5 * increment.lsb
        return made / self.half + 2.0 * U64 * reach
