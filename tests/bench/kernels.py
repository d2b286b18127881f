"""History sums: ns a tap on this computer beside others; cycles a tap of every core's kernels by the model.

On this computer: the generated step, portable and as it stands in a folder for a core (there the C behind the
core's macros), beside a ring with a modulo for each tap and :func:`scipy.signal.lfilter` over a whole
recording with the same weights, all in one run. On the cores: steps of a controller with one sum.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
from cffi import FFI
from scipy.signal import lfilter

from focgen.codegen.generate import folder_files
from focgen.codegen.kernels import Kernels
from focgen.compiler import compile_shared
from focgen.fractional.transfer import TransferFunction
from focgen.output import write_files
from focgen.plan.build import build_plan
from tests.conftest import paper_controller

LENGTH = 1024
STEPS = 20_000
ON_CORE = (68, 1028)  # steps: once round the ring of 64 and of 1024 past samples
TYPES = {"q15": "int16_t", "q31": "int32_t", "f32": "float"}
SUMS = {"q15": "int32_t", "q31": "int64_t", "f32": "float"}
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off")
CORES = (
    ("cortex-m4", "q15", 1.6),
    ("cortex-m4", "q31", 2.9),
    ("cortex-m4", "f32", 3.1),
    ("cortex-m3", "q15", 3.1),
    ("cortex-m3", "q31", None),
    ("cortex-m0plus", "q15", 5.6),
    ("cortex-m0plus", "q31", 45.0),
)

_NAIVE = """
static {x} history[{n}];
static unsigned newest;

{s} naive_step({x} e)
{{
    {s} sum = 0;
    unsigned i;

    newest = (newest + 1u) % {n}u;
    history[newest] = e;
    for (i = {n}u; i-- > 0u;) {{
        sum += ({s})weights[i] * history[(newest + {n}u - i) % {n}u];
    }}
    return sum;
}}
"""
_RUN = """
#include "{name}.h"

void {name}_many({x} *e, {x} *u, int count)
{{
    static {name}_state s;
    int k;

    {name}_init(&s);
    for (k = 0; k < count; k++) {{
        u[k] = {name}_step(&s, e[k], 0);
    }}
}}
"""


def controller(length: int, transfer=None):
    """The paper's, without its schedule: one sum and an integrator; or with another transfer function."""
    changes = {"transfer": transfer} if transfer else {}
    return paper_controller(length, gain=25.0, **changes)


def best(call, repeats: int = 5) -> float:
    """The least seconds of several calls."""
    found = []
    for _ in range(repeats):
        begin = time.perf_counter()
        call()
        found.append(time.perf_counter() - begin)
    return min(found)


def on_host() -> list[str]:
    """ns a tap on this computer."""
    heads = f"{'generated':>11}{'look-ahead':>12}{'modulo ring':>13}{'lfilter':>9}"
    lines = [f"  {'':<6}{heads}   ns a tap, L = {LENGTH}"]
    for arithmetic in TYPES:
        times = _host(arithmetic)
        lines.append(f"  {arithmetic:<6}{times[0]:>11.3f}{times[1]:>12.3f}{times[2]:>13.3f}{times[3]:>9.3f}")
    return lines


def _host(arithmetic: str) -> tuple[float, ...]:
    x, total = TYPES[arithmetic], SUMS[arithmetic]
    plans = [build_plan(controller(LENGTH), arithmetic, name=name) for name in ("plain", "ahead")]
    with tempfile.TemporaryDirectory() as scratch:
        ffi, library = _compiled(plans, arithmetic, Path(scratch))
    e = np.random.default_rng(1).integers(0, 2, STEPS).astype(_dtype(x))
    u, sums = np.empty_like(e), np.empty(STEPS, _dtype(total))

    def many(name: str, out: np.ndarray, ctype: str):
        arrays = ffi.cast(f"{x} *", e.ctypes.data), ffi.cast(f"{ctype} *", out.ctypes.data)
        return lambda: getattr(library, f"{name}_many")(*arrays, STEPS)

    values = np.array(plans[0].direct.values, np.float32 if arithmetic == "f32" else np.float64)
    whole = e.astype(values.dtype)
    calls = [many("plain", u, x), many("ahead", u, x), many("naive", sums, total)]
    calls.append(lambda: lfilter(values, [values.dtype.type(1)], whole))
    return tuple(best(call) / STEPS / (LENGTH + 1) * 1e9 for call in calls)


