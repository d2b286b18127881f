"""What parameters fitted to noise leave open of a simulated signal, which is the next stage's input.

A refit of one stage is as sure as its noise allows. Where the next stage's output is measured with less
noise, what is left open shows there, and looks like a fault of that stage unless its input may move by as
much.
"""

from __future__ import annotations

import numpy as np

from focgen.diagnosis.fitting.fit import STEP, Weighing, innovations, jacobian
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.rig.kernels import products

_FLAT = 1e-10  # of the largest: what information on parameters is none


def input_covariance(e: Explanation) -> np.ndarray:
    """Ways (n, k) in which what an explained segment is simulated to give may be off, uncorrelated, each one
    standard deviation, in the output's unit: its own, and those of its input; not the zeros of its readings,
    which are no part of it."""
    problem, vector, weighing = e.best.problem, e.best.vector, Weighing(e.ar)
    now = innovations(problem, vector, weighing)
    low, high = problem.bounds()
    rows = jacobian(problem, vector, now, weighing, low, high)[:-1]  # the fit's own are of an earlier vector
    variance = float(np.mean(now**2))
    spread = _spread(products(rows) + variance * np.diag(problem.known[1]), variance)
    problem = problem.at_every_row
    made = problem.simulate(vector)
    moved = [problem.simulate(vector + STEP * problem.level(direction)) - made for direction in spread.T]
    ways = np.stack(moved, axis=1) / STEP
    axes, size, _ = np.linalg.svd(ways, full_matrices=False)
    found: np.ndarray = axes * size
    return found


def _spread(information: np.ndarray, variance: float) -> np.ndarray:
    """Columns (k, m) whose outer products add up to the parameters' covariance; none for what the samples
    tell nothing of."""
    values, vectors = np.linalg.eigh(information)
    told = values > _FLAT * max(float(values[-1]), 1e-300)
    return vectors[:, told] * np.sqrt(variance / values[told])
