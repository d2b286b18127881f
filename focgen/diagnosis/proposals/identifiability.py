"""Before any data: which effects a set of experiments can and cannot tell apart.

Each effect is switched on a little in the nominal chain; what of its trace in the output survives a refit of
the nominal parameters, and how alike the survivors are, is known without a rig.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from focgen.diagnosis.hypotheses.explain import candidates_for
from focgen.diagnosis.hypotheses.nuisances import problem_of
from focgen.diagnosis.problem.excitation import excitation
from focgen.diagnosis.problem.segments import cuts, make
from focgen.diagnosis.proposals.limits import InputLimits
from focgen.diagnosis.proposals.menu import menu
from focgen.logs.experiment import ROLES, Experiment
from focgen.logs.read import Logs, each_of
from focgen.rig.arguments import RigLike, rig_of, rig_then_logs
from focgen.rig.effects import Excitation, Run, library
from focgen.rig.engine import Chain
from focgen.rig.replay import experiments, simulate_session, with_known
from focgen.rig.response import check_bounded, integrations, longest, response_time
from focgen.rig.rig import Rig
from focgen.rig.stages import LEAVES
from focgen.rig.stale_zero import with_zero_of
from focgen.rig.turned import Turn, turn_of, with_its_way

ALIKE = 0.9  # cosine beyond which two effects cannot be told apart
HIDDEN = 0.1  # surviving share below which an effect hides in the nominal parameters
_FINE, _LONGEST = 200, 600.0  # samples of a response time, and response times of an experiment of the menu
_COMMAND = (0.0, 10.0)  # where the rig file is silent


@dataclass(frozen=True)
class Survival:
    """An effect under the plan: the share of its trace that a refit leaves, what it is tied with, what is
    lacking."""

    effect: str
    stage: str
    survives: float
    tied_with: dict[str, float]
    lacking: str | None


@dataclass(frozen=True)
class Plan:
    """What the experiments can tell: ``effects`` by segment of the chain, and the ``experiments`` they were
    asked of."""

    experiments: tuple[str, ...]
    effects: tuple[Survival, ...]

    def text(self) -> str:
        """For people."""
        lines = [f"experiments: {', '.join(self.experiments)}", f"{'effect':22s}survives  tied with"]
        for s in self.effects:
            tied = ", ".join(f"{k} {v:.2f}" for k, v in s.tied_with.items()) or "-"
            hidden = " (hides in the nominal parameters)" if s.survives < HIDDEN else ""
            lack = f" [{s.lacking}]" if s.lacking else ""
            lines.append(f"{s.effect:22s}{s.survives:8.2f}  {tied}{hidden}{lack}")
        return "\n".join(lines)


@rig_then_logs
def plan(rig: RigLike, logs: Logs = ()) -> Plan:
    """Which effects the inputs of ``logs`` could tell apart, or without logs those of a menu of experiments.

    Only the inputs of the logs are used. Raises RigError and LogError for files that cannot be used.
    """
    nominal, each = with_known(rig_of(rig)), each_of(logs)
    logged = experiments(nominal, each) if each else ()
    nominal, _ = with_zero_of(nominal, logged)
    nominal = with_its_way(nominal, logged or _reach(nominal))
    turn = turn_of(nominal)
    nominal, logged = turn.rig(nominal), tuple(turn.log(log, nominal) for log in logged)
    nominal, session = _from_its_zero(nominal, logged or _menu(nominal))
    roles = cuts(session)
    response = response_time(nominal, session[0].sample_time, longest(session))
    seen = excitation([s[roles[0]] for s in session], session[0].sample_time, response)
    found = [survival for a, b in pairwise(roles) for survival in _segment(nominal, session, a, b, seen)]
    return Plan(tuple(s.name for s in session), tuple(found))


def _from_its_zero(rig: Rig, logs: tuple[Experiment, ...]) -> tuple[Rig, tuple[Experiment, ...]]:
    """The rig and its logs as a diagnosis would run them, with what it makes where none is logged."""
    seen = logs if all("output" in log for log in logs) else _made(rig, logs)
    if rig.moved or rig.effects:
        return rig, seen
    turn = Turn(dict.fromkeys(ROLES, 1), with_its_way(rig, seen).origins)
    moved = replace(turn.rig(rig), downwards=rig.downwards, turned=rig.turned)  # as it was turned before
    return moved, tuple(turn.log(log, rig) for log in seen)


def _made(rig: Rig, logs: tuple[Experiment, ...]) -> tuple[Experiment, ...]:
    """The logs, with what the rig makes of their inputs where they lack the output."""
    made = ({"output": y["output"]} for y in simulate_session(rig, logs))
    return tuple(replace(log, signals={**y, **log.signals}) for log, y in zip(logs, made))


def _reach(rig: Rig) -> tuple[Experiment, ...]:
    """The ends of the command, as a log that goes there."""
    ends = np.asarray(rig.ranges.command or _COMMAND, float)
    return (Experiment("ranges", rig.sample_time, {"command": ends}),)


def _menu(rig: Rig) -> tuple[Experiment, ...]:
    """The menu's experiments on the nominal rig."""
    seconds = 2e4 * rig.sample_time
    check_bounded(rig, seconds)
    response = response_time(rig, rig.sample_time, seconds)
    start, found = 0.0, []
    for choice in menu(_limits(rig, response)):
        run = Run.of([len(choice.levels)], [start], choice.limits.h)
        tap: dict[str, np.ndarray] = {}
        Chain(rig).run(choice.input, "regulator", "sensor", run, tap=tap)
        logged = {role for role in ("pressure", "curvature") if getattr(rig.signals, role)} | {"output"}
        signals = {"command": choice.input} | {LEAVES[s]: y for s, y in tap.items() if LEAVES[s] in logged}
        found.append(Experiment(choice.what, choice.limits.h, signals, start))
        start += choice.seconds
    return tuple(found)


