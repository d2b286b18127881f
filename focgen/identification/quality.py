"""How well a model fits: GOF, eq. (4), and an information criterion for correlated residuals."""

from __future__ import annotations

import numpy as np

from focgen.arrays import Array
from focgen.identification.noise import residual_model


def gof(measured: Array, simulated: Array) -> float:
    """1 − ‖measured − simulated‖ / ‖measured − mean‖, eq. (4)."""
    return 1.0 - float(np.linalg.norm(measured - simulated) / np.linalg.norm(measured - measured.mean()))


def bic(measured: Array, simulated: Array, parameters: int, effective: float) -> float:
    """Schwarz's criterion, N ln(mean square) + k ln N, with the ``effective`` number of samples for N."""
    mean_square = float(np.mean((measured - simulated) ** 2))
    made: float = effective * np.log(max(mean_square, 1e-300)) + parameters * np.log(effective)
    return made


def effective_samples(residual: Array) -> float:
    """How many independent samples a residual stands for."""
    return max(residual_model(residual).effective, 3.0)
