"""What is said beside a verdict: what may be otherwise, what cannot be told, and what to look at."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from focgen.diagnosis.controller.check import ControllerCheck
from focgen.diagnosis.hypotheses.converter import is_rounded
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.level_pace import paced_stage, slower_by
from focgen.diagnosis.hypotheses.rivals import Cause
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.verdict.confidence import nominal_instead
from focgen.diagnosis.verdict.moving import begun_moving
from focgen.diagnosis.verdict.predicted_improvement import paths
from focgen.diagnosis.verdict.restless import louder
from focgen.diagnosis.verdict.sizes import at_their_ends
from focgen.diagnosis.verdict.summary import Summary, doubts
from focgen.diagnosis.verdict.unexplained import acts_besides, disturbed, is_driven
from focgen.logs.notes import listed
from focgen.rig.effects import library
from focgen.rig.rig import Rig

_NEAR = 0.95  # of the error without any effect: with more a family is not near


def of_file(rig: Rig) -> tuple[str, ...]:
    """A note where the rig's file has effects."""
    names = [f"{p.effect} of the {p.stage}" for p in rig.known]
    said = f"taken as the rig's file has it, and what else is there is looked for: {listed(names)}"
    return (said,) if names else ()


def cautions(
    causes: Sequence[tuple[Explanation, Cause]],
    unknown: Sequence[Explanation],
    doubted: Sequence[Explanation] = (),
    off: Sequence[tuple[Explanation, Cause]] = (),
) -> Iterator[str]:
    """What cannot be predicted, what may be there instead, and what is unexplained beside what is named.
    ``doubted``: of what is likelier something that no effect is, instead of a part of what was found;
    ``off``: what is likelier the nominal chain."""
    for effect in dict.fromkeys(candidate.effect for e, _ in causes for candidate in paths(e)):
        yield (
            f"the {effect} wanders: followed through this session, its next turn cannot be "
            "predicted, and nothing of it is promised"
        )
    named = [e.whole or e for e, _ in causes]
    for e in dict.fromkeys([*unknown, *doubted, *named]):
        yield from _instead(e)
    yield from _nominal([*causes, *off])
    for e in unknown if causes else ():
        yield f"{_within(e)}: no effect explains what is left there{_nearest(e)}"


def lesser(causes: Sequence[tuple[Explanation, Cause]]) -> Iterator[str]:
    """What was found beside a larger part of the gap that nothing explains."""
    for e, cause in causes:
        first = cause.rivals[0].effect
        yield f"{_within(e)}: {first} may be there as well, but more of the gap is what no effect explains"


def the_rest(summary: Summary) -> Iterator[str]:
    """Where what was found closes less of the gap than it leaves above the noise, or leaves what else drives
    the rig."""
    if summary.stands_for_more:
        yield (
            "what was found closes less than half of the gap, and the error stays "
            f"{summary.loudness:.1f} times the noise: something else is missing, which it may stand for"
        )
    if summary.follows_these_logs:
        yield (
            f"what was found closes {summary.closed:.0%} of the gap in these logs, but fitted to parts of "
            f"them {_little(summary.foretold)} in the others: it may follow what is missing instead of being "
            "it. Replay augmented.toml on a new log"
        )
    for e in {id(e): e for e, _ in summary.causes}.values():
        if is_driven(e):
            yield (
                f"{_within(e)}: what is left has passed through the rig, {disturbed(e).above:.1f} times what "
                "is quick in it, and no input predicts it: something else acts there, which it may stand for"
            )
        elif acts_besides(e):
            yield (
                f"{_within(e)}: what is left is {np.sqrt(louder(e)):.1f} times as large where the rig moves "
                "as where it rests, which noise is not: something else acts there, which it may stand for"
            )
        elif (further := _further(e)) is not None:
            follows = f"{_within(e)}: {e.amiss:.0%} of what is left follows the {e.segment.entry}"
            yield (
                f"{follows}. With {further} as well {e.beside[further]:.2g} of the error would stay: "
                "it may be there, too, or what was found does not go quite as the library has it"
            )


def _further(e: Explanation) -> str | None:
    """The family that would take most of what effects leave, where inputs predict much of that and it takes
    as much as what is no wonder of a form."""
    asked = {n: error for n, error in e.beside.items() if not library()[n].rounds}
    if not asked or e.amiss < NUMBERS.much:
        return None
    name = min(asked, key=lambda n: asked[n])
    return name if asked[name] ** 2 < NUMBERS.unlikely else None


def _little(share: float) -> str:
    return f"{share:.0%}" if share > 0.0 else "nothing"


def underway(causes: Sequence[tuple[Explanation, Cause]]) -> Iterator[str]:
    """Where a log of what integrates begins while that moves."""
    for e in {id(e): e for e, _ in causes}.values():
        if names := begun_moving(e):
            verb = "begins" if len(names) == 1 else "begin"
            yield (
                f"{_within(e)}: {listed(names)} {verb} while the rig moves. How fast is not known, and an "
                "effect may stand for it: let the log of what integrates begin at rest"
            )


