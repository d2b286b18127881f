"""The experiment that best tells the rivals apart, of those that the rig allows, per second of rig time.

For rivals A and B the expected separation is the distance of their outputs in units of the noise, as far as
B cannot take it up by moving its parameters (T-optimality, A. C. Atkinson and V. V. Fedorov, Biometrika 62,
1975), with what the logs have already told about them. Every candidate rig makes the experiment in
simulation, from the input to the output; where a signal of one of them would leave its range, the input is
made smaller, until it stays inside.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.rivals import Rival
from focgen.diagnosis.model import Found, NextExperiment
from focgen.diagnosis.problem.excitation import excitation
from focgen.diagnosis.problem.segments import cuts
from focgen.diagnosis.proposals.candidate_rigs import CandidateRig, candidate_rigs
from focgen.diagnosis.proposals.limits import Bounds, bounds_of, limits_of
from focgen.diagnosis.proposals.menu import Choice, menu
from focgen.diagnosis.proposals.separation import alone, in_session, without
from focgen.logs.experiment import Experiment
from focgen.present import present
from focgen.rig.effects import library
from focgen.rig.rig import Rig

NEXT = "next_experiment.csv"  # beside the diagnosis: the input that makes the experiment
_ENOUGH = 3.0  # standard deviations of the noise
_SURE = 5.0  # the same with forms a little wrong: of experiments expected to do less, most resolved nothing
_CERTAIN = 11.0  # the same with any form: with the signals at hand, all expected to do more resolved the set
_MOST = 99.0
_IN_A_ROW = 3  # experiments of the menu in one proposal
_RIVALS = 3  # of those tied, the likeliest
_SHARES = (1.0, 0.7, 0.5, 0.35, 0.25, 0.15, 0.1)  # of the way to the input's ends, until all stay in range
_ROLES = {"regulator": "pressure", "actuator": "curvature"}


def propose(
    rig: Rig, logs: Sequence[Experiment], explanations: Sequence[Explanation], found: Sequence[Found]
) -> tuple[NextExperiment, Choice] | None:
    """The experiment for the least certain cause with rivals, in words and as the input that makes it; None
    where nothing is tied, or the rig allows none that would tell."""
    tied = [f for f in found if len(f.candidates) > 1 and f.stage != "controller"]
    for least in sorted(tied, key=lambda f: f.candidates[0].confidence):
        names = [c.effect for c in least.candidates]
        for e in explanations:
            for cause in e.causes:
                rivals = [r for r in cause.rivals if r.effect in names]
                if len(rivals) > 1 and cause.rivals[0].effect == names[0]:
                    out = [r for r in cause.rivals if r.effect not in names]
                    asked = _Question(e, tuple(rivals[: 1 + _RIVALS]), tuple(out[:_RIVALS]))
                    return _answered(rig, logs, explanations, asked)
    return None


@dataclass(frozen=True, eq=False)
class _Question:
    """Which of the ``rivals`` is the cause in the segment ``e``; ``out``: the next ones, that the session has
    ruled out."""

    e: Explanation
    rivals: tuple[Rival, ...]
    out: tuple[Rival, ...]

    @property
    def anew(self) -> tuple[Rival, ...]:
        """All that a diagnosis has to decide between that does not know of the session."""
        return (*self.rivals, *self.out, without(self.e, self.rivals[0]))


@dataclass(frozen=True, eq=False)
class _Asked:
    """An experiment asked for: the ``choice``, on the input ``entry``, with what leaves ``stage`` logged too,
    within ``bounds``; ``rate``: the fastest so far, units of the input a second."""

    choice: Choice
    entry: str
    stage: str | None
    bounds: Bounds
    rate: float

    def said(self, rig: Rig) -> str:
        """It in words, with the rig's units."""
        limits, made, signals = self.choice.limits, self.choice.logged, rig.signals
        unit = signals.unit_of(self.entry)
        ends = f"from {made.min():.4g} to {made.max():.4g} {unit}".strip()
        parts = [f"{self.choice.what}, on the {self.entry} {ends}"]
        if np.isfinite(self.rate):
            faster = "no faster" if np.isfinite(limits.rate) else "faster"
            parts.append(f"{faster} than {self.rate:.3g} {unit}/s")
        parts.append(f"{self.choice.seconds:.0f} s")
        if limits.integrates:
            stands = rig.as_logged("output", present(self.bounds.stands))
            place = f"{stands:.3g} {signals.unit_of('output')}".strip()
            left = self.bounds.left
            parts.append(f"from where it stands at {place}" if left else f"brought to {place} first")
        logged = f", with the {_ROLES[self.stage]} logged" if self.stage else ""
        return ", ".join(parts) + logged


