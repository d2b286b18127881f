"""Whether what was found is there by as much all along, or is the form of something else.

An effect whose form is right explains its part of every stretch of the session. What only looks like it is
followed well where much hangs on it and badly elsewhere: there the form, at the size found, is too much or
too little. So every stretch says by itself how many times the effect is there: of what it changes beside a
rig whose own numbers, and other effects, have made up for it as far as they can. Stretches of a right form
agree.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import chdtri

from focgen.arrays import Array, Ints
from focgen.diagnosis.fitting.fit import Weighing, innovations
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.verdict.instead import Instead, bases, gone, is_likelier

_STRETCHES = 4  # of an experiment
_NOTHING = 1e-12  # of an effect: a stretch with less has nothing of it
_CHANCE = 0.01  # that noise alone makes stretches differ by as much as is taken off


@dataclass(frozen=True)
class Stretch:
    """Where an effect is ``times`` as much there as on the whole: ``within`` s after an ``experiment``
    began."""

    times: float
    experiment: str
    within: float

    def __str__(self) -> str:
        return f"{self.times:.1f} times ({self.experiment}, from {self.within:.4g} s on)"


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
            f"something else may act ({self.sure:.0%}): told from one stretch alone it is {self.most} and "
            f"{self.least} what was found, and an effect is as large in both; compare these stretches"
        )


@lru_cache(maxsize=16)
def unsteady(e: Explanation) -> tuple[Unsteady, ...]:
    """For every family found how likely it is something else, by how differently it is there; none where a
    rounding was found."""
    weighing, found = Weighing(e.ar), []
    left = innovations(e.best.problem, e.best.vector, weighing)
    for base in bases(e):
        out = gone(e, base)
        if len(out) == 1:
            shape = innovations(base.problem, base.vector, weighing) - left
            found.append(_judged(e, out, shape, left))
    return tuple(one for one in found if one is not None)


def is_unsteady(e: Explanation) -> bool:
    """Whether something else is likelier than one of the effects found."""
    return any(is_likelier(one) for one in unsteady(e))


def _judged(e: Explanation, out: frozenset[str], shape: Array, left: Array) -> Unsteady | None:
    """An effect that changes the innovations ``left`` (n,) by a ``shape`` (n,). None of the families is as
    likely as beforehand where stretches differ by as much as a form is wrong, and by the fourth power of that
    more."""
    total = float(shape @ shape)
    stretches = [s for s in _stretches_of(e) if shape[s] @ shape[s] > _NOTHING * total]
    if len(stretches) < 2 or not total > 0.0:
        return None
    weight = np.array([shape[s] @ shape[s] for s in stretches])
    times = 1.0 + np.array([shape[s] @ left[s] for s in stretches]) / weight
    by = _differ(weight, times, float(left @ left), len(left))
    # what is as likely as beforehand is in every confidence already
    more = max((by / NUMBERS.form) ** 4 - 1.0, 1e-12)
    odds = float(np.log(NUMBERS.elsewhere * more))
    telling = np.sqrt(weight) * (times - weight @ times / weight.sum())
    most, least = (_stretch(e, stretches[i], float(times[i])) for i in (telling.argmax(), telling.argmin()))
    return Unsteady(out, odds, by, most, least)


def _differ(weight: Array, times: Array, left: float, count: int) -> float:
    """By how much stretches (k,) differ, root mean square by ``weight``, beyond what noise does, and what is
    ``left`` (a sum of ``count`` squares) is other than noise by."""
    mean = weight @ times / weight.sum()
    noise = left / count * float(chdtri(len(weight) - 1, _CHANCE)) + left * NUMBERS.other
    return float(np.sqrt(max(weight @ (times - mean) ** 2 - noise, 0.0) / weight.sum()))


def _stretches_of(e: Explanation) -> list[Ints]:
    """The samples of every stretch, experiments apart."""
    spans = e.segment.run.spans
    return [s for first, last in spans for s in np.array_split(np.arange(first, last), _STRETCHES) if len(s)]


def _stretch(e: Explanation, samples: Ints, times: float) -> Stretch:
    run = e.segment.run
    number, first = next((i, first) for i, (first, last) in enumerate(run.spans) if samples[0] < last)
    return Stretch(times, e.segment.names[number], float(samples[0] - first) * run.h)
