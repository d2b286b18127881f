"""``make fuzz-c``: sequences of init, step, reset and track, led by coverage, under both sanitisers.

After every call an oracle looks at the whole state: slots inside their rings, every member within what
:func:`tests.proofs.harness.reachable` says, the output within its limits, nothing in a floating state that is
NaN or infinite, only flags that exist.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from focgen.codegen.kernels import PORTABLE, Kernels
from focgen.codegen.manifest import flags
from focgen.codegen.state import members
from focgen.plan.plan import Plan
from tests.c_code import lacking
from tests.proofs.harness import inside, reachable
from tests.proofs.spread import ARITHMETICS, KERNELS, controllers, generated, remembering, tuned

FLAGS = """-std=c99 -O1 -g -ffp-contract=off
    -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all""".split()
_SHORT, _AHEAD = 11, 27  # past samples: few, so that rings wrap often; as few as looking ahead takes
_ALL = (*controllers(_SHORT), *tuned(_SHORT), *remembering())
CASES = [
    *((name, a, _SHORT, PORTABLE) for name in _ALL for a in ARITHMETICS),
    *(("all", a, _AHEAD, Kernels(target)) for target, a in KERNELS),
]
"""What is fuzzed: a controller, its arithmetic and length, and its form of the sums."""
_EMPTY = """#include <stddef.h>
#include <stdint.h>
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) { return data && size > 1000u ? 1 : 0; }
"""
_DEFAULT = 600.0  # seconds in all


@dataclass(frozen=True)
class Fuzzed:
    """One target: how many sequences were run, how many edges of the code they covered; ``found``: what the
    fuzzer said of a fault, empty where there is none.
    """

    name: str
    executions: int
    coverage: int
    found: str


def target(plan: Plan, kernels: Kernels = PORTABLE) -> str:
    """The C of a target for libFuzzer."""
    name, signal = plan.name, plan.output.ctype
    sched = ", argument(&at, end)" if plan.schedule else ""
    return _TARGET % {
        "name": name,
        "signal": signal,
        "sched": sched,
        "oracle": "\n".join(_oracle(plan, kernels)),
        "tune": _TUNE % {"name": name, "NAME": name.upper()} if plan.tuning else "",
        "low": "s.u_min" if plan.tuning else f"{name}_U_MIN",
        "high": "s.u_max" if plan.tuning else f"{name}_U_MAX",
        "flags": sum(flags(plan).values()),
    }


def _oracle(plan: Plan, kernels: Kernels) -> list[str]:
    ranges, lines = reachable(plan, kernels), []
    for m in members(plan, kernels):
        asked = []
        if ranges.get(m.name):
            asked.append(inside(m, ranges[m.name]))
        if m.ctype in ("float", "double"):
            asked.append("$ - $ == 0")  # neither NaN nor infinite
        slots = f"for (i = 0; i < {m.array}; i++) " if m.array else ""
        place = f"s.{m.name}[i]" if m.array else f"s.{m.name}"
        lines += [f"    {slots}if (!({one.replace('$', place)})) __builtin_trap();" for one in asked]
    return lines


_TARGET = """#include <stddef.h>
#include <string.h>
#include "%(name)s.c"

static %(name)s_state s;

static %(signal)s argument(const uint8_t **at, const uint8_t *end)
{
    %(signal)s value = 0;
    const size_t left = (size_t)(end - *at);

    memcpy(&value, *at, left < sizeof value ? left : sizeof value);
    *at += left < sizeof value ? left : sizeof value;
    return value;
}

static void look(void)
{
    unsigned i;

    (void)i;
%(oracle)s
    if ((s.flags & ~%(flags)du) != 0u) __builtin_trap();
}