@dataclass(frozen=True, eq=False)
class _Option:
    """A ``choice``, made as it is or with what leaves ``stage`` logged too: ``apart``, the expected
    separation of the first rival from each of the others (k,); ``shows``: whether it is made to show most
    of them."""

    choice: Choice
    stage: str | None
    apart: np.ndarray
    shows: bool = True

    def least(self, telling: np.ndarray) -> float:
        """The separation from the rival that it tells least, of those that count (k,)."""
        return float(np.min(self.apart[telling]))

    def then(self, other: _Option) -> _Option:
        """It with ``other`` behind it: what each tells by itself, put together."""
        return replace(self, choice=self.choice.then(other.choice), apart=np.hypot(self.apart, other.apart))


def _answered(
    rig: Rig, logs: Sequence[Experiment], explanations: Sequence[Explanation], question: _Question
) -> tuple[NextExperiment, Choice] | None:
    """The experiment that tells the first of the rivals from the others. First asked is what the rig has done
    before and the logs hold; steps where there were none, or a further signal, only where that does not
    do."""
    e, rivals = question.e, question.rivals
    entry, bounds = cuts(logs)[0], bounds_of(rig, logs)
    limits, rigs = limits_of(rig, logs, entry), candidate_rigs(explanations, e, rivals)
    tiers: list[list[_Option]] = []
    shown: list[Choice] = []
    allowed: list[tuple[Choice, list[CandidateRig]]] = []
    for one in dict.fromkeys((limits, limits.faster)):
        allowed = _allowed(menu(one), rigs, bounds)
        shown = [choice for choice, _ in _showing(allowed, e, rivals)]
        tiers.append(
            [_Option(choice, None, in_session(e, made), choice in shown) for choice, made in allowed]
        )
    if not _all_told(tiers):
        further = _with_a_further_signal(question, [choice for choice, _ in allowed], explanations)
        tiers.append([replace(o, shows=o.choice in shown) for o in further])
    if (best := _best(tiers)) is None:
        return None
    row = _in_a_row(best[1], tiers, lambda choice: _holds(choice, rigs, bounds))
    choice = replace(row.choice, sign=rig.sign(entry))
    asked = _Asked(choice, entry, row.stage, bounds, limits.rate)
    value = float(min(row.least(_telling(tiers)), _MOST))
    return _proposed(rig, e, rivals, value, asked), choice


def _with_a_further_signal(
    question: _Question, choices: Sequence[Choice], explanations: Sequence[Explanation]
) -> list[_Option]:
    """The experiments with what leaves a stage logged besides. Such a log is diagnosed alone, so it has to
    tell the first rival also from those that only the session rules out, and from nothing at all."""
    e, found = question.e, []
    rigs = candidate_rigs(explanations, e, question.anew)
    for choice in choices:
        made = [one.making(choice) for one in rigs]
        for stage in e.segment.stages[:-1]:
            apart = alone(e, made, stage)
            tied, others = np.split(apart, [len(question.rivals) - 1])
            found.append(_Option(choice, stage, np.minimum(tied, np.min(others))))
    return found


def _best(tiers: Sequence[Sequence[_Option]]) -> tuple[float, _Option] | None:
    """The most telling option a second of the first tier that is sure to tell, and what it tells; where none
    is, the most telling. A rival that none tells, as one that holds the other as a special case, does not
    count where others can be told: such are told by needing more parameters for the same."""
    options = _shown(tiers)
    if not options:
        return None
    telling = _telling(tiers)
    for tier in tiers:
        good = [o for o in tier if o.shows and o.least(telling) >= _SURE]
        if good:
            best = max(good, key=lambda o: o.least(telling) / np.sqrt(o.choice.seconds))
            return best.least(telling), best
    # a further signal is asked for where it tells
    plain = [o for o in options if o.stage is None or o.least(telling) >= _ENOUGH] or options
    best = max(plain, key=lambda o: o.least(telling))
    return best.least(telling), best


