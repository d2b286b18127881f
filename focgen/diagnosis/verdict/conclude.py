"""The verdict: what the explanations of all segments amount to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from focgen.diagnosis.controller.check import ControllerCheck, Departure
from focgen.diagnosis.fitting.fit import Weighing, fit
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.rivals import Cause, Rival
from focgen.diagnosis.hypotheses.search import evidence as nats
from focgen.diagnosis.model import Candidate, Diagnosis, Estimate, Found, Gap, PlainFit
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.verdict import compose
from focgen.diagnosis.verdict.cautions import another_command, cautions, gauges, lesser, paced
from focgen.diagnosis.verdict.confidence import tied
from focgen.diagnosis.verdict.cross_validation import cross_validated_share
from focgen.diagnosis.verdict.evidence import Evidence
from focgen.diagnosis.verdict.floor import floor as noise_floor
from focgen.diagnosis.verdict.improvement import Improvement
from focgen.diagnosis.verdict.late import logged_late
from focgen.diagnosis.verdict.moments import another, changed_at_once, lasting_part
from focgen.diagnosis.verdict.moves import far_moves
from focgen.diagnosis.verdict.predicted_improvement import paths, promised
from focgen.diagnosis.verdict.sizes import estimates
from focgen.diagnosis.verdict.uneven import unevenly_paced
from focgen.diagnosis.verdict.unexplained import disturbed, is_rounded, is_unknown
from focgen.diagnosis.verdict.where import locate, stage_shares
from focgen.logs.experiment import Experiment
from focgen.logs.notes import notes_of
from focgen.rig.replay import goodness
from focgen.rig.rig import Rig


def conclude(
    rig: Rig,
    logs: Sequence[Experiment],
    rigs: compose.Rigs,
    explanations: Sequence[Explanation],
    controller: ControllerCheck | None = None,
    granted: bool = False,
) -> tuple[compose.Rigs, Diagnosis, Evidence]:
    """The rigs that the verdict stands for, the diagnosis without a next experiment, and what it rests on.
    ``granted``: the effects are there, however little they explain."""
    changed = {} if granted else _changed(explanations)
    if changed:
        explanations = [changed.get(e, e) for e in explanations]
        rigs = compose.compose(rig, explanations, logs)
    unknown = [e for e in explanations if is_unknown(e)]
    summary = _summary(rig, logs, rigs, explanations, [*unknown, *_no_closer(rig, logs, rigs, explanations)])
    if summary.in_vain and not granted and (vain := _in_vain(summary)):
        unknown += vain
        summary = _summary(rig, logs, rigs, explanations, unknown)
    if not granted and not unknown and explanations[-1].segment.pace and _unaccounted(summary):
        unknown += explanations[-1:]
    beside = summary.causes if unknown and not granted and summary.more_is_left else []
    if beside:
        unknown += dict.fromkeys(e for e, _ in beside)
        summary = _summary(rig, logs, rigs, explanations, unknown)
    at_odds = [] if granted else _at_odds(summary)
    if at_odds:
        unknown += at_odds
        summary = _summary(rig, logs, rigs, explanations, unknown)
    made, squares, floor, total = summary.made, summary.squares, summary.floor, summary.total
    found = _ordered([_found(e, c, summary, logs) for e, c in summary.causes])
    found += _departures(controller)
    word = _word(found, unknown, [e for e in explanations if e.kept_by(rig, summary.rigs.refitted)])
    if controller is not None and controller.large and not found:
        word = "unknown"
    shares = stage_shares(found, unknown, explanations)
    diagnosis = Diagnosis(
        verdict=word,
        where=locate(explanations, shares, found),
        causes=found,
        gap=_gap(rig, logs, made, squares, floor),
        shrink=total.value if total else None,
        shrink_interval=total.interval if total else None,
        refitted_rig="refitted.toml",
        augmented_rig="augmented.toml",
        next_experiment=None,
        unexplained=_description(unknown) | _departing(controller),
        notes=(
            *notes_of(logs),
            *far_moves(rig, summary.rigs.fitted if summary.causes else summary.rigs.refitted),
            *cautions(summary.causes, unknown, list(changed)),
            *lesser(beside),
            *paced(explanations),
            *gauges(at_odds),
            *another_command(controller),
        ),
        fits=_plain_fits(explanations),
    )
    return summary.rigs, diagnosis, Evidence(made, tuple(explanations))


@dataclass(frozen=True, eq=False)
class _Summary:
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
            and not any(is_rounded(e) or paths(e) for e, _ in self.causes)
        )

    @property
    def more_is_left(self) -> bool:
        """Whether effects close less of the gap than they leave above the noise. Then the gap comes from
        something else, which they may stand for."""
        refitted, explained = (float(np.mean(self.squares[name])) for name in ("refitted", "explained"))
        return bool(self.causes) and refitted - explained < explained - self.floor

    @property
    def stands_for_more(self) -> bool:
        """The same, but for steps of a rounding, which never fall where a model has them."""
        return self.more_is_left and not any(is_rounded(e) for e, _ in self.causes)


def _summary(
    rig: Rig,
    logs: Sequence[Experiment],
    rigs: compose.Rigs,
    explanations: Sequence[Explanation],
    left_out: Sequence[Explanation],
) -> _Summary:
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
    return _Summary(rigs, causes, made, squares, floor, total)


def _changed(explanations: Sequence[Explanation]) -> dict[Explanation, Explanation]:
    """The explanations of which a part became another at once instead, each with the part that lasts, where
    this explains its segment but for that."""
    parts = ((e, lasting_part(e)) for e in explanations)
    return {e: part for e, part in parts if part is not e and not is_unknown(part)}


def _unaccounted(summary: _Summary) -> bool:
    """Whether nothing was found, and yet the output is off by far more than noise. Where errors add up, no
    segment need show it: gusts in a path are gone from its own errors at their pace."""
    return not summary.causes and summary.floor < NUMBERS.vain * float(np.mean(summary.squares["explained"]))


def _in_vain(summary: _Summary) -> list[Explanation]:
    """Of the segments with effects those whose own gap they do not close on new experiments either: what one
    leaves unexplained takes nothing away from what is clear in another. Where errors add up, a fit does not
    see its gap whole, but forgets it at its pace: there the promise tells, which is of the path."""
    explained = dict.fromkeys(e for e, _ in summary.causes)
    return [e for e in explained if e.segment.pace or cross_validated_share(e) < NUMBERS.vain]


def _at_odds(summary: _Summary) -> list[Explanation]:
    """The segments with effects, where what was found leaves the output further off than no effect.

    Then a signal logged in between fits neither what is ahead of it nor what is behind, as of a gauge that is
    at fault: either segments make up for one another, or without any effect there is no gap at all. A path
    that one wanders is not foretold, so that only the latter tells then. Where errors add up, one may stand
    for another."""
    explained = list(dict.fromkeys(e for e, _ in summary.causes))
    if not explained or any(is_rounded(e) or e.segment.pace for e in explained):
        return []
    found, *others = (float(np.mean(summary.squares[k])) for k in ("explained", "as given", "refitted"))
    without = min(others)
    if len(explained) > 1 and not any(map(paths, explained)):
        return explained if found > without else []
    no_gap, above = summary.floor > NUMBERS.above**2 * without, without < NUMBERS.above**2 * found
    return explained if no_gap and above else []


def _no_closer(
    rig: Rig, logs: Sequence[Experiment], rigs: compose.Rigs, explanations: Sequence[Explanation]
) -> list[Explanation]:
    """The last segment, where its effects fit its measured input but bring the whole chain's output no
    closer: what they mend is that input. A rounding leaves more, by nature."""
    last = explanations[-1]
    if not last.causes or is_rounded(last):
        return []
    without = compose.compose(rig, _held(explanations, [last]), logs)
    both = (compose.simulated(r.fitted, r.placed, logs) for r in (rigs, without))
    found, bare = (compose.mean_square(logs, made) for made in both)
    return [last] if found > bare else []


def _held(explanations: Sequence[Explanation], left_out: Sequence[Explanation]) -> list[Explanation]:
    """The explanations, those that are left out without their effects and what was fitted beside them."""
    return [replace(e, best=e.nominal) if e in left_out else e for e in explanations]


def _plain_fits(explanations: Sequence[Explanation]) -> tuple[PlainFit, ...]:
    """Every family's error alone, the lowest first."""
    fits = [PlainFit(name, error) for e in explanations for name, error in e.errors.items()]
    return tuple(sorted(fits, key=lambda f: f.error))


