"""How well the data tell two fitted explanations apart: Vuong's test on blocks of innovations.

Q. H. Vuong, Likelihood ratio tests for model selection and non-nested hypotheses, Econometrica 57 (1989).
Differences of the log-likelihood are summed over blocks, for neighbours are alike where a form is a little
wrong.
"""

from __future__ import annotations

import numpy as np

from focgen.diagnosis.fit import Fit
from focgen.rig.effects import library

_BLOCKS = 80
_FORM = (
    0.004,
    0.01,
)  # of the gain: what a form a little wrong may cost, in one stage, and where stages are merged
# of the nats that inputs still foretell of what the better one leaves: its form is wrong by as much at least,
# and so may the other's be
_SEEN = 0.5
_NOISE = 0.01  # of a residual's mean square foretold by inputs: up to here it is chance
_UNTOLD = 0.05
_DRAWN = (
    0.03  # the same where the better one is a curve drawn through points: it describes, and explains little
)
_COUNTED = 8.0  # nats: what counting parameters may decide, where the experiments are not made to tell
# of what the better one closes of the gap: where the experiments are not made to tell, what closes as much is
_ALIKE = 0.95
_AT_MOST = 1.0  # so many standard deviations behind, for what tells them then is the detail of their forms
_KINKED = 1.0  # standard deviations that a curve with kinks stands back, where the effect's own have none
_ROUGH = 2.0  # nats: what is held against own parameters far from those given is known no better


def separation(better: Fit, other: Fit, nominal: Fit, indistinct: bool = False) -> float:
    """Standard deviations by which ``better`` beats ``other``, complexity paid for, own parameters close to
    those given preferred; innovations of the same weighing.

    To the spread belongs that no form is quite what the rig does: a part of the gain over ``nominal``, a
    larger one where the experiments are not made to tell the two apart (``indistinct``), and what inputs
    still foretell of what ``better`` leaves.
    """
    a, b = better.innovations, other.innovations
    n = min(len(a), len(b))
    variance = min(better.sse, other.sse) / n
    difference = (b[:n] ** 2 - a[:n] ** 2) / (2 * max(variance, 1e-300))
    length = max(1, n // _BLOCKS)
    sums = difference[: n // length * length].reshape(-1, length).sum(axis=1)
    spread = float(np.std(sums, ddof=1) * np.sqrt(len(sums))) if len(sums) > 2 else np.inf
    gain = 0.5 * n * np.log(max(nominal.sse, 1e-300) / max(better.sse, 1e-300))
    drawn = any(c.form.drawn for c in better.problem.clues)
    part = _DRAWN if drawn else _FORM[len(better.problem.segment.stages) > 1]
    part = max(part, _UNTOLD * indistinct)
    wrong = np.hypot(part * gain, _SEEN * _left(better))
    spread = float(np.hypot(max(spread, _COUNTED if indistinct else 1.0), wrong))
    paid = 0.5 * (better.size - other.size) * np.log(n)
    likely = (other.doubt - better.doubt) / max(spread, _ROUGH)
    apart = float((difference.sum() - paid) / spread + likely) + _KINKED * (_kinked(other) - _kinked(better))
    return min(apart, _AT_MOST) if indistinct and _closes_alike(better, other, nominal) else apart


def _left(of: Fit) -> float:
    """Nats that a form without fault would gain over this one."""
    share = min(max(of.foretold - _NOISE, 0.0), 1.0 - 1e-9)
    return -0.5 * len(of.innovations) * float(np.log1p(-share))


def _kinked(of: Fit) -> bool:
    """Whether a curve drawn through points stands for an effect whose curves are smooth."""
    return any(c.form.drawn and library()[c.effect].smooth for c in of.problem.clues)


def _closes_alike(better: Fit, other: Fit, nominal: Fit) -> bool:
    """Whether ``other`` closes nearly as much of the gap, in mean square, whatever the noise's colour."""
    closed, gap = (np.mean(nominal.weighed**2) - np.mean(f.weighed**2) for f in (other, better))
    return closed > _ALIKE * gap
