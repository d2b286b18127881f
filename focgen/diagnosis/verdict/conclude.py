"""The verdict: what the explanations of all segments amount to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace

import numpy as np

from focgen.diagnosis.controller.check import ControllerCheck, Departure
from focgen.diagnosis.fitting.fit import Weighing, fit
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.rivals import Cause, Rival
from focgen.diagnosis.hypotheses.search import evidence as nats
from focgen.diagnosis.model import Candidate, Diagnosis, Estimate, Found, Gap, PlainFit
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.verdict import compose
from focgen.diagnosis.verdict.cautions import (
    another_command,
    cautions,
    ended,
    gauges,
    lesser,
    of_file,
    paced,
    rounded,
    the_rest,
    underway,
    zeros_off,
)
from focgen.diagnosis.verdict.confidence import tied
from focgen.diagnosis.verdict.evidence import Evidence
from focgen.diagnosis.verdict.improvement import Improvement
from focgen.diagnosis.verdict.late import ahead_told
from focgen.diagnosis.verdict.moments import another
from focgen.diagnosis.verdict.moves import at_the_end, far_moves
from focgen.diagnosis.verdict.moving import begun_moving
from focgen.diagnosis.verdict.nominal import likelier_nominal, nominal_alone, unnamed
from focgen.diagnosis.verdict.on_the_bench import measured
from focgen.diagnosis.verdict.sizes import at_their_ends, estimates
from focgen.diagnosis.verdict.summary import Summary, doubts, sorted_out, sound_parts
from focgen.diagnosis.verdict.unexplained import acts_besides, disturbed
from focgen.diagnosis.verdict.unsteady import is_unsteady
from focgen.diagnosis.verdict.where import locate, stage_shares
from focgen.logs.experiment import Experiment
from focgen.logs.notes import notes_of
from focgen.rig.effects import library
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
    doubted = {} if granted else sound_parts(explanations)
    explanations = [doubted.get(e, e) for e in explanations]
    off = [] if granted else likelier_nominal(explanations)
    explanations = [unnamed(e, [c for of, c in off if of is e]) for e in explanations]
    if doubted or off:
        rigs = compose.compose(rig, explanations, logs)
    stands = sorted_out(rig, logs, rigs, explanations, granted)
    summary, unknown = stands.summary, stands.unknown
    made, squares, floor, total = summary.made, summary.squares, summary.floor, summary.total
    far = far_moves(rig, summary.rigs.fitted if summary.causes else summary.rigs.refitted)
    trust = NUMBERS.smaller if far and not granted else 1.0
    strained = any(e.strained for e, _ in summary.causes)
    found = _ordered([_found(e, c, summary, logs, trust) for e, c in summary.causes])
    found += _departures(controller)
    refitted = [e for e in explanations if e.zero or e.kept_by(rig, summary.rigs.refitted)]
    word = _word(found, unknown, refitted)
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
            *of_file(rig),
            *notes_of(logs),
            *ahead_told(explanations[0], rig),
            *far,
            *(at_the_end(rig, summary.rigs.fitted) if strained and not far else ()),
            *cautions(summary.causes, unknown, list(doubted), [*off, *nominal_alone(explanations, off)]),
            *lesser(stands.beside),
            *the_rest(summary),
            *underway(summary.causes),
            *ended(summary.causes),
            *zeros_off(rig, summary.rigs.refitted, explanations),
            *paced(explanations),
            *rounded(explanations),
            *gauges(stands.at_odds),
            *another_command(controller),
        ),
        fits=_plain_fits(explanations),
    )
    return summary.rigs, diagnosis, Evidence(made, tuple(explanations))


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
    return Candidate(d.effect, "controller", confidence, "running", parameters, 0.0)


def _word(found: Sequence[Found], unknown: Sequence[Explanation], explanations: Sequence[Explanation]) -> str:
    if found:
        return "named" if all(len(f.candidates) == 1 for f in found) else "set"
    if unknown:
        return "unknown"
    return "parameters" if any(_moved(e) for e in explanations) else "none"


def _moved(e: Explanation) -> bool:
    """Whether refitting the nominal parameters, or the zero of a reading, closed a gap beyond the noise."""
    if e.zero:
        return True
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
    summary: Summary,
    logs: Sequence[Experiment],
    trust: float,
) -> Found:
    """A cause as an entry of the diagnosis, no surer than the file's own numbers, and its own, can be
    trusted."""
    rigs = summary.rigs
    kept, sure = tied(cause.rivals)
    sure = sure * NUMBERS.unlikely if e.strained else sure  # numbers far off explain the same
    sure = sure * NUMBERS.unlikely if summary.stands_for_more or something_unknown_acts(e) else sure
    sure = sure * NUMBERS.smaller if summary.follows_these_logs else sure
    sure = sure * NUMBERS.unlikely if begun_moving(e) else sure
    trust = min(trust, NUMBERS.smaller) if at_their_ends(cause.rivals[0]) else trust
    sure = sure * _lasting(e, cause) * min(_beside(e, cause), trust)
    total = summary.total or Improvement(0.0, (0.0, 0.0))
    lost = _share_lost(cause, rigs, logs, summary.squares, summary.floor, total)
    candidates = tuple(_candidate(r, float(p), rigs.fitted) for r, p in zip(kept, sure))
    return Found(cause.rivals[0].stage, candidates, lost.value, lost.interval)


def something_unknown_acts(e: Explanation) -> bool:
    """Whether something acts in the segment that nobody has a form of: it pushes the rig, or it is likelier
    than a part of what was found. The other part may stand for it, too."""
    return acts_besides(e) or (e.whole is not None and is_unsteady(e.whole))


def _lasting(e: Explanation, cause: Cause) -> float:
    """How likely a cause was there all along, and neither did the rig become another at once instead, nor was
    the command logged late, nor columns on clocks of their own, nor a pace uneven."""
    found = [f for f in doubts(e.whole or e) if f is not None]
    first = cause.rivals[0].effect
    return float(np.prod([1.0 - f.sure for f in found if first in f.instead]))


def _beside(e: Explanation, cause: Cause) -> float:
    """How sure a cause can be beside another one of its segment that closes more: what looks like it may be
    what the other one's form lacks of this rig. A wander follows whatever is left, so it is never the larger.
    Steps are seen in the readings.
    """

    def size(c: Cause) -> float:
        return 0.0 if _wanders(c) else c.share

    seen = library()[cause.rivals[0].effect].rounds
    return 1.0 if seen or size(cause) >= max(size(c) for c in e.causes) else NUMBERS.smaller


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
    likeliest = candidate[places[0]]
    separation = float(rival.separation)
    sizes = measured(rival.fit, rival.effect, parameters, rig)
    return Candidate(
        rival.effect, likeliest.stage, confidence, likeliest.form.name, parameters, separation, sizes
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
