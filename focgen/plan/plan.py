"""The plan: everything the C and its bit-true reference need, decided once.

A plan describes one controller step in machine terms. Both the templates, which print it, and
:mod:`focgen.plan.execute`, which runs it in Python, follow this description and nothing else.

One step, at sample k (steps that a plan does not need are ``None`` and leave no code behind)
--------------------------------------------------------------------------------------------
1. Inputs. Fixed point: reference, measurement and schedule are clamped to ``low`` … ``high`` of their
   formats. e_k = reference − measurement (counts of ``error``; exact, no rounding).
   With a ``set_point`` the reference is filtered first: :mod:`focgen.plan.setpoint`.
2. ``direct``: p = Σ_{j=0…} w_j e_{k−j}, the numerator's terms of order ≥ 0 in one table.
3. ``inner`` (numerator terms of negative order): r_k = Σ_{j=0…} w_j e_{k−j}, where the trapezoid's h/2 is
   inside the weights; z = clamp(z + (r_k + r_{k−1})); p = p + shift(z, to_wide).
4. ``feedback`` (denominators with dynamics; all weights divided by the coefficient of v_k):
   S = Σ_{j=1…} w_j v_{k−j}, x = p − S + carry_{k−1}, v_k = shift(x, narrow), carry_k = x − v_k·2^narrow
   (before v_k is saturated): what rounding drops is taken up by the next sample, so it cannot pile up in a
   slow recursion. Floating: v_k = p − S. Without feedback v_k = shift(p, narrow) (floating: p).
5. ``schedule``: g, linear between breakpoints, held beyond them. Without it g is ``constant_gain``.
6. d_k = shift(g·v_k, gain_shift), in physical output units (per second, times h/2, where an integrator
   follows).
7. ``integrator``: I = clamp(I + (d_k + d_{k−1})), u = shift(I, to_output). Floating: u = I. With a ``slew``
   d_k + d_{k−1} is clamped to ± slew first; what is cut off is forgotten, so nothing winds up.
   Without an integrator d is in counts of the output and u = clamp(d_k) to ``low`` … ``high`` of ``output``.

Histories hold the past ``error_lags`` samples of e and the past ``filtered_lags`` samples of v.

``reset(ref, meas, u0)`` takes the error as having been constant for ever. Fixed point: ref and meas are
clamped as in a step, u0 to the output limits. The history of e is filled with e; z = 0, r_{k−1} = r of that
history. With feedback v = saturate(shift(steady·e, steady_shift)) fills the history of v and carry = 0;
without, v is step 4's of that history. I = u0·2^to_output. The first step after it takes d_{k−1} = shift(g·v,
gain_shift) with its own g (the schedule is not known before). ``init`` is the reset to ref = meas, u0 = 0,
with u0 clamped alike. ``track(u)`` sets I = clamp(u·2^to_output) and touches nothing else.
Without an integrator u0 is not looked at and track does nothing.

Flags describe the latest step (0 after init and reset; track leaves them): bit 0: u is at its high limit; bit
1: u is at its low limit; bit 2: the (clamped) schedule is below the first or above the last breakpoint; bit
3: an input of the step was outside its range and has been clamped (fixed point only); bit 4: an argument
could not be used (floating point only, below).

Fixed point
-----------
An integer count x stands for the physical value x · lsb; every lsb is a power of two. shift(x, n) rounds half
up: (x + 2^(n−1)) >> n for n > 0, x for n = 0; n is never negative. The types:

=========  ==========================================  ==========================================
node       q15                                         q31
=========  ==========================================  ==========================================
inputs, e  int16                                       int32
weights    int16, products 16×16→32                    int32, products 32×32→64
block sum  int32                                       int64
total, p   int32 (``wide``)                            int64 (``wide``)
v          int16 with feedback, else int32             int32
g          int16; g·v is exact, at most 48 bits:       int32; g·v is exact, int64
           (v>>16)·g·2^16 + (v & 0xffff)·g
slopes     int16, slope·(s − breakpoint) in int32      int32, in int64
d, I, z    int32, or int64 (see the formats)           int64
u          int16                                       int32
=========  ==========================================  ==========================================

A history sum is split into blocks of taps, each with weights of its own scale. Each block's sum starts at 0
and is exact; total = Σ_blocks shift(block sum, align), so all blocks meet at the lsb of ``Sum.total``. A
proof in ``proofs`` says for each of these nodes that it cannot overflow, so the order does not matter. Every
narrowing (v, u) saturates to the ends of its type all the same; the proofs say that in range it never has to.
Additions to an integral (z, I) are made in the type of its state, r and d widened to it.

Exponential memory ------------------ With ``memory`` "exponential" a sum's taps are short, and ``Sum.banks``
remember the rest. A term c s^β, m − 1 < β < m, is c h^−β ∇^m (x_k + Σ_{j≥1} Σ_i w_i p_i^(j−1) x_{k−j})
(:mod:`focgen.fractional.exponential`), ∇ the backward difference; its lag 0 and every whole order are taps.
With the operator "continuous" x_k has a weight of its own (:mod:`focgen.fractional.continuous`). A
mode's part, ∇^m Σ_{j≥1} p^(j−1) x_{k−j}, is how far the history's past is from its own mean, weighted by p^j.
So a mode keeps that mean, L: it never leaves the range of what it averages, and a constant is remembered
without any error.

With u_k = ∇^(m−1) x_k (x itself for m = 1), at sample k, before L_i knows of it:

    D_i = u_{k−1} − L_i,      M = Σ_i c_i D_i,      L_i ← L_i + q_i D_i,      q_i = 1 − p_i

in the order of the bank. The sum's total is that of its blocks plus M of each bank. Every fractional term has
modes of its own; those too slow to be held like the rest are in a second bank.

* Fixed: D_i = shift(u_{k−1}·2^up − L_i, to_drive), M = Σ c_i D_i, L_i ← L_i + shift(a_i D_i, rate_shift),
  where a_i counts 2^−(to_drive + rate_shift). M starts at 0, is exact, and enters as shift(M, align). L has
  ``up`` bits more than x, and D_i is the only thing that is rounded (where rate_shift is 0): to at most half
  a count of D, whatever q is, and for ever, since L only ever moves towards u.
* Floating: as written, M = 0, M ← M + c_i D_i. In a ``compensated`` bank L_i is the sum of two numbers, L_i
  and r_i: D_i = (u_{k−1} − L_i) − r_i, t = r_i + q_i D_i, L' = L_i + t, r_i ← t − (L' − L_i), L_i ← L'. That
  is so for f32 and slow modes: L_i alone would stand still as soon as q_i D_i is less than half its last
  digit.

``reset`` and ``init`` set L_i to u of the constant past: x (m = 1) or 0 (m = 2), and r_i = 0. ``track``
leaves them.

=================  ========================  ========================  ================
mode               q15, q ≥ 2^−8             q15, slower               q31
=================  ========================  ========================  ================
D, c               int16                     int16                     int32
a                  int16                     int32                     int32
a·D, L             int32                     int64                     int64
M                  int32                     int32                     int64
=================  ========================  ========================  ================

u·2^up − L_i is in the type of L.

Floating point
--------------
The same structure with one block per sum, lsb 1.0 and no shifts: acc = 0; acc = acc + w·x, from the oldest
sample to the newest, sample k last. Each operation is rounded to the type, none is contracted; brackets are
as written above. g = gains[i] + slopes[i]·(s − breakpoints[i]).

In f32 integrals are whole counts (:mod:`focgen.plan.integrals`): d_k and r_k are rounded to counts of 2^−up,
halves away from zero, to at most 2^61; I and z are int64, as in fixed point, and what they give is the float
nearest to their count, halves to even, times 2^−up. u is clamped once more, since a limit need be no whole
number of counts. u0 and ``track``'s u become counts likewise, after their clamp.

An argument is usable where its magnitude is below 2^48 (float) or 2^512 (double); NaN and infinity are not
(:mod:`focgen.plan.usable`). No other ever enters the state:

- A step whose reference, measurement or schedule is not usable is left out: it changes nothing but the flags
  (bit 4, and bits 0 and 1 of the output it returns) and returns the output that stands. That is I with an
  integrator, so also what a reset or a track has left there; without one the output of the latest step that
  was not left out, or 0, clamped, where there has been none since init or reset. The next step whose inputs
  are usable follows the latest such one as if there had been nothing in between.
- A reset takes e = 0 where ref or meas is not usable, and u0 = 0 where u0 is not; the flags are bit 4 then.
- A track of what is not usable raises bit 4 and does nothing else.

A step with usable inputs has a state that no step can have left, a flipped bit or memory that nothing has
initialised, where I + (d_k + d_{k−1}) (without an integrator, or in counts: d_k or r_k) is NaN or infinite,
or where it finds I or a z in counts beyond its limits, a d_{k−1} or r_{k−1} beyond 2^61 counts, or, where
there are counts, a slot that the ring of e does not have. It is left out in the same way; the output that
stands is 0, clamped, where I (or the output kept) is no number within the limits, or the slot is none. Then
the past is as after a reset to this sample's error and that output
(:mod:`focgen.plan.damage`).

In the integer arithmetics a reset or a track whose argument is beyond its range raises bit 3.

Tuning
------
With ``tuning`` the gains and the output's limits are part of the state: ``init`` takes the parameters that
``default`` gives, and ``tune`` takes others, in this order: ``tune``, ``reset``, ``track``, step.

    g_i = shift(factor_i · nominal_i, to_gain),  slope_i = shift((g_{i+1} − g_i) · reciprocal_i, to_slope_i)

in 64 bits; floating without the shifts. ``tune`` then clamps I to the new limits at once (without an
integrator the output kept), as every clamp to the output's limits from then on; d_{k−1} stays as it is, so
only the rate at which u moves changes. Parameters outside the box (``refused``) change nothing. After a
reset d_{k−1} is taken with the first step's own g, with and without a schedule. ``reset`` and ``track`` keep
the parameters. A floating step that finds parameters that no ``tune`` has taken (NaN, a gain or a limit
outside the box) has a damaged state, and the default ones return with the mended one. The gain that a slope
leads to is asked about, too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from focgen.control.controller import Controller
from focgen.fractional.continuous import ContinuousMemory
from focgen.fractional.exponential import ExponentialMemory
from focgen.plan.sums import Bank, Block, Count, Format, SetPoint, Sum

__all__ = [
    "FLAG_HIGH",
    "FLAG_INPUT",
    "FLAG_INVALID",
    "FLAG_LOW",
    "FLAG_SCHEDULE",
    "Bank",
    "Block",
    "Count",
    "ErrorBound",
    "Feedback",
    "Format",
    "InnerIntegrator",
    "Integrator",
    "Plan",
    "Proof",
    "Schedule",
    "SetPoint",
    "Sum",
    "Tuning",
]

LONGEST = 65_534
"""Past samples that a history in C can hold: the ring's slots are counted in 16 bits."""

