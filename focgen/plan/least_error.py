"""The steady error from which on an integral always moves; a smaller one may be left standing.

Every rounding on the way is taken to be against it. A sum of a constant history is short by half a count for
each alignment, and by what its modes keep. An increment may be short by half a count of its own.

A recursion in integers takes up what rounding drops, so that v need not be still: its mean is what its
weights ask for, within the errors of its sums. An integral adds up, so the mean is what counts, unless a slew
limit cuts what v swings by. In floating point each operation takes away a part of its result; all of them
together are the share that is lost.

Ahead of an integrator the inner integral may stand anywhere, also where it cancels the error. So it is the
inner one's figure that counts there. Where exact arithmetic gives it nothing in the end (s^−0.5 and an
exponential memory), what is said of the integrator holds since a reset to the error, which sets the inner one
to 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from focgen.fractional.transfer import Polynomial
from focgen.plan.canonical import realise
from focgen.plan.formats import shift
from focgen.plan.plan import Bank, Format, Plan, Sum
from focgen.plan.proofs import at_rest, inverse_of_recursion, rounding_reach
from focgen.plan.truncation import largest_error
from focgen.plan.tuning import gain_intervals
from focgen.present import present

_DIGITS = 2.0**-24  # of the largest input: what a measurement has at most
_UNIT = {"f64": 2.0**-53, "f32": 2.0**-24}
_UP = 1.0 + 1e-9  # over the rounding of what is reckoned here
_MOST_LOST = 0.25  # of a result, by rounding: beyond it nothing is said


def smallest_error(plan: Plan) -> float | None:
    """The steady error, physical, from which on an integral always moves once the error has been held, at the
    smallest gain that is not 0 and, in f64, wherever the integral stands: see the module's description.

    It may be beyond the ranges. None where there is no integral, where exact arithmetic does not act on a
    steady error, and where rounding in floating point may take a quarter of it.
    """
    if plan.inner and _gain_at_rest(plan, plan.inner.rest, realise(plan.controller).rest):
        return _inner_least(plan)
    if plan.integrator is None or not _gain_at_rest(plan, plan.direct, realise(plan.controller).direct):
        return None
    return _floating_least(plan) if plan.floating else _fixed_least(plan)


def out_of_reach(plan: Plan) -> bool:
    """Whether no error within the ranges is sure to move it."""
    least = smallest_error(plan)
    return least is not None and least > largest_error(plan.controller)


def since_reset(plan: Plan) -> bool:
    """Whether :func:`smallest_error` holds only since a reset to the error."""
    acts = plan.inner and _gain_at_rest(plan, plan.inner.rest, realise(plan.controller).rest)
    return bool(plan.inner) and not acts


def coarse(plan: Plan) -> bool:
    """Whether an error may be left that a measurement has digits for: a count, or 24 bits of the largest."""
    least = smallest_error(plan)
    inputs = max(map(abs, (*plan.controller.ranges.reference, *plan.controller.ranges.measurement)))
    return least is not None and least > max(_DIGITS * inputs, 0.0 if plan.floating else plan.error.lsb)


def _gains(plan: Plan) -> list[float]:
    """Every gain, in counts, that is not 0; of a tunable one at both ends of its factor."""
    if plan.tuning is None:
        found = list(plan.schedule.gains) if plan.schedule else [plan.constant_gain]
    elif plan.floating:
        found = [g * plan.tuning.factor.low for g in plan.tuning.nominal]
    else:
        found = [end for each in gain_intervals(plan.tuning) for end in (each.low, each.high)]
    return [g for g in found if g]


def _gain_at_rest(plan: Plan, table: Sum | None, terms: Polynomial) -> float:
    """Σ w, physical; 0 where it is nothing but the weights' rounding."""
    if table is None:
        return 0.0
    biased = not plan.exponential and any(not t.order.is_integer() for t in terms)
    return math.fsum(table.values) if biased or any(t.order == 0.0 for t in terms) else 0.0


def _inner_least(plan: Plan) -> float | None:
    inner = present(plan.inner)
    if plan.floating:
        lost = _lost(plan, inner.rest)
        each = abs(math.fsum(inner.rest.values)) * (1.0 - lost)
        return _least_addend(inner.state) * _UP / each if lost < _MOST_LOST else None
    return _first(plan, 0.0, _per_count(plan, inner.rest), _short(inner.rest))


# --------------------------------------------------------------------------------------------------- integers


def _first(plan: Plan, needed: float, each: float, short: float) -> float:
    """The least error of which ``each`` · counts − ``short`` is above ``needed``."""
    return (math.floor((needed + short) / each * _UP) + 1) * plan.error.lsb


