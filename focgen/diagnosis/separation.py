"""How well the data tell two fitted explanations apart: Vuong's test on blocks of innovations.

Q. H. Vuong, Likelihood ratio tests for model selection and non-nested hypotheses, Econometrica 57 (1989). Differences of
the log-likelihood are summed over blocks, for neighbours are alike where a form is a little wrong.
"""

from __future__ import annotations

import numpy as np

from focgen.diagnosis.fit import Fit

_BLOCKS = 80
_ROUGH = 2.0  # nats: what is held against own parameters far from those given is known no better


def separation(better: Fit, other: Fit) -> float:
    """Standard deviations by which ``better`` beats ``other``, complexity paid for, own parameters close to
    those given preferred; innovations of the same weighing."""
    a, b = better.innovations, other.innovations
    n = min(len(a), len(b))
    variance = min(better.sse, other.sse) / n
    difference = (b[:n] ** 2 - a[:n] ** 2) / (2 * max(variance, 1e-300))
    length = max(1, n // _BLOCKS)
    sums = difference[: n // length * length].reshape(-1, length).sum(axis=1)
    spread = float(np.std(sums, ddof=1) * np.sqrt(len(sums))) if len(sums) > 2 else np.inf
    paid = 0.5 * (better.size - other.size) * np.log(n)
    likely = (other.doubt - better.doubt) / max(spread, _ROUGH)
    return float((difference.sum() - paid) / max(spread, 1.0) + likely)
