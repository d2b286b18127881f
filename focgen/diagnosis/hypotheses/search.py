"""Which effects a segment needs: every form of every family fitted on top of what was found, the best one
kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from focgen.diagnosis.belief.choice import foremost_forms
from focgen.diagnosis.belief.further import Ground, Surroundings
from focgen.diagnosis.fitting.fit import WHITE, Fit, Known, Weighing, fit, innovations, known_at
from focgen.diagnosis.fitting.jumps import by_trying
from focgen.diagnosis.fitting.noise import fit_ar
from focgen.diagnosis.fitting.repeats import without_hearsay
from focgen.diagnosis.hypotheses.abreast import abreast
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.candidates import CandidateEffect
from focgen.diagnosis.problem.problem import Problem
from focgen.rig.plant import plant_of
from focgen.rig.rig import LinearActuator

_COARSE = 5000  # samples of the first, coarse pass
_LONG = 4000  # samples from which on a plant's own steps take longer than what is about them
_DEEP = 5  # how many forms are fitted to the end beside the families' best
_QUICK = 0.3  # of the best quick fit's fall in the sum of squares: forms below are left at that
_ADRIFT = 1.15  # of a fit's mean square without a colour
_NOTHING = 2.0  # nats: when the coarse pass finds no more, nothing is there
_FAR, _NEAR = 0.25, 10.0  # a form with less than this part of the best evidence, less these nats, is dropped
_TRIED = 3  # start values of a form that are fitted, where it has more
_FOREMOST = 2  # of those that a first iteration has brought furthest
# iterations from each start value, beside nominal parameters as given, and from the best
_FIRST, _FROM_GIVEN, _THEN = 2, 3, 3
_BENT = 4.0  # nats against nominal parameters that make up for what is missing: then started as given, too
_HOPELESS = 2.0  # beyond this many times the best sum of squares a form is dropped


@dataclass(frozen=True, eq=False)
class Ranking:
    """``base`` and what each family adds to it, all under the same noise model ``ar``; ``best`` by family,
    likeliest first. Beside a later family the effects of ``base`` may have other forms.

    ``errors``: by family, the root-mean-square residual with its best form, over that of ``base`` (a quick
    fit's where no more was worth while). ``gain`` are nats of evidence over ``base``: half the
    log-likelihood ratio's worth less half k ln n. ``left``: further forms, as far as they were fitted: on
    means of samples where they had fallen behind another of their family.
    """

    base: Fit
    ar: np.ndarray
    best: dict[str, Fit]
    gain: dict[str, float]
    errors: dict[str, float]
    left: tuple[Fit, ...] = ()
    further: tuple[Fit, ...] = ()

    @property
    def winner(self) -> str | None:
        """The family of highest evidence."""
        return next(iter(self.best), None)

    def firsts(self, without: Callable[[CandidateEffect], bool] = lambda c: False) -> list[Fit]:
        """Every family's best on every sample, the likeliest first, and behind them those that fell behind by
        themselves, which they may not beside another, by their error; ``without`` some forms."""
        found, whole = dict[str, Fit](), self.base.problem
        for of in (*self.best.values(), *sorted(self.left, key=lambda f: self.errors.get(family(f), np.inf))):
            if family(of) not in found and not without(of.problem.candidates[-1]):
                factor = round(whole.slack / of.problem.slack)
                found[family(of)] = of if factor == 1 else on_all(of, whole, factor)
        return list(found.values())

    @property
    def on_all(self) -> tuple[Fit, ...]:
        """What was fitted to every sample, to the end and in one colour: the families' best, and further
        forms."""
        return *self.best.values(), *self.further


def evidence(of: Fit, against: Fit) -> float:
    """Nats of evidence of one fit over another on the same innovations (Schwarz's approximation), own
    parameters close to those given preferred."""
    n = len(of.innovations)
    gain = 0.5 * n * np.log(max(against.sse, 1e-300) / max(of.sse, 1e-300))
    return float(gain - 0.5 * (of.size - against.size) * np.log(n) + against.prior_penalty - of.prior_penalty)


def rank(problem: Problem, base: np.ndarray, candidates: Sequence[CandidateEffect]) -> Ranking:
    """Fit every candidate effect on top of ``base`` (a vector of ``problem``), first on means of neighbouring
    samples, then on every sample and with the colour of the noise.
    """
    factor = coarseness(problem)
    ground, tried, errors = _coarse(problem, base, candidates, factor)
    top = evidence(tried[0], ground) if tried else 0.0
    chosen = tried[:2] if top < _NOTHING else _chosen(tried, ground)
    kept = [t for t in chosen if top < _NOTHING or keeps_up(evidence(t, ground), top)]
    full = [on_all(t, problem, factor) for t in (ground, *kept)]
    found = finish(full[0], full[1:], errors)
    fallen = [t for t in kept if family(t) not in found.best]
    return replace(found, left=(*found.left, *fallen, *(t for t in tried if t not in kept)))


def keeps_up(gain: float, top: float) -> bool:
    """Whether evidence is near enough to that of the foremost one to be looked at further."""
    return gain > _FAR * top - _NEAR


def likeliest_on_all(problem: Problem, base: np.ndarray, candidates: Sequence[CandidateEffect]) -> Fit | None:
    """The candidate effect that is the likeliest on top of ``base`` on means of samples, as the start of a
    fit to all of them; None where there is none."""
    factor = coarseness(problem)
    _, tried, _ = _coarse(problem, base, candidates, factor)
    return on_all(tried[0], problem, factor) if tried else None


def _coarse(
    problem: Problem, base: np.ndarray, candidates: Sequence[CandidateEffect], factor: int
) -> tuple[Fit, list[Fit], dict[str, float]]:
    """``base`` and the candidates worth it fitted to means of ``factor`` samples, likeliest first, and each
    family's error."""
    thin = problem.thinned(factor)
    ground = fit(thin, problem.stretched(base, 1.0 / factor), WHITE)
    from_ = footings(thin, ground.vector) if candidates else []
    tried = [t for t in _started(thin, from_, candidates) if t is not None]
    tried = without_hearsay(ground, tried)
    errors = _errors(tried, ground)
    tried = _promising(tried, ground)
    rough, ground = _coloured(ground, min([ground, *tried], key=lambda t: t.sse), 6)
    return ground, sorted(raced(tried, rough, 10, 0.05), key=lambda t: -evidence(t, ground)), errors


def _started(
    thin: Problem, from_: Sequence[Footing], candidates: Sequence[CandidateEffect]
) -> list[Fit | None]:
    """The best start of each candidate: on all cores where the plant is one that is run in steps. The rest is
    quick, and mostly Python's own work, of which one thread at a time does any."""
    if not _in_steps(thin):
        return [best_start(thin, from_, candidate) for candidate in candidates]
    return abreast(lambda c: best_start(replace(thin, memory={}), from_, c), candidates)


def _in_steps(problem: Problem) -> bool:
    """Whether a run takes long by itself: of a plant that goes in steps."""
    own = problem.nominals.rig.actuator
    plant = isinstance(own, LinearActuator) and plant_of(own.dynamics)
    return bool(plant) and len(problem.segment.y) >= _LONG


def coarseness(problem: Problem) -> int:
    """How many neighbouring samples a coarse pass takes the mean of."""
    return max(1, min(len(problem.segment.y) // _COARSE, problem.coarsest))


def on_all(of: Fit, problem: Problem, factor: int) -> Fit:
    """A fit to thinned samples as the start of one to all of them."""
    whole = problem.with_candidates(of.problem.candidates)
    return fit(whole, whole.stretched(of.vector, factor), WHITE, 0)


def _promising(tried: Sequence[Fit], ground: Fit) -> list[Fit]:
    """Without the forms that a quick fit shows to be far behind, each family's best kept."""
    tried = sorted(tried, key=lambda t: t.sse)
    best = ground.sse - tried[0].sse if tried else 0.0
    near = [t for t in tried if ground.sse - t.sse > _QUICK * best]
    return near + [t for t in _firsts(tried) if t not in near]


def _firsts(tried: Sequence[Fit]) -> list[Fit]:
    """The first of every family."""
    found: dict[str, Fit] = {}
    for t in tried:
        found.setdefault(family(t), t)
    return list(found.values())


def _chosen(tried: Sequence[Fit], ground: Fit) -> list[Fit]:
    """The best form of every family, the best forms altogether, and the forms that most speaks for."""
    odds = Ground.of(ground, ground, tried, WHITE, Surroundings())
    return list(dict.fromkeys([*_firsts(tried), *tried[:_DEEP], *foremost_forms(odds, tried)]))


def _colour(leader: Fit) -> np.ndarray:
    """The whitening filter of what the best fit leaves. Where inputs predict much of that it is no noise
    yet, and a filter that takes out its colour would hide what is missing: then there is none."""
    return np.ones(1) if leader.predictable_share > NUMBERS.much else fit_ar(leader.residual())


def _coloured(ground: Fit, leader: Fit, iterations: int) -> tuple[Weighing, Fit]:
    """The weighing by the colour of what ``leader`` leaves, and the ground fitted so. Where that drives the
    ground away from the data the colour is not the noise's: then none."""
    weighing = Weighing(_colour(leader))
    moved = fit(ground.problem, ground.vector, weighing, iterations)
    if np.mean(moved.weighed**2) < _ADRIFT * np.mean(ground.weighed**2):
        return weighing, moved
    return WHITE, fit(ground.problem, ground.vector, WHITE, iterations)


def _errors(tried: Sequence[Fit], ground: Fit) -> dict[str, float]:
    """Each family's least root mean square over the ground's."""
    found: dict[str, float] = {}
    for t in tried:
        error = float(np.sqrt(t.sse / max(ground.sse, 1e-300)))
        found[family(t)] = min(found.get(family(t), error), error)
    return found


def finish(ground: Fit, tried: Sequence[Fit], errors: dict[str, float]) -> Ranking:
    """Fit on every sample, in the colour of what the best one leaves."""
    leader = min([ground, *tried], key=lambda t: t.sse)
    for iterations in (3, 6):
        weighing, ground = _coloured(ground, leader, iterations)
        tried = sorted(raced(tried, weighing, iterations, 0.02), key=lambda t: t.sse)
        leader = min([ground, *tried], key=lambda t: t.sse)
        tried = [t for t in tried if t.sse < leader.sse * _HOPELESS or t is leader] or tried[:1]
    return _ranking(ground, weighing.ar, tried, errors)


def _ranking(ground: Fit, ar: np.ndarray, tried: Sequence[Fit], errors: dict[str, float]) -> Ranking:
    families: dict[str, Fit] = {}
    tried = [t for t in tried if is_itself(t)]
    for one in sorted(tried, key=lambda t: -evidence(t, ground)):
        families.setdefault(family(one), one)
    gain = {name: evidence(f, ground) for name, f in families.items()}
    left = tuple(t for t in tried if families[family(t)] is not t)
    return Ranking(ground, ar, families, gain, errors, left, left)


def family(of: Fit) -> str:
    """The family added last."""
    return of.problem.candidates[-1].effect


def is_itself(of: Fit) -> bool:
    """Whether the effect added last is, with the values found, what its family says."""
    actuator = of.problem.rig(of.vector).actuator
    form, values = of.problem.candidates[-1].form, of.problem.values(of.vector)[-1]
    return actuator is None or form.itself(values, actuator.dynamics.den)


@dataclass(frozen=True, eq=False)
class Footing:
    """Where quick fits set out from: a ``vector``, its innovations ``now`` (n,), and the Jacobian ``known``
    there, which a quick fit takes as it is; ``first`` iterations from there."""

    vector: np.ndarray
    now: np.ndarray
    known: Known
    first: int


def footings(problem: Problem, base: np.ndarray) -> list[Footing]:
    """``base``, and where nominal parameters make up for what is missing the same with those given."""
    found = [_footing(problem, base, _FIRST)]
    if problem.nominals.prior_penalty(base) > _BENT:
        given = np.r_[problem.nominal_start, base[len(problem.nominal_start) :]]
        found.append(_footing(problem, given, _FROM_GIVEN))
    return found


def _footing(problem: Problem, vector: np.ndarray, first: int) -> Footing:
    now, known = known_at(problem, vector, WHITE)
    return Footing(vector, now, known, first)


def best_start(problem: Problem, from_: Sequence[Footing], candidate: CandidateEffect) -> Fit | None:
    """The best of the fits from the candidate effect's start values beside each of the footings ``from_``:
    one iteration each, a few for the foremost, and a few more for the best of these.
    """
    extended = problem.with_candidates([*problem.candidates, candidate])
    starts, fits = extended.starts(candidate), []
    if candidate.form.jumps:
        return by_trying(extended, from_[0].vector, starts, from_[0].known.rows)
    if len(starts) > _TRIED:
        starts = _likeliest(extended, from_[0], starts)
    for start in starts:
        for at in from_:
            fits.append((_quick(extended, np.r_[at.vector, start], at, 1), at))
    foremost = sorted(fits, key=lambda pair: pair[0].sse)[:_FOREMOST]
    fits = [(_further(of, at, at.first - 1), at) for of, at in foremost]
    best, at = min(fits, key=lambda pair: pair[0].sse)
    if not np.isfinite(best.sse):
        return None
    return min(best, _further(best, at, _THEN), key=lambda f: f.sse)


def _quick(
    problem: Problem, start: np.ndarray, at: Footing, iterations: int, now: np.ndarray | None = None
) -> Fit:
    return fit(problem, start, WHITE, iterations, tolerance=0.1, known=at.known, now=now)


def _further(of: Fit, at: Footing, iterations: int) -> Fit:
    """A quick fit from where another has come."""
    return _quick(of.problem, of.vector, at, iterations, of.innovations)


def raced(tried: Sequence[Fit], weighing: Weighing, iterations: int, tolerance: float) -> list[Fit]:
    """Each fitted further, the most promising first; one that falls behind is left there. On all cores those
    behind the first, where a run takes long."""

    def on(of: Fit, leader: Fit | None) -> Fit:
        return fit(of.problem, of.vector, weighing, iterations, tolerance, leader=leader)

    ordered = sorted(tried, key=lambda t: t.sse)
    if ordered and _in_steps(ordered[0].problem):
        first = on(ordered[0], None)
        apart = [replace(t, problem=replace(t.problem, memory={})) for t in ordered[1:]]
        return [first, *abreast(lambda t: on(t, first), apart)]
    found: list[Fit] = []
    for t in ordered:
        found.append(on(t, min(found, key=lambda f: f.cost, default=None)))
    return found


def _likeliest(problem: Problem, at: Footing, starts: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Of many start values those whose direction, the parameters of the footing free to give way, goes
    furthest towards the data."""
    rows = at.known.rows
    own, _ = np.linalg.qr(rows[np.any(rows, axis=1)].T)
    tried = np.stack([innovations(problem, np.r_[at.vector, start], WHITE) for start in starts]) - at.now
    tried -= (tried @ own) @ own.T
    reach = (tried @ at.now) ** 2 / np.maximum(np.sum(tried**2, axis=1), 1e-300)
    return [starts[i] for i in np.argsort(-reach)[:_TRIED]]
