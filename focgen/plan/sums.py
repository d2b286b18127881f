"""History sums in machine terms: taps in blocks, and the banks of an exponential memory.

How they are computed is part of :mod:`focgen.plan.plan`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

Count = int | float


@dataclass(frozen=True)
class Format:
    """How one node is held.

    ``ctype`` is a C type; ``lsb`` the physical value of one count (1.0 floating); ``low`` and ``high`` its
    proven range in counts; ``unit`` for comments.
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
class SetPoint:
    """The set-point filter, as :mod:`focgen.plan.setpoint` tells: its rate, in fixed point a count of
    2^−``up``, and the ends of its state in counts; floating, the lag up to which it is 0.
    """

    rate: Count
    up: int = 0
    low: Count = 0
    high: Count = 0
    drop: float = 0.0


@dataclass(frozen=True)
class Block:
    """Taps ``first`` … ``last`` (lags, both included), which share one scale.

    ``weights[i]`` belongs to lag ``first + i``; its real value is ``weights[i] * lsb``. ``sum`` holds the
    block's own sum; shifted right by ``align``, rounding, it is in counts of the total.
    """

    first: int
    last: int
    weights: tuple[Count, ...]
    lsb: float
    sum: Format
    align: int


@dataclass(frozen=True)
class Bank:
    """Modes of an exponential memory that are held alike, the fastest first; see the module's description.

    ``rates`` (a_i) and ``weights`` (c_i) are counts of ``rate.lsb`` and ``lsb``. ``state`` is L, ``drive`` D,
    in units of the history; ``sum`` M, which shifted right by ``align`` is in counts of the total. ``order``
    is that of their term s^β.
    """

    order: float
    rates: tuple[Count, ...]
    weights: tuple[Count, ...]
    rate: Format
    lsb: float
    state: Format
    drive: Format
    sum: Format
    up: int = 0
    to_drive: int = 0
    rate_shift: int = 0
    align: int = 0
    compensated: bool = False

    @property
    def differences(self) -> int:
        """m, the order rounded up: 1 or 2."""
        return math.ceil(self.order)

    @property
    def modes(self) -> int:
        """How many there are."""
        return len(self.rates)

    @property
    def real_rates(self) -> tuple[float, ...]:
        """q_i; exact."""
        return tuple(a * self.rate.lsb for a in self.rates)

    @property
    def values(self) -> tuple[float, ...]:
        """c_i; exact."""
        return tuple(c * self.lsb for c in self.weights)


@dataclass(frozen=True)
class Sum:
    """Σ_j w_j x_{k−j} over ``history`` ("error" or "filtered"); ``blocks`` oldest first, without gaps.

    ``banks`` add what an exponential memory remembers beyond the taps.
    """

    name: str
    history: str
    blocks: tuple[Block, ...]
    total: Format
    banks: tuple[Bank, ...] = ()

    @property
    def taps(self) -> int:
        """How many weights there are."""
        return sum(len(block.weights) for block in self.blocks)

    @property
    def first(self) -> int:
        """The smallest lag: 0, or 1 for the feedback."""
        return self.blocks[-1].first

    @property
    def last(self) -> int:
        """The largest lag."""
        return self.blocks[0].last

    @property
    def weights(self) -> tuple[Count, ...]:
        """All weights by rising lag, from lag ``first`` on, each in counts of its own block."""
        return tuple(w for block in reversed(self.blocks) for w in block.weights)

    @property
    def modes(self) -> int:
        """How many modes its banks have."""
        return sum(bank.modes for bank in self.banks)

    @property
    def values(self) -> tuple[float, ...]:
        """The taps' real values by rising lag; exact."""
        return tuple(w * block.lsb for block in reversed(self.blocks) for w in block.weights)
