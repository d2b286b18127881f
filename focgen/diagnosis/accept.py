"""Whether the family that helps a residual most is an effect, or only mends what noise, a coarse converter or
the form of an effect found already leave.

Pairs of numbers: for a family unlike those found already, and for one that is easily confused with them, or
else as said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from focgen.diagnosis.converter import Converter
from focgen.diagnosis.disturbance import disturbance
from focgen.diagnosis.fit import Fit
from focgen.diagnosis.integrating import counted
from focgen.diagnosis.leftover import LEFT
from focgen.diagnosis.problem import Clue
from focgen.diagnosis.reconsider import near_families, reconsidered
from focgen.diagnosis.search import Ranking, evidence, family, rank
from focgen.rig.effects import confused, library

# parts of the remaining mean square
_VISIBLE = (0.015, 0.05)  # what the first effect, and any further, has to take away to be of use
_NOISY = (0.15, 0.03)  # the same where the input is measured: its noise still in it, or freed of it
_SURE = (0.4, 0.6)  # the first effect, and any further, that takes away as much takes no noise away
# of what inputs foretell of a residual
_KNOWN = 0.12  # an effect takes at least as much of what it takes away from there
_WHOLE = 0.5  # a further family has to explain as much
# of the gap: what a further family has to close
_SHARE = (0.08, 0.15)
_MERGED = (0.15, 0.25)  # where the stages are merged
# (of what remains, of the gap): where it takes away so much of the one, so little of the other will do, for
# another family seldom makes just what a form lacks
_CLEAN = (((0.55, 0.015), (0.4, 0.04)), ((0.75, 0.04),))
# the same where no more than noise is left
_PURE = (((0.2, 0.015), (0.1, 0.05)), ((0.3, 0.08),))
_WHITE = 0.01  # of a residual's mean square foretold by inputs: below it nothing is left but noise
_ANEW = 0.7  # of the mean square that an effect leaves: another beginning is taken if two leave less
# of the winner's evidence: from there a family that the experiments are made to show goes before one that not
_SHOWN = 0.75
# of the best further family's evidence: from there another form of a family found already goes first
_MENDING = 0.6


@dataclass(frozen=True)
class Asked:
    """What an effect has to show to be one. ``threshold``: nats of evidence that noise alone does not reach;
    ``trusted``: whether the input could be freed of its noise; ``converter``: that hides small ones.
    ``granted``: it is there, and only its strength is asked."""

    threshold: float
    trusted: bool
    converter: Converter | None
    granted: bool = False


def chosen(rankings: Sequence[Ranking], asked: Asked, clues: Sequence[Clue]) -> Fit | None:
    """The winner where it is beyond chance and of use. Another form of what was found already goes before a
    further family, unless that explains clearly more: no form is quite what the rig does, and others mend
    what it lacks."""
    ranking = rankings[-1]
    if ranking.winner is None or ranking.gain[ranking.winner] < asked.threshold:
        return None
    if asked.granted and (missing := _missing(ranking)) is not None:
        return missing
    winner, again = ranking.best[_leading(ranking, asked.converter)], _again(ranking)
    gained = evidence(again, ranking.base) if again is not None else 0.0
    sure = gained > asked.threshold and counted(again, ranking.base) > asked.threshold
    mends = sure and _mends(ranking.base, again, _VISIBLE[1], 0.0, asked.converter)
    mended = again if mends else None
    if gained > _MENDING * ranking.gain[ranking.winner]:
        return mended
    if not ranking.base.problem.clues:
        return winner if _useful(rankings, winner, asked) else mended
    tried = dict.fromkeys((reconsidered(rankings, winner, clues), winner))
    return next((f for f in tried if _useful(rankings, f, asked) and not _marginal(rankings, f)), mended)


def begun_anew(
    rankings: Sequence[Ranking], asked: Asked, clues: Sequence[Clue]
) -> tuple[Ranking, Fit] | None:
    """Where one effect leaves much that no second one explains: begun with another of those that came close,
    if it and another effect, unlike either, explain much more; the other's ranking, and both."""
    alone = rankings[-1].base
    if alone.foretold < LEFT or alone.problem.segment.pace:  # the errors of a path that is kept are too few
        return None
    found = []
    for first in near_families(rankings[0], alone):
        ranking = rank(first.problem, first.vector, first.problem.untried(clues))
        both = chosen([rankings[0], ranking], asked, clues)
        if both is not None and _further(alone, both):
            found.append((ranking, both))
    better = min(found, key=lambda pair: np.mean(pair[1].weighed ** 2), default=None)
    if better is None or np.mean(better[1].weighed ** 2) > _ANEW * np.mean(alone.weighed**2):
        return None
    return better


