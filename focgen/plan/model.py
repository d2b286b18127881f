"""The plan: everything the C and its bit-true reference need, decided once.

A plan describes one controller step in machine terms. Both the templates, which print it, and
:mod:`focgen.plan.execute`, which runs it in Python, follow this description and nothing else.

One step, at sample k (steps that a plan does not need are ``None`` and leave no code behind)
--------------------------------------------------------------------------------------------
1. Inputs. Fixed point: reference, measurement and schedule are clamped to the counts of their ranges.
   e_k = reference − measurement (counts of ``error``; exact, no rounding).
2. ``direct``: p = Σ_{j=0…L} w_j e_{k−j}, the numerator's terms of order ≥ 0 in one table.
3. ``inner`` (numerator terms of negative order, see below): r = Σ_{j=0…L} w_j e_{k−j};
   z = clamp(z + (r + r_prev)·gain), r_prev = r: the trapezoid, h/2 inside ``gain``. p = p + z.
4. ``feedback`` (denominators with dynamics): v_k = p − Σ_{j=1…L} w_j v_{k−j}, all weights divided by the
   coefficient of v_k. Without it v_k = p.
5. ``schedule``: g, linear between breakpoints, held beyond them. Without it g is constant.
6. d_k = g·v_k, in physical output units (per second, times h/2, where an integrator follows).
7. ``integrator``: I = clamp(I + d_k + d_{k−1}), u = I rounded to output counts.
   Without an integrator u = clamp(d_k).

Histories hold e (and v where there is feedback) of the L past samples; a sum is taken from the oldest
sample to the newest, sample k last.

Reset takes error and schedule as having been constant for ever: both histories are filled with their
constant values, the first step after it takes d_{k−1} with its own gain, z keeps the value that makes
the output u0 where it can (no integrator: z = 0), and I = clamp(u0). Init is the same with zeros, but
d_{−1} = 0. Track sets I = clamp(u_applied).

Fixed point
-----------
An integer count x stands for the physical value x · lsb; every lsb is a power of two. A right shift by n
rounds half up: (x + 2^(n−1)) >> n. Every narrowing saturates to the ends of the narrower type, and a
proof in ``proofs`` says that in range it never has to. A history sum is split into blocks of taps, oldest first,
each with weights of its own scale: before a block is added, the running sum is shifted right by the
block's ``align``. Products are 32×32→64 bit in q31 and 16×16→32 bit in q15; the accumulator's type is in
``Sum.accumulator``.

Floating point
--------------
The same structure with one block per sum, lsb 1.0 and no shifts: acc = 0; acc = acc + w·x, oldest
first, each operation rounded to the type, never contracted.
"""

from __future__ import annotations

from dataclasses import dataclass

from focgen.control.controller import Controller

Count = int | float


@dataclass(frozen=True)
class Format:
    """How one node is held.

    ``ctype`` is a C type; ``lsb`` the physical value of one count (1.0 floating); ``low`` and ``high`` its proven
    range in counts; ``unit`` for comments.
    """

    ctype: str
    lsb: float
    low: Count
    high: Count
    unit: str = ""

    @property
    def floating(self) -> bool:
        """Whether this is ``float`` or ``double``."""
        return self.ctype in ("float", "double")

    @property
    def bits(self) -> int:
        """Width of the type."""
        return {"float": 32, "double": 64}.get(self.ctype) or int(self.ctype.strip("u_int"))


@dataclass(frozen=True)
class Block:
    """Taps ``first`` … ``last`` (lags, both included), which share one scale.

    ``weights[i]`` belongs to lag ``first + i``; its real value is ``weights[i] * lsb``. ``align``: bits by which the
    sum of all older blocks is shifted right, rounding, before this block is added.
    """

    first: int
    last: int
    weights: tuple[Count, ...]
    lsb: float
    align: int


@dataclass(frozen=True)
class Sum:
    """Σ_j w_j x_{k−j} over ``history`` ("error" or "filtered"); ``blocks`` oldest first.

    ``accumulator`` is the running sum's format after the newest block; shifted right by ``narrow`` (negative:
    shifted left, exact), rounded and saturated, it becomes ``result``.
    """

    name: str
    history: str
    blocks: tuple[Block, ...]
    accumulator: Format
    narrow: int
    result: Format

    @property
    def taps(self) -> int:
        """How many weights there are."""
        return sum(len(block.weights) for block in self.blocks)


@dataclass(frozen=True)
class InnerIntegrator:
    """z = clamp(z + shift(gain·(r + r_prev))); ``weights`` makes r.

    Floating: z + gain·(r + r_prev), no shift. ``state`` bounds z in counts, and is wide; ``to_sum`` is the right
    shift, rounding, from z to the format of p.
    """

    rest: Sum
    gain: Count
    gain_lsb: float
    shift: int
    state: Format
    to_sum: int


@dataclass(frozen=True)
class Schedule:
    """g = gains[i] + shift(slopes[i] · (s − breakpoints[i])) for breakpoints[i] ≤ s < breakpoints[i+1].

    All in counts; held at the first gain below and at the last gain above. ``slope_shift`` is the right shift,
    rounding (0 floating).
    """

    signal: Format
    breakpoints: tuple[Count, ...]
    gains: tuple[Count, ...]
    slopes: tuple[Count, ...]
    slope_shift: int
    gain: Format


@dataclass(frozen=True)
class Integrator:
    """I = clamp(I + d_k + d_{k−1}) to ``low`` … ``high`` counts of ``state``; u = I shifted right by ``to_output``."""

    state: Format
    low: Count
    high: Count
    to_output: int


@dataclass(frozen=True)
class Proof:
    """Why one integer node cannot overflow: its worst magnitude in counts, its limit, and how it was proved."""

    node: str
    worst: int
    ctype: str
    limit: int
    how: str

    @property
    def margin_bits(self) -> float:
        """log2 of limit / worst."""
        import math

        return math.inf if self.worst == 0 else math.log2(self.limit / self.worst)


@dataclass(frozen=True)
class ErrorBound:
    """Proven bounds, for inputs anywhere in their ranges; None where no bound exists.

    ``operator``: of d/(h/2) with an integrator and of d without one, i.e. of the signal ahead of the integrator, in
    physical units, in any one sample. ``output_per_sample``: by which the output's error can grow each sample,
    the output's own rounding included. ``truncation``: of the operator, against an infinite memory.
    """

    operator: float
    output_per_sample: float
    truncation: float | None


@dataclass(frozen=True)
class Plan:
    """A controller in machine terms; see the module's description for what one step does with it.

    ``gain_shift``: right shift, rounding, from g·v to ``increment`` (d). ``constant_gain`` (counts of ``gain``) is used
    where there is no schedule. ``output`` carries the output limits as its low and high.
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
    direct: Sum
    inner: InnerIntegrator | None
    feedback: Sum | None
    filtered: Format
    schedule: Schedule | None
    constant_gain: Count
    gain: Format
    gain_shift: int
    increment: Format
    integrator: Integrator | None
    output: Format
    proofs: tuple[Proof, ...]
    error_bound: ErrorBound
