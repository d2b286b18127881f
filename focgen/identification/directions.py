"""Whether a stage falls as it rises: its shape with one time scale up and another down.

Up is while the input lies above what a unit gain would deliver. There every time constant is multiplied by
one factor, below it by another; gain, offsets and free responses are fitted along.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from focgen.arrays import Array
from focgen.identification.noise import half_width
from focgen.identification.projected import Problem, Solved, mean_square, uncertainty
from focgen.identification.rational import Discrete, Record, Shape, delay_of, discretise, shifted
from focgen.identification.shapes import MARGIN, Fitted, fit_of, simplest

_MATERIAL = 1.25  # ratio of the two time constants: a smaller one matters to no controller
_SURE = 2.576  # standard errors of its logarithm, 99 %
_SEEN = 0.9  # of the residual of one line: what two leave, where they fit visibly better
_DONE, _STEPS, _SUMS = 1.0 - math.exp(-1.0), 200, 20  # of a step; samples a sum of time constants; such sums
_WIDEST = 5.0  # logarithm of a factor
_ROUNDS = 10  # of Levenberg–Marquardt


@dataclass(frozen=True)
class UpDown:
    """Time constants (value, half 95 % interval) in s while ``rising`` and ``falling``, of the ``shape``.

    Of two poles it is the time after which a step is 63 % done. ``gof`` is that of the two, beside the one
    line's in the stage's fit.
    """

    shape: str
    rising: tuple[float, float]
    falling: tuple[float, float]
    gof: float
    one_line_will_do: bool


class _Switched(Problem):
    """A fitted stage with the logarithms of two factors of time, and its dead time, as parameters."""

    def __init__(self, fitted: Fitted) -> None:
        super().__init__(fitted.shape, fitted.problem.records)
        self.stage = fitted.solved.x
        self.begins = [_beginning(fitted, i) for i in range(len(self.records))]
        self.owned = [own for own, _ in fitted.solved.rows]  # as free as the one line it is compared with

    def inside(self, x: Array) -> Array:
        return np.concatenate([np.clip(x[:2], -_WIDEST, _WIDEST), np.clip(x[2:], 0.0, self.latest)])

    def rows(self, x: Array) -> list[tuple[Array, Array]]:
        x = self.inside(x)
        delay, hold = float(x[2]) if self.shape.delayed else 0.0, self.records[0].hold
        up, down = (discretise(self.shape.poles, self.stage, delay, hold, math.exp(s)) for s in x[:2])
        states = [_run(up, down, r, begin) for r, begin in zip(self.records, self.begins)]
        return [(own, made[: 1 + self.shape.zeros]) for own, made in zip(self.owned, states)]


@dataclass(frozen=True, eq=False)
class _TwoScales:
    """A shape ``one`` fitted with two time scales; ``bic`` as for one, with one parameter more."""

    one: Fitted
    problem: _Switched
    solved: Solved

    @property
    def bic(self) -> float:
        fell = mean_square(self.problem, self.solved) / mean_square(self.one.problem, self.one.solved)
        return self.one.report.bic + self.one.independent * math.log(fell) + math.log(self.one.independent)

    @property
    def parameters(self) -> int:
        return self.one.shape.parameters + 1


def fit_directions(fits: Sequence[Fitted], chosen: Fitted, step: float) -> tuple[UpDown | None, Fitted]:
    """Fit shapes without a zero with two time scales; ``step`` is the sample time in s.

    Returns what the better one says, None where both directions are not seen, and the shape to be taken. That
    is ``chosen`` where one line will do. Else it is the better one's own shape: further poles and zeros of
    the chosen one only imitate two time constants.
    """
    alone = Shape(1)
    plain = [f for f in fits if f.shape.poles and not f.shape.zeros]
    tried = [f for f in plain if not f.report.refused or f.shape == alone]
    made = [two for f in tried if (two := _two_scales(f)) is not None] if chosen.shape.poles else []
    if not made:
        return None, chosen
    best = simplest([(two.bic, two.parameters, two) for two in made])
    try:
        found = _judged(best, chosen, step)
    except np.linalg.LinAlgError:
        return None, chosen
    return found, chosen if found is None or found.one_line_will_do else best.one


def _two_scales(fitted: Fitted) -> _TwoScales | None:
    problem = _Switched(fitted)
    late = [delay_of(fitted.shape, fitted.solved.x)] * fitted.shape.delayed
    x = problem.fit(np.array([0.0, 0.0, *late]), _ROUNDS, 1e-6)
    return None if x is None else _TwoScales(fitted, problem, problem.solved(x))


def _judged(two: _TwoScales, chosen: Fitted, step: float) -> UpDown | None:
    problem, solved = two.problem, two.solved
    spread, effective = uncertainty(problem, solved)
    half = half_width(np.diag(spread)[:2], effective, len(spread))
    if not np.all(half < 1.0):
        return None
    times = [step * _time(problem, solved, scale) for scale in np.exp(solved.x[:2])]
    up, down = ((float(t), float(t * h)) for t, h in zip(times, np.atleast_1d(half)))
    if solved.shared[0] < 0.0:  # a negative gain falls while its input rises
        up, down = down, up
    error = math.sqrt(max(spread[0, 0] + spread[1, 1] - 2.0 * spread[0, 1], 0.0))
    apart = abs(float(solved.x[0] - solved.x[1]))
    differ = apart > max(math.log(_MATERIAL), _SURE * error)
    one = mean_square(two.one.problem, two.one.solved)
    better = mean_square(problem, solved) < _SEEN**2 * one and two.bic <= chosen.report.bic + MARGIN
    return UpDown(problem.shape.name, up, down, fit_of(problem, solved), not (differ and better))


def _time(problem: _Switched, solved: Solved, scale: float) -> float:
    """Samples until a step of the stage, its time constants ``scale`` times as long, is 63 % done."""
    poles, lag = problem.shape.poles, math.exp(problem.stage[0])
    if poles == 1:
        return scale * lag
    span = scale * 2.0 * math.exp(problem.stage[1] - problem.stage[0]) / _STEPS  # of the time constants' sum
    made = discretise(poles, problem.stage, 0.0, "zero", scale / span)
    step = np.ones(_SUMS * _STEPS)
    rows = [lfilter(made.numerator(i), made.denominator, step) / span**i for i in range(len(solved.shared))]
    answer = np.maximum.accumulate(solved.shared @ np.array(rows) / solved.shared[0])
    return span * float(np.interp(_DONE, answer, np.arange(len(answer))))


def _beginning(fitted: Fitted, index: int) -> Array:
    """The state at a record's first sample, in units of the input: at rest, or as the linear fit has it."""
    record, poles = fitted.problem.records[index], fitted.shape.poles
    if not record.moves:
        return np.zeros(poles)
    own, _ = fitted.solved.rows[index]
    free = fitted.solved.own[index][1 : 1 + poles] @ own[1 : 1 + poles, :poles]
    move = discretise(poles, fitted.solved.x, 0.0, record.hold).move
    seen = np.pad(fitted.solved.shared, (0, poles - len(fitted.solved.shared)))  # what is measured of a state
    rows = np.vstack([seen @ np.linalg.matrix_power(move, k) for k in range(poles)])
    made: Array = np.linalg.lstsq(rows, free, rcond=None)[0]
    return made


