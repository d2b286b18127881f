"""Parts of a session, each predicted by a fit that does not see it: cross-validation.

M. Stone, Cross-validatory choice and assessment of statistical predictions, Journal of the Royal Statistical
Society B 36, 1974.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from focgen.diagnosis.fitting.fit import WHITE, Fit, Weighing, fit, innovations
from focgen.diagnosis.fitting.integrating import settled
from focgen.diagnosis.problem.problem import Problem
from focgen.rig.begun import alone

_FOLDS = 4
_ITERATIONS = 4


def folds(lengths: Sequence[int]) -> np.ndarray:
    """The fold (n,) of every sample of experiments of these lengths: neighbouring experiments about a quarter
    of the session long, or quarters of it where experiments are fewer."""
    n = sum(lengths)
    if len(lengths) < _FOLDS:
        return np.arange(n) * _FOLDS // n
    middles = np.cumsum(lengths) - 0.5 * np.array(lengths)
    return np.repeat((middles * _FOLDS / n).astype(int), lengths)


def fitted_to(best: Fit, weighing: Weighing, seen: np.ndarray) -> Fit:
    """A fit made anew to the samples ``seen`` (n,) only. What these do not tell stays as it was, for a prior
    alone would move it."""
    problem = best.problem
    masked = replace(problem, segment=problem.segment.seen_at(seen))
    found = settled(fit(masked, best.vector, weighing, _ITERATIONS))
    vector, own = found.vector.copy(), _not_told(problem, seen)
    vector[own] = best.vector[own]
    return fit(masked, vector, WHITE if problem.segment.pace else weighing, 0) if len(own) else found


def _not_told(problem: Problem, seen: np.ndarray) -> np.ndarray:
    """Where in the vector (k,) the numbers are that no sample ``seen`` (n,) tells. The zero of an
    experiment's readings is told by its own. What a pump held as it began is told by those of the experiments
    that go on from it as well."""
    run = problem.segment.run
    shown = np.array([bool(np.any(seen[a:b])) for a, b in run.spans])
    behind = np.cumsum(alone(run))
    held = problem.head - problem.stood + np.flatnonzero(~np.isin(behind, behind[shown]))
    zeros = problem.head - problem.stood - problem.zeros + np.flatnonzero(~shown)
    return np.concatenate([zeros if problem.zeros else zeros[:0], held if problem.stood else held[:0]])


def foreseen(best: Fit, weighing: Weighing) -> float:
    """The mean square error of a segment whose every part is simulated by a fit to the others, but for what
    only that part tells."""
    return _foreseen(best, weighing, best.problem.weighed)


def foretold(best: Fit, weighing: Weighing) -> float:
    """The same of what effects are judged by. A fit foretells no other square: what a colour counts for
    little it leaves far off."""
    problem = best.problem
    if problem.segment.pace:
        return foreseen(best, weighing)
    return _foreseen(best, weighing, lambda vector: innovations(problem, vector, weighing))


def judged_error(of: Fit) -> np.ndarray:
    """The innovations (n,), which a fit made least; of a rig that integrates the error itself, which its
    effects were fitted to in the end."""
    return of.weighed if of.problem.segment.pace else of.innovations


def _foreseen(best: Fit, weighing: Weighing, error_of: Callable[[np.ndarray], np.ndarray]) -> float:
    fold = folds([last - first for first, last in best.problem.segment.run.spans])
    error = np.empty(len(fold))
    for part in np.unique(fold):
        vector = fitted_to(best, weighing, fold != part).vector
        error[fold == part] = error_of(vector)[fold == part]
    return float(np.mean(error**2))