def _departures(controller: ControllerCheck | None) -> tuple[Found, ...]:
    """The running controller's causes as entries of the diagnosis."""
    return tuple(_departed(tied) for tied in controller.causes) if controller else ()


def _departed(tied: Sequence[Departure]) -> Found:
    """One of them: those that may be it, as sure as they are many."""
    share = tied[0].share
    interval = (max(share - 0.1, 0.0), min(share + 0.1, 1.0))
    sure = [NUMBERS.held * 2.0**-k / sum(2.0**-i for i in range(len(tied))) for k in range(len(tied))]
    return Found("controller", tuple(_suspected(d, p) for d, p in zip(tied, sure)), share, interval)


def _departing(controller: ControllerCheck | None) -> dict[str, object]:
    """The same as an entry of what is unexplained, where it is much."""
    if controller is None or not controller.large:
        return {}
    return {"reference to command": {"depends_on": ["nothing"], "departure": controller.departure}}


def _suspected(d: Departure, confidence: float) -> Candidate:
    parameters = {d.parameter: Estimate(d.value, (d.value, d.value), d.unit)}
    return Candidate(d.effect, confidence, "running", parameters, 0.0)


def _word(found: Sequence[Found], unknown: Sequence[Explanation], explanations: Sequence[Explanation]) -> str:
    if found:
        return "named" if all(len(f.candidates) == 1 for f in found) else "set"
    if unknown:
        return "unknown"
    return "parameters" if any(_moved(e) for e in explanations) else "none"


