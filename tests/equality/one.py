"""One controller: its C compiled, run, and compared with the reference; its worst error beside its bound."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from focgen.codegen.generate import folder_files
from focgen.control.files import controller_text
from focgen.errors import MissingExtra
from focgen.output import write_files
from focgen.plan.ending import endings
from focgen.plan.ideal import ideal
from focgen.plan.plan import Plan
from focgen.plan.scenario import Scenario, Trace, physical_trace, to_raw
from focgen.targets import avr
from focgen.targets.cores import core
from focgen.targets.driver import header_scales
from focgen.targets.library import TargetLibrary
from focgen.targets.toolchains import toolchains
from focgen.verification.compare import Case, Cases, Runs, judged
from focgen.verification.errors_seen import _samples_since_reset
from focgen.verification.host import Library
from tests.equality.drawn import Drawn
from tests.equality.inputs import measured, others, wide

LEVELS = ("-O0", "-O1", "-O2", "-O3")


@dataclass(frozen=True)
class Seen:
    """``differing``: samples and states that are not the reference's; ``within``: no bound was exceeded.

    ``share``: the worst error of the signal ahead of the integrator (of the output's clamp, without one) over
    its bound; ``cause``: the largest part of that bound. ``seconds`` of this process, compilers aside.
    """

    seed: int
    kind: str
    arithmetic: str
    kinds: tuple[str, ...]
    target: str
    samples: int
    differing: int
    within: bool
    share: float
    cause: str
    seconds: float
    first: str = ""


def cases(plan: Plan, lanes: int, samples: int, seed: int) -> tuple[Cases, float]:
    """All a plan is compared in, and the share of its bound that its worst error is."""
    physical = measured(plan, samples, seed)
    raw = {"inside": wide(plan, lanes, samples, seed), **others(plan, samples, seed)}
    raw["errors"] = to_raw(plan, physical)
    made = tuple(Case(label, scenario, *endings(plan, scenario)) for label, scenario in raw.items())
    return Cases(made, physical), _share(plan, physical, made[-1].expected)


def _share(plan: Plan, physical: Scenario, trace: Trace) -> float:
    """The reference's d beside exact arithmetic's, sample by sample against what the bound allows there."""
    exact, bound = ideal(plan.controller, physical, plan.length, plan.memories), plan.error_bound
    allowed = np.full(exact.d.shape, bound.operator)
    if bound.operator_per_sample:
        since = _samples_since_reset(physical)
        allowed = np.minimum(allowed, since * bound.operator_per_sample)
    error = np.abs(physical_trace(plan, trace).d - exact.d)
    return float(np.max(np.divide(error, allowed, out=np.zeros_like(error), where=error > 0.0)))


def on_host(one: Drawn, lanes: int, samples: int) -> Seen:
    """Compare on this computer, compiled at a level of optimisation that changes with the seed."""
    flags = ("-std=c99", LEVELS[one.seed % len(LEVELS)], "-ffp-contract=off")
    with tempfile.TemporaryDirectory(prefix="focgen-") as folder:
        write(one.plan, Path(folder))
        library = Library([one.plan], [Path(folder)], flags=flags)
    return compared(one, library, lanes, samples, "host")


def on_core(one: Drawn, name: str, lanes: int, samples: int) -> Seen | None:
    """Compare on an emulated core; None where this machine has no emulator or compiler for it, or the core
    not the memory."""
    with tempfile.TemporaryDirectory(prefix="focgen-") as folder:
        write(one.plan, Path(folder))
        if name == "avr":
            if avr.missing(one.plan):
                return None
            return compared(
                one, _Apart(avr.AvrLibrary(one.plan, Path(folder)), one.plan), lanes, samples, name
            )
        target = core(name)
        try:
            chains = toolchains(target)
        except MissingExtra:
            return None
        library = TargetLibrary(target, chains[one.seed % len(chains)], [one.plan], [Path(folder)])
        return compared(one, library, lanes, samples, name)


class _Apart:
    """An AVR's C; its header is compared elsewhere, since a double has 32 bits there."""

    def __init__(self, library: avr.AvrLibrary, plan: Plan):
        self._library, self._scales = library, header_scales(plan)
        self.alignment, self.answers = library.alignment, library.answers

    def scales(self, plan: Plan) -> dict[str, float]:
        return self._scales


def write(plan: Plan, folder: Path) -> None:
    """The C of a plan."""
    write_files(folder, folder_files(plan, controller_text(plan.controller).encode()))


def compared(one: Drawn, library: Runs, lanes: int, samples: int, target: str) -> Seen:
    """Run the C of a plan anywhere and compare it in every bit."""
    begin, plan = time.process_time(), one.plan
    given, share = cases(plan, lanes, samples, one.seed)
    answers = [library.answers(plan, case.scenario) for case in given.cases]
    found = judged(plan, given, answers, library.scales(plan), None, alignment=library.alignment)
    cause = max(plan.error_bound.parts, key=lambda part: part[1], default=("none", 0.0))[0]
    differing, first = found.mismatches + len(found.header), found.first or "".join(found.header)
    return Seen(
        seed=one.seed,
        kind=plan.controller.name.rpartition("_")[0],
        arithmetic=plan.arithmetic,
        kinds=one.kinds,
        target=target,
        samples=found.samples,
        differing=differing,
        within=found.within and share <= 1.0,
        share=share,
        cause=cause,
        seconds=round(time.process_time() - begin, 3),
        first=first,
    )
