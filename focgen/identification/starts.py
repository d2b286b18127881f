"""Where the fits of a rational stage begin: a scan over time constants and dead times by correlation.

The cost over the dead time has local minima, one for each step or bit that lines up with another. The
correlation of the measured signal with the responses of first-order lags tells all of them at once.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from scipy import fft
from scipy.signal import lfilter

from focgen.arrays import Array
from focgen.identification.projected import Problem
from focgen.identification.rational import LATEST, Record, Shape, discretise
from focgen.present import present

_RATIO = 2.0  # between neighbouring time constants
_SHORTEST = 0.3  # samples
_KEPT = 3  # minima
_PAIRS = ((1.0, 0.1), (0.7, 0.4))  # time constants of two real poles, over that of one
_SWINGS = tuple(itertools.product((0.6, 1.2, 2.4), (0.25, 0.7)))  # (wn times that time constant, damping)


def scan(records: Sequence[Record], poles: int) -> list[Array]:
    """(log T, delay in samples) of the best minima, best first; of a gain (delay,) alone.

    The first entry is followed by the best without a dead time, then by further minima over the dead time.
    """
    times = _time_constants(records) if poles else (None,)
    costs = np.array([_costs(records, T) for T in times])
    best = costs.min(axis=0)
    known = np.pad(best, 1, constant_values=np.inf)
    low = np.flatnonzero((best <= known[:-2]) & (best <= known[2:]))
    order = low[np.argsort(best[low], kind="stable")][:_KEPT]
    late = list(dict.fromkeys([int(order[0]), 0, *map(int, order[1:])]))
    if not poles:
        return [np.array([float(m)]) for m in late]
    return [np.array([float(np.log(present(times[int(np.argmin(costs[:, m]))]))), float(m)]) for m in late]


def _time_constants(records: Sequence[Record]) -> Array:
    longest = 0.5 * max(map(len, records))
    count = int(np.log(longest / _SHORTEST) / np.log(_RATIO)) + 1
    return _SHORTEST * _RATIO ** np.arange(max(count, 2))


def _costs(records: Sequence[Record], T: float | None) -> Array:
    """Sum of squares left by gain and offsets for 0, 1, 2, … samples of dead time; initial states at rest."""
    count = max(int(LATEST * min(map(len, records))), 2)
    product, power, total = np.zeros(count), np.zeros(count), 0.0
    for record in records:
        lagged, wanted = _lagged(record, T), record.measured - record.measured.mean()
        size = fft.next_fast_len(2 * len(record), real=True)
        spectrum = fft.rfft(wanted, size) * np.conj(fft.rfft(lagged, size))
        product += fft.irfft(spectrum, size)[:count]
        kept = len(record) - 1 - np.arange(count)
        power += np.cumsum(lagged**2)[kept] - np.cumsum(lagged)[kept] ** 2 / len(record)
        total += float(wanted @ wanted)
    made: Array = total - product**2 / np.maximum(power, 1e-300 + 1e-9 * power.max())
    return made


def _lagged(record: Record, T: float | None) -> Array:
    if T is None:
        return record.drive
    made = discretise(1, np.array([np.log(T)]), 0.0, record.hold)
    found: Array = lfilter(made.numerator(0), made.denominator, record.drive)
    return found


def second_order(problem: Problem, T: float, delays: Sequence[float]) -> list[Array]:
    """The two best of a few pairs of poles around the time constant ``T`` (samples) of one."""
    shapes = [_from_pair(T * slow, T * fast) for slow, fast in _PAIRS]
    shapes += [np.log([swing / T, damping]) for swing, damping in _SWINGS]
    ends = [[float(d)] for d in delays] if problem.shape.delayed else [[]]
    starts = [np.append(x, end) for x in shapes for end in ends]
    return best_of(problem, starts, 2)


def best_of(problem: Problem, starts: Sequence[Array], count: int) -> list[Array]:
    """The ``count`` starts from which least is left."""
    return sorted(starts, key=problem.cost)[:count]


def _from_pair(slow: float, fast: float) -> Array:
    """(log wn, log damping) of two time constants."""
    return np.log([1.0 / np.sqrt(slow * fast), 0.5 * (slow + fast) / np.sqrt(slow * fast)])


def starts_of(problem: Problem, found: dict[Shape, Array], scanned: Sequence[Array]) -> list[Array]:
    """The starts of a shape, from the scan and from the optima ``found`` of the smaller shapes."""
    shape = problem.shape
    if shape.poles == 0:
        return [scanned[0][:1]] if shape.delayed else [np.empty(0)]
    if shape.poles == 1:
        plain = found.get(Shape(1))
        if shape.delayed:
            beside = (0.5, -0.5, -1.5) if problem.earliest else (0.5,)
            return [*scanned, *([] if plain is None else [np.append(plain, late) for late in beside])]
        return [start[:1] for start in scanned[:2]]
    return _starts_of_two(problem, found, scanned)


def _starts_of_two(problem: Problem, found: dict[Shape, Array], scanned: Sequence[Array]) -> list[Array]:
    shape = problem.shape
    one = found.get(Shape(1, 0, shape.delayed), scanned[0])
    late = float(one[-1]) if shape.delayed else 0.0
    starts = second_order(problem, float(np.exp(one[0])), (0.3 * late, 0.7 * late, late))
    if shape.delayed and (plain := found.get(Shape(2, shape.zeros))) is not None:
        beside = (0.3, -0.5, -1.5) if problem.earliest else (0.3,)
        starts += [np.append(plain, late) for late in beside]
    if shape.zeros and (without := found.get(Shape(2, 0, shape.delayed))) is not None:
        starts.append(without)
    return starts
