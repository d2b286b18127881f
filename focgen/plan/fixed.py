"""A controller in integers: every format follows from the physical ranges by l1 norms of the quantised
weights."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from focgen.control.controller import NOTHING, Controller
from focgen.errors import PlanError
from focgen.plan.banks import BankDraft, bank_drafts, drive_error
from focgen.plan.blocks import Draft, coarsest, finished, split
from focgen.plan.canonical import Table, Tables, inner_limits
from focgen.plan.formats import Interval, Word, exponent_for, integer, limit, nearest, span
from focgen.plan.gains import Gain, fixed_gain, span_of
from focgen.plan.mode_sums import Response, response_of
from focgen.plan.plan import Bank, Block, Feedback, Format, InnerIntegrator, Integrator, Sum
from focgen.plan.stability import Inverse, inverse
from focgen.present import present

_FEWEST_COUNTS = 16  # of the integrator that the smallest steady error must add


@dataclass(frozen=True)
class Signals:
    """The formats of what comes in and goes out; ``exponent`` and ``output_exponent`` are log2 of their
    lsb."""

    reference: Format
    measurement: Format
    error: Format
    exponent: int
    output: Format
    output_exponent: int


@dataclass(frozen=True)
class Filter:
    """From e to v: the parts of a plan of the same names, and log2 of the lsb of v."""

    direct: Sum | None
    inner: InnerIntegrator | None
    wide: Format
    narrow: int
    feedback: Feedback | None
    filtered: Format
    exponent: int


@dataclass(frozen=True)
class Actuation:
    """From v to u: the parts of a plan of the same names."""

    gain: Gain
    product: Format
    gain_shift: int
    increment: Format
    integrator: Integrator | None


def signals(controller: Controller, word: Word) -> Signals:
    """Formats of the inputs, whose difference must fit as well, and of the output."""
    where, ranges, unit = f"{controller.name} [ranges]", controller.ranges, controller.units.measurement
    (r0, r1), (m0, m1) = ranges.reference, ranges.measurement
    most = word.limit - 1  # one count is left for what is out of range, above as below
    exponent = exponent_for(max(map(abs, (r0, r1, m0, m1))), most, where, "the reference or measurement")
    while True:
        ref = span_of(r0, r1, exponent, where, "reference")
        meas = Interval(0, 0) if (m0, m1) == NOTHING else span_of(m0, m1, exponent, where, "measurement")
        error = (ref - meas).hull(0)
        if error.worst <= word.limit:
            break
        exponent += 1
    low, high = ranges.output
    output = exponent_for(max(abs(low), abs(high)), most, where, "the output")
    r, y, e = (_format(word.bits, exponent, x, unit) for x in (ref, meas, error))
    u = _format(word.bits, output, span_of(low, high, output, where, "output"), controller.units.output)
    return Signals(r, y, e, exponent, u, output)


def _format(bits: int, exponent: int, reach: Interval, unit: str = "") -> Format:
    return Format(integer(bits), 2.0**exponent, reach.low, reach.high, unit)


# ---------------------------------------------------------------------------------------------------- e to v


def filter_of(controller: Controller, tables: Tables, inputs: Signals, word: Word) -> Filter:
    """Formats and integer weights from e to v. Raises PlanError where the recursion is not stable or does not
    fit."""
    sample = _Sample(inputs.exponent, span(inputs.error), word, f"{controller.name} [transfer]")
    direct = sample.parts(tables.direct, 0) if tables.direct else None
    back = _past(word, 0, sample.where).parts(tables.feedback, 1) if tables.feedback else None
    at_rest = back.at_rest if back else 1.0
    inner = _inner(inner_limits(controller, at_rest), tables.rest, sample) if tables.rest else None
    if back is None:
        return _without_feedback(direct, inner, sample)
    return _with_feedback(direct, inner, back, sample, controller)


@dataclass(frozen=True)
class _Sample:
    """log2 of a history's lsb, the range of its counts, the arithmetic, and where its weights come from."""

    exponent: int
    each: Interval
    word: Word
    where: str

    def parts(self, table: Table, first: int) -> _Parts:
        """Modes lose the end of a type's range to the rounding of their means."""
        most = self.word.limit - 1
        each = Interval(max(self.each.low, -most), min(self.each.high, most))
        taps = split(table.weights[first:], first, self.each.worst, self.word, self.where)
        return _Parts(taps, bank_drafts(table.modes, each, self.word, self.where))

    def sum(self, name: str, history: str, parts: _Parts, total: int, unit: str = "") -> Sum:
        blocks = finished(parts.taps, self.exponent, total, self.each, self.word, unit)
        banks = tuple(b.finished(self.exponent, total) for b in parts.banks)
        reach = Interval(0, 0)
        parts_of: tuple[Block | Bank, ...] = (*blocks, *banks)
        for part in parts_of:
            reach = reach + span(part.sum).shifted(part.align)
        return Sum(name, history, blocks, _format(self.word.sum_bits, total, reach, unit), banks)


