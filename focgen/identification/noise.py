"""Covariance of a least-squares fit whose residuals are correlated in time.

The residual is modelled as an autoregressive process; its order is chosen by BIC, so that white residuals
give the ordinary covariance. References: Burg's recursion (Kay, Modern Spectral Estimation, 1988); the
sandwich (J'J)⁻¹ J'ΓJ (J'J)⁻¹ with Γ the residual's autocovariance (Ljung, System Identification, 1999, §9.5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter
from scipy.stats import t as student

from focgen.arrays import Array

_HIGHEST = 20  # order


@dataclass(frozen=True, eq=False)
class ResidualModel:
    """a(q) r = white noise: ``a`` = [1, a₁, …] and the ``variance`` of the white noise, of ``count``
    residuals.
    """

    a: Array
    variance: float
    count: int

    @property
    def effective(self) -> float:
        """How many independent samples say as much about a mean: count · (Σa)² γ₀/σ²-wise, at most
        ``count``.
        """
        return min(float(self.count), self.count * float(np.sum(self.a)) ** 2 * self._power() / self.variance)

    def _power(self) -> float:
        """The residual's own variance, γ₀."""
        pulse = np.zeros(4096)
        pulse[0] = 1.0
        return self.variance * float(np.sum(lfilter([1.0], self.a, pulse) ** 2))


def residual_model(residual: Array) -> ResidualModel:
    """Burg's autoregressive model of a residual (n,), order by BIC, at most a tenth of its length."""
    r = residual - residual.mean()
    count = len(r)
    forward, backward = r.copy(), r.copy()
    a, variance = np.ones(1), float(np.mean(r**2))
    best = ResidualModel(a, variance, count)
    lowest = count * np.log(max(variance, 1e-300))
    for order in range(1, min(_HIGHEST, count // 10) + 1):
        f, b = forward[1:], backward[:-1]
        scale = float(f @ f + b @ b)
        if scale <= 1e-300:
            break
        k = -2.0 * float(f @ b) / scale
        forward, backward = f + k * b, b + k * f
        a = np.concatenate([a, [0.0]]) + k * np.concatenate([a, [0.0]])[::-1]
        variance *= 1.0 - k * k
        score = count * np.log(max(variance, 1e-300)) + order * np.log(count)
        if score < lowest:
            lowest, best = score, ResidualModel(a, variance, count)
    return best


def covariance(jacobian: Array, models: list[ResidualModel]) -> Array:
    """Covariance (k, k) of the k parameters of a fit; ``jacobian`` (n, k) has the rows of all ``models`` in
    order.

    The parameters' own number is taken off the degrees of freedom. Raises numpy.linalg.LinAlgError where the
    parameters cannot be told apart.
    """
    ends = np.cumsum([model.count for model in models])
    return sandwich(np.split(jacobian, ends[:-1]), models, [0.0] * len(models))


def sandwich(
    jacobians: list[Array],
    models: list[ResidualModel],
    priors: list[float],
) -> Array:
    """The same for experiments that have a prior.

    ``jacobians``: of each experiment, (n, k), whose residual ``models`` describe; rows beyond a model's count
    stand for a prior, whose residual is white with the variance in ``priors``.
    """
    bread = np.linalg.inv(sum(j.T @ j for j in jacobians))
    meat = sum(_carried(j, model, prior) for j, model, prior in zip(jacobians, models, priors))
    count = sum(model.count for model in models)
    made: Array = bread @ meat @ bread * count / max(count - bread.shape[0], 1)
    return made


def _carried(rows: Array, model: ResidualModel, prior: float) -> Array:
    """Jᵀ Γ J, Γ the autocovariance of a residual and of the prior below it."""
    spread = lfilter([1.0], model.a, rows[: model.count][::-1], axis=0)  # Γ = σ² H Hᵀ, H the filter 1/a
    below = rows[model.count :]
    made: Array = model.variance * spread.T @ spread + prior * below.T @ below
    return made


def half_width(variance: Array | float, effective: float, parameters: int) -> Array | float:
    """Half the 95 % interval of an estimate, by Student's t with what ``effective`` samples leave."""
    freedom = max(effective - parameters, 1.0)
    made: Array | float = np.sqrt(np.where(variance >= 0.0, variance, np.inf)) * student.ppf(0.975, freedom)
    return made
