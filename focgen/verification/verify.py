"""``verify``: generated C against the Python reference, sample for sample, and its errors against bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from focgen.errors import InputError
from focgen.plan.execute import execute
from focgen.plan.model import Plan
from focgen.plan.scenario import Scenario, Trace, to_raw
from focgen.verification.apart import Crashed, apart
from focgen.verification.errors_seen import ErrorsSeen, MaxError, errors_seen
from focgen.verification.folder import GeneratedFolder, read_folder
from focgen.verification.host import Library, header_scales
from focgen.verification.scenarios import mixed, raw_scenarios

TARGETS = ("host", "cortex-m0plus", "cortex-m3", "cortex-m4", "cortex-m7", "rv32imac", "avr")


@dataclass(frozen=True)
class TargetResult:
    """One target. ``mismatches``: samples whose output, increment or flags differ in a bit.

    ``max_error`` of the C against the same memory in float64, ``error_bound`` as the manifest has it,
    ``within`` whether it holds. ``first`` describes the first mismatch, ``header`` every scale of the header
    that is not the manifest's. ``skipped``: why the target was not run; the rest is None then.
    """

    samples: int = 0
    mismatches: int = 0
    max_error: MaxError | None = None
    error_bound: dict[str, float] | None = None
    within: bool = True
    first: str | None = None
    header: tuple[str, ...] = ()
    skipped: str | None = None


@dataclass(frozen=True)
class Verification:
    """``targets`` by name; ``differences`` between the manifest and what its controller gives; ``holds``: all
    is well, and something was run.
    """

    name: str
    arithmetic: str
    targets: dict[str, TargetResult]
    differences: tuple[str, ...] = field(default=())

    @property
    def holds(self) -> bool:
        """Whether everything that ran agrees and stays within its bounds, and something ran."""
        ran = [t for t in self.targets.values() if t.skipped is None]
        return (
            bool(ran)
            and not self.differences
            and all(t.within and not t.mismatches and not t.header for t in ran)
        )


def verify(
    folder: str | Path, samples: int = 10_000, seed: int = 0, target: str | Sequence[str] = "host"
) -> Verification:
    """Compile the C of a generated folder and compare it with the bit-true reference.

    ``samples`` of mixed inputs, from ``seed``, besides the worst case of every node. ``target``: a name of
    ``TARGETS``, several, or "all". The C runs in a process of its own; where it crashes, that is a mismatch.

    Raises InputError for a folder that is none, BuildError where the C does not compile.
    """
    if not isinstance(samples, int) or samples < 1:
        raise InputError("--samples", f"is {samples!r}", "give at least 1")
    if seed < 0:
        raise InputError("--seed", f"is {seed}", "give 0 or more")
    read = read_folder(folder)
    results = {name: _on(name, read, samples, seed) for name in _targets(target)}
    return Verification(read.plan.name, read.plan.arithmetic, results, read.differences)


def _targets(target: str | Sequence[str]) -> tuple[str, ...]:
    names = TARGETS if target == "all" else (target,) if isinstance(target, str) else tuple(target)
    for name in names:
        if name not in TARGETS:
            raise InputError("--target", f"is {name!r}", f"choose of {', '.join(TARGETS)}, all")
    return names


def _on(name: str, read: GeneratedFolder, samples: int, seed: int) -> TargetResult:
    if name != "host":
        return TargetResult(skipped="emulated targets are not part of this version")
    library = Library([read.plan], [read.path])
    try:
        return apart(compare, read.plan, library, samples, seed, read)
    except Crashed as how:
        return TargetResult(mismatches=1, within=False, first=f"the C crashed ({how})")


def compare(
    plan: Plan, library: Library, samples: int, seed: int, read: GeneratedFolder | None = None
) -> TargetResult:
    """Run a plan's C and its reference over everything; the bound is the folder's, else the plan's."""
    bound = plan.error_bound if read is None else read.bound
    total, mismatches, first = 0, 0, None
    for label, scenario in raw_scenarios(plan, samples, seed).items():
        seen, expected = library.run(plan, scenario), execute(plan, scenario)
        wrong = _differs(plan, seen, expected)
        total += wrong.size
        mismatches += int(np.count_nonzero(wrong))
        if first is None and wrong.any():
            first = _described(label, scenario, seen, expected, wrong)
    errors = _errors(plan, library, samples, seed, bound)
    limits = {"operator": bound.operator, "output_per_sample": bound.output_per_sample}
    return TargetResult(
        total, mismatches, errors.largest, limits, errors.within, first, _header(plan, library)
    )


def _header(plan: Plan, library: Library) -> tuple[str, ...]:
    """The header's scales that are wrong: no sample depends on them, but every program that uses it does."""
    expected, found = header_scales(plan), library.scales(plan)
    return tuple(
        f"{plan.name}_{key} is {found[key]!r}, the controller gives {value!r}"
        for key, value in expected.items()
        if found[key] != value
    )


def _differs(plan: Plan, seen: Trace, expected: Trace) -> np.ndarray:
    """Where output, flags or, with an integrator, the increment differ in a bit; (lanes, samples)."""
    wrong = (_bits(seen.u) != _bits(expected.u)) | (seen.flags != expected.flags)
    return wrong | (_bits(seen.d) != _bits(expected.d)) if plan.integrator else wrong


def _bits(values: np.ndarray) -> np.ndarray:
    """What is compared: integers as they are, floating values by their bits, +0 and −0 alike."""
    if values.dtype.kind != "f":
        return values.astype(np.int64)
    positive = np.where(values == 0.0, np.zeros_like(values), values)
    return positive.view(np.int32 if values.dtype.itemsize == 4 else np.int64)


def _described(label: str, scenario: Scenario, seen: Trace, expected: Trace, wrong: np.ndarray) -> str:
    lane, sample = (int(i) for i in np.argwhere(wrong)[np.argmin(np.argwhere(wrong)[:, 1])])
    at = lane, sample
    return (
        f"{label}, run {lane}, sample {sample}: C gives u = {seen.u[at]}, flags {seen.flags[at]}; "
        f"the reference u = {expected.u[at]}, flags {expected.flags[at]} "
        f"(ref {scenario.ref[at]}, meas {scenario.meas[at]})"
    )


def _errors(plan: Plan, library: Library, samples: int, seed: int, bound) -> ErrorsSeen:
    """The C's errors on physical inputs anywhere in their ranges."""
    physical = mixed(plan.controller, samples, seed + 1)
    return errors_seen(plan, physical, library.run(plan, to_raw(plan, physical)), bound)
