"""Generated controllers under the address and undefined-behaviour sanitisers, on the inputs that take every
sum to its proved worst case, beyond the ranges, at breakpoints, NaN and infinite: no complaint, and the bits
are still the reference's.

Red when a sanitiser complains, or watching changes a bit.
"""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from focgen.plan.execute import execute
from focgen.plan.plan import Plan
from focgen.plan.scenario import Scenario
from focgen.targets.driver import DTYPES, REFUSED, driver, given_width, lane_of
from focgen.verification.scenarios import raw_scenarios
from tests.c_code import compiler, run, tool
from tests.proofs.spread import ARITHMETICS, controllers, generated, remembering, tuned

SANITISERS = """-std=c99 -O1 -g -ffp-contract=off
    -fsanitize=address,undefined -fno-sanitize-recover=all""".split()
LENGTH = 24
CASES = [(name, a) for name in (*controllers(LENGTH), *tuned(LENGTH), *remembering()) for a in ARITHMETICS]

_MAIN = """#include <stdio.h>
#include <stdlib.h>
#include "%(name)s_driver.c"

static void *take(FILE *from, size_t size)
{
    void *const block = malloc(size); /* of its own, so that the sanitiser sees its ends */

    if (fread(block, 1, size, from) != size) exit(3);
    return block;
}

int main(int count, char **files)
{
    FILE *const in = fopen(files[1], "rb"), *const out = fopen(files[2], "wb");
    uint32_t n;

    (void)count;
    while (fread(&n, sizeof n, 1, in) == 1) {
        %(signal)s *const ref = take(in, n * sizeof *ref), *const meas = take(in, n * sizeof *ref);
        %(signal)s *const sched = take(in, n * sizeof *ref);
        uint8_t *const event = take(in, n);
        %(signal)s *const given = take(in, %(width)d * n * sizeof *ref), *const u = malloc(n * sizeof *ref);
        %(increment)s *const d = malloc(n * sizeof *d);
        uint8_t *const flags = malloc(n);

        %(name)s_run(n, ref, meas, sched, event, given, u, d, flags);
        fwrite(u, sizeof *u, n, out);
        fwrite(flags, 1, n, out);
        free(ref), free(meas), free(sched), free(event), free(given), free(u), free(d), free(flags);
    }
    return fclose(out);
}
"""


@dataclass(frozen=True, eq=False)
class Sanitised:
    """A controller's program, and where it is."""

    plan: Plan
    folder: Path

    @classmethod
    def built(cls, command: list[str], folder: Path, name: str, arithmetic: str) -> Sanitised:
        return cls(generated(folder, name, arithmetic, LENGTH), folder).compiled(command)

    def compiled(self, command: list[str]) -> Sanitised:
        plan = self.plan
        (self.folder / f"{plan.name}_driver.c").write_text(driver(plan))
        names = {"name": plan.name, "signal": plan.output.ctype, "increment": plan.increment.ctype,
                 "width": given_width(plan)}  # fmt: skip
        (self.folder / "main.c").write_text(_MAIN % names)
        sources = [self.folder / "main.c", self.folder / f"{plan.name}.c"]
        run(*command, *SANITISERS, *sources, "-o", self.folder / "main.exe")
        return self

    def run(self, scenarios: list[Scenario]) -> str:
        """Feed the scenarios and compare outputs and flags; returns the sanitiser's complaint, or nothing."""
        lanes = [(s, lane) for s in scenarios for lane in range(s.lanes)]
        with open(self.folder / "in.bin", "wb") as out:
            for scenario, lane in lanes:
                out.write(np.uint32(scenario.samples).tobytes())
                out.write(b"".join(a.tobytes() for a in vars(lane_of(self.plan, scenario, lane)).values()))
        command = [str(self.folder / name) for name in ("main.exe", "in.bin", "out.bin")]
        done = subprocess.run(command, capture_output=True, text=True)
        complaint = re.search(r"(runtime error: .*|ERROR: AddressSanitizer: \S+)", done.stderr)
        if done.returncode:
            return complaint[1] if complaint else f"exit status {done.returncode}"
        self.compare(scenarios, (self.folder / "out.bin").read_bytes())
        return ""

    def compare(self, scenarios: list[Scenario], content: bytes) -> None:
        kind, at = np.dtype(DTYPES[self.plan.output.ctype]), 0
        for scenario in scenarios:
            expected = execute(self.plan, scenario)
            for lane in range(scenario.lanes):
                u = np.frombuffer(content, kind, scenario.samples, at)
                at += u.nbytes
                flags = np.frombuffer(content, np.uint8, scenario.samples, at)
                at += flags.nbytes
                assert np.array_equal(u, expected.u[lane])
                assert np.array_equal(flags & (REFUSED - 1), expected.flags[lane])
        assert at == len(content)


def adversarial(plan: Plan) -> list[Scenario]:
    """All that ``verify`` compares; the worst case of every proof among it."""
    return list(raw_scenarios(plan, 4000, 9).values())


def sanitising(name: str) -> list[str]:
    """The command of a compiler whose sanitisers' runtimes are there; skips, by name, where they are not."""
    return compiler(tool(name), *SANITISERS)  # Zig's has none that reports


@pytest.mark.parametrize(
    "cc, cases",
    [
        pytest.param("gcc", CASES[::9], id="gcc"),
        pytest.param("gcc", CASES[3::9] + CASES[6::9], id="gcc, more of a third", marks=pytest.mark.long),
        pytest.param("gcc", CASES[1::3], id="gcc, the second third", marks=pytest.mark.long),
        pytest.param("gcc", CASES[2::3], id="gcc, the last third", marks=pytest.mark.long),
        pytest.param("clang", CASES[::5], id="clang"),
    ],
)
def test_no_input_whatever_is_complained_of(cc, cases, tmp_path):
    command = sanitising(cc)
    for name, arithmetic in cases:
        (tmp_path / f"{name}_{arithmetic}").mkdir()
        one = Sanitised.built(command, tmp_path / f"{name}_{arithmetic}", name, arithmetic)
        assert one.run(adversarial(one.plan)) == "", (name, arithmetic)


_TAP = r"\{(\d+), (\d+), (\d+)\}(?=,\s+/\*)"
_HALF = r"1 << n\) >> 1\)\) >> n;"
FAULTS = {
    "off-by-one tap": ("all.c", _TAP, r"{\1, \2 + 1, \3}", "overflow|out of bounds"),
    "ring wraps with >": ("foc_rt.h", r"now \+ 1u < size", "now < size", "out of bounds|overflow"),
    "product too large": ("foc_rt.h", r"\(int32_t\)weights", "4 * (int32_t)weights", "signed integer"),
    "shift by the width": ("foc_rt.h", _HALF, "1 << n) >> 1)) >> (n + 32);", "shift exponent"),
}


@pytest.mark.parametrize(
    "fault",
    [pytest.param(f, marks=pytest.mark.long if turn % 2 else ()) for turn, f in enumerate(FAULTS)],
)
def test_a_seeded_fault_is_named(fault, tmp_path):
    """The inputs do go where it hurts."""
    command, (file, pattern, by, says) = sanitising("gcc"), FAULTS[fault]
    plan = generated(tmp_path, "all", "q15", LENGTH)
    text, places = re.subn(pattern, by, (tmp_path / file).read_text())
    assert places
    (tmp_path / file).write_text(text)
    assert re.search(says, Sanitised(plan, tmp_path).compiled(command).run(adversarial(plan)))