FLAG_HIGH, FLAG_LOW, FLAG_SCHEDULE, FLAG_INPUT, FLAG_INVALID = 1, 2, 4, 8, 16


@dataclass(frozen=True)
class InnerIntegrator:
    """z = clamp(z + (r + r_prev)) to ``low`` … ``high`` of ``state``; ``rest`` makes r, in counts of
    ``state`` too.

    ``to_wide`` is the right shift, rounding, from z to ``Plan.wide``.
    """

    rest: Sum
    state: Format
    to_wide: int


@dataclass(frozen=True)
class Feedback:
    """The recursion's table, and the gain from a constant e to the v that goes with it (for ``reset``)."""

    table: Sum
    steady: Count
    steady_shift: int


@dataclass(frozen=True)
class Schedule:
    """g = gains[i] + shift(slopes[i] · (s − breakpoints[i]), slope_shifts[i]) for breakpoints[i] ≤ s <
    breakpoints[i+1].

    All in counts; held at the first gain below and at the last gain from the last breakpoint on. ``slopes``
    and ``slope_shifts`` have one entry a segment, one fewer than ``gains``.
    """

    signal: Format
    breakpoints: tuple[Count, ...]
    gains: tuple[Count, ...]
    slopes: tuple[Count, ...]
    slope_shifts: tuple[int, ...]