def _run(up: Discrete, down: Discrete, record: Record, begin: Array) -> Array:
    """The states (poles, n) of a record that switches between two stages."""
    past = [shifted(record.drive, up.late + i) for i in range(3)]
    forced_up, forced_down = (made.take.T @ np.array(past) for made in (up, down))
    target = _target(record, up)
    loop = _one_state if len(begin) == 1 else _two_states
    return loop(target.tolist(), up.move, down.move, forced_up, forced_down, begin)


def _target(record: Record, made: Discrete) -> Array:
    """The input that acts over the sample before each sample, towards its end."""
    late = shifted(record.drive, made.late + 1)
    return late if record.hold == "zero" else 0.5 * (late + shifted(record.drive, made.late))


def _one_state(
    target: list[float], up: Array, down: Array, forced_up: Array, forced_down: Array, begin: Array
) -> Array:
    a_up, a_down, z = float(up[0, 0]), float(down[0, 0]), float(begin[0])
    made = [z]
    for to, b_up, b_down in zip(target[1:], forced_up[0, 1:].tolist(), forced_down[0, 1:].tolist()):
        z = a_up * z + b_up if to > z else a_down * z + b_down
        made.append(z)
    return np.array([made])


def _two_states(
    target: list[float], up: Array, down: Array, forced_up: Array, forced_down: Array, begin: Array
) -> Array:
    (p, q), (r, s) = up.tolist()
    (t, u), (v, w) = down.tolist()
    y, rate = map(float, begin)
    made = [(y, rate)]
    forced = np.vstack([forced_up, forced_down])[:, 1:].tolist()
    for to, y_up, rate_up, y_down, rate_down in zip(target[1:], *forced):
        if to > y:
            y, rate = p * y + q * rate + y_up, r * y + s * rate + rate_up
        else:
            y, rate = t * y + u * rate + y_down, v * y + w * rate + rate_down
        made.append((y, rate))
    return np.array(made).T