def _per_count(plan: Plan, table: Sum) -> float:
    """|Σ w|: what a steady count of the error adds, in counts of the sum's total."""
    return abs(math.fsum(table.values)) * plan.error.lsb / table.total.lsb


def _short(table: Sum, still: bool = True) -> float:
    """What a sum's alignments and its modes may take away in the mean, in counts of its total; ``still``: of
    a constant history."""
    kept = [bank for bank in table.banks if bank.rate_shift or not still]
    aligned = sum(bool(b.align) for b in table.blocks) + sum(bool(b.align) for b in kept)
    return 0.5 * aligned + math.fsum(map(_stalled, kept)) / table.total.lsb


def _stalled(bank: Bank) -> float:
    """What the modes of a bank keep, in units of the history. L moves by a D, rounded where that is shifted:
    since L does not run away, the mean of a D is 0, but for half of what is shifted out."""
    late = 0.5 * bank.state.lsb if bank.rate_shift else 0.0
    return math.fsum(abs(c) * late / q for c, q in zip(bank.values, bank.real_rates))


def _fixed_least(plan: Plan) -> float | None:
    gains, direct = _gains(plan), present(plan.direct)
    if not gains:
        return None
    each, short = _per_count(plan, direct), _short(direct)
    if plan.feedback is None:
        return _searched(plan, lambda n: math.ceil(each * n / _UP - short), gains)
    smallest = min(map(abs, gains)) * 2.0**-plan.gain_shift
    needed = 0.5 / smallest if plan.gain_shift else 0.0
    needed += _swing(plan, smallest)
    wide = at_rest(plan) * 2.0**plan.narrow
    return _first(plan, needed * wide, each, short + _short(plan.feedback.table, still=False))


def _swing(plan: Plan, gain: float) -> float:
    """By how much more v has to be, in counts, where a slew limit may cut one side of what v swings by.

    With v between x − R and x + R, two increments reach 2 gain (x + R) and a rounding. While x is at most R,
    that is no more than 4 gain R; and where x is larger, all of them have the same sign.
    """
    slew, swing = present(plan.integrator).slew, rounding_reach(plan, present(inverse_of_recursion(plan)))
    return 0.0 if slew is None or 4.0 * gain * swing + 2.0 <= slew else swing


def _searched(plan: Plan, sum_of: Callable[[int], int], gains: list[float]) -> float:
    """By bisection: what a step makes of the least sum of an error, of either sign, grows with it."""

    def moves(n: int) -> bool:
        sums = [sign * max(sum_of(n), 0) for sign in (1, -1)]
        return all(shift(int(g) * shift(p, plan.narrow), plan.gain_shift) for p in sums for g in gains)

    low, high = 0, 1
    while not moves(high):
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if moves(middle) else (middle, high)
    return high * plan.error.lsb


# --------------------------------------------------------------------------------------------- floating point


def _floating_least(plan: Plan) -> float | None:
    """2 d has to be a count, or half a digit of the integral where it is largest."""
    lost, gains = _lost(plan, present(plan.direct)), _gains(plan)
    if plan.feedback:
        lost = _lost_in_recursion(plan)
    if not gains or lost >= _MOST_LOST:
        return None
    steady = math.fsum(present(plan.direct).values) / (at_rest(plan) if plan.feedback else 1.0)
    needed = _least_addend(present(plan.integrator).state) * _UP
    return needed / (min(map(abs, gains)) * abs(steady) * (1.0 - lost))


def _least_addend(state: Format) -> float:
    if not state.floating:
        return 0.5 * state.lsb
    return 0.25 * float(np.spacing(max(abs(state.low), abs(state.high))))


def _rounded(plan: Plan, table: Sum) -> float:
    """What rounding may add to a sum of a history that is at most 1, beside the last place of the sum."""
    unit = _UNIT[plan.arithmetic]
    taps = math.fsum(map(abs, table.values))
    kept = math.fsum(
        abs(c) * (4.0 if bank.compensated else 4.0 + 2.0 / q)
        for bank in table.banks
        for c, q in zip(bank.values, bank.real_rates)
    )
    return (table.taps + 3 * table.modes + 4) * unit * taps + (table.modes + 4) * unit * kept


def _lost(plan: Plan, table: Sum) -> float:
    """The share of a sum of a constant that rounding may take away."""
    return _rounded(plan, table) / abs(math.fsum(table.values)) + 8.0 * _UNIT[plan.arithmetic]


def _lost_in_recursion(plan: Plan) -> float:
    """The same of v: each step's rounding goes through 1/A."""
    own, back = inverse_of_recursion(plan), present(plan.feedback).table
    if own is None:
        return 1.0
    direct = _lost(plan, present(plan.direct)) * at_rest(plan)
    return own.norm * (direct + 2.0 * _rounded(plan, back) + 8.0 * _UNIT[plan.arithmetic])
