"""Answers of compiled C beside those of the reference: bits that differ, bounds that are exceeded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from focgen.arrays import Numbers
from focgen.codegen.kernels import PORTABLE, Kernels
from focgen.plan.ending import Ending, endings
from focgen.plan.plan import ErrorBound, Plan
from focgen.plan.scenario import Scenario, Trace, to_raw
from focgen.plan.usable import refused_events
from focgen.present import present
from focgen.targets.driver import REFUSED, Answers, header_scales
from focgen.verification.errors_seen import ErrorsSeen, MaxError, errors_seen
from focgen.verification.folder import GeneratedFolder
from focgen.verification.host import Library
from focgen.verification.scenarios import mixed, raw_scenarios, thinned
from focgen.verification.states import wrong_member
from focgen.verification.subprocess_call import Crashed, TimedOut, in_subprocess

PATIENCE = 20.0
"""Seconds that C may take at least before it is said not to return."""


@dataclass(frozen=True)
class TargetResult:
    """One target. ``mismatches``: samples whose output, increment or flags differ in a bit, and runs that
    left another state behind.

    ``max_error`` of the C against the same memory in float64, ``error_bound`` as the manifest has it,
    ``within`` whether it holds. ``first`` describes the first mismatch, ``header`` every scale of the header
    that is not the manifest's. ``tools``: what compiled and ran it; ``illegal``: instructions that the target
    does not have; ``absent``: further tools that would have been used. ``selftest``: what NAME_selftest()
    returned, 0 where it agrees; None where it was not run. ``states``: how many states, one a run, were
    compared member by member. ``skipped``: why the target was not run; the rest means nothing then.
    """

    samples: int = 0
    mismatches: int = 0
    max_error: MaxError | None = None
    error_bound: dict[str, float] | None = None
    within: bool = True
    first: str | None = None
    header: tuple[str, ...] = ()
    skipped: str | None = None
    tools: tuple[str, ...] = ()
    illegal: tuple[str, ...] = ()
    absent: tuple[str, ...] = ()
    selftest: int | None = None
    states: int = 0

    @property
    def sound(self) -> bool:
        """Whether what ran agrees in every bit, within its bounds, with the instructions that there are."""
        faults = self.mismatches or self.header or self.illegal or self.selftest
        return self.within and not faults


class Runs(Protocol):
    """The C of plans somewhere: on this computer, on an emulated core. ``alignment`` (bytes): the largest of
    a type there.
    """

    alignment: int

    def answers(self, plan: Plan, scenario: Scenario) -> Answers:
        """What the C answers to a scenario."""

    def scales(self, plan: Plan) -> dict[str, float]:
        """The physical sizes of a count that its header gives, by macro."""


@dataclass(frozen=True, eq=False)
class Case:
    """A scenario of raw inputs, what the reference answers, and how it leaves the state of every lane."""

    label: str
    scenario: Scenario
    expected: Trace
    endings: tuple[Ending, ...]


@dataclass(frozen=True, eq=False)
class Cases:
    """All a plan is compared in; ``physical``: inputs of the last case, whose errors are measured."""

    cases: tuple[Case, ...]
    physical: Scenario

    @property
    def samples(self) -> int:
        """Samples of all cases."""
        return sum(case.expected.u.size for case in self.cases)


def cases_of(plan: Plan, samples: int, seed: int, worst: int | None = None) -> Cases:
    """What to try a plan with; of the worst cases at most ``worst`` samples, where given."""
    scenarios: dict[str, Scenario | None] = {**raw_scenarios(plan, samples, seed)}
    if worst is not None:
        scenarios["worst cases"] = thinned(present(scenarios["worst cases"]), worst)
    physical = mixed(plan.controller, samples, seed + 1)
    scenarios["errors"] = to_raw(plan, physical)
    found = (Case(label, s, *endings(plan, s)) for label, s in scenarios.items() if s is not None)
    return Cases(tuple(found), physical)


def compare(
    plan: Plan,
    library: Runs,
    samples: int,
    seed: int,
    read: GeneratedFolder | None = None,
    kernels: Kernels = PORTABLE,
) -> TargetResult:
    """Run a plan's C and its reference over everything; bound and kernels are the folder's, else the plan's
    and those given.
    """
    cases = cases_of(plan, samples, seed)
    return judged(plan, cases, *answered(library, plan, cases), read, kernels, library.alignment)


def observed(plan: Plan, library: Runs, samples: int, seed: int, read: GeneratedFolder) -> TargetResult:
    """The same with the C in a process of its own: what it does to itself ends there."""
    cases = cases_of(plan, samples, seed)
    try:
        seen = in_subprocess(answered, library, plan, cases, seconds=host_limit(plan, cases))
    except (Crashed, TimedOut) as how:
        return failed(how)
    answers, scales = seen
    return judged(plan, cases, answers, scales, read, alignment=library.alignment)


def self_tested(result: TargetResult, plan: Plan, library: Library) -> TargetResult:
    """Add what the folder's self-test says, on this computer."""
    try:
        return replace(result, selftest=in_subprocess(library.selftest, plan, seconds=PATIENCE))
    except (Crashed, TimedOut) as how:
        return failed(how)