def _moved(e: Explanation) -> bool:
    """Whether refitting the nominal parameters closed a gap beyond the noise."""
    problem, weighing = e.nominal.problem, Weighing(e.ar)
    own = len(problem.nominal_start)
    if not own:
        return False
    held = replace(problem, nominals=replace(problem.nominals, held=True))
    given = fit(held, np.r_[e.given[:own], e.nominal.vector[own:]], weighing, 6)
    visible = np.mean(given.weighed**2) > 1.01 * np.mean(e.nominal.weighed**2)
    return bool(
        visible and nats(e.nominal, given) - 0.5 * own * np.log(len(given.innovations)) > NUMBERS.nats
    )


def _found(
    e: Explanation,
    cause: Cause,
    summary: _Summary,
    logs: Sequence[Experiment],
) -> Found:
    rigs = summary.rigs
    kept, sure = tied(cause.rivals)
    sure = sure * NUMBERS.unlikely if e.freed else sure  # numbers far off explain the same
    sure = sure * NUMBERS.unlikely if summary.stands_for_more else sure
    sure = sure * _lasting(e, cause) * _beside(e, cause)
    total = summary.total or Improvement(0.0, (0.0, 0.0))
    lost = _share_lost(cause, rigs, logs, summary.squares, summary.floor, total)
    candidates = tuple(_candidate(r, float(p), rigs.fitted) for r, p in zip(kept, sure))
    return Found(cause.rivals[0].stage, candidates, lost.value, lost.interval)


def _lasting(e: Explanation, cause: Cause) -> float:
    """How likely a cause was there all along, and neither did the rig become another at once instead, nor was
    the command logged late, nor a pace uneven."""
    found = [f for f in (changed_at_once(e), logged_late(e), unevenly_paced(e)) if f is not None]
    first = cause.rivals[0].effect
    return float(np.prod([1.0 - f.sure for f in found if first in f.instead]))


