"""Fewer samples of long signals, for the eye: every peak stays."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from focgen.arrays import Array, Ints


def thinned(*signals: Array, most: int) -> Ints:
    """Indices (m,) of about ``most`` samples of ``signals``, all (n,): both ends, in every one of equally
    long stretches the smallest and the largest of each signal, and where a signal breaks off (the first NaN
    of a row)."""
    count = len(signals[0])
    if count <= most:
        return np.arange(count)
    stretches = max(1, (most - 2) // (2 * len(signals)))
    edges = np.linspace(0, count, stretches + 1).astype(int)
    kept = {0, count - 1}
    for signal in signals:
        absent = np.isnan(np.asarray(signal, float))
        kept |= set(np.flatnonzero(absent & ~np.roll(absent, 1)).tolist())
        plain = np.where(absent, 0.0, signal)
        for a, b in pairwise(edges):
            kept |= {a + int(plain[a:b].argmin()), a + int(plain[a:b].argmax())}
    return np.array(sorted(kept))
