"""Where fits of forms that jump begin.

What such a form gives changes in jumps as its numbers do: a valve breaks loose a sample sooner, or never.
No slope leads to the right numbers, so they are looked for by trying: first all that are proposed, then ever
closer about the best (R. Hooke, T. A. Jeeves, "Direct search" solution of numerical and statistical problems,
Journal of the ACM 8, 1961).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.diagnosis.fitting.fit import WHITE, Fit, fit, innovations, jacobian
from focgen.diagnosis.fitting.pinned import pinned
from focgen.diagnosis.problem.problem import Problem

_BEST = 6  # of the starts are looked about
_ABOUT = (
    (0.86, 0.93, 1.0, 1.07, 1.15),
    (-0.15, 0.0, 0.15),
)  # times the first number, and more than the second
_WORTH = 0.97  # of the sum of squares: where no start leaves less, none is looked about
_STEP = 0.1  # of a number, or of its range where that is 0: the first step from the best
_ROUNDS = 10  # of steps, each in every number
_FINEST = 0.02  # of the first step: closer is left to the fit
_FITTED = 6  # iterations of a fit
_TURNS = 4  # of looking about the best and fitting what is beside
_LIKELIEST, _SETTLED = 3, 4  # starts beside which what else is fitted gives way, and iterations


def by_trying(
    problem: Problem, base: np.ndarray, starts: Sequence[np.ndarray], known: np.ndarray | None
) -> Fit:
    """The best fit of ``problem``, whose last candidate effect jumps, beside ``base`` (the vector without
    it), begun at the best of ``starts``. ``known``: the Jacobian's rows at ``base``. A valve that makes a
    loop cycle draws a fit without it far away, so it is tried beside the nominal parameters as given, too.
    """
    found = _tried(problem, base, starts, known)
    given = np.r_[problem.nominal_start, base[len(problem.nominal_start) :]]
    least = min(of.sse for of in found)
    if len(problem.nominal_start) and least < _WORTH * _Missed(problem, base, known).before:
        found += _tried(problem, given, starts, None)
    return _looked_about(min(found, key=lambda f: f.cost), len(base))


def _looked_about(best: Fit, head: int) -> Fit:
    """The best fit about one whose form's values are those from ``head`` on. What gives way beside them may
    let them come closer."""
    for _ in range(_TURNS):
        base, values = np.split(best.vector, [head])
        again = _about_there(best.problem, base, [values])
        if again.cost >= best.cost:
            break
        best = again
    return best


def _tried(
    problem: Problem, base: np.ndarray, starts: Sequence[np.ndarray], known: np.ndarray | None
) -> list[Fit]:
    """Fits begun about the best of the ``starts``. What is beside the form was fitted without it: it is tried
    once more beside what that has become, and with what it becomes beside the likeliest of the starts."""
    missed = _Missed(problem, base, known)
    closest, kept = _closest(missed, starts)
    found = [_fitted(problem, base, closest)]
    if found[0].sse < _WORTH * missed.before:
        moved, values = np.split(found[0].vector, [len(base)])
        found.append(_about_there(problem, moved, [values, *kept]))
    if missed(closest) < _WORTH * missed.before:
        found.append(_given_way(problem, base, kept))
    return found


def _fitted(problem: Problem, base: np.ndarray, values: np.ndarray) -> Fit:
    return fit(problem, np.r_[base, values], WHITE, _FITTED, tolerance=0.1)


def _about_there(problem: Problem, base: np.ndarray, starts: Sequence[np.ndarray]) -> Fit:
    values, _ = _closest(_Missed(problem, base, None), starts)
    return _fitted(problem, base, values)


def _given_way(problem: Problem, base: np.ndarray, starts: Sequence[np.ndarray]) -> Fit:
    """The best fit from the likeliest of the ``starts``, once what is beside the form is fitted to each: it
    may be further from where it was than a slope tells."""
    *others, last = problem.candidates

    def beside(values: np.ndarray) -> Fit:
        held = problem.with_candidates([*others, pinned(last, values)])
        return fit(held, np.r_[base, values], WHITE, _SETTLED, tolerance=0.1)

    best = min((beside(values) for values in starts[:_LIKELIEST]), key=lambda f: f.cost)
    moved, values = np.split(best.vector, [len(base)])
    return _about_there(problem, moved, [values])


class _Missed:
    """What a form leaves with these values, the numbers beside it free to give way by a little."""

    def __init__(self, problem: Problem, base: np.ndarray, known: np.ndarray | None):
        self.problem, self.base = problem, base
        bare = problem.with_candidates(problem.candidates[:-1])
        now = innovations(bare, base, WHITE)
        rows = jacobian(bare, base, now, WHITE, *bare.bounds())[:-1] if known is None else known
        self.nominal, _ = np.linalg.qr(rows.T)
        self.low, self.high = (bound[len(base) :] for bound in problem.bounds())
        self.before = self._square(now)

    def _square(self, left: np.ndarray) -> float:
        left = left - self.nominal @ (left @ self.nominal)
        return float(left @ left)

    def __call__(self, values: np.ndarray) -> float:
        return self._square(innovations(self.problem, np.r_[self.base, values], WHITE))

    def within(self, values: np.ndarray) -> np.ndarray:
        """The values, those beyond a bound at it."""
        made: np.ndarray = np.clip(values, self.low, self.high)
        return made


def _closest(missed: _Missed, starts: Sequence[np.ndarray]) -> tuple[np.ndarray, list[np.ndarray]]:
    """The values that leave least, and the best of the ``starts``."""
    tried = sorted(((missed(v), i) for i, v in enumerate(map(missed.within, starts))))
    least, kept = tried[0][0], [starts[i] for _, i in tried[:_BEST]]
    best = missed.within(kept[0])
    if least > _WORTH * missed.before:
        return best, kept
    best = min((v for start in kept for v in _about(missed, start)), key=missed)
    return _stepped(missed, best), kept


def _about(missed: _Missed, start: np.ndarray) -> list[np.ndarray]:
    """Values beside a start."""
    found = []
    for times in _ABOUT[0]:
        for more in _ABOUT[1] if len(start) > 1 else (0.0,):
            values = start.copy()
            values[0] *= times
            values[1:2] += more
            found.append(missed.within(values))
    return found


def _stepped(missed: _Missed, best: np.ndarray) -> np.ndarray:
    """The best values that steps in one number at a time, ever smaller, lead to."""
    least, whole = (
        missed(best),
        np.where(best != 0.0, _STEP * np.abs(best), _STEP * (missed.high - missed.low)),
    )
    part = 1.0
    for _ in range(_ROUNDS):
        before = least
        for i in np.flatnonzero(whole > 0.0):
            for way in (part, -part):
                tried = best.copy()
                tried[i] += way * whole[i]
                tried = missed.within(tried)
                if (now := missed(tried)) < least:
                    best, least = tried, now
                    break
        part *= 1.0 if least < before else 0.4
        if part < _FINEST:
            break
    return best
