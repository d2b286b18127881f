"""Rational stages with a dead time: their shapes, and their exact responses at the samples.

A stage of order n ≤ 2 is ẋ = A x + B u(t − d), y = x₁ (+ zero · ẋ₁). Between samples u is held or runs
straight; a dead time of m samples and a fraction moves its corners into the sample. Both parts of the sample
are integrated by one matrix exponential each (Van Loan, IEEE Trans. Automat. Control 23, 1978), so there is
no error of discretisation, real poles may coincide, and the stage is a filter of order n for
scipy.signal.lfilter. Time is counted in samples here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import expm
from scipy.signal import lfilter

from focgen.arrays import Array

_FASTEST = 0.02  # samples: a shorter time constant has no effect between samples
_SLOWEST = 30.0  # lengths of the longest record: a longer one is an integrator there
_DAMPING = (0.01, 300.0)
LATEST = 0.2  # of the shortest record: no longer dead time is looked for, it could shift one step to the next
_PLACES = 13  # that are tried for a part of a record
_FEWEST = 100  # samples of a part


@dataclass(frozen=True)
class Shape:
    """How many poles and zeros a stage has, and whether a dead time; no pole is a plain gain."""

    poles: int
    zeros: int = 0
    delayed: bool = False

    @property
    def name(self) -> str:
        """As in a table: ``gain``, ``1p``, ``2p1z+delay``."""
        zeros = f"{self.zeros}z" if self.zeros else ""
        return (f"{self.poles}p{zeros}" if self.poles else "gain") + "+delay" * self.delayed

    @property
    def parameters(self) -> int:
        """The gain, the poles, the zeros and the dead time."""
        return 1 + self.poles + self.zeros + self.delayed


_KINDS = ((0, 0), (1, 0), (2, 0), (2, 1))
SHAPES = tuple(Shape(*kind, delayed) for kind in _KINDS for delayed in (False, True))
"""Every shape that is tried; (2, 1) last, since the smaller ones give it its starts."""


@dataclass(frozen=True, eq=False)
class Record:
    """One experiment made ready: ``drive`` and ``measured`` (n,), ``hold`` "zero" or "linear".

    ``drive`` is the input from its first value on, and the stage was at rest there. Where ``rests`` it
    is the whole input of a log that begins with its step: the stage was at rest at 0 before. Where ``moves``
    the stage is not known to have been at rest at the first sample, and its state there is free. Where it is
    ``noisy`` the drive was measured; a command is known. ``early``: by how many samples at most the drive
    may have been what a row says before what else is in the row was read.
    """

    name: str
    drive: Array
    measured: Array
    hold: str
    rests: bool = False
    moves: bool = False
    noisy: bool = False
    early: float = 0.0

    def __len__(self) -> int:
        return len(self.measured)

    def part(self, count: int) -> Record:
        """The ``count`` samples in a row over which the measured signal moves most."""
        if count >= len(self):
            return self
        begins = np.unique(np.linspace(0, len(self) - count, _PLACES).astype(int))
        begin = max(begins, key=lambda b: float(np.var(self.measured[b : b + count])))
        drive, measured = (signal[begin : begin + count] for signal in (self.drive, self.measured))
        rests = self.rests and begin == 0
        drive = drive if rests else drive - drive[0]
        moves = self.moves or begin > 0
        return replace(self, drive=drive, measured=measured, rests=rests, moves=moves)


def parts(records: Sequence[Record], limit: int) -> list[Record]:
    """A part of every record, at most ``limit`` samples together; each keeps ``_FEWEST``."""
    total = sum(map(len, records))
    if total <= limit:
        return list(records)
    return [r.part(max(len(r) * limit // total, _FEWEST)) for r in records]


@dataclass(frozen=True, eq=False)
class Discrete:
    """x[k] = ``move`` x[k−1] + Σᵢ ``take``[i] u[k − ``late`` − i], i = 0, 1, 2; ``take`` (3, n)."""

    move: Array
    take: Array
    late: int

    @property
    def denominator(self) -> Array:
        """Of the filter from u to every state."""
        if len(self.move) == 1:
            return np.array([1.0, -self.move[0, 0]])
        return np.array([1.0, -np.trace(self.move), np.linalg.det(self.move)])

    def numerator(self, state: int) -> Array:
        """Of the filter from u, ``late`` samples back, to one state."""
        now = np.append(self.take[:, state], 0.0)
        if len(self.move) == 1:
            return now
        before = self.take @ (self.move - np.trace(self.move) * np.eye(2)).T
        made: Array = now + np.append(0.0, before[:, state])
        return made


def inside(shape: Shape, x: Array, longest: int, earliest: float, latest: float) -> Array:
    """``x`` with every parameter within what ``longest`` samples can tell, the dead time from ``earliest`` to
    ``latest``.

    ``x`` is (log T) for one pole, (log wn, log damping) for two, none for a gain; then the dead time.
    """
    slowest = _SLOWEST * longest
    edges: list[tuple[float, float]] = {
        0: [],
        1: [(math.log(_FASTEST), math.log(slowest))],
        2: [(-math.log(slowest), -math.log(_FASTEST)), (math.log(_DAMPING[0]), math.log(_DAMPING[1]))],
    }[shape.poles]
    low, high = np.array(edges + [(earliest, latest)] * shape.delayed).reshape(-1, 2).T
    return np.clip(x, low, high)


def delay_of(shape: Shape, x: Array) -> float:
    """The dead time in samples; less than 0 where the drive was early."""
    return float(x[-1]) if shape.delayed else 0.0


def discretise(poles: int, x: Array, delay: float, hold: str, scale: float = 1.0) -> Discrete:
    """The stage from sample to sample, every time constant ``scale`` times as long."""
    late = math.floor(delay)
    before, after = delay - late, 1.0 - (delay - late)  # the corner of u lies between the two
    system = _system(poles, x) / scale
    (_, step0, ramp0), (move1, step1, ramp1) = (_integrals(system, span) for span in (before, after))
    whole = _integrals(system, 1.0)[0]
    if hold == "zero":
        take = [np.zeros(poles), step1, move1 @ step0]
    else:
        middle = move1 @ (after * step0 + ramp0) + step1 - ramp1
        take = [ramp1, middle, move1 @ (before * step0 - ramp0)]
    return Discrete(whole, np.array(take), late)


def _system(poles: int, x: Array) -> Array:
    """[A, B], unit gain."""
    if poles == 1:
        rate = math.exp(-x[0])
        return np.array([[-rate, rate]])
    wn, damping = np.exp(x[:2])
    return np.array([[0.0, 1.0, 0.0], [-(wn**2), -2.0 * damping * wn, wn**2]])


def _integrals(system: Array, span: float) -> tuple[Array, Array, Array]:
    """e^{A span}, and the states that a unit step and a unit ramp reach after ``span``."""
    n = len(system)
    block = np.zeros((n + 2, n + 2))
    block[:n, : n + 1], block[n, n + 1] = system, 1.0
    moved = expm(block * span)
    return moved[:n, :n], moved[:n, n], moved[:n, n + 1]


def shifted(signal: Array, late: int) -> Array:
    """``signal`` (n,) ``late`` samples later, 0 before it; or so many sooner, held at its end."""
    if late < 0:
        return np.concatenate([signal[-late:], np.full(min(-late, len(signal)), signal[-1])])
    return np.concatenate([np.zeros(min(late, len(signal))), signal[: max(len(signal) - late, 0)]])


Rows = list[tuple[Array, Array]]


def responses(shape: Shape, x: Array, records: Sequence[Record]) -> Rows:
    """What every record is a sum of: its own rows (·, n), and those whose weights all records share (·, n).

    Shared are the response of unit gain and, with a zero, its derivative per sample. Its own are an offset
    and, where it moves at the first sample, the free response of the state there and that to another input
    before.
    """
    delay = delay_of(shape, x)
    if not shape.poles:
        return [(_own_of_gain(r, delay), _static(r, delay)[None]) for r in records]
    made = discretise(shape.poles, x, delay, records[0].hold)
    own = np.array(_own(shape, made, max(map(len, records))))
    counts = [len(own) if r.moves else 1 for r in records]
    return [(own[:count, : len(r)], _shared(shape, made, r)) for count, r in zip(counts, records)]


def _own(shape: Shape, made: Discrete, count: int) -> list[Array]:
    before = [_from_before(made, count)] if shape.delayed else []
    return [np.ones(count), *_free(made, count), *before]


def _shared(shape: Shape, made: Discrete, record: Record) -> Array:
    drive, den = shifted(record.drive, made.late), made.denominator
    return np.array([lfilter(made.numerator(state), den, drive) for state in range(1 + shape.zeros)])


def _own_of_gain(record: Record, delay: float) -> Array:
    """An offset, and another one while the input from before the first sample acts."""
    early = (np.arange(len(record)) < delay).astype(float)
    return np.array([np.ones(len(record)), early][: 2 if record.moves and delay > 0.0 else 1])


def _static(record: Record, delay: float) -> Array:
    """The input itself, late by ``delay``; a held one by whole samples."""
    if record.hold == "zero":
        return shifted(record.drive, math.ceil(delay))
    places = np.arange(len(record))
    made: Array = np.interp(places - delay, places, record.drive)
    return made


def _free(made: Discrete, count: int) -> list[Array]:
    """Two (or one) responses that span every free response of the first state."""
    pulse = np.zeros(count)
    pulse[0] = 1.0
    first = lfilter([1.0], made.denominator, pulse)
    return [shifted(first, i) for i in range(len(made.move))]


def _from_before(made: Discrete, count: int) -> Array:
    """The response to a unit input that ends with the first sample and arrives a dead time later."""
    known = len(made.take) - 1
    past = np.zeros(count + known)
    past[: made.late + known] = 1.0
    found: Array = lfilter(made.numerator(0), made.denominator, past)[known:]
    return found