def _limits(rig: Rig, response: float) -> InputLimits:
    """What the rig file says of the command: from 0 to 10 where it is silent."""
    low, high = rig.ranges.command or _COMMAND
    h = max(rig.sample_time, response / _FINE)
    return InputLimits(
        low, high, min(max(0.0, low), high), np.inf, _LONGEST * response, response, h, 1, integrations(rig)
    )


def _segment(
    rig: Rig, session: Sequence[Experiment], entry: str, exit: str, seen: Excitation
) -> list[Survival]:
    problem = problem_of(rig, make(session, entry, exit), session)
    base = problem.nominal()
    level, zero = problem.segment.level_out, problem.simulate(base)
    columns = []
    for i in np.flatnonzero(problem.nominals.precision == 0.0):  # the others give way by little
        moved = base.copy()
        moved[i] += 1e-4
        columns.append((problem.simulate(moved) - zero) / 1e-4 / level)
    basis = np.linalg.qr(np.stack(columns, axis=1))[0] if columns else np.zeros((len(zero), 0))
    traces: dict[str, tuple[str, np.ndarray, float]] = {}
    for candidate in candidates_for(problem.segment, rig):
        if candidate.effect in traces:
            continue
        extended = problem.with_candidates([candidate])
        trace = (extended.simulate(np.r_[base, extended.starts(candidate)[0]]) - zero) / level
        left = trace - basis @ (basis.T @ trace)
        size = float(np.linalg.norm(trace))
        if size > 0 and np.all(np.isfinite(left)):
            traces[candidate.effect] = (candidate.stage, left, float(np.linalg.norm(left)) / size)
    return [_survival(name, traces, seen) for name in traces]


def _survival(name: str, traces: dict[str, tuple[str, np.ndarray, float]], seen: Excitation) -> Survival:
    stage, left, share = traces[name]
    tied = {}
    for other, (_, theirs, _) in traces.items():
        cosine = abs(float(left @ theirs)) / max(float(np.linalg.norm(left) * np.linalg.norm(theirs)), 1e-300)
        if other != name and cosine > ALIKE:
            tied[other] = cosine
    return Survival(name, stage, share, tied, library()[name].needs(seen))