def _further(alone: Fit, both: Fit) -> bool:
    """Whether one of the two stands for what was found ``alone`` and the other is easily confused with
    neither: a bend upon a bend would only draw the curve that one leaves."""
    found = {c.effect for c in alone.problem.clues}
    near = found.union(*map(confused, found))
    names = {c.effect for c in both.problem.clues}
    others = names - near
    return len(names) == 2 and len(others) == 1 and not names & set(confused(min(others)))


def _missing(ranking: Ranking) -> Fit | None:
    """The likeliest of the families not found yet that finds anything to mend."""
    found = {c.effect for c in ranking.base.problem.clues}
    return next((f for n, f in ranking.best.items() if n not in found and ranking.gain[n] > 0), None)


def _leading(ranking: Ranking, converter: Converter | None) -> str:
    """The likeliest family that these experiments are made to show, where it comes close to the winner: of
    those that no coarse converter hides, if there are any."""
    clear = [n for n, f in ranking.best.items() if converter is None or not converter.hides(ranking.base, f)]
    names = clear or list(ranking.best)
    top, lacks = ranking.gain[names[0]], ranking.base.problem.lacks
    shown = [n for n in names if not lacks(n) and ranking.gain[n] > _SHOWN * top]
    return shown[0] if shown else names[0]


def _again(ranking: Ranking) -> Fit | None:
    """The best further form of a family found already."""
    already = {c.effect for c in ranking.base.problem.clues}
    known = [ranking.best[name] for name in already if name in ranking.best]
    return max(known, key=lambda f: evidence(f, ranking.base), default=None)


def _useful(rankings: Sequence[Ranking], winner: Fit, asked: Asked) -> bool:
    """Whether a family mends what an effect has to; a further one most of what inputs foretell."""
    base = rankings[-1].base
    measured, further = base.problem.segment.entry != "command", len(base.problem.clues) > 0
    visible = _NOISY[asked.trusted] if measured and not (further and asked.trusted) else _VISIBLE[further]
    if _goes_round(base, winner):
        return False
    if counted(winner, base) < asked.threshold:
        return False
    return _mends(base, winner, visible, _WHOLE * further, asked.converter)


def _goes_round(base: Fit, winner: Fit) -> bool:
    """Whether a tone is to be explained by one in a closed loop: whatever hums there is in the input, too."""
    segment, response = base.problem.segment, base.problem.references.clocks["response"]
    if not segment.led or not library()[family(winner)].tonal:
        return False
    return disturbance(base.residual(), segment.run.h, response).hums


def _marginal(rankings: Sequence[Ranking], winner: Fit) -> bool:
    """Whether a further family closes only a small part of the gap: what the first one's form lacks looks
    like that, the more so to a family that is easily confused with it."""
    first, now, then = (float(np.mean(f.weighed**2)) for f in (rankings[0].base, rankings[-1].base, winner))
    noise = now * (1.0 - rankings[-1].base.foretold)
    *others, last = winner.problem.clues
    near = [c for c in others if c.effect in confused(last.effect)]
    alike = bool(near)
    asked = [(_MERGED if len(winner.problem.segment.stages) > 1 else _SHARE)[alike]]
    if not any(c.form.drawn for c in near):
        enough = _CLEAN[alike] + (_PURE[alike] if winner.foretold < _WHITE else ())
        asked += [share for fall, share in enough if now - then > fall * now]
    return now - then < min(asked) * (first - min(noise, then))


def _mends(base: Fit, better: Fit, visible: float, whole: float, converter: Converter | None) -> bool:
    """Whether the residual falls visibly, by the part ``whole`` of what inputs foretell of it, and mostly
    so: what is not foretold is noise, and what takes that away no effect, unless it is most of all that is
    left; and what a coarse ``converter`` hides is no effect either."""
    old, new = (np.mean(f.weighed**2) for f in (base, better))
    if old - new < visible * new or (converter is not None and converter.hides(base, better)):
        return False
    sure = old - new > _SURE[bool(base.problem.clues)] * old
    told = sure or base.foretold * old - better.foretold * new > _KNOWN * (old - new)
    return told and old - new > whole * old * base.foretold
