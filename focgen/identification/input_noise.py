"""What noise on a measured input does to a fit: it passes through the model, and not through the rig.

A model that smooths its input leaves less of this noise in the residual, by σ² Σ h², h its impulse response.
That makes a slower shape look better than it is, and a gain smaller (T. Söderström, Errors-in-Variables
Methods in System Identification, 2018).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.identification.projected import Problem, Solved, mean_square
from focgen.identification.rational import Record, responses
from focgen.logs.between import white_level

_PULSE = 4096  # samples


def input_noise(records: Sequence[Record]) -> float:
    """Variance of the noise on a measured input, from its second differences; 0 for a command.

    An upper bound where the input itself moves within few samples.
    """
    if not records[0].noisy:
        return 0.0
    return float(np.mean([white_level(r.drive) ** 2 for r in records]))


def passed(problem: Problem, solved: Solved) -> float:
    """Σ h², the share of white input noise's variance that a model passes on."""
    pulse = Record("pulse", np.eye(1, _PULSE, _PULSE // 4)[0], np.zeros(_PULSE), "linear", True)
    _, shared = responses(problem.shape, solved.x, [pulse])[0]
    return float(np.sum((solved.shared @ shared) ** 2))


def fair_square(problem: Problem, solved: Solved) -> float:
    """Mean square of the residual as if every model passed the input's noise on as a plain gain would."""
    square, noise = mean_square(problem, solved), input_noise(problem.records)
    if not noise:
        return square
    drives = np.concatenate([r.drive - r.drive.mean() for r in problem.records])
    plain = problem.spread**2 / float(np.mean(drives**2))
    return square + noise * max(plain - passed(problem, solved), 0.0)


def attenuation(problem: Problem, solved: Solved) -> float:
    """By which share a fitted gain is too small at most."""
    noise = input_noise(problem.records)
    if not noise:
        return 0.0
    rows = [shared[0] - shared[0].mean() for _, shared in solved.rows]
    power = float(np.mean(np.concatenate(rows) ** 2))
    return noise * passed(problem, solved) / (power * float(solved.shared[0]) ** 2)
