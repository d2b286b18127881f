"""Poles of a fractional transfer function on the first sheet, |arg s| < π.

Zeros of Σ aᵢ s^αᵢ are counted by the argument principle on the boundary of a sector, every step of which is
proved small enough, then located by Newton's method in log s until the count is met.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Array, Complex
from focgen.fractional.transfer import Polynomial

_MERGED = 1e-3  # zeros this close, relative to their size, are located together
_CIRCLE = 64
_REACH = 600.0  # of an exponent: beyond it a term's size is no number any more
_MOST_STEPS = 1_000_000  # along an edge; further halving would find nothing new


def first_sheet_zeros(terms: Polynomial, sector: float) -> Complex:
    """Return the zeros of Σ aᵢ s^αᵢ with 0 < |s| and |arg s| ≤ ``sector`` < π, each as often as it counts.

    Complex zeros come in conjugate pairs. Where a zero lies within 0.02 rad of the sector's edge, it may
    be on either side. Raises ArithmeticError where they cannot be located.
    """
    return np.exp(zeros_in_log(terms, sector))


def zeros_in_log(terms: Polynomial, sector: float) -> Complex:
    """Return ln s of the same zeros, with |Im ln s| ≤ ``sector``, which may go beyond π: there they lie on
    the sheets next to the first.
    """
    if len(terms) < 2:
        return np.empty(0, complex)
    if len(terms) == 2:
        return _two_terms(terms, sector)
    return _Sector(terms, sector).zeros()


def _two_terms(terms: Polynomial, sector: float) -> Complex:
    (a, high), (b, low) = terms
    order = high - low
    first = 0.0 if b / a < 0 else math.pi
    most = math.ceil(order * sector / math.pi)
    angles = (first + 2.0 * math.pi * np.arange(-most, most + 1)) / order
    made: Complex = math.log(abs(b / a)) / order + 1j * angles[np.abs(angles) <= sector]
    return made


class _Sector:
    """D(e^x) with its lowest power divided out, on |Im x| ≤ ``angle``."""

    def __init__(self, terms: Polynomial, angle: float) -> None:
        self.coefficients = np.array([t.coefficient for t in terms])
        self.orders = np.array([t.order for t in terms]) - terms[-1].order
        # where one term outweighs the sum of the others there is no zero
        self.low, self.high = self._dominated(-1), self._dominated(0)
        if max(-self.low, self.high) * self.orders[0] > _REACH:
            ends = f"{-self.high / math.log(10.0):.0f} to 1e{-self.low / math.log(10.0):.0f}"
            raise ArithmeticError(f"its time constants are too far apart, 1e{ends} s")
        self.angle = max((angle, angle + 0.01, angle - 0.01), key=self._clearance)

    def parts(self, x: ArrayLike) -> Array:
        return self.coefficients * np.exp(np.multiply.outer(x, self.orders))

    def value(self, x: ArrayLike) -> Array:
        made: Array = self.parts(x).sum(axis=-1)
        return made

    def relative(self, x: ArrayLike) -> Array:
        parts = self.parts(x)
        made: Array = np.abs(parts.sum(axis=-1)) / np.abs(parts).sum(axis=-1)
        return made

    def slope(self, x: ArrayLike) -> Array:
        made: Array = (self.parts(x) * self.orders).sum(axis=-1)
        return made

    def _dominated(self, index: int) -> float:
        """Return a log radius beyond which the highest (0) or lowest (-1) term outweighs the rest twice."""
        way = 1.0 if index == 0 else -1.0
        others = np.delete(np.arange(len(self.orders)), index)
        gaps = np.abs(self.orders[others] - self.orders[index])
        with np.errstate(divide="ignore", over="ignore"):  # of a term of no weight, of one of all
            weights = 2.0 * len(others) * np.abs(self.coefficients[others] / self.coefficients[index])
            return way * float(np.max(np.log(weights) / gaps))

    def _clearance(self, angle: float) -> float:
        return float(self.relative(np.linspace(self.low, self.high, 256) + 1j * angle).min())

    def count(self) -> int:
        """Return how many zeros the sector holds, by the argument principle."""
        ends = [complex(self.low, self.angle), complex(self.high, self.angle)]
        # at the ends one term dominates: the argument along each arc is known in closed form
        low = np.angle(self.value(ends[0]) / self.coefficients[-1])
        high = np.angle(self.value(ends[1]) / (self.parts(ends[1])[0])) + self.orders[0] * self.angle
        made: int = round((high - low - self._turn()) / math.pi)
        return made

    def _turn(self) -> float:
        """Return the change of arg D outward along the sector's edge."""
        x = np.linspace(self.low, self.high, 200)
        for _ in range(60):
            values = self.value(x + 1j * self.angle)
            steps = np.diff(x)
            # |D(x+δ) − D(x)| ≤ Σ |a| e^{αx} (e^{αδ} − 1); below |D(x)|, the argument turns by less than π/2
            change = (np.abs(self.parts(x[:-1])) * np.expm1(np.outer(steps, self.orders))).sum(axis=-1)
            coarse = change >= np.abs(values[:-1])
            if not coarse.any():
                return float(np.sum(np.angle(values[1:] / values[:-1])))
            x = np.sort(np.concatenate([x, (x[:-1] + 0.5 * steps)[coarse]]))
            if len(x) > _MOST_STEPS:
                break
        raise ArithmeticError("a pole lies on the edge of the sector")

    def zeros(self) -> Complex:
        expected = self.count()
        density = 12.0
        while expected and density < 200.0:
            found = self._distinct(self._newton(self._starts(density)))
            if len(found) < expected:
                found = self._with_multiplicity(found)
            if len(found) == expected:
                return np.asarray(found, complex)
            density *= 2.0
        if expected:
            raise ArithmeticError(f"located {len(found)} of {expected} poles")
        return np.empty(0, complex)

    def _starts(self, density: float) -> Array:
        """Return the local minima of |D| relative to its terms on a grid of the upper half."""
        radii = np.linspace(self.low, self.high, max(8, math.ceil(density * (self.high - self.low))))
        angles = np.linspace(0.0, self.angle, math.ceil(density * self.angle))
        grid = radii[:, None] + 1j * angles
        # e^(r + iθ)α is a product: so many exponentials are taken once for each radius and each angle
        sizes = self.coefficients * np.exp(np.outer(radii, self.orders))
        turns = np.exp(1j * np.outer(angles, self.orders))
        share = np.abs((sizes[:, None] * turns).sum(axis=-1)) / np.abs(sizes).sum(axis=-1)[:, None]
        level = np.pad(share, 1, constant_values=np.inf)
        inner = level[1:-1, 1:-1]
        around = [
            level[1 + i : level.shape[0] - 1 + i, 1 + j : level.shape[1] - 1 + j]
            for i in (-1, 0, 1)
            for j in (-1, 0, 1)
            if (i, j) != (0, 0)
        ]
        return grid[np.all([inner <= other for other in around], axis=0)]

    def _newton(self, x: Array) -> Array:
        for _ in range(80):
            with np.errstate(all="ignore"):
                step = np.nan_to_num(self.value(x) / self.slope(x))
            x = x - step / np.maximum(1.0, np.abs(step) / 0.5)
            if np.all(np.abs(step) < 1e-15):
                break
        inside = (np.abs(x.imag) <= self.angle) & (self.relative(x) < 1e-9)
        return x[inside]

    def _distinct(self, x: Array) -> Array:
        """Merge what is the same zero, and add the conjugates."""
        x = np.where(np.abs(x.imag) < 1e-9, x.real, x)
        x = np.concatenate([x, x.conj()])
        kept: list[complex] = []
        for candidate in x[np.argsort(self.relative(x))]:
            if all(abs(candidate - other) > _MERGED for other in kept):
                kept.append(candidate)
        return np.array(kept, complex)

    def _with_multiplicity(self, centres: Array) -> Array:
        found = []
        for i, centre in enumerate(centres):
            gaps = np.abs(np.delete(centres, i) - centre)
            found.append(self._cluster(centre, min(0.2, 0.4 * gaps.min(initial=1.0))))
        return np.concatenate(found) if found else centres

    def _cluster(self, centre: complex, radius: float) -> Complex:
        """Return the zeros in a circle, from power sums (1/2πi) ∮ (x − c)^k D'/D dx (Delves and Lyness)."""
        offset = radius * np.exp(2j * math.pi * (np.arange(_CIRCLE) + 0.5) / _CIRCLE)
        density = self.slope(centre + offset) / self.value(centre + offset) * offset / _CIRCLE
        multiplicity = round(density.sum().real)
        sums = [np.sum(density * (offset / radius) ** k) for k in range(multiplicity + 1)]
        monic = np.ones(1, complex)  # Newton's identities
        for k in range(1, multiplicity + 1):
            monic = np.append(monic, -sum(monic[k - i] * sums[i] for i in range(1, k + 1)) / k)
        return centre + radius * np.roots(monic)
