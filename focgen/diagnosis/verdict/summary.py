"""Which explanations stand, and what they amount to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from focgen.diagnosis.hypotheses.converter import is_rounded
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.rivals import Cause
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.verdict import compose
from focgen.diagnosis.verdict.clocks import clocks_apart
from focgen.diagnosis.verdict.cross_validation import cross_validated_share
from focgen.diagnosis.verdict.crossed import crossed
from focgen.diagnosis.verdict.floor import floor as noise_floor
from focgen.diagnosis.verdict.improvement import Improvement
from focgen.diagnosis.verdict.instead import Instead, sound_part
from focgen.diagnosis.verdict.late import logged_late
from focgen.diagnosis.verdict.moments import changed_at_once
from focgen.diagnosis.verdict.predicted_improvement import drifting, paths, promised
from focgen.diagnosis.verdict.taken_up import taken_up
from focgen.diagnosis.verdict.two_instead import two_instead
from focgen.diagnosis.verdict.uneven import unevenly_paced
from focgen.diagnosis.verdict.unexplained import is_unknown
from focgen.diagnosis.verdict.unsteady import unsteady
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Rig


@dataclass(frozen=True, eq=False)
class Summary:
    """What explanations amount to: ``made`` the simulated logs by rig, ``squares`` their mean square errors,
    ``floor`` the noise's, ``total`` the promise."""

    rigs: compose.Rigs
    causes: list[tuple[Explanation, Cause]]
    made: dict[str, list[dict[str, np.ndarray]]]
    squares: dict[str, np.ndarray]
    floor: float
    total: Improvement | None

    @property
    def in_vain(self) -> bool:
        """Whether effects that claim a gap well above the noise promise next to nothing: they mend what
        something else does. Steps of a rounding do not come twice, whoever knows of them."""
        return (
            self.total is not None
            and self.total.value < NUMBERS.vain
            and self.floor < NUMBERS.above**2 * float(np.mean(self.squares["refitted"]))
            and not any(is_rounded(e.causes) or paths(e) for e, _ in self.causes)
        )

    @property
    def more_is_left(self) -> bool:
        """Whether effects close less of the gap than they leave above the noise. Then the gap comes from
        something else, which they may stand for."""
        refitted, explained = (float(np.mean(self.squares[name])) for name in ("refitted", "explained"))
        return bool(self.causes) and refitted - explained < explained - self.floor

    @property
    def loudness(self) -> float:
        """The root mean square that the effects leave, over the noise's."""
        return float(np.sqrt(np.mean(self.squares["explained"]) / max(self.floor, 1e-300)))

    @property
    def stands_for_more(self) -> bool:
        """The same, but for steps of a rounding, which never fall where a model has them."""
        return self.more_is_left and not any(is_rounded(e.causes) for e, _ in self.causes)

    @property
    def closed(self) -> float:
        """The share of what can be explained that the effects close in these logs."""
        refitted, explained = (float(np.mean(self.squares[name])) for name in ("refitted", "explained"))
        return (refitted - explained) / max(refitted - self.floor, 1e-300)

    @property
    def foretold(self) -> float:
        """The same of parts of the session, each by fits to the others."""
        return self.closed - self.total.lost if self.total else self.closed

    @property
    def follows_these_logs(self) -> bool:
        """Whether much of what the effects close is lost on parts of the session that their numbers were not
        fitted to: then these may follow what is missing instead of being it. Not so of what goes on as no log
        can show, of steps of a rounding, nor in a gap that tells no more than noise: fits lose some of it.
        Where errors add up, what one part loses goes on through the others."""
        loud = self.floor < NUMBERS.above**2 * float(np.mean(self.squares["refitted"]))
        less = 0.0 < self.closed and self.foretold < NUMBERS.unlikely * self.closed
        if not (self.causes and loud and less):
            return False
        return not any(e.segment.pace or is_rounded(e.causes) or drifting(e) for e, _ in self.causes)


@dataclass(frozen=True, eq=False)
class SortedOut:
    """The ``summary`` of what stands, and the explanations that are ``unknown``: among them those of effects
    ``beside`` a larger part of the gap that nothing explains, and those ``at_odds`` with one another."""

    summary: Summary
    unknown: list[Explanation]
    beside: list[tuple[Explanation, Cause]]
    at_odds: list[Explanation]


def sorted_out(
    rig: Rig,
    logs: Sequence[Experiment],
    rigs: compose.Rigs,
    explanations: Sequence[Explanation],
    granted: bool,
) -> SortedOut:
    """Which explanations stand. Every one that is left out changes what the others amount to."""
    out = [] if granted else crossed(rig, logs, explanations)
    apart = _no_closer(rig, logs, rigs, explanations)
    # of a part that is no closer, the rest was something that no effect is
    unknown = [e for e in explanations if e in out or is_unknown(e) or (e in apart and e.whole is not None)]
    apart = [e for e in apart if e not in unknown]

    def summary_without(unknown: Sequence[Explanation]) -> Summary:
        return _summary(rig, logs, rigs, explanations, [*unknown, *apart])

    summary = summary_without(unknown)
    if granted:
        return SortedOut(summary, unknown, [], [])
    if summary.in_vain and (vain := _in_vain(summary)):
        unknown += vain
        summary = summary_without(unknown)
    bare = apart or [e for e in explanations if e.segment.pace and not summary.causes]
    if not unknown and bare and _unaccounted(summary):
        unknown += bare
    # what one segment's effects bring no closer takes nothing away from what is clear in another
    beside = summary.causes if unknown and unknown != apart and summary.more_is_left else []
    if beside:
        unknown += dict.fromkeys(e for e, _ in beside)
        summary = summary_without(unknown)
    at_odds = _at_odds(summary)
    if at_odds:
        unknown += at_odds
        summary = summary_without(unknown)
    return SortedOut(summary, unknown, beside, at_odds)


