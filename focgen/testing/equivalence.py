"""``assert_equivalent``: a candidate against the reference, in every bit or within the proven bound."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from focgen.arguments import checked
from focgen.arrays import Numbers
from focgen.control.controller import Controller
from focgen.control.files import controller_from
from focgen.errors import InputError, check_choice
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.ideal import ideal
from focgen.plan.plan import Plan
from focgen.plan.scenario import Reset, Scenario, Track
from focgen.running.controller import LoadedController
from focgen.testing.candidates import Candidate, Played, candidate_of, played, tunes
from focgen.testing.inputs import Trial, bounded_trials, exact_trials
from focgen.testing.telling import difference
from focgen.verification.folder import read_folder
from focgen.verification.subprocess_call import Crashed, TimedOut, in_subprocess

__all__ = ["Equivalence", "assert_equivalent"]

_PATIENCE = 30.0  # seconds that C may take at least
_SLOW = 2e-4  # seconds a sample that it may take beyond them


@dataclass(frozen=True)
class Equivalence:
    """What was compared: ``samples`` in ``runs``, and whether ``flags`` were. ``share``: the largest part of
    the bound that was used, within="bound"; 0 where every bit agrees.
    """

    samples: int
    runs: int
    flags: bool
    share: float = 0.0


@dataclass(frozen=True, eq=False)
class Judged:
    """A trial and what came of it, shapes (lanes, samples): the reference's outputs and flags, both outputs
    in one unit, the ``error`` between them and how much is ``allowed``, and where it is ``wrong``.
    """

    trial: Trial
    seen: Played
    u: Numbers
    flags: Numbers | None
    error: Numbers
    allowed: Numbers | None
    wrong: Numbers


@checked
def assert_equivalent(
    reference: str | Path | Controller | LoadedController,
    candidate: Any,
    within: Literal["bits", "bound"] = "bits",
    samples: int = 10_000,
    seed: int = 0,
) -> Equivalence:
    """Raise AssertionError where a candidate is not the controller that it should be, with the first sample
    that differs, its inputs and both outputs; return what was compared.

    ``reference``: a generated folder, of which controller.toml and the options are taken and no C; what
    :func:`focgen.load` gives; or a controller or its file, in the arithmetic that it names.

    ``candidate``: a generated folder, edited or not; an object with ``reset(ref, meas, u0)``, ``step(ref,
    meas, sched)`` and ``track(u)`` in counts, such as :func:`focgen.testing.from_c` makes, which may also
    have ``init()``, ``flags`` and, for a tunable reference, ``tune(params)``; a class or function without
    arguments that makes such an object; or a function ``step(ref, meas, sched)`` that starts at rest, which
    is tried in one run, without resets and tracks.
    Nothing is passed for ``sched`` where nothing is scheduled.

    ``within`` "bits": outputs, and flags where the candidate has them, are the bit-true reference's, on the
    inputs that ``verify`` takes: steps, noise, limits, ends and breakpoints of the schedule, resets, tracks,
    parameters, inputs out of range or not usable, the worst case of every node. "bound": outputs are no
    further from the same controller in float64 than manifest.json's ``error_bound`` allows, on inputs within
    their ranges; for fused multiply-adds, vectorised sums and other orders of summation. ``samples`` of mixed
    inputs from ``seed``, besides the worst cases.

    Raises InputError for what cannot be compared.
    """
    check_choice("within", within, ("bits", "bound"))
    _check_numbers(samples, seed)
    plan, name = _plan(reference)
    tried = candidate_of(candidate, plan)
    trials = (exact_trials if within == "bits" else bounded_trials)(plan, samples, seed, tried.plain)
    if plan.tuning and not tried.plain and not tunes(tried):
        trials = [replace(t, raw=replace(t.raw, tunes=()), physical=replace(t.physical, tunes=()))
                  for t in trials]  # fmt: skip
    seen = _run(tried, plan, [trial.raw for trial in trials])
    judge = _in_bits if within == "bits" else _in_bound
    judged = [judge(plan, trial, one) for trial, one in zip(trials, seen)]
    wrong = [one for one in judged if one.wrong.any()]
    if wrong:
        headline = f"{tried.label} is not {name}"
        raise AssertionError(difference(plan, headline, wrong[0], _counted(judged), seed))
    share = max(float(np.max(_share(one))) for one in judged)
    runs = sum(one.wrong.shape[0] for one in judged)
    return Equivalence(_counted(judged)[1], runs, all(one.flags is not None for one in judged), share)


def _check_numbers(samples: int, seed: int) -> None:
    if not isinstance(samples, int) or samples < 1:
        raise InputError("samples", f"is {samples!r}", "give at least 1")
    if not isinstance(seed, int) or seed < 0:
        raise InputError("seed", f"is {seed!r}", "give 0 or more")


def _plan(reference: str | Path | Controller | LoadedController) -> tuple[Plan, str]:
    """The plan that is the reference, and its name."""
    if isinstance(reference, LoadedController):
        _check_unedited(str(reference.path), reference.differences)
        return reference.plan, reference.name
    if isinstance(reference, Controller):
        return build_plan(controller_from(reference)), reference.name
    if Path(reference).is_file():
        return build_plan(controller_from(reference)), str(reference)
    read = read_folder(reference)
    _check_unedited(str(reference), read.differences)
    return read.plan, str(reference)


def _check_unedited(where: str, differences: tuple[str, ...]) -> None:
    """Raise InputError where what a reference is taken from has been edited; its C takes no part."""
    changed = [d for d in differences if d.startswith(("controller.toml", "manifest.json"))]
    if changed:
        raise InputError(where, f"has been edited: {changed[0]}", "generate it again")


def _run(candidate: Candidate, plan: Plan, scenarios: list[Scenario]) -> list[Played]:
    """C in a process of its own: what it does to itself is a failed test, and no more."""
    if not candidate.isolated:
        return played(candidate, plan, scenarios)
    limit = _PATIENCE + _SLOW * sum(s.ref.size for s in scenarios)
    try:
        seen: list[Played] = in_subprocess(played, candidate, plan, scenarios, seconds=limit)
        return seen
    except Crashed as how:
        raise AssertionError(f"{candidate.label} crashed ({how})") from None
    except TimedOut as how:
        raise AssertionError(f"{candidate.label} did not return within {how}: it hangs") from None


def _in_bits(plan: Plan, trial: Trial, seen: Played) -> Judged:
    expected = execute(plan, trial.raw)
    u = expected.u.astype(float)
    wrong = seen.u != u  # which NaN is, too
    flags = None if seen.flags is None else expected.flags
    if flags is not None:
        wrong |= seen.flags != flags
    return Judged(trial, seen, u, flags, np.abs(seen.u - u), None, wrong)


def _in_bound(plan: Plan, trial: Trial, seen: Played) -> Judged:
    expected = ideal(plan.controller, trial.physical, plan.length, plan.memories)
    error = np.abs(seen.u * plan.output.lsb - expected.u)
    allowed = _steps(plan, trial.physical) * plan.error_bound.output_per_sample
    return Judged(trial, seen, expected.u, None, error, allowed, ~(error <= allowed))


def _steps(plan: Plan, scenario: Scenario) -> Numbers:
    """Over how many samples the output's error may have grown; shape (lanes, samples).

    An integral's since init, a reset or a track. Otherwise one, unless an inner integral remembers.
    """
    count = np.ones((scenario.lanes, scenario.samples))
    if not plan.integrator and not plan.error_bound.operator_per_sample:
        return count
    count = count.cumsum(axis=1)
    begun: list[Reset | Track] = [*scenario.resets, *(scenario.tracks if plan.integrator else ())]
    for event in sorted(begun, key=lambda event: event.sample):
        count[event.lane, event.sample :] = np.arange(1, scenario.samples - event.sample + 1)
    return count


def _counted(judged: list[Judged]) -> tuple[int, int]:
    """Samples that differ, and all."""
    return sum(int(np.count_nonzero(one.wrong)) for one in judged), sum(one.wrong.size for one in judged)


def _share(judged: Judged) -> Numbers:
    return np.zeros(1) if judged.allowed is None else judged.error / judged.allowed