def _beside(e: Explanation, cause: Cause) -> float:
    """How sure a cause can be beside another one of its segment that closes more: what looks like it may be
    what the other one's form lacks of this rig. A wander follows whatever is left, so it is never the larger.
    """

    def size(c: Cause) -> float:
        return 0.0 if _wanders(c) else c.share

    return 1.0 if size(cause) >= max(size(c) for c in e.causes) else NUMBERS.unlikely


def _wanders(cause: Cause) -> bool:
    """Whether a cause, at its likeliest, is followed through the session instead of foretold."""
    best = cause.rivals[0]
    return any(c.form.wanders and c.effect == best.effect for c in best.fit.problem.candidates)


def _share_lost(
    cause: Cause,
    rigs: compose.Rigs,
    logs: Sequence[Experiment],
    squares: dict[str, np.ndarray],
    floor: float,
    total: Improvement,
) -> Improvement:
    """The part of the shrink that is lost without the cause, none for a wander; its interval is as wide as
    the total's."""
    best = cause.rivals[0]
    others = tuple(p for p in rigs.placed if (p.effect, p.stage) != (best.effect, best.stage))
    if not others:
        return total
    without = compose.squares(logs, compose.simulated(rigs.fitted, others, logs))
    could = max(float(np.mean(squares["refitted"])) - floor, 1e-300)
    lost = np.mean(np.minimum(without, squares["refitted"])) - np.mean(squares["explained"])
    value = 0.0 if _wanders(cause) else float(np.clip(lost / could, 0, 1))
    wide = (total.interval[1] - total.interval[0]) / 2
    return Improvement(value, (max(value - wide, -1.0), min(value + wide, 1.0)))


def _candidate(rival: Rival, confidence: float, rig: Rig) -> Candidate:
    candidate = rival.fit.problem.candidates
    places = [i for i, c in enumerate(candidate) if c.effect == rival.effect]
    parameters: dict[str, Estimate] = {}
    for i in places:
        prefix = "" if i == places[0] else f"{candidate[i].form.name}."
        parameters |= {prefix + k: v for k, v in estimates(rival.fit, i, rig).items()}
    return Candidate(
        rival.effect, confidence, candidate[places[0]].form.name, parameters, float(rival.separation)
    )


def _ordered(found: Sequence[Found]) -> tuple[Found, ...]:
    return tuple(sorted(found, key=lambda f: -f.shrink))


def _gap(
    rig: Rig,
    logs: Sequence[Experiment],
    made: dict[str, list[dict[str, np.ndarray]]],
    squares: dict[str, np.ndarray],
    floor: float,
) -> Gap:
    rms = {name: float(np.sqrt(np.mean(v))) for name, v in squares.items()}
    gof = {
        name: float(np.mean([goodness(log["output"], m["output"]) for log, m in zip(logs, parts)]))
        for name, parts in made.items()
    }
    spread = [np.std(log["output"]) for log in logs]
    gof["possible"] = float(np.mean([1 - np.sqrt(floor) / s for s in spread if s > 0] or [0.0]))
    unit = rig.signals.unit_of("output") or rig.signals.output
    return Gap(rms["as given"], rms["refitted"], rms["explained"], float(np.sqrt(floor)), unit, gof)


def _description(unknown: Sequence[Explanation]) -> dict[str, object]:
    """What the residual that no effect explains depends on."""
    found: dict[str, object] = {}
    for e in unknown:
        parts, noise = {k: v for k, v in e.nominal_predictability.depends.items() if v > 0.02}, disturbed(e)
        said: dict[str, object] = {
            "depends_on": sorted(parts, key=lambda k: -parts[k]) or ["nothing"],
            "share": e.nominal_predictability.share,
            "bursts": noise.bursts,
            "low_frequency": noise.low_frequency,
            "tonal": noise.tonal,
            "pushed": noise.pushed,
        }
        if changed := another(e):
            said["moments"] = [asdict(m) for m in changed.moments]
        found[f"{e.segment.entry} to {e.segment.exit}"] = said
    return found
