"""A second effect may show that the first one's form, or the first one itself, was the next best thing.

The first is chosen while the second is still missing, and bends to make up for it. So before a second is
judged, the first is tried again beside it: in its other forms, and as the families that came close to it;
then the second in its other forms.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.diagnosis.fit import WHITE, Fit, fit
from focgen.diagnosis.problem import Clue
from focgen.diagnosis.search import Ranking, best_start, coarseness, evidence, footings, on_all, raced

_CLOSE = 0.4  # of the first one's evidence: families that reach as much are tried in its place
_MOST = 3


def reconsidered(rankings: Sequence[Ranking], second: Fit, clues: Sequence[Clue]) -> Fit:
    """``second``, with either effect exchanged where that does better; with more than one before it,
    ``second`` as it is."""
    if len(rankings[-1].base.problem.clues) != 1:
        return second
    whole, factor = second.problem, coarseness(second.problem)
    thin = whole.thinned(factor)
    found = fit(thin, whole.stretched(second.vector, 1.0 / factor), WHITE, 0)
    found = _best(found, [*_other_forms(found, 0, clues), *_other_families(rankings[0], found, factor)])
    found = on_all(_best(found, _other_forms(found, 1, clues)), whole, factor)
    return fit(found.problem, found.vector, WHITE, 3, 0.05)


def _best(of: Fit, others: Sequence[Fit]) -> Fit:
    """The likeliest, the noise taken as white: a filter that takes out the colour of what a wrong form
    leaves would hide what the right one mends."""
    fits = raced([of, *others], WHITE, 8, 0.05)
    return max(fits, key=lambda f: evidence(f, fits[0]))


def _other_forms(of: Fit, which: int, clues: Sequence[Clue]) -> list[Fit]:
    """One of two effects in its other forms, each from its best start beside the other."""
    own, other = of.problem.clues[which], of.problem.clues[1 - which]
    alone, (head, *parts) = of.problem.with_clues([other]), _split(of)
    forms = [c for c in clues if c.effect == own.effect and c.stage == own.stage and c != own]
    from_ = footings(alone, np.r_[head, parts[1 - which]]) if forms else []
    starts = [s for clue in forms if (s := best_start(alone, from_, clue)) is not None]
    return [_in_order(s) for s in starts] if which == 0 else starts


def _split(of: Fit) -> list[np.ndarray]:
    """The vector: what precedes the two effects, and each of theirs."""
    head, count = of.problem.head, len(of.problem.clues[0].form.parameters)
    return np.split(of.vector, [head, head + count])


def _in_order(of: Fit) -> Fit:
    """The two effects the other way round."""
    head, first, second = _split(of)
    problem = of.problem.with_clues(of.problem.clues[::-1])
    return fit(problem, np.r_[head, second, first], WHITE, 0)


def near_families(first: Ranking, found: Fit) -> list[Fit]:
    """The families that came close to the first effect and are not among those ``found``; without those that
    these experiments are not made to show."""
    best, lacks = max(first.gain.values()), first.base.problem.lacks
    names = {c.effect for c in found.problem.clues}
    near = [n for n in first.best if first.gain[n] > _CLOSE * best and not lacks(n) and n not in names]
    return [first.best[n] for n in near[:_MOST]]


def _other_families(first: Ranking, second: Fit, factor: int) -> list[Fit]:
    """The families that came close to the first effect, as they were fitted alone to ``factor`` times as many
    samples, and the second; without those that these experiments are not made to show."""
    last, tail, near = second.problem.clues[-1], _split(second)[-1], near_families(first, second)
    starts = [f.problem.stretched(f.vector, 1.0 / factor) for f in near]
    return [
        fit(second.problem.with_clues([*f.problem.clues, last]), np.r_[start, tail], WHITE, 0)
        for f, start in zip(near, starts, strict=True)
    ]