def _dtype(ctype: str):
    return np.float32 if ctype == "float" else ctype.removesuffix("_t")


def _compiled(plans, arithmetic: str, folder: Path):
    """The portable controller, the one for a core, and the naive sum, as one library."""
    x, total, weights = TYPES[arithmetic], SUMS[arithmetic], plans[0].direct.weights
    ffi = FFI()
    for plan, target in zip(plans, (None, "cortex-m4")):
        write_files(folder, folder_files(plan, b"", kernels=Kernels(target)))
        (folder / f"{plan.name}_many.c").write_text(_RUN.format(name=plan.name, x=x))
        ffi.cdef(f"void {plan.name}_many({x} *, {x} *, int);")
    table = ", ".join(map(repr, weights))
    (folder / "naive_many.c").write_text(
        f"#include <stdint.h>\nstatic const {x} weights[{len(weights)}] = {{{table}}};\n"
        + _NAIVE.format(x=x, s=total, n=len(weights))
        + f"void naive_many({x} *e, {total} *u, int count)\n"
        + "{ int k; for (k = 0; k < count; k++) u[k] = naive_step(e[k]); }\n"
    )
    ffi.cdef(f"void naive_many({x} *, {total} *, int);")
    sources = [*folder.glob("*_many.c"), *(folder / f"{plan.name}.c" for plan in plans)]
    compile_shared(sources, folder / "all.so", FLAGS, [folder])
    return ffi, ffi.dlopen(str(folder / "all.so"))


def costs(library, plan) -> np.ndarray:
    """Cycles of every step, once round the ring."""
    from focgen.targets.steps import step_costs

    return step_costs(library, plan, ON_CORE[plan.length > 64]).cycles


def on_cores() -> list[str]:
    """Cycles a tap by the timing model: the slope from L = 64, and the whole sum at L = 1024."""
    from focgen.targets.cores import core
    from focgen.targets.library import TargetLibrary
    from focgen.targets.toolchains import toolchains

    one_tap = TransferFunction([(1.0, 0.0)])
    lines = [f"  {'':<22}{'compiler':<19}{'slope':>7}{'whole':>7}{'worst/mean':>12}{'reach':>7}"]
    for name, arithmetic, reach in CORES:
        plans = [build_plan(controller(n), arithmetic, name=f"l{n}") for n in (64, LENGTH)]
        plans.append(build_plan(controller(1, one_tap), arithmetic, name="none"))
        with tempfile.TemporaryDirectory() as scratch:
            for plan in plans:
                write_files(scratch, folder_files(plan, b"", kernels=Kernels(name)))
            for chain in toolchains(core(name)):
                library = TargetLibrary(core(name), chain, plans, [Path(scratch)] * 3)
                short, long, none = (costs(library, plan) for plan in plans)
                slope = (long.mean() - short.mean()) / (LENGTH - 64)
                whole = (long.mean() - none.mean()) / (LENGTH + 1)
                worst = long.max() / long.mean()
                lines.append(f"  {name:<14}{arithmetic:<8}{chain.name:<19}{slope:>7.2f}{whole:>7.2f}"
                             f"{worst:>12.2f}" + (f"{reach:>7.1f}" if reach else ""))  # fmt: skip
    return lines


def run() -> str:
    """Return the tables."""
    lines = ["History sums on this computer.", *on_host()]
    try:
        import unicorn  # noqa: F401
        import ziglang  # noqa: F401
    except ImportError:
        return "\n".join([*lines, "Cores: not measured, pip install 'focgen[targets]'"])
    return "\n".join([*lines, "History sums on cores: cycles a tap by Arm's published timings.", *on_cores()])
