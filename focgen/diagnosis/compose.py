"""The segments' findings put together into rigs: the refitted one, the augmented one, and their sessions
simulated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from focgen.diagnosis.explain import Explanation
from focgen.diagnosis.segments import session
from focgen.logs.experiment import Experiment
from focgen.rig.engine import Chain, Placed
from focgen.rig.model import Rig
from focgen.rig.replay import effect_tables, simulate_session


@dataclass(frozen=True, eq=False)
class Rigs:
    """``refitted``: own parameters only; ``fitted`` with ``placed``: own parameters together with the
    effects."""

    refitted: Rig
    fitted: Rig
    placed: tuple[Placed, ...]

    def augmented(self, logs: Sequence[Experiment]) -> Rig:
        """The rig that carries its effects, and what outlives this session."""
        left: list[dict[str, float]] = []
        entry = "command" if all("command" in log for log in logs) else "pressure"
        x = np.concatenate([np.asarray(log[entry], float) for log in logs])
        first = "regulator" if entry == "command" else "actuator"
        run = session(logs, entry)
        Chain(self.fitted, self.placed).run(x, first, "sensor", run, entry == "command", left=left)
        clock = max(log.start + len(log) * log.sample_time for log in logs)
        return replace(self.fitted, effects=effect_tables(self.placed, left, clock))


def compose(rig: Rig, explanations: Sequence[Explanation], logs: Sequence[Experiment]) -> Rigs:
    """Own parameters from the segment that has them, effects from all. Where that refit brings the output no
    closer, because the gap lies in a stage that is not refitted, the refitted rig keeps the parameters
    given."""
    refitted = fitted = rig
    placed: list[Placed] = []
    for e in explanations:
        problem = e.best.problem
        if problem.own.stage is not None and len(problem.own_start):
            refitted, fitted = e.nominal.problem.rig(e.nominal.vector), problem.rig(e.best.vector)
        placed += problem.placed(e.best.vector)
    refitted, fitted, given = (replace(r, effects=()) for r in (refitted, fitted, rig))
    if len(explanations) > 1 and _gap(refitted, logs) > _gap(given, logs):
        refitted = given
    return Rigs(refitted, fitted, tuple(placed))


def _gap(rig: Rig, logs: Sequence[Experiment]) -> float:
    return mean_square(logs, simulated(rig, (), logs))


def simulated(rig: Rig, placed: Sequence[Placed], logs: Sequence[Experiment]) -> list[dict[str, np.ndarray]]:
    """The session's signals from its first input, by experiment and role."""
    return simulate_session(rig, logs, placed, continues=False)


def mean_square(logs: Sequence[Experiment], made: Sequence[dict[str, np.ndarray]]) -> float:
    """The output's mean square error, experiments counted alike."""
    return float(np.mean(squares(logs, made)))


def squares(logs: Sequence[Experiment], made: Sequence[dict[str, np.ndarray]]) -> np.ndarray:
    """The output's mean square error of every experiment."""
    return np.array([np.mean((log["output"] - m["output"]) ** 2) for log, m in zip(logs, made)])
