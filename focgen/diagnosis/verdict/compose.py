"""The segments' findings put together into rigs: the refitted one, the augmented one, and their sessions
simulated."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from focgen.diagnosis.fitting.fit import Fit
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.logs.experiment import Experiment
from focgen.rig.effects import library
from focgen.rig.engine import Chain, between_of
from focgen.rig.initial import in_windows
from focgen.rig.placed import Placed
from focgen.rig.recalled import recalled, with_recalled
from focgen.rig.replay import effect_tables, simulate_session
from focgen.rig.rig import Rig
from focgen.rig.session import entering, entry_of, run_of

_SHOWN = 1e-3  # of the output's level: less of a zero shows in no reading


@dataclass(frozen=True, eq=False)
class Rigs:
    """``refitted``: nominal parameters only; ``fitted`` with ``placed``: nominal parameters together with the
    effects."""

    refitted: Rig
    fitted: Rig
    placed: tuple[Placed, ...]

    def refitted_after(self, logs: Sequence[Experiment]) -> Rig:
        """The refitted rig as a file has it, with what of the effects it was given outlives this session."""
        return _after(self.refitted, (), logs)

    def augmented(self, logs: Sequence[Experiment], promise: float | None = None) -> Rig:
        """The rig that carries its effects, what outlives this session, the outputs that they were learned
        at, and the share that they ``promise`` to explain."""
        told: dict[str, Any] = {
            "learned": [float(f([f(log["output"]) for log in logs])) for f in (np.min, np.max)]
        }
        told |= {"promise": float(promise)} if promise is not None else {}
        return _after(self.fitted, self.placed, logs, told)


def _after(
    rig: Rig, placed: Sequence[Placed], logs: Sequence[Experiment], told: Mapping[str, Any] | None = None
) -> Rig:
    """A rig after a session, its effects as a file has them: those that it was given, with what they were
    ``told`` then, ahead of those ``placed``."""
    left: list[dict[str, float]] = []
    entry = entry_of(logs)
    first = "regulator" if entry == "command" else "actuator"
    chain = Chain(rig, tuple(placed))
    if chain.placed:
        way = between_of(rig, entry)
        chain.run(entering(logs, entry), first, "sensor", run_of(logs, entry), way, left=left)
    clock = max(log.start + len(log) * log.sample_time for log in logs)
    besides = [{k: v for k, v in table.items() if k in ("learned", "promise")} for table in rig.effects]
    besides += [dict(told or {})] * len(placed)
    tables = effect_tables(chain.placed, left, clock)
    effects = tuple(table | beside for table, beside in zip(tables, besides, strict=True))
    return replace(rig, effects=effects, known=())


def compose(rig: Rig, explanations: Sequence[Explanation], logs: Sequence[Experiment]) -> Rigs:
    """Own parameters and effects from all segments. Each was fitted by itself: where the output of the whole
    chain comes no closer by it, as where what one stage's refit makes up for is mended in another, segments
    keep what was given; those with effects keep what was fitted beside them. So does the zero of the reading.
    """
    placed = tuple(p for e in explanations for p in e.best.problem.placed(e.best.vector))
    beside = [e.best for e in explanations if e.best.problem.candidates]
    alone = [e.best for e in explanations if not e.best.problem.candidates]
    nominal, last = [e.nominal for e in explanations], explanations[-1]
    refitted = _closest(rig, nominal, last.nominal, (), logs)
    if not placed:
        return Rigs(refitted, refitted, placed)
    fitted = _closest(_moved(rig, beside), alone, last.best, placed, logs)
    return Rigs(refitted, fitted, placed)


def _with_zero(rig: Rig, last: Fit, placed: Sequence[Placed], logs: Sequence[Experiment]) -> Rig:
    """The rig with the zero that the output's readings have, where that brings the output closer."""
    zero = last.problem.zero(last.vector)
    if abs(zero) < _SHOWN * last.problem.segment.level_out:
        return rig
    found = replace(rig, zero=rig.zero + zero)
    return found if gap(found, placed, logs) < gap(rig, placed, logs) else rig


def _closest(
    rig: Rig, fits: Sequence[Fit], last: Fit, placed: Sequence[Placed], logs: Sequence[Experiment]
) -> Rig:
    """The rig with the nominal parameters of all ``fits`` where that brings the output closer, else of those
    that bring it closest; each with the zero that the ``last`` segment's readings have.
    """
    fits = [f for f in fits if len(f.problem.nominal_start)]

    def moved(part: Sequence[Fit]) -> Rig:
        return _with_zero(_moved(rig, part), last, placed, logs)

    all_moved = moved(fits)
    if not fits or gap(all_moved, placed, logs) <= gap(rig, placed, logs):
        return all_moved
    some = [moved(part) for n in range(len(fits)) for part in combinations(fits, n)]
    return min(some, key=lambda r: gap(r, placed, logs))


def _moved(rig: Rig, fits: Sequence[Fit]) -> Rig:
    for f in fits:
        rig = f.problem.nominals.put(rig, f.vector[: len(f.problem.nominal_start)])
    return rig


def gap(rig: Rig, placed: Sequence[Placed], logs: Sequence[Experiment]) -> float:
    """The mean square error of the output, of each rig from the pasts that suit it best."""
    logs = in_windows(rig, logs, placed)
    return mean_square(logs, simulated(rig, placed, logs))


def carried_on(rigs: Rigs, logs: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The experiments with what the earlier ones left in the rig with its effects, where that outlasts a
    rest, as a creep does; else as they are. Fitted without, a creep is too quick to have left what it left,
    so that it need not come closer yet, unless the rests are not known. Not asked are what wanders, which
    makes up for what is left out of a begin, and what lies where its last turn was: the means over windows
    that a past is given as have no turns."""
    lasting = _lasting(rigs)
    if not lasting:
        return tuple(logs)
    if any(log.paused for log in logs):
        return with_recalled(rigs.fitted, logs, lambda found: gap(rigs.fitted, lasting, found), lasting)
    return recalled(rigs.fitted, logs, lasting, closer=False)


def held_on(
    rigs: Rigs, logs: Sequence[Experiment], left: Callable[[Sequence[Experiment]], float]
) -> tuple[Experiment, ...]:
    """The same where logs do not begin at 0: since the last one each input was what the log's own begin
    tells, and that forgets what is slow. A refit tells, by the mean square that it has ``left``."""
    lasting = _lasting(rigs)
    return with_recalled(rigs.fitted, logs, left, lasting, held=True) if lasting else tuple(logs)


def _lasting(rigs: Rigs) -> tuple[Placed, ...]:
    return tuple(p for p in rigs.placed if not (p.form.wanders or library()[p.effect].remembers))


def simulated(rig: Rig, placed: Sequence[Placed], logs: Sequence[Experiment]) -> list[dict[str, np.ndarray]]:
    """The session's signals from its first input, by experiment and role."""
    return simulate_session(rig, logs, placed, continues=False)


def mean_square(logs: Sequence[Experiment], made: Sequence[dict[str, np.ndarray]]) -> float:
    """The output's mean square error, experiments counted alike."""
    return float(np.mean(squares(logs, made)))


def squares(logs: Sequence[Experiment], made: Sequence[dict[str, np.ndarray]]) -> np.ndarray:
    """The output's mean square error of every experiment, where it was read."""
    errors = [(log["output"] - m["output"])[log.read("output")] for log, m in zip(logs, made)]
    return np.array([np.mean(error**2) for error in errors])
