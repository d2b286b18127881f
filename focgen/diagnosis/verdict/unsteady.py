"""Whether what was found is there by as much all along, or is the form of something else.

An effect whose form is right explains its part of every stretch of the session. What only looks like it is
followed well where much hangs on it and badly elsewhere: there the form, at the size found, is too much or too
little. So every stretch says by itself how many times the effect is there, with all that the rig's own numbers
and the other effects can make up for taken out. Stretches of a right form agree.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import chdtri

from focgen.arrays import Array
from focgen.diagnosis.fitting.fit import Weighing, innovations, jacobian
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.rivals import without
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.verdict.instead import Instead, bases, is_likelier

_STRETCHES = 4  # of an experiment
_CHANCE = 0.01  # that noise alone makes stretches differ by as much as is taken off
_NOTHING = 1e-9  # of the largest: a direction about which nothing is known


@dataclass(frozen=True)
class Stretch:
    """Where an effect is ``times`` as much there as on the whole: ``within`` s after an ``experiment``
    began."""

    times: float
    experiment: str
    within: float

    def __str__(self) -> str:
        return f"{self.times:.1f} times from {self.within:.4g} s on in {self.experiment}"


@dataclass(frozen=True, eq=False)
class Unsteady(Instead):
    """An effect that is there ``by`` so much more or less, root mean square over the session, from one
    stretch to another: the ``most`` and the ``least`` of it."""

    by: float
    most: Stretch
    least: Stretch
    fills = True

    @property
    def may_be(self) -> str:
        """As of :class:`Instead`."""
        return (
            f"something may act ({self.sure:.0%}) that is there by as much nowhere: as this effect it would "
            f"differ by {self.by:.0%} (root mean square), {self.most}, {self.least}; compare the two"
        )


@lru_cache(maxsize=16)
def unsteady(e: Explanation) -> tuple[Unsteady, ...]:
    """For every family found how likely it is something else, by how differently it is there; none where a
    rounding was found."""
    if not e.causes or next(bases(e), None) is None:
        return ()
    found = (_judged(e, family) for family in e.best.problem.families)
    return tuple(one for one in found if one is not None)


def is_unsteady(e: Explanation) -> bool:
    """Whether something else is likelier than one of the effects found."""
    return any(is_likelier(one) for one in unsteady(e))


def _judged(e: Explanation, family: str) -> Unsteady | None:
    """As likely as none of the families is beforehand where stretches differ by as much as a form is wrong,
    and by the fourth power more."""
    shape, left = _alone(e, family)
    stretches = [s for s in _stretches_of(e) if np.any(shape[s])]
    if len(stretches) < 2:
        return None
    weight = np.array([shape[s] @ shape[s] for s in stretches])
    times = 1.0 + np.array([shape[s] @ left[s] for s in stretches]) / weight
    by = _differ(weight, times, float(left @ left), len(left))
    prior = NUMBERS.elsewhere / (1.0 - NUMBERS.elsewhere)
    odds = float(np.log(prior) + 4.0 * np.log(max(by, 1e-12) / NUMBERS.form))
    telling = np.sqrt(weight) * (times - weight @ times / weight.sum())
    most, least = (_stretch(e, stretches[i], float(times[i])) for i in (telling.argmax(), telling.argmin()))
    return Unsteady(frozenset({family}), odds, by, most, least)


def _differ(weight: Array, times: Array, left: float, count: int) -> float:
    """By how much stretches (k,) differ, root mean square by ``weight``, beyond what noise does, and what is
    ``left`` (a sum of ``count`` squares) is other than noise by."""
    mean = weight @ times / weight.sum()
    noise = left / count * float(chdtri(len(weight) - 1, _CHANCE)) + left * NUMBERS.other
    return float(np.sqrt(max(weight @ (times - mean) ** 2 - noise, 0.0) / weight.sum()))


def _alone(e: Explanation, family: str) -> tuple[Array, Array]:
    """What a family changes of the innovations, and these (n,), each less what all else in the fit could make
    up for, as far as that is not known beforehand."""
    best, weighing = e.best, Weighing(e.ar)
    problem, now = best.problem, innovations(best.problem, best.vector, weighing)
    own = [c for c in problem.candidates if c.effect == family]
    shape = without(best, own, weighing).innovations - now
    rows = jacobian(problem, best.vector, now, weighing, *problem.bounds())[:-1]
    entries = [c.effect != family for c in problem.candidates for _ in c.form.parameters]
    kept = np.r_[np.ones(problem.head, bool), np.array(entries, bool)] & rows.any(axis=1)
    scale = np.linalg.norm(rows[kept], axis=1)
    others, known = rows[kept] / scale[:, None], problem.known[1][kept] / scale**2
    normal = others @ others.T + np.diag(known * (now @ now) / len(now))
    both = np.array([shape, now])
    shape, left = both - np.linalg.lstsq(normal, others @ both.T, rcond=_NOTHING)[0].T @ others
    return shape, left


def _stretches_of(e: Explanation) -> list[Array]:
    """The samples of every stretch, experiments apart."""
    spans = e.segment.run.spans
    return [s for first, last in spans for s in np.array_split(np.arange(first, last), _STRETCHES) if len(s)]


def _stretch(e: Explanation, samples: Array, times: float) -> Stretch:
    run = e.segment.run
    number, first = next((i, first) for i, (first, last) in enumerate(run.spans) if samples[0] < last)
    return Stretch(times, e.segment.names[number], float(samples[0] - first) * run.h)
