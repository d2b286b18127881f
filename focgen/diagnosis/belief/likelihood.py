"""How likely a residual is under a hypothesis that is, as every one, a little wrong.

The measured output is what the hypothesis simulates, plus noise, plus a discrepancy: what the form lacks of
the rig. The discrepancy is smooth, so it has few independent values, its turns. Their variance is unknown,
with a scaled inverse χ² prior about a small part of what the effects change (a discrepancy term as of M. C.
Kennedy and A. O'Hagan, Bayesian calibration of computer models, Journal of the Royal Statistical Society B
63, 2001). Integrated out, it leaves Student's t for the misfit. While the misfit is below its scale, evidence
grows like the likelihood; beyond, only with the logarithm. So two good forms stay close, as in J. W. Miller
and D. B. Dunson, Robust Bayesian inference via coarsening, Journal of the American Statistical Association
114 (2019).

How wrong forms are is not one number either: one in several is as good as right. Then it is no wonder that
next to nothing is left. But no free value is excused then, so that each costs what the data tell of it.

Everything is in nats of the noise: a mean square m over n samples of noise σ² is n m/(2 σ²).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from focgen.diagnosis.numbers import NUMBERS


@dataclass(frozen=True)
class Scale:
    """What misfit is no wonder: ``other`` nats whatever the hypothesis, and a part of what its effects
    change."""

    other: float = 0.0

    def of(self, changed: float, form: float = NUMBERS.form) -> float:
        """The scale, nats, of a hypothesis whose effects change ``changed`` nats, wrong by ``form``."""
        return 0.5 * NUMBERS.turns + self.other + form**2 * max(changed, 0.0)


def log_likelihood(misfit: float, scale: float) -> float:
    """Of ``misfit`` nats beyond the noise, up to a constant: multivariate t with a degree of freedom for each
    value."""
    half = 0.5 * NUMBERS.turns
    return float(-half * np.log(scale) - 2.0 * half * np.log1p(max(misfit, 0.0) / scale))


def paid(count: int, gained: float, misfit: float, scale: float) -> float:
    """Nats that ``count`` free values cost which gain ``gained`` nats: by how much the data narrow a prior of
    the width of the effect itself (D. J. C. MacKay, Bayesian interpolation, Neural Computation 4, 1992).

    Where a form is wrong they narrow it the less, and of the values of one form few are independent.
    """
    told = NUMBERS.turns * max(gained, 0.0) / (scale + max(misfit, 0.0))
    return float(0.5 * NUMBERS.free * count * np.log1p(told))


def speaks(count: int, gained: float, misfit: float, scale: Scale, changed: float) -> float:
    """What speaks for a hypothesis, nats, up to a constant, of which no form is quite right: of effects that
    change ``changed`` nats, ``gained`` of them by ``count`` free values, and leave ``misfit``."""
    usual = scale.of(changed)
    return log_likelihood(misfit, usual) - paid(count, gained, misfit, usual)


def speaks_or_is_right(count: int, gained: float, misfit: float, scale: Scale, changed: float) -> float:
    """The same where one in ten is as good as right.

    A form that is as good as right is wrong by a third of what others are. Its values are told to within the
    noise; a signal of ``gained`` nats is √(2 ``gained``) times that.
    """
    mostly = speaks(count, gained, misfit, scale, changed)
    seldom = log_likelihood(misfit, scale.of(changed, NUMBERS.form / 3.0))
    seldom -= 0.5 * count * np.log1p(2.0 * max(gained, 0.0))
    return float(np.logaddexp(np.log1p(-NUMBERS.right) + mostly, np.log(NUMBERS.right) + seldom))