def _all_told(tiers: Sequence[Sequence[_Option]]) -> bool:
    """Whether every rival is told by some option: one that is not may be the likeliest."""
    return bool(np.all(_told(_shown(tiers), _SURE)))


def _shown(tiers: Sequence[Sequence[_Option]]) -> list[_Option]:
    """The options that may be chosen alone."""
    return [o for tier in tiers for o in tier if o.shows]


def _telling(tiers: Sequence[Sequence[_Option]]) -> np.ndarray:
    """Of each rival (k,) whether it counts: those that some option tells, or all where none is told."""
    told = _told(_shown(tiers), _ENOUGH)
    return told if np.any(told) else np.ones(len(told), bool)


def _in_a_row(first: _Option, tiers: Sequence[Sequence[_Option]], holds: Callable[[Choice], bool]) -> _Option:
    """``first`` with the most telling others behind it where it is not certain to tell: a rival may take up
    one experiment by another of its forms, but hardly all. It alone where that would not tell either."""
    alike = (o for tier in tiers for o in tier if o.stage == first.stage)
    left = [o for o in alike if o is not first and o.choice.limits == first.choice.limits]
    telling, row = _telling(tiers), first
    if first.least(telling) >= _CERTAIN:
        return first
    while left and row.choice.parts < _IN_A_ROW:
        longer = {id(o): row.then(o) for o in left}
        best = max(left, key=lambda o: longer[id(o)].least(telling))
        left.remove(best)
        if holds(longer[id(best)].choice):
            row = longer[id(best)]
    return row if row.least(telling) >= _ENOUGH else first


def _told(options: Sequence[_Option], enough: float) -> np.ndarray:
    """Of each rival (k,) whether any option tells it by ``enough``; False where there is none."""
    told: np.ndarray = np.any([o.apart >= enough for o in options], axis=0)
    return told


def _allowed(
    choices: Sequence[Choice], rigs: Sequence[CandidateRig], bounds: Bounds
) -> list[tuple[Choice, list[CandidateRig]]]:
    """Each experiment as large as all candidate rigs stay within the bounds, and what they make of it; those
    left out that do so at no size."""
    found = []
    for choice in choices:
        for share in _SHARES:
            smaller = replace(choice, share=share)
            made = [one.making(smaller) for one in rigs]
            if all(bounds.hold(one.signals) for one in made):
                found.append((smaller, made))
                break
    return found


def _holds(choice: Choice, rigs: Sequence[CandidateRig], bounds: Bounds) -> bool:
    """Whether all candidate rigs stay within the bounds."""
    return all(bounds.hold(one.making(choice).signals) for one in rigs)


def _showing(
    choices: Sequence[tuple[Choice, list[CandidateRig]]], e: Explanation, rivals: Sequence[Rival]
) -> list[tuple[Choice, list[CandidateRig]]]:
    """The experiments that together with those at hand are made to show most of the rivals."""
    needs = [library()[r.effect].needs for r in rivals]
    fed, response = e.segment.fed, e.nominal.problem.references.clocks["response"]
    hidden = []
    for choice, made in choices:
        entering = np.repeat(made[0].entering, choice.limits.coarse)
        done = excitation([*fed.parts(fed.x), entering], fed.run.h, response)
        hidden.append(sum(need(done) is not None for need in needs))
    return [c for c, count in zip(choices, hidden, strict=True) if count == min(hidden)]


def _proposed(
    rig: Rig, e: Explanation, rivals: Sequence[Rival], value: float, asked: _Asked
) -> NextExperiment:
    names, made = [r.effect for r in rivals], asked.choice.logged
    return NextExperiment(
        f"telling {names[0]} from {' and '.join(names[1:])}{_lacking(e, names)}",
        asked.said(rig),
        value,
        {
            "seconds": asked.choice.seconds,
            "at_most_s": asked.choice.limits.seconds * asked.choice.parts,
            "entry": asked.entry,
            "low": float(made.min()),
            "high": float(made.max()),
            "also_log": _ROLES.get(asked.stage or ""),
            "rivals": names,
            "file": NEXT,
        },
    )


def _lacking(e: Explanation, names: Sequence[str]) -> str:
    """What the segment's experiments lack to show any of the effects."""
    missing = dict.fromkeys(m for name in names if (m := e.nominal.problem.lacks(name)))
    return f" (so far, {'; '.join(missing)})" if missing else ""