@dataclass(frozen=True)
class _Parts:
    """A sum before its parts are aligned: blocks of taps, newest first, and banks."""

    taps: list[Draft]
    banks: list[BankDraft]

    @property
    def coarsest(self) -> int:
        """log2 of the coarsest scale of weights times what they weigh, in counts of the history."""
        return max([coarsest(self.taps)] + [b.exponent + b.guard for b in self.banks])

    @property
    def at_rest(self) -> float:
        """What the denominator makes of a constant 1, where these are its weights from lag 1 on; modes add
        nothing."""
        return 1.0 + math.fsum(float(c) * 2.0**d.exponent for d in self.taps for c in d.counts)

    @property
    def response(self) -> Response:
        """The quantised weights by lag from 0 on."""
        taps = np.concatenate([d.counts * 2.0**d.exponent for d in self.taps])
        return response_of(taps, self.taps[0].first, [b.modes for b in self.banks])


def _past(word: Word, exponent: int, where: str) -> _Sample:
    """Of v, which may be anywhere in its type."""
    return _Sample(exponent, Interval(-word.limit - 1, word.limit), word, where)


def _inner(limits: tuple[float, float], table: Table, sample: _Sample) -> InnerIntegrator:
    """The integral, clamped to ``limits``; ``to_wide`` is filled in once the wide format is known."""
    parts, (low, high) = sample.parts(table, 0), limits
    exponent = sample.exponent + parts.coarsest
    while True:
        rest = sample.sum("rest", "error", parts, exponent)
        clamp = Interval(nearest(low * 2.0**-exponent), nearest(high * 2.0**-exponent))
        worst = (clamp + span(rest.total) + span(rest.total)).worst
        if span(rest.total).worst <= limit(sample.word.sum_bits) and worst <= limit(64):
            break
        exponent += 1
    bits = 32 if sample.word.sum_bits == 32 and worst <= limit(32) else 64
    return InnerIntegrator(rest, _format(bits, exponent, clamp), 0)


def _floor(direct: _Parts | None, inner: InnerIntegrator | None, sample: _Sample) -> int:
    """The finest exponent of the wide format: no shift to it goes left."""
    finest = [sample.exponent + direct.coarsest] if direct else []
    return max(finest + ([_log2(inner.state.lsb)] if inner else []))


def _log2(lsb: float) -> int:
    return math.frexp(lsb)[1] - 1


def _combined(
    direct: _Parts | None, inner: InnerIntegrator | None, sample: _Sample, exponent: int
) -> tuple[Sum | None, InnerIntegrator | None, Interval]:
    """Both parts of p aligned to 2^``exponent``, and the range of p."""
    made = sample.sum("direct", "error", direct, exponent) if direct else None
    reach = span(made.total) if made else Interval(0, 0)
    if inner:
        inner = InnerIntegrator(inner.rest, inner.state, exponent - _log2(inner.state.lsb))
        reach = reach + span(inner.state).shifted(inner.to_wide)
    return made, inner, reach


