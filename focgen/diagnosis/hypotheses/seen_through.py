"""What a coarse converter hides from a search: effects held against one another with its steps simulated.

To a search, which goes without the steps, they are an error as large as what another effect changes. With the
steps in its model a rig alone leaves little, and nothing that inputs predict. What another effect changes
moves the times at which the levels change.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from scipy.optimize import minimize_scalar

from focgen.diagnosis.belief.choice import rarity
from focgen.diagnosis.belief.further import Ground
from focgen.diagnosis.belief.standing import behind, holds
from focgen.diagnosis.fitting.fit import WHITE, Fit, fit
from focgen.diagnosis.hypotheses.accept import AcceptanceCriteria
from focgen.diagnosis.hypotheses.converter import Converter, rms
from focgen.diagnosis.hypotheses.own_steps import left_by_own_steps
from focgen.diagnosis.hypotheses.rivals import (
    Beside,
    Cause,
    Rival,
    alike,
    change_of,
    lack_of,
    share_of,
    without,
)
from focgen.diagnosis.hypotheses.search import Ranking, evidence, family, is_itself, on_all, rank
from focgen.diagnosis.numbers import NUMBERS
from focgen.rig.effects import library

_STEPS = 6  # iterations
_FINELY = {"xatol": 0.003, "maxiter": 20}  # of a step


def with_steps(
    converter: Converter, best: Fit, causes: tuple[Cause, ...], beside: Beside, asked: AcceptanceCriteria
) -> tuple[Fit, tuple[Cause, ...]]:
    """What was found, with what is there beside the steps of a ``converter``, and with the steps where they
    make more than noise. Steps that are noise hide an effect from the search all the same. ``beside``: what
    every effect is doubted with; ``asked``: what it has to show."""
    best, causes = _with_steps(converter, best, causes, beside, asked)
    return (best, causes) if asked.granted else _its_own(converter, best, causes, beside)


def _its_own(
    converter: Converter, best: Fit, causes: tuple[Cause, ...], beside: Beside
) -> tuple[Fit, tuple[Cause, ...]]:
    """What was found, but for a loop of the reading that is the converter's own: where its levels go on late
    either way, as those of encoders and comparators do, the loop is no wider than a step. Where levels change
    is fitted roughly, so the loop has to leave far less than that."""
    loops = [c.rivals[0].effect for c in causes if _is_loop_behind(c.rivals[0])]
    if not loops:
        return best, causes
    own = (*loops, converter.candidate.effect)
    found, weighing = [c for c in best.problem.candidates if c.effect in own], beside.weighing
    bare = without(best, found, weighing)
    missed = lambda lag: rms(converter.sluggish(lag).stepped(bare).weighed)
    closest = minimize_scalar(missed, bounds=(0.0, 0.5), method="bounded", options=_FINELY)
    there = best if converter.candidate in best.problem.candidates else converter.stepped(best)
    if rms(there.weighed) ** 2 < NUMBERS.unlikely * closest.fun**2:
        return best, causes
    kept = tuple(c for c in causes if c.rivals[0].effect not in own)
    stands, every = converter.sluggish(float(closest.x)).beside(bare, beside.nominal, kept, weighing)
    return (stands, every) if stands is not bare else (best, causes)


def _is_loop_behind(rival: Rival) -> bool:
    """Whether it is a loop behind all that moves."""
    effect = library()[rival.effect]
    form = next(c.form for c in reversed(rival.fit.problem.candidates) if c.effect == rival.effect)
    return effect.remembers and (effect.stage == "sensor" or form.slot in ("place", "response"))


def _with_steps(
    converter: Converter, best: Fit, causes: tuple[Cause, ...], beside: Beside, asked: AcceptanceCriteria
) -> tuple[Fit, tuple[Cause, ...]]:
    nominal, weighing = beside.nominal, beside.weighing
    noise = converter.is_noise(nominal, alone=not best.problem.candidates)
    nothing = asked.granted or converter.blurred or (noise and best.predictable_share < NUMBERS.left)
    seen = None if nothing else _seen_through(converter, best, beside, asked)
    if seen is None:
        return converter.beside(best, nominal, causes, weighing)
    plain, cause = seen
    first, *others = cause.rivals
    found = fit(plain[first.effect].problem, plain[first.effect].vector, weighing, _STEPS)
    best, every = converter.beside(found, nominal, (*causes, cause), weighing)
    if best is found:  # experiments are chosen by what rivals would show: all with the steps, or none
        others = [replace(r, fit=plain[r.effect]) for r in others]
    now = replace(cause, rivals=(replace(first, fit=best), *others))
    return best, tuple(now if c is cause else c for c in every)


def _seen_through(
    converter: Converter, best: Fit, beside: Beside, asked: AcceptanceCriteria
) -> tuple[dict[str, Fit], Cause] | None:
    """Families beside those of ``best``, each fitted without the steps, and the cause that the likeliest of
    them is with the steps simulated. None where none is likelier than none. How much inputs predict is not
    asked: what is left where levels change late or soon are whole steps, of which nothing predicts much."""
    base = converter.stepped(best)
    plain = _every_family(_ranked(best, beside))
    tried = {n: s for n, f in plain.items() if evidence(s := converter.stepped(f), base) > asked.threshold}
    if not tried:
        return None
    nominal = converter.stepped(beside.nominal)
    for hidden, among in _hidden(converter, base, tried):
        fits = (nominal, base, plain, among)
        if (cause := _told(best, beside, fits, hidden, asked)) is not None:
            return plain, cause
    return None


def _hidden(converter: Converter, base: Fit, tried: dict[str, Fit]) -> Iterator[tuple[float, dict[str, Fit]]]:
    """The mean square that a converter may make beside its steps, and the families that are held against it:
    as much as real ones make, and all. Then what steps at places of their own take of ``base``, or a little
    of the same, and those that leave far less than it even so. Where errors add up no place stays."""
    yield converter.left**2, tried
    if base.problem.segment.pace:
        return
    own, even = left_by_own_steps(base), rms(base.weighed) ** 2
    hidden = max(even - own, NUMBERS.vain * converter.left**2)
    if own < even and hidden < converter.left**2:
        far = {n: f for n, f in tried.items() if left_by_own_steps(f) < NUMBERS.unlikely * own}
        if far:
            yield hidden, far


def _told(
    best: Fit,
    beside: Beside,
    fits: tuple[Fit, Fit, dict[str, Fit], dict[str, Fit]],
    hidden: float,
    asked: AcceptanceCriteria,
) -> Cause | None:
    """The cause that the likeliest of the families tried is, where it is likelier than none. ``fits``: of
    the rig by itself, the one that they are tried beside, and theirs without the steps and with them."""
    nominal, base, plain, tried = fits
    surroundings = replace(asked.surroundings, hidden=hidden)
    ground = Ground.of(nominal, base, [*tried.values()], WHITE, surroundings)
    rare = {n: rarity([plain[n].problem.candidates[-1]]) for n in tried}
    odds = {n: ground.compared(f) + rare[n] for n, f in tried.items()}
    first = max(odds, key=lambda n: odds[n])
    there = ground.odds(tried[first]) + rare[first]
    if there <= ground.closer(tried[first]):
        return None
    more = there - odds[first]

    def rival(name: str, of: Fit) -> Rival:
        stage = plain[name].problem.candidates[-1].stage
        apart, gain = behind(odds[name], odds[first]), evidence(of, base)
        return Rival(name, stage, apart, gain, of, odds[name] + more, change_of(of, base), lack_of(of))

    rivals = tuple(sorted((rival(n, f) for n, f in tried.items()), key=lambda r: r.separation))
    if holds(rivals[0].off):
        return None
    return Cause(rivals, rivals[0].gain, share_of(beside.nominal, best, tried[first]))


def _every_family(ranking: Ranking) -> dict[str, Fit]:
    """A fit of each family, the foremost of its forms: what is far behind without the steps need not be with
    them."""
    problem, found = ranking.base.problem, dict(ranking.best)
    for left in sorted(ranking.left, key=lambda f: f.sse / len(f.innovations)):
        if family(left) not in found:
            whole = on_all(left, problem, round(problem.slack / left.problem.slack))
            found[family(left)] = fit(whole.problem, whole.vector, WHITE, _STEPS)
    return {n: f for n, f in found.items() if is_itself(f) and n not in problem.families}


def _ranked(best: Fit, beside: Beside) -> Ranking:
    """What each further family does beside ``best``, without the steps. Where a search saw no more than noise
    it tried none."""
    problem = best.problem
    for ranking in beside.rankings:
        if alike(ranking.base.problem, problem) and (ranking.best or ranking.left):
            return ranking
    return rank(problem, best.vector, problem.untried(beside.candidates))