@dataclass(frozen=True)
class Integrator:
    """I = clamp(I + (d_k + d_{k−1})) to ``low`` … ``high`` of ``state``; u = shift(I, to_output)."""

    state: Format
    to_output: int
    slew: Count | None = None


@dataclass(frozen=True)
class Tuning:
    """What may be changed at run time, and what it takes to do so; see the module's description.

    ``factor``: the format and the box of the factors, in counts. ``nominal``: the gains that they are on,
    counts of ``nominal_lsb``, one a breakpoint or the only one. ``reciprocals`` and ``to_slopes`` have one
    entry a segment. ``low`` and ``high``: the boxes of the limits, counts of the output.
    """

    factor: Format
    nominal: tuple[Count, ...]
    nominal_lsb: float
    to_gain: int
    reciprocals: tuple[Count, ...] = ()
    to_slopes: tuple[int, ...] = ()
    low: tuple[Count, Count] = (0, 0)
    high: tuple[Count, Count] = (0, 0)


@dataclass(frozen=True)
class Proof:
    """Why one integer node cannot overflow: its worst magnitude in counts, its limit, and how it was
    proved."""

    node: str
    worst: int
    ctype: str
    limit: int
    how: str

    @property
    def margin_bits(self) -> float:
        """log2 of limit / worst."""
        return math.inf if self.worst == 0 else math.log2(self.limit / self.worst)