def _summary(
    rig: Rig,
    logs: Sequence[Experiment],
    rigs: compose.Rigs,
    explanations: Sequence[Explanation],
    left_out: Sequence[Explanation],
) -> Summary:
    held = _held(explanations, left_out)
    rigs = compose.compose(rig, held, logs) if left_out else rigs
    causes = [(e, c) for e in explanations for c in e.causes if e not in left_out]
    made = {
        "as given": compose.simulated(rig, (), logs),
        "refitted": compose.simulated(rigs.refitted, (), logs),
        "explained": compose.simulated(rigs.fitted, rigs.placed, logs),
    }
    squares = {name: compose.squares(logs, m) for name, m in made.items()}
    floor = noise_floor(explanations[-1], float(np.mean(squares["explained"])))
    total = promised(rig, logs, held, squares, floor) if causes else None
    return Summary(rigs, causes, made, squares, floor, total)


def doubts(e: Explanation) -> tuple[Instead | None, ...]:
    """What no effect is, or two others are, and may be there instead of what was found."""
    elsewise = changed_at_once(e), logged_late(e), clocks_apart(e), unevenly_paced(e), taken_up(e)
    return *elsewise, *unsteady(e), two_instead(e)


def sound_parts(explanations: Sequence[Explanation]) -> dict[Explanation, Explanation]:
    """The explanations of which a part is likelier something that no effect is, each with its other part,
    where this explains its segment but for that."""
    found = {}
    for e in explanations:
        if len(e.best.problem.families) > 1:
            part = sound_part(e, doubts(e))
            if part is not None and not is_unknown(part):
                found[e] = part
    return found


def _unaccounted(summary: Summary) -> bool:
    """Whether the output is off by far more than noise, whatever was found. Where errors add up, no segment
    need show it: gusts in a path are gone from its own errors at their pace. And what a segment's own effects
    bring no closer is there nevertheless, whatever those of another segment do."""
    return summary.floor < NUMBERS.vain * float(np.mean(summary.squares["explained"]))


def _in_vain(summary: Summary) -> list[Explanation]:
    """Of the segments with effects those whose own gap they do not close on new experiments either: what one
    leaves unexplained takes nothing away from what is clear in another. Where errors add up, a fit does not
    see its gap whole, but forgets it at its pace: there the promise tells, which is of the path."""
    explained = dict.fromkeys(e for e, _ in summary.causes)
    return [e for e in explained if e.segment.pace or cross_validated_share(e) < NUMBERS.vain]


def _at_odds(summary: Summary) -> list[Explanation]:
    """The segments with effects, where what was found leaves the output further off than no effect.

    Then a signal logged in between fits neither what is ahead of it nor what is behind, as of a gauge that is
    at fault: either segments make up for one another, or without any effect there is no gap at all. A path
    that one wanders is not foretold, so that only the latter tells then. Where errors add up, one may stand
    for another. And what comes in with a stage that is explained badly tells nothing of the last one."""
    explained = list(dict.fromkeys(e for e, _ in summary.causes))
    if not explained or any(is_rounded(e.causes) or e.segment.pace for e in explained):
        return []
    found, *others = (float(np.mean(summary.squares[k])) for k in ("explained", "as given", "refitted"))
    without = min(others)
    if len(explained) > 1 and not any(map(paths, explained)):
        return explained if found > without and not _comes_in(explained[-1], without) else []
    no_gap, above = summary.floor > NUMBERS.above**2 * without, without < NUMBERS.above**2 * found
    return explained if no_gap and above else []


def _no_closer(
    rig: Rig, logs: Sequence[Experiment], rigs: compose.Rigs, explanations: Sequence[Explanation]
) -> list[Explanation]:
    """The last segment, where its effects fit its measured input but bring the whole chain's output no
    closer: what they mend is that input. A rounding leaves more, by nature, and so does a stage ahead that is
    explained badly."""
    last = explanations[-1]
    if not last.causes or is_rounded(last.causes):
        return []
    without = compose.compose(rig, _held(explanations, [last]), logs)
    both = (compose.simulated(r.fitted, r.placed, logs) for r in (rigs, without))
    found, bare = (compose.mean_square(logs, made) for made in both)
    return [last] if found > bare and not _comes_in(last, bare) else []


def _comes_in(e: Explanation, square: float) -> bool:
    """Whether an error of the output, of this mean ``square``, comes in with what the last segment's input is
    simulated as: from that input as it was read, its effects leave next to nothing of it. A gauge in between
    that is at fault leaves no such error without them."""
    if e.segment.exit != "output" or e.segment.pace:
        return False
    return float(np.mean(e.best.weighed**2)) * e.segment.level_out**2 < NUMBERS.vain * square


def _held(explanations: Sequence[Explanation], left_out: Sequence[Explanation]) -> list[Explanation]:
    """The explanations, those that are left out without their effects and what was fitted beside them."""
    return [replace(e, best=e.nominal) if e in left_out else e for e in explanations]
