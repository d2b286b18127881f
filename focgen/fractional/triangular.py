"""Exponentials of small triangular matrices, accurate where their eigenvalues nearly meet.

scipy.linalg.expm takes the superdiagonal of a triangular matrix from a divided difference, which loses
digits there (7 of 16 for eigenvalues 1e-8 apart); a Taylor series with squaring does not.
"""

from __future__ import annotations

import numpy as np

from focgen.arrays import Array

_TERMS = 18  # Σ_{k ≤ 18} x^k/k! is exact to rounding for |x| ≤ 1


def triangular_exponential(matrices: Array) -> Array:
    """Return e^A for each upper triangular A, shape (n, m, m) complex.

    The real part of the diagonal may be large; its spread within one matrix should be moderate.
    """
    m = matrices.shape[-1]
    diagonal = np.diagonal(matrices, axis1=1, axis2=2)
    shift = diagonal[np.arange(len(diagonal)), np.argmax(diagonal.real, axis=1)]  # so that nothing grows
    shifted = matrices - shift[:, None, None] * np.eye(m)
    norm = np.abs(shifted).sum(axis=-1).max(axis=-1)
    squarings = np.ceil(np.log2(np.maximum(norm, 1.0))).astype(int)
    scaled = shifted / (2.0**squarings)[:, None, None]
    result = np.broadcast_to(np.eye(m, dtype=complex), scaled.shape)
    for k in range(_TERMS, 0, -1):
        result = np.eye(m) + scaled @ result / k
    for k in range(squarings.max(initial=0)):
        left = squarings > k
        result[left] = result[left] @ result[left]
    made: Array = result * np.exp(shift)[:, None, None]
    return made