def answered(library: Runs, plan: Plan, cases: Cases) -> tuple[list[Answers], dict[str, float]]:
    """What the C gives in every case, and the header's scales."""
    return [library.answers(plan, case.scenario) for case in cases.cases], library.scales(plan)


def host_limit(plan: Plan, cases: Cases) -> float:
    """Seconds that this computer may take: a hundred times what it should, and at least ``PATIENCE``."""
    return PATIENCE + cases.samples * (200 + plan.taps) * 1e-7


def failed(how: Exception) -> TargetResult:
    """The result of C that crashed, did what its core cannot do, or did not return."""
    said = {Crashed: f"the C crashed ({how})", TimedOut: f"the C did not return within {how}: it hangs"}
    return TargetResult(mismatches=1, within=False, first=said.get(type(how), f"the C {how}"))


def judged(
    plan: Plan,
    cases: Cases,
    seen: Sequence[Answers],
    scales: dict[str, float],
    read: GeneratedFolder | None,
    kernels: Kernels = PORTABLE,
    alignment: int = 8,
) -> TargetResult:
    """Compare what was seen with what was expected; ``kernels`` are the folder's where one was ``read``;
    ``alignment`` (bytes) is the largest that a member of a state has where it ran.
    """
    bound, kernels = (plan.error_bound, kernels) if read is None else (read.bound, read.kernels)
    total, mismatches, first, states = 0, 0, None, 0
    for case, answer in zip(cases.cases, seen, strict=True):
        wrong = _differs(plan, answer.trace, _said(plan, case))
        total += wrong.size
        mismatches += int(np.count_nonzero(wrong))
        left = _states(plan, case, answer, kernels, alignment)
        mismatches, states = mismatches + len(left), states + len(answer.states)
        if first is None and (wrong.any() or left):
            first = _described(plan, case, answer.trace, wrong) if wrong.any() else left[0]
    errors = _errors(plan, cases, seen[-1].trace, bound)
    limits = {"operator": bound.operator, "output_per_sample": bound.output_per_sample}
    found = TargetResult(total, mismatches, errors.largest, limits, errors.within, first, states=states)
    return replace(found, header=_header(plan, scales))


def _states(plan: Plan, case: Case, answer: Answers, kernels: Kernels, alignment: int) -> list[str]:
    """The runs of a case that leave another state than the reference does; none where none was read."""
    both = zip(answer.states, case.endings)
    found = (wrong_member(plan, state, ending, kernels, alignment) for state, ending in both)
    return [f"{case.label}, after run {lane}: {wrong}" for lane, wrong in enumerate(found) if wrong]


def _header(plan: Plan, found: dict[str, float]) -> tuple[str, ...]:
    """The header's scales that are wrong: no sample depends on them, but every program that uses it does."""
    return tuple(
        f"{plan.name}_{key} is {found[key]!r}, the controller gives {value!r}"
        for key, value in header_scales(plan).items()
        if found[key] != value and not np.isnan(found[key])
    )


def _differs(plan: Plan, seen: Trace, expected: Trace) -> Numbers:
    """Where output, flags or, with an integrator, the increment differ in a bit; (lanes, samples)."""
    wrong = (_bits(seen.u) != _bits(expected.u)) | (seen.flags != expected.flags)
    if plan.integrator:
        wrong = wrong | (_bits(seen.d) != _bits(expected.d))
    return np.asarray(wrong)


def _bits(values: Numbers) -> Numbers:
    """What is compared: integers as they are, floating values by their bits, +0 and −0 alike."""
    if values.dtype.kind != "f":
        return values.astype(np.int64)
    positive = np.where(values == 0.0, np.zeros_like(values), values)
    return positive.view(np.int32 if values.dtype.itemsize == 4 else np.int64)


def _said(plan: Plan, case: Case) -> Trace:
    """What is expected; beside the flags, whether a reset or a track ahead of the step has raised its own."""
    flags = present(case.expected.flags)
    refused = refused_events(plan, case.scenario, flags)
    return replace(case.expected, flags=np.where(refused, flags | REFUSED, flags).astype(np.uint8))


def _described(plan: Plan, case: Case, seen: Trace, wrong: Numbers) -> str:
    lane, sample = (int(i) for i in np.argwhere(wrong)[np.argmin(np.argwhere(wrong)[:, 1])])
    at, expected = (lane, sample), _said(plan, case)
    return (
        f"{case.label}, run {lane}, sample {sample}: C gives {_answer(seen, at)}; "
        f"the reference {_answer(expected, at)} "
        f"(ref {case.scenario.ref[at]}, meas {case.scenario.meas[at]})"
    )


def _answer(trace: Trace, at: tuple[int, int]) -> str:
    """A sample's output, increment (equal to it without an integrator) and flags."""
    return f"u = {trace.u[at]}, increment {trace.d[at]}, flags {present(trace.flags)[at]}"


def _errors(plan: Plan, cases: Cases, seen: Trace, bound: ErrorBound) -> ErrorsSeen:
    """The C's errors on physical inputs anywhere in their ranges."""
    return errors_seen(plan, cases.physical, seen, bound)