int LLVMFuzzerTestOneInput(const uint8_t *at, size_t size)
{
    const uint8_t *const end = at + size;
    %(signal)s ref = 0, meas = 0;

    %(name)s_init(&s);
    while (at < end) {
        const uint8_t what = *at++;

%(tune)s        if ((what & 7u) < 5u) {
            unsigned n = 1u + (what >> 4);
            %(signal)s u;

            if ((what & 1u) == 0u) ref = argument(&at, end);
            if ((what & 2u) == 0u) meas = argument(&at, end);
            for (; n > 0u; n--) {
                u = %(name)s_step(&s, ref, meas%(sched)s);
                if (!(u >= %(low)s && u <= %(high)s)) __builtin_trap();
                look();
            }
        } else if ((what & 7u) == 5u) {
            const %(signal)s first = argument(&at, end), second = argument(&at, end);

            %(name)s_reset(&s, first, second, argument(&at, end));
        } else if ((what & 7u) == 6u) {
            %(name)s_track(&s, argument(&at, end));
        } else {
            %(name)s_init(&s);
        }
        look();
    }
    return 0;
}
"""


_TUNE = """        if ((what & 15u) == 12u) {
            %(name)s_params p;
            unsigned i;

            %(name)s_default(&p);
            for (i = 0; i < %(NAME)s_GAINS; i++) {
                const unsigned corner = what >> i & 16u;

                p.gain[i] = corner ? %(NAME)s_GAIN_MIN : %(NAME)s_GAIN_MAX;
                if ((what & 128u) != 0u) p.gain[i] = argument(&at, end);
            }
            if ((what & 16u) != 0u) p.u_min = %(NAME)s_U_MIN_HIGHEST;
            if ((what & 32u) != 0u) p.u_max = %(NAME)s_U_MAX_LOWEST;
            if ((what & 64u) != 0u) p.u_max = argument(&at, end);
            if (%(name)s_check(&p) != %(name)s_tune(&s, &p)) __builtin_trap();
            look();
            continue;
        }
"""


def missing() -> str:
    """What fuzzing lacks here: clang, its libFuzzer, the sanitisers' runtimes; empty where nothing."""
    if not shutil.which("clang"):
        return "clang is not on this machine (Debian: apt install clang)"
    reason = lacking(("clang",), tuple(FLAGS), _EMPTY, "-runs=1")
    where = "not on this machine (Debian: apt install libclang-rt-dev)"
    return reason and f"clang's libFuzzer or its sanitisers' runtimes are {where}: {reason}"


def fuzz(plan: Plan, folder: Path, seconds: float, seed: int = 1, kernels: Kernels = PORTABLE) -> Fuzzed:
    """Build the target of a plan whose C is in ``folder`` and run it for so long."""
    (folder / "target.c").write_text(target(plan, kernels))
    program = folder / "target.exe"
    subprocess.run(["clang", *FLAGS, str(folder / "target.c"), "-o", str(program)], check=True, cwd=folder)
    time = f"-max_total_time={max(1, round(seconds))}"
    options = [time, "-max_len=600", "-print_final_stats=1", f"-seed={seed}"]
    corpus = folder / "corpus"
    corpus.mkdir(exist_ok=True)
    done = subprocess.run([str(program), *options, str(corpus)], capture_output=True, text=True, cwd=folder)
    said = done.stderr
    executions = re.search(r"number_of_executed_units: (\d+)", said) or re.search(r"#(\d+)", said)
    coverage = re.findall(r"cov: (\d+)", said)
    fault = re.search(r"(runtime error: .*|ERROR: \S+: .*|SUMMARY: .*)", said)
    found = (fault[1] if fault else f"exit status {done.returncode}") if done.returncode else ""
    name = f"{plan.name} {plan.arithmetic}" + (f", C for {kernels.target}" if kernels.target else "")
    return Fuzzed(name, int(executions[1]) if executions else 0, int(coverage[-1]) if coverage else 0, found)


def main() -> int:
    """Share the time among all controllers in all arithmetics; 1 where a fault was found."""
    parser = argparse.ArgumentParser(prog="python -m tests.proofs.fuzz", description=main.__doc__)
    parser.add_argument("--seconds", type=float, default=_DEFAULT, help="in all (default: 600)")
    seconds = parser.parse_args().seconds
    if lacks := missing():
        print(f"nothing is fuzzed: {lacks}")
        return 1
    results = []
    for name, arithmetic, length, kernels in CASES:
        with tempfile.TemporaryDirectory(prefix="focgen-fuzz-") as scratch:
            plan = generated(Path(scratch), name, arithmetic, length, kernels)
            one = fuzz(plan, Path(scratch), seconds / len(CASES), kernels=kernels)
        results.append(one)
        said = one.found or "clean"
        print(f"{one.name:<30} {one.executions:>10} sequences, {one.coverage:>4} edges: {said}")
        sys.stdout.flush()
    print(f"{sum(r.executions for r in results)} sequences in all")
    return int(any(r.found for r in results))


if __name__ == "__main__":
    sys.exit(main())
