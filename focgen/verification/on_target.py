"""Generated C on emulated cores: every cross compiler that is there, in every emulator that is."""

from __future__ import annotations

from dataclasses import replace

from focgen.errors import MissingExtra
from focgen.plan.formats import runtime
from focgen.plan.plan import Plan
from focgen.targets import avr, qemu
from focgen.targets.cores import Core, core
from focgen.targets.driver import Answers, header_scales
from focgen.targets.emulator import TargetFault, emulator_title
from focgen.targets.library import TargetLibrary
from focgen.targets.toolchains import absent, toolchains
from focgen.verification.compare import (
    Cases,
    TargetResult,
    answered,
    cases_of,
    failed,
    judged,
)
from focgen.verification.folder import GeneratedFolder

_MOST = 2000  # samples by default
_THOROUGH = 100_000  # samples from which on nothing is left out
_BUDGET, _SOFT_BUDGET = 2_000_000, 250_000  # multiplications by default; where the core has no such numbers


def on_core(name: str, read: GeneratedFolder, samples: int | None, seed: int) -> TargetResult:
    """A folder's C on an emulated core; skipped, with the line that installs it, where a tool is missing."""
    one, plan = core(name), read.plan
    count = default_samples(plan, one) if samples is None else samples
    try:
        title, chains = emulator_title(), toolchains(one)
    except MissingExtra as missing:
        return TargetResult(skipped=f"{missing.what} ({missing.remedy})")
    cases = cases_of(plan, count, seed, None if count >= _THOROUGH else max(count, _least(plan)))
    results = []
    for chain in chains:
        library = TargetLibrary(one, chain, [plan], [read.path], selftest=read.selftest)
        result = _observed(plan, library, cases, read)
        results.append(replace(result, tools=(f"{chain.title}, {title}",), illegal=library.illegal()))
        if qemu.absent(one) is None and result.max_error is not None:  # what has come to an end there
            again = _in_qemu(plan, library, cases, read)
            results.append(replace(again, tools=(f"{chain.title}, {qemu.title()}",)))
    lacking = qemu.absent(one) if one.arm else None
    return replace(_joined(results), absent=(*absent(one), *([lacking] if lacking else [])))


def on_avr(read: GeneratedFolder, samples: int | None, seed: int) -> TargetResult:
    """A folder's C on an AVR, where avr-gcc and simavr are installed.

    The header's scales are of type double, which has 32 bits there: they are looked at elsewhere.
    """
    plan = read.plan
    why = avr.missing(plan)
    if why:
        return TargetResult(skipped=why)
    count = max(100, min(_MOST, _SOFT_BUDGET // (50 + plan.taps))) if samples is None else samples
    cases = cases_of(plan, count, seed, None if count >= _THOROUGH else max(count, _least(plan)))
    library = avr.AvrLibrary(plan, read.path, read.selftest)
    try:
        seen = [library.answers(plan, case.scenario) for case in cases.cases]
        said = library.selftest() if read.selftest else None
    except TargetFault as how:
        return replace(failed(how), tools=(avr.tools(),))
    result = judged(plan, cases, seen, header_scales(plan), read, alignment=library.alignment)
    return replace(result, selftest=said, tools=(avr.tools(),))


def default_samples(plan: Plan, one: Core) -> int:
    """As many as take seconds."""
    has = {"f64": one.double, "f32": one.single, "q31": one.wide, "q15": True}
    soft = not has[runtime(plan.arithmetic)]
    return max(100, min(_MOST, (_SOFT_BUDGET if soft else _BUDGET) // (50 + plan.taps)))


def _least(plan: Plan) -> int:
    """Fixed point tries at least one worst case, whatever it takes: no other input goes so far."""
    return 0 if plan.floating else plan.error_lags + 2


def _observed(plan: Plan, library: TargetLibrary, cases: Cases, read: GeneratedFolder) -> TargetResult:
    try:
        seen, scales = answered(library, plan, cases)
        said = library.selftest(plan) if read.selftest else None
    except TargetFault as how:
        return failed(how)
    return replace(judged(plan, cases, seen, scales, read), selftest=said)


def _in_qemu(plan: Plan, library: TargetLibrary, cases: Cases, read: GeneratedFolder) -> TargetResult:
    """The same program once more, in another emulator."""
    try:
        seen = qemu.traces(library.program, plan, [case.scenario for case in cases.cases])
    except TargetFault as how:
        return failed(how)
    return judged(plan, cases, [Answers(trace, ()) for trace in seen], library.scales(plan), read)


def _joined(results: list[TargetResult]) -> TargetResult:
    """Several compilers' results as one: all samples and mismatches; errors are the same where bits are."""
    worst = next((r for r in results if not r.sound), results[0])
    return replace(
        worst,
        samples=sum(r.samples for r in results),
        states=sum(r.states for r in results),
        mismatches=sum(r.mismatches for r in results),
        within=all(r.within for r in results),
        first=next((f"{r.tools[0]}: {r.first}" for r in results if r.first), None),
        tools=tuple(t for r in results for t in r.tools),
        selftest=next((r.selftest for r in results if r.selftest), worst.selftest),
        illegal=tuple(dict.fromkeys(i for r in results for i in r.illegal)),
    )