@dataclass(frozen=True)
class ErrorBound:
    """Proven bounds, for inputs anywhere in their ranges; None where no bound exists.

    ``operator``: of d/(h/2) with an integrator and of d without one, i.e. of the signal ahead of the
    integrator, in physical units, in any one sample. ``output_per_sample``: by which the output's error can
    grow each sample, the output's own rounding included: n samples after a reset, an init or a track it is at
    most n times this. It holds against physical inputs, outputs set and limits that lie between two counts:
    their rounding, half a count each, is included. ``truncation``: of the operator, against infinite memory.
    ``operator_per_sample``: with an inner integrator the error of its state adds up until its clamp ends it;
    n samples after a reset the operator's error is at most n times this (and ``operator``). 0 elsewhere.
    ``parts`` splits ``operator`` by cause, for reports. ``within_horizon``: ``truncation`` as long as no more
    than the horizon's samples have passed since a reset to a constant; None without a horizon.
    With the operator "continuous" ``truncation`` is against s^α: see :mod:`focgen.plan.truncation_band`.
    """

    operator: float
    output_per_sample: float
    truncation: float | None
    operator_per_sample: float = 0.0
    parts: tuple[tuple[str, float], ...] = ()
    within_horizon: float | None = None


@dataclass(frozen=True)
class Plan:
    """A controller in machine terms; see the module's description for what one step does with it.

    At least one of ``direct`` and ``inner`` is there. ``wide`` holds p and x, ``filtered`` holds v,
    ``product`` g·v before its shift. ``constant_gain`` (counts of ``gain``) is used where there is no
    schedule. ``increment`` holds d. ``output`` carries the output limits as its low and high.

    ``memory`` is "short", with ``length`` past samples, or "exponential": then ``memories`` has the operator
    of each fractional order, with the poles as the arithmetic holds them, ``horizon`` (samples) and
    ``tolerance`` are what was asked for, and ``length`` counts the past samples that the taps need.
    ``operator`` is "gl" where they follow the Grünwald–Letnikov weights, or "continuous" where they follow
    (jω)^α: then in the ``band``, in rad/s, and there is no horizon.

    With ``tuning``, ``schedule`` and ``constant_gain`` are those of the default parameters, ``gain`` reaches
    as far as any others take it, and so do the proofs and bounds.
    """

    controller: Controller
    name: str
    arithmetic: str
    memory: str
    length: int
    sample_time: float
    reference: Format
    measurement: Format
    error: Format
    direct: Sum | None
    inner: InnerIntegrator | None
    wide: Format
    narrow: int
    feedback: Feedback | None
    filtered: Format
    schedule: Schedule | None
    gain: Format
    constant_gain: Count
    product: Format
    gain_shift: int
    increment: Format
    integrator: Integrator | None
    output: Format
    proofs: tuple[Proof, ...]
    error_bound: ErrorBound
    memories: tuple[ExponentialMemory | ContinuousMemory, ...] = ()
    tolerance: float | None = None
    horizon: int | None = None
    operator: str = "gl"
    band: tuple[float, float] | None = None
    tuning: Tuning | None = None
    set_point: SetPoint | None = None

    @property
    def exponential(self) -> bool:
        """Whether the memory is a sum of exponentials."""
        return self.memory == "exponential"

    @property
    def box(self) -> Tuning:
        """``tuning`` of a plan that has it. Raises ValueError for any other."""
        if self.tuning is None:
            raise ValueError(f"{self.name} has no parameters")
        return self.tuning

    @property
    def sums(self) -> tuple[Sum, ...]:
        """The sums that there are: numerator, what 1/s integrates, denominator."""
        found = (self.direct, self.inner and self.inner.rest, self.feedback and self.feedback.table)
        return tuple(s for s in found if s)

    @property
    def taps(self) -> int:
        """How many samples its sums weigh one by one."""
        return sum(s.taps for s in self.sums)

    @property
    def states(self) -> int:
        """How many modes its memory has; 0 with short memory."""
        return sum(s.modes for s in self.sums)

    @property
    def multiplies(self) -> int:
        """Multiplications in one step: a tap one, a mode two, gain and slope one each."""
        return self.taps + 2 * self.states + 1 + (self.schedule is not None)

    @property
    def floating(self) -> bool:
        """Whether the arithmetic is f64 or f32."""
        return self.output.floating

    @property
    def counted(self) -> bool:
        """Whether it is floating and has an integral in whole counts."""
        integrals = (self.integrator, self.inner)
        return self.floating and any(i is not None and not i.state.floating for i in integrals)

    @property
    def error_lags(self) -> int:
        """How many past samples of the error are needed."""
        return max(s.last for s in self.sums if s.history == "error")

    @property
    def filtered_lags(self) -> int:
        """How many past samples of v are needed."""
        return self.feedback.table.last if self.feedback else 0
