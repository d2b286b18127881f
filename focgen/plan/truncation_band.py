"""What an operator that is fitted to s^α is off by, against s^α, for sines in its band.

The controller is compared with one whose fractional powers are (jω)^β themselves; whole powers, 1/s included,
are sampled in both. With b and a what numerator and denominator may be off by at ω,

    |B̂/Â − B/A| ≤ (b + |B/A| a) / (|A| − a),

looked at on lines ``_STEP`` apart in t = ln ω. Between two lines A changes by at most the step times
Σ |dA/dt|, a term c s^β by β |c| ω^β (|d(1 − e^{−jθ})/dt| = θ, and |1 − e^{−jθ}| ≤ θ). The trapezoid of 1/s is
at most 1/ω large. So the bound holds at every ω in the band.
"""

from __future__ import annotations

import numpy as np

from focgen.arrays import Array
from focgen.fractional.continuous_fit import Lines, power_of, spread
from focgen.fractional.elementary import exp, log, total
from focgen.fractional.transfer import Polynomial, Term
from focgen.plan.canonical import realise
from focgen.plan.gains import largest_gain
from focgen.plan.plan import Plan
from focgen.plan.truncation import largest_error
from focgen.present import present

_STEP = 1e-3
_SLACK = 1.0 + 1e-9


def band_truncation(plan: Plan) -> float | None:
    """Bound on the error of the signal ahead of the integrator, physical, for a sine of the error of any
    frequency in the band and as large as the ranges allow, once it is settled; None where the denominator may
    vanish."""
    form, (low, high) = realise(plan.controller), present(plan.band)
    off = {memory.order: memory.tolerance for memory in plan.memories}
    lines = spread(low, high, int(float(log(high / low)) / _STEP) + 2)
    end = lines * float(exp(_STEP))
    b = _wrong(form.direct, off, lines, end) + _wrong(form.rest, off, lines, end) / lines
    a = _wrong(form.den, off, lines, end)
    least = _least(form.den, plan.sample_time, lines, end) - a
    if not np.all(least > 0.0):
        return None
    most = _most(form.direct, end) + _most(form.rest, end) / lines
    worst = float(((b + most / (least + a) * a) / least).max())
    return largest_gain(plan.controller) * largest_error(plan.controller) * worst * _SLACK


def _sizes(terms: Polynomial, omega: Array) -> list[Array]:
    return [abs(t.coefficient) * exp(t.order * log(omega)) for t in terms]


def _wrong(terms: Polynomial, off: dict[float, float], lines: Array, end: Array) -> Array:
    """What the powers may be off by from each line to its end."""
    parts = [off[t.order] * size for t, size in zip(terms, _sizes(terms, end)) if t.order in off]
    return total(parts) if parts else np.zeros_like(lines)


def _most(terms: Polynomial, end: Array) -> Array | float:
    """Bound on the polynomial's size up to each end."""
    return total(_sizes(terms, end)) if terms else 0.0


def _least(terms: Polynomial, step: float, lines: Array, end: Array) -> Array:
    """Bound from below on the polynomial's size from each line to its end."""
    value = total([_value(t, step, lines) for t in terms])
    change = total([t.order * size for t, size in zip(terms, _sizes(terms, end))])
    made: Array = np.sqrt(value[0] * value[0] + value[1] * value[1]) - _STEP * change
    return made


def _value(term: Term, step: float, omega: Array) -> Array:
    """c s^β at jω, a whole β as it is sampled: real and imaginary part, shape (2, points)."""
    if not term.order.is_integer():
        return term.coefficient * power_of(term.order, omega)
    difference = Lines(0.5, omega * step).departure / step
    found = np.stack([np.full(len(omega), term.coefficient), np.zeros(len(omega))])
    for _ in range(int(term.order)):
        real = found[0] * difference[0] - found[1] * difference[1]
        found = np.stack([real, found[0] * difference[1] + found[1] * difference[0]])
    return found