def _without_feedback(direct: _Parts | None, inner: InnerIntegrator | None, sample: _Sample) -> Filter:
    """v is p, narrowed to 32 bits."""
    word, exponent = sample.word, _floor(direct, inner, sample)
    while True:
        made, placed, reach = _combined(direct, inner, sample, exponent)
        if reach.worst <= limit(word.sum_bits) - (1 << (word.sum_bits // 2)):
            break
        exponent += 1
    narrow = max(0, reach.worst.bit_length() - 31)
    while reach.shifted(narrow).worst > limit(32):
        narrow += 1
    wide = _format(word.sum_bits, exponent, reach)
    v = _format(32, exponent + narrow, reach.shifted(narrow))
    return Filter(made, placed, wide, narrow, None, v, exponent + narrow)


def _with_feedback(
    direct: _Parts | None,
    inner: InnerIntegrator | None,
    back: _Parts,
    sample: _Sample,
    controller: Controller,
) -> Filter:
    word = sample.word
    own = _quantised_inverse(back, controller, word)
    b = direct.response if direct else Response(np.zeros(1))
    reach = own.norm_after(b.weights, b.left_out) * sample.each.worst * 2.0**sample.exponent
    if inner:
        reach += own.norm * span(inner.state).worst * inner.state.lsb
    exponent = exponent_for(reach, word.limit, controller.name, "the filtered error")
    while exponent < 150:
        made = _recursion(direct, inner, sample, back, exponent)
        if made is not None and reach * 2.0**-exponent + _noise(made, own) <= word.limit - 1:
            return made
        exponent += 1
    what = f"the recursion multiplies rounding by up to {own.norm:.3g}, more than {word.bits} bits can hold"
    raise PlanError(controller.name, what, "choose q31, f32 or f64, or a longer sample_time")


def _quantised_inverse(back: _Parts, controller: Controller, word: Word) -> Inverse:
    response = back.response
    made = inverse(np.concatenate([[1.0], response.weights[1:]]), response.left_out)
    if made is None:
        what = f"its recursion is stable, but not with weights of {word.bits} bits"
        raise PlanError(controller.name, what, "choose q31, f32 or f64, or a longer sample_time")
    return made


def _noise(made: Filter, own: Inverse) -> float:
    """What rounding can add to v, in counts of v."""
    sums = [present(made.feedback).table] + ([made.direct] if made.direct else [])
    aligned = sum(len(s.blocks) + len(s.banks) for s in sums) + 1
    drives = math.fsum(drive_error(s) for s in sums) * 2.0**-made.narrow
    carried = own.norm_after(np.array([1.0, -1.0]))
    at_reset = 2.0 * max(1.0, own.norm * (1.0 + math.fsum(present(made.feedback).table.values)))
    return 0.5 * carried + own.norm * (0.5 * aligned * 2.0**-made.narrow + drives) + at_reset


def _recursion(
    direct: _Parts | None, inner: InnerIntegrator | None, sample: _Sample, back: _Parts, exponent: int
) -> Filter | None:
    """The filter with v in counts of 2^``exponent``; None where the wide format cannot be finer than v."""
    word = sample.word
    past = _past(word, exponent, sample.where)
    wide = max(_floor(direct, inner, sample), exponent + back.coarsest)
    while wide <= exponent:
        made, placed, p = _combined(direct, inner, sample, wide)
        table = past.sum("feedback", "filtered", back, wide)
        narrow = exponent - wide
        half = (1 << narrow) >> 1
        x = p - span(table.total) + Interval(-half, half)
        if max(x.worst, p.worst, span(table.total).worst) + half <= limit(word.sum_bits):
            steady, by = _steady(made, table, sample, exponent, word)
            v = _format(word.bits, exponent, past.each)
            return Filter(
                made,
                placed,
                _format(word.sum_bits, wide, x),
                narrow,
                Feedback(table, steady, by),
                v,
                exponent,
            )
        wide += 1
    return None


def _still(direct: Sum | None, table: Sum | None) -> float:
    """The gain from a constant e to v, the inner integral apart."""
    total = math.fsum(direct.values) if direct else 0.0
    return total / (1.0 + math.fsum(table.values)) if table else total


def _steady(direct: Sum | None, table: Sum, sample: _Sample, exponent: int, word: Word) -> tuple[int, int]:
    """Constant e to constant v, as count and right shift."""
    ratio = _still(direct, table) * 2.0 ** (sample.exponent - exponent)
    by = 2 * word.bits - 2
    while nearest(abs(ratio) * 2.0**by) > word.limit:
        by -= 1
    return nearest(ratio * 2.0**by), by


# ---------------------------------------------------------------------------------------------------- v to u


def actuation(controller: Controller, made: Filter, inputs: Signals, word: Word) -> Actuation:
    """Gain, product, increment and integrator."""
    factor = 0.5 * controller.sample_time if controller.integrator else 1.0
    gain = fixed_gain(controller, factor, word)
    exponent = made.exponent + _log2(gain.format.lsb)
    reach = span(made.filtered) * span(gain.format)
    product = _format(64, exponent, reach)
    unit = controller.units.output
    if not controller.integrator:
        by = inputs.output_exponent - exponent
        if by < 0:
            raise _too_small(controller, by)
        increment = _narrowed(reach, by, inputs.output_exponent, word.sum_bits, unit)
        return Actuation(gain, product, by, increment, None)
    table = made.feedback.table if made.feedback else None
    slowest = abs(_still(made.direct, table)) * inputs.error.lsb * _smallest(gain)
    return _integrated(controller, gain, product, slowest, inputs, word)


def _smallest(gain: Gain) -> float:
    """The smallest gain that is not 0, with the h/2 in it, and the smallest factor on it."""
    counts = gain.schedule.gains if gain.schedule else (gain.constant,)
    factor = gain.tuning.factor.low * gain.tuning.factor.lsb if gain.tuning else 1.0
    return min((abs(c) for c in counts if c), default=0) * gain.format.lsb * factor


def _too_small(controller: Controller, by: int) -> PlanError:
    what = f"the output range is too small by 2^{-by} for what the transfer function can ask for"
    return PlanError(
        f"{controller.name} [ranges]", what, "narrow the input ranges, widen the output's, or choose q31"
    )


def _narrowed(reach: Interval, by: int, exponent: int, bits: int, unit: str) -> Format:
    reach = reach.shifted(by)
    return _format(bits if reach.worst <= limit(bits) else 64, exponent, reach, unit)


def _integrated(
    controller: Controller, gain: Gain, product: Format, slowest: float, inputs: Signals, word: Word
) -> Actuation:
    """The integrator is as fine as its width allows: 32 bits, in q15, only where they lose no increment.

    ``slowest`` is the increment of a steady error of one count at the smallest gain.
    """
    exponent, unit = _log2(product.lsb), controller.units.output
    for bits in sorted({word.sum_bits, 64}):
        fine = _finest(exponent, span(product), inputs, bits)
        if fine is None:
            continue
        d = span(product).shifted(fine - exponent)
        lost = d.worst < 1 << word.bits or 0.0 < slowest < _FEWEST_COUNTS * 2.0**fine
        if bits == 64 or not lost:
            to_output = inputs.output_exponent - fine
            state = _format(bits, fine, span(inputs.output) * Interval(1 << to_output, 1 << to_output), unit)
            increment = _format(bits, fine, d, unit)
            return Actuation(gain, product, fine - exponent, increment, Integrator(state, to_output))
    raise _too_small(controller, inputs.output_exponent - exponent)


def _finest(exponent: int, product: Interval, inputs: Signals, bits: int) -> int | None:
    """log2 of the finest lsb at which I + d + d fits; None where the output's is finer still."""
    for fine in range(max(exponent, inputs.output_exponent - bits), inputs.output_exponent + 1):
        d = product.shifted(fine - exponent)
        state = span(inputs.output).worst << (inputs.output_exponent - fine)
        if state + 2 * d.worst + (1 << (inputs.output_exponent - fine)) <= limit(bits):
            return fine
    return None
