"""Eq. (10) with exponential memories in place of its sums: a recursion of a few first-order modes.

Each fractional power is whole differences and a handful of states (:mod:`focgen.fractional.exponential`), so
the whole transfer function is a linear recursion with a few dozen states. Its eigenvalues decouple it: every
mode is a first-order filter, and a simulation costs some 30 of them whatever the number of samples, instead
of transforms of all of the past. The poles of the memories interlace with those of the recursion, which
leaves its eigenvectors well conditioned.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import lfilter

from focgen.arrays import Array
from focgen.fractional.exponential import ExponentialMemory, fit_exponential
from focgen.fractional.transfer import Polynomial, TransferFunction


class ExponentialRecursion:
    """Simulates a transfer function with every power of s as :class:`GrunwaldLetnikov` has it, fast.

    ``step`` is h in s; ``horizon`` in samples and ``tolerance`` as in
    :func:`focgen.fractional.exponential.fit_exponential`: the memories' relative error up to the horizon.
    Raises ValueError for an improper transfer function, a step that is not positive, orders outside (−1, 2)
    that are not whole, a negative whole order, or where the sum of the leading coefficients vanishes.
    """

    def __init__(self, transfer: TransferFunction, step: float, horizon: int, tolerance: float) -> None:
        if not 0.0 < step < np.inf:
            raise ValueError(f"the step is {step} s, it must be positive")
        if not transfer.is_proper:
            raise ValueError("the transfer function is improper")
        self._num = _Terms(transfer.num, step, horizon, tolerance)
        self._den = _Terms(transfer.den, step, horizon, tolerance)
        if self._den.lags[0] == 0.0:
            raise ValueError("the sum of the leading coefficients A_i is zero at this step")
        self._modes = self._den.inverse()

    @property
    def states(self) -> int:
        """How many exponentials there are in all."""
        return self._num.states + self._den.states

    def run(self, u: ArrayLike) -> Array:
        """Return the output for the samples ``u``, from rest at 0; float64, both (samples,)."""
        u = np.asarray(u, dtype=float)
        return self._modes.run(self._num.run(u)) if len(u) else u.copy()


@dataclass(frozen=True, eq=False)
class _Modes:
    """y_k = ``through`` f_k + Σ residues · (modes filtered, one sample late); complex modes come in pairs."""

    values: Array
    residues: Array
    through: float

    def run(self, forced: Array) -> Array:
        y = self.through * forced
        for value, residue in zip(self.values, self.residues):
            if value.imag == 0.0:
                y += lfilter([0.0, residue.real], [1.0, -value.real], forced)
            elif value.imag > 0.0:
                y += 2.0 * lfilter([0.0, residue], [1.0, -value], forced.astype(complex)).real
        return y


class _Terms:
    """Σ c s^β as differences of the signal and exponentials of them.

    ``lags``: what multiplies the signal's present and past samples; every memory adds its exponentials.
    """

    def __init__(self, terms: Polynomial, step: float, horizon: int, tolerance: float) -> None:
        highest = max((math.ceil(term.order) for term in terms), default=0)
        self.lags = np.zeros(highest + 1)
        self._memories: list[tuple[float, ExponentialMemory]] = []
        for term in terms:
            factor, differences = term.coefficient * step**-term.order, math.ceil(term.order)
            if not term.order.is_integer():
                self._memories.append((factor, fit_exponential(term.order, horizon, tolerance)))
            elif differences < 0:
                raise ValueError(f"the order {term.order:g} is negative")
            self.lags[: differences + 1] += factor * _binomials(differences)

    @property
    def states(self) -> int:
        return sum(memory.states for _, memory in self._memories)

    def run(self, x: Array) -> Array:
        y: Array = lfilter(self.lags, [1.0], x)
        for factor, memory in self._memories:
            y += factor * (memory.run(x) - lfilter(_binomials(memory.differences), [1.0], x))
        return y

    def inverse(self) -> _Modes:
        """The recursion that solves Σ c D^β y = f for y.

        Its state: the exponentials, then the past outputs. y is a row over it, and each exponential takes in
        a difference of y and its past.
        """
        lead, kept = self.lags[0], len(self.lags) - 1
        poles, weights, taken = self._exponentials()
        row = -np.concatenate([weights, self.lags[1:]]) / lead
        count = len(poles)
        matrix, entry = np.zeros((count + kept, count + kept)), np.zeros(count + kept)
        matrix[:count, :count] = np.diag(poles)
        matrix[:count, count:] = taken[:, 1:]
        matrix[:count] += np.outer(taken[:, 0], row)
        entry[:count] = taken[:, 0] / lead
        if kept:
            matrix[count], entry[count] = row, 1.0 / lead
            matrix[count + 1 :, count : count + kept - 1] = np.eye(kept - 1)
        values, vectors = np.linalg.eig(matrix)
        residues = (row @ vectors) * np.linalg.solve(vectors, entry)
        return _Modes(values.astype(complex), residues.astype(complex), 1.0 / lead)

    def _exponentials(self) -> tuple[Array, Array, Array]:
        """Poles and weights, shape (n,), and the difference of the signal each takes in, shape (n, lags)."""
        poles = [pole for _, memory in self._memories for pole in memory.poles]
        weights = [factor * weight for factor, memory in self._memories for weight in memory.weights]
        taken = np.zeros((len(poles), len(self.lags)))
        place = 0
        for _, memory in self._memories:
            taken[place : place + memory.states, : memory.differences + 1] = _binomials(memory.differences)
            place += memory.states
        return np.array(poles), np.array(weights), taken


def _binomials(differences: int) -> Array:
    """The coefficients of (1 − x)^differences."""
    return np.array([(-1.0) ** j * math.comb(differences, j) for j in range(differences + 1)])