def ended(causes: Sequence[tuple[Explanation, Cause]]) -> Iterator[str]:
    """Where a number of what was found is as far as it is looked for."""
    for e, cause in causes:
        effect = cause.rivals[0].effect
        if numbers := at_their_ends(cause.rivals[0]):
            yield (
                f"{_within(e)}: the {effect}'s {' and '.join(numbers)} would go on beyond where numbers are "
                "looked for: something else may act, which it stands for"
            )


def _within(e: Explanation) -> str:
    return f"{e.segment.entry} to {e.segment.exit}"


def _instead(e: Explanation) -> Iterator[str]:
    """What no effect is and may be there instead: of several things instead of one effect the likeliest."""
    told = set[str]()
    for other in sorted(filter(None, doubts(e)), key=lambda o: -o.odds):
        if other.sure > 1.0 - NUMBERS.held and not (told and other.instead <= told):
            told |= other.instead or {""}
            yield f"{_within(e)}: {other.said}"


def zeros_off(rig: Rig, refitted: Rig, explanations: Iterable[Explanation]) -> Iterator[str]:
    """Where the zero of a signal is off against the one ahead of it, and whether it is in ``refitted``."""
    for e in explanations:
        if zero := e.zero:
            entry, exit = e.segment.entry, e.segment.exit
            by = f"{abs(zero):.3g} {rig.signals.unit_of(exit) or ''}".rstrip()
            zero *= rig.sign(exit)
            by += " more" if zero > 0.0 else " less"
            mended = f"; if it is this gauge's, an offset of {-zero:.3g} in [signals] mends it"
            if exit == "output":
                kept = refitted.zero != rig.zero
                mended = ", and refitted.toml has it in the sensor's offset" if kept else ""
            yield (
                f"{_within(e)}: the {exit} reads {by} than the {entry} tells, "
                f"at every level; the zero of one of them is off{mended}"
            )


def paced(explanations: Iterable[Explanation]) -> Iterator[str]:
    """Where a time that depends on the level, within its uncertainty, explains what was not called a gap."""
    for e in explanations:
        problem = e.best.problem
        rig, stage = problem.nominals.rig, paced_stage(problem.nominals.rig, problem.segment)
        if problem.segment.paced and stage is not None:
            by = 100.0 * slower_by(rig, stage, float(problem.begun(e.best.vector)[-1]))
            yield (
                f"{_within(e)}: the {stage} seems to be {abs(by):.2g} % {'slower' if by > 0 else 'faster'} "
                "at its highest level; that is within what its time may be off, and in no rig that is written"
            )


def rounded(explanations: Iterable[Explanation]) -> Iterator[str]:
    """Where readings move in steps that are noise, or noise beside what was found."""
    for e in explanations:
        if e.converter is None or is_rounded(e.causes):
            continue
        if e.converter.is_noise(e.nominal, alone=not e.causes):
            step = e.converter.step * e.segment.level_out
            noise = "noise beside what was found" if e.causes else "part of the noise"
            yield f"{_within(e)}: the readings move in steps of {step:.3g}, which are {noise}"


def _nominal(causes: Sequence[tuple[Explanation, Cause]]) -> Iterator[str]:
    """Where the nominal chain may be off by itself instead of an effect, and how to tell."""
    for e, cause in causes:
        first = cause.rivals[0]
        if (instead := nominal_instead(first)) > 1.0 - NUMBERS.held:
            lacked = "its form lacks about as much, as its [uncertainty] says; "
            why = f"{lacked if first.of_form else ''}to tell, identify the rig from "
            yield (
                f"{_within(e)}: the nominal rig may be off by itself ({instead:.0%}) by what the "
                f"{first.effect} changes, {first.change:.2g} of the noise; {why}logs of it as it should be"
            )


def _nearest(e: Explanation) -> str:
    """The family that would close most of a segment's gap, where one closes any."""
    if min(e.errors.values(), default=1.0) > _NEAR:
        return ""
    name = min(e.errors, key=lambda k: e.errors[k])
    return f"; nearest is {name}, with which its error is {e.errors[name]:.2g} of what it is without"


def gauges(at_odds: Sequence[Explanation]) -> Iterator[str]:
    """What to look at where a signal in between fits neither side."""
    between = dict.fromkeys(r for e in at_odds for r in (e.segment.entry, e.segment.exit))
    gauges = [role for role in between if role not in ("command", "output")]
    if gauges:
        yield (
            f"with the effects that {' and '.join(gauges)} as logged would ask for, the output is further "
            "off than without any: check that gauge, its range and its column"
        )


def another_command(controller: ControllerCheck | None) -> Iterator[str]:
    """What to look at where the command is not the file's, and nothing known makes it so."""
    if controller is not None and controller.unexplained:
        by = f"{controller.departure:.3g} (root mean square)"
        yield (
            f"the command departs from the controller's file by {by}, which no memory, arithmetic or limit "
            "explains; check that this file and these gains ran, and that no column is late"
        )
