"""Whether a stage falls as it rises: its shape with one time scale up and another down.

Up is while the input lies above what a unit gain would deliver. There every time constant is multiplied by
one factor, below it by another; gain, offsets and free responses are fitted along.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from focgen.identification.noise import half_width
from focgen.identification.projected import Problem, Solved, mean_square, uncertainty
from focgen.identification.rational import Discrete, Record, Shape, delay_of, discretise, inside, shifted
from focgen.identification.shapes import Fitted

_MATERIAL = 1.25  # ratio of the two time constants: a smaller one matters to no controller
_SURE = 2.576  # standard errors of its logarithm, 99 %
_SEEN = 0.9  # of the residual of one line: what two leave, where they fit visibly better
_WIDEST = 5.0  # logarithm of a factor
_ROUNDS = 10  # of Levenberg–Marquardt


@dataclass(frozen=True)
class UpDown:
    """Time constants (value, half 95 % interval) in s while ``rising`` and ``falling``, of the ``shape``.

    Of two poles it is the sum of their time constants, 2 damping / wn. ``gof`` is that of the two, beside
    the one line's in the stage's fit.
    """

    shape: str
    rising: tuple[float, float]
    falling: tuple[float, float]
    gof: float
    one_line_will_do: bool


class _Switched(Problem):
    """A fitted stage with the logarithms of two factors of time, and its dead time, as parameters."""

    def __init__(self, fitted: Fitted):
        super().__init__(fitted.shape, fitted.problem.records)
        self.stage = fitted.solved.x
        self.begins = [_beginning(fitted, i) for i in range(len(self.records))]
        self.owned = [own for own, _ in fitted.solved.rows]

    def inside(self, x: np.ndarray) -> np.ndarray:
        late = inside(self.shape, np.append(self.stage[: self.shape.poles], x[2:]), self.longest)
        return np.concatenate([np.clip(x[:2], -_WIDEST, _WIDEST), late[self.shape.poles :]])

    def rows(self, x: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        x = self.inside(x)
        delay, hold = float(x[2]) if self.shape.delayed else 0.0, self.records[0].hold
        up, down = (discretise(self.shape.poles, self.stage, delay, hold, math.exp(s)) for s in x[:2])
        states = [_run(up, down, r, begin) for r, begin in zip(self.records, self.begins)]
        return [(own, made[: 1 + self.shape.zeros]) for own, made in zip(self.owned, states)]


def fit_directions(fits: Sequence[Fitted], chosen: Fitted, step: float) -> UpDown | None:
    """Fit the chosen shape, and one pole, with two time scales; None where both directions are not seen.

    ``step`` is the sample time in s.
    """
    one = Shape(1, 0, chosen.shape.delayed)
    tried = [f for f in fits if f is chosen or f.shape in (one, Shape(1))] if chosen.shape.poles else []
    results = [made for f in tried if (made := _two_scales(f)) is not None]
    if not results:
        return None
    problem, solved = min(results, key=lambda pair: float(np.mean(pair[1].left ** 2)))
    try:
        return _judged(problem, solved, chosen, step)
    except np.linalg.LinAlgError:
        return None


def _two_scales(fitted: Fitted) -> tuple[_Switched, Solved] | None:
    problem = _Switched(fitted)
    late = [delay_of(fitted.shape, fitted.solved.x)] * fitted.shape.delayed
    x = problem.fit(np.array([0.0, 0.0, *late]), _ROUNDS, 1e-6)
    return None if x is None else (problem, problem.solved(x))


def _judged(problem: _Switched, solved: Solved, chosen: Fitted, step: float) -> UpDown | None:
    spread, effective = uncertainty(problem, solved)
    up_first = bool(solved.shared[0] > 0.0)  # a negative gain falls while its input rises
    rising, falling = (0, 1) if up_first else (1, 0)
    half = half_width(np.diag(spread)[:2], effective, len(spread))
    if not np.all(half < 1.0):
        return None
    times = step * _time(problem) * np.exp(solved.x[:2])
    apart = abs(float(solved.x[0] - solved.x[1]))
    error = math.sqrt(max(spread[0, 0] + spread[1, 1] - 2.0 * spread[0, 1], 0.0))
    one = mean_square(chosen.problem, chosen.solved)
    better = mean_square(problem, solved) < _SEEN**2 * one
    differ = apart > math.log(_MATERIAL) and apart > _SURE * error
    pairs = [(float(times[i]), float(times[i] * half[i])) for i in (rising, falling)]
    gof = 1.0 - float(np.sqrt(np.mean(solved.left**2))) / problem.spread
    return UpDown(problem.shape.name, *pairs, gof, not (differ and better))


def _time(problem: _Switched) -> float:
    """The stage's time constant, or the sum of both, in samples."""
    if problem.shape.poles == 1:
        return math.exp(problem.stage[0])
    return 2.0 * math.exp(problem.stage[1] - problem.stage[0])


def _beginning(fitted: Fitted, index: int) -> np.ndarray:
    """The state at a record's first sample, in units of the input, as the linear fit has it."""
    record, poles = fitted.problem.records[index], fitted.shape.poles
    if record.rests:
        return np.zeros(poles)
    own, _ = fitted.solved.rows[index]
    free = fitted.solved.own[index][1 : 1 + poles] @ own[1 : 1 + poles, :poles]
    move = discretise(poles, fitted.solved.x, 0.0, record.hold).move
    seen = np.pad(fitted.solved.shared, (0, poles - len(fitted.solved.shared)))  # what is measured of a state
    rows = np.vstack([seen @ np.linalg.matrix_power(move, k) for k in range(poles)])
    return np.linalg.lstsq(rows, free, rcond=None)[0]


def _run(up: Discrete, down: Discrete, record: Record, begin: np.ndarray) -> np.ndarray:
    """The states (poles, n) of a record that switches between two stages."""
    past = [shifted(record.drive, up.late + i) for i in range(3)]
    forced = [made.take.T @ np.array(past) for made in (up, down)]
    target = _target(record, up)
    loop = _one_state if len(begin) == 1 else _two_states
    return loop(target.tolist(), up.move, down.move, *forced, begin)


def _target(record: Record, made: Discrete) -> np.ndarray:
    """The input that acts over the sample before each sample, towards its end."""
    late = shifted(record.drive, made.late + 1)
    return late if record.hold == "zero" else 0.5 * (late + shifted(record.drive, made.late))


def _one_state(target, up, down, forced_up, forced_down, begin) -> np.ndarray:
    a_up, a_down, z = float(up[0, 0]), float(down[0, 0]), float(begin[0])
    made = [z]
    for to, b_up, b_down in zip(target[1:], forced_up[0, 1:].tolist(), forced_down[0, 1:].tolist()):
        z = a_up * z + b_up if to > z else a_down * z + b_down
        made.append(z)
    return np.array([made])


def _two_states(target, up, down, forced_up, forced_down, begin) -> np.ndarray:
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
