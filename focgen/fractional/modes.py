"""The share of a response that poles make, exactly: Σ of exponentials, poles that nearly coincide together.

A cluster p₁ … p_m contributes Σ_k γ_k / Π_{i ≥ k} (s − p_i), a chain of first-order lags. Unlike residues
its coefficients stay finite where the poles meet, and its time function is one triangular matrix exponential.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from focgen.arrays import Array, Complex, Ints
from focgen.fractional.triangular import triangular_exponential

_CIRCLE = 128
_RELATIVE_GAP = 0.02


@dataclass(frozen=True)
class Chain:
    """Σ_k γ_k / Π_{i ≥ k} (s − p_i) for one cluster; ``weight`` 2 where its conjugate counts as well.

    ``poles`` in rad/s, ``gammas`` γ_k, both of shape (m,).
    """

    poles: Complex
    gammas: Complex
    weight: float

    def image(self, s: Complex) -> Any:
        """Return the Laplace transform at ``s``, the conjugate included."""
        total = _chain_image(self.poles, self.gammas, s)
        if self.weight == 2.0:
            total = total + _chain_image(self.poles.conj(), self.gammas.conj(), s)
        return total

    def samples(self, step: float, count: int, begin: float = 0.0) -> Array:
        """Return the time function at ``begin``, ``begin`` + ``step``, …, shape (count,)."""
        return self._follow(self._later(self._start(), begin), step, count)

    def means(self, step: float, count: int, begin: float = 0.0) -> Array:
        """Return its mean over each step that begins at ``begin`` + j ``step``, j = 0 … count − 1, shape
        (count,).
        """
        return self._follow(self._later(self._mean_state(step), begin), step, count)

    def at(self, t: Array) -> Array:
        """Return the time function at the times ``t`` ≥ 0 (s), shape of ``t``."""
        if len(self.poles) == 1:
            made: Array = self.weight * (self.gammas[0] * np.exp(self.poles[0] * t)).real
            return made
        return self.weight * (self._propagators(t)[:, :, -1] @ self.gammas).real

    def _later(self, state: Array, time: float) -> Array:
        if time == 0.0:
            return state
        if len(self.poles) == 1:
            made: Array = np.exp(self.poles[0] * time) * state
        else:
            made = self._propagators(np.array([time]))[0] @ state
        return made

    def _start(self) -> Array:
        made: Array = np.eye(len(self.poles), dtype=complex)[-1]
        return made

    def _propagators(self, t: Array) -> Array:
        """Return e^{At} of the chain's lags (poles on the diagonal, ones above it), shape (n, m, m)."""
        m = len(self.poles)
        spread = np.max(np.abs(self.poles - self.poles[0]))
        # a similarity gives the entries one size, so that each of them comes out accurate
        size = np.maximum(spread, 1.0 / np.maximum(t, np.finfo(float).tiny))
        scaled = (np.diag(self.poles) + size[:, None, None] * np.eye(m, k=1)) * t[:, None, None]
        distance = np.arange(m) - np.arange(m)[:, None]
        made: Array = triangular_exponential(scaled) * size[:, None, None] ** -np.maximum(distance, 0.0)
        return made

    def _mean_state(self, step: float) -> Array:
        """Return the mean over the first step of the states that start as ``_start``."""
        if len(self.poles) == 1:
            x = self.poles[0] * step
            return np.array([np.expm1(x) / x if x else 1.0], complex)
        # one more pole, at 0, in front of the chain's first lag integrates it
        integrating = Chain(np.append(self.poles, 0.0), np.append(self.gammas, 0.0), self.weight)
        return integrating._propagators(np.array([step]))[0, :-1, -1] / step

    def _follow(self, state: Array, step: float, count: int) -> Array:
        """Return the output at ``count`` samples from ``state`` on, doubling them by one propagator each."""
        lengths = step * 2.0 ** np.arange(max(count - 1, 0).bit_length())
        states = state[:, None]
        if len(self.poles) == 1:
            for factor in np.exp(self.poles[0] * lengths):
                states = np.concatenate([states, factor * states], axis=1)
        elif len(lengths):
            for factor in self._propagators(lengths):
                states = np.concatenate([states, factor @ states], axis=1)
        return self.weight * (self.gammas @ states[:, :count]).real


def _chain_image(poles: Complex, gammas: Complex, s: Complex) -> Any:
    total: Any = 0.0
    lags: Any = 1.0
    for pole, gamma in zip(poles[::-1], gammas[::-1]):
        lags = lags / (s - pole)
        total = total + gamma * lags
    made: Array = total
    return made


def polar_part(
    image: Callable[..., Any],
    poles: Complex,
    gap: float,
    isolated: Callable[..., Any],
    obstacle: Callable[..., Any],
) -> list[Chain]:
    """Return the polar part of ``image`` at ``poles`` (rad/s, closed under conjugation) as chains.

    Poles closer than 2 % of their size, or than ``gap``, share a chain. ``isolated(p, others)`` is the
    residue at a simple pole; ``obstacle(c)`` the distance from c to the nearest singularity of ``image``
    that is not a pole in the list.
    """
    chains = []
    for members in _clusters(poles, gap):
        cluster, others = poles[members], np.delete(poles, members)
        middle = cluster.mean()
        if middle.imag < -1e-9 * abs(middle):
            continue
        weight = 2.0 if middle.imag > 1e-9 * abs(middle) else 1.0
        if len(cluster) == 1:
            gammas = np.atleast_1d(isolated(cluster[0], others))
        else:
            cluster, gammas = _chain(image, cluster, others, obstacle, gap)
        chains.append(Chain(cluster, gammas, weight))
    return chains


def _clusters(poles: Complex, gap: float) -> list[Ints]:
    size = np.abs(poles)
    close = np.abs(poles[:, None] - poles) <= np.maximum(gap, _RELATIVE_GAP * np.maximum(size[:, None], size))
    for _ in range(len(poles).bit_length()):  # transitive closure
        close = (close.astype(int) @ close.astype(int)) > 0
    return [np.flatnonzero(row) for i, row in enumerate(close) if not row[:i].any()]


def _chain(
    image: Callable[..., Any], cluster: Complex, others: Complex, obstacle: Callable[..., Any], gap: float
) -> tuple[Complex, Complex]:
    """Return the cluster's poles and its γ_k = (1/2πi) ∮ image(s) Π_{i > k} (s − p_i) ds."""
    corners = [complex(end(cluster.real), end(cluster.imag)) for end in (np.min, np.max)]
    middle = 0.5 * (corners[0] + corners[1])
    inner = float(np.max(np.abs(cluster - middle)))
    outer = min(float(np.min(np.abs(others - middle), initial=math.inf)), obstacle(middle))
    if math.isinf(outer):
        outer = max(16.0 * inner, 16.0 * gap) or 1.0
    # a wide circle: rounding enters γ_k by the power of 1/radius
    radius = max(math.sqrt(inner * outer), 0.5 * outer)
    s = middle + radius * np.exp(2j * math.pi * (np.arange(_CIRCLE) + 0.5) / _CIRCLE)
    share = image(s) * (s - middle) / _CIRCLE
    gammas = np.empty(len(cluster), complex)
    for k in range(len(cluster) - 1, -1, -1):
        gammas[k] = share.sum()
        share = share * (s - cluster[k])
    return cluster, gammas
