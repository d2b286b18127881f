"""A sum of 1024 past samples on a Cortex-M4: generated, beside a ring kept twice with a vector product.

The product has the form that DSP libraries offer; in 16 bits SMLALD takes two products at once.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from focgen.codegen.generate import folder_files
from focgen.codegen.kernels import Kernels
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.plan.plan import Plan
from tests.bench._on_core import CalledCost, called
from tests.bench.kernels import LENGTH, ON_CORE, SUMS, TYPES, controller

CORE = "cortex-m4"
_MIRRORED = """#include "mirrored.h"
static const {x} weights[{n}] = {{{table}}};
static {x} ring[2 * {n}];
static uint32_t now;
{s} total;
__attribute__((noinline)) void step({x} e)
{{
    now = now > 0u ? now - 1u : {n}u - 1u;
    ring[now] = e;
    ring[now + {n}u] = e;
    dot_{arithmetic}(weights, &ring[now], {n}u, &total);
}}
uint32_t called(uint32_t k);
uint32_t called(uint32_t k)
{{
    step(({x})k);
    return (uint32_t)(int32_t)total;
}}
"""


def mirrored(plan: Plan, chain, samples: list[int]) -> CalledCost:
    """A step of the ring kept twice, for these samples, with a plan's weights, newest first."""
    from focgen.targets.cores import core

    arithmetic = plan.arithmetic
    weights = plan.direct.weights
    suffix = "f" if arithmetic == "f32" else ""
    table = ", ".join(f"{w!r}{suffix}" for w in (float(w) if suffix else int(w) for w in weights))
    parts = dict(x=TYPES[arithmetic], s=SUMS[arithmetic].replace("32", "64"), n=len(weights), table=table)
    text = _MIRRORED.format(arithmetic=arithmetic, **parts)
    found = called(core(CORE), chain, text, samples, [Path(__file__).parent / "c"])
    if arithmetic == "q15":
        assert [t & 0xFFFFFFFF for t in np.convolve(samples, weights)[: len(samples)]] == [*found.returned]
    return found


def generated(plan: Plan, chain, target: str | None) -> tuple[float, float]:
    """Mean instructions and cycles of a whole step, once round the ring."""
    from focgen.targets.cores import core
    from focgen.targets.library import TargetLibrary
    from focgen.targets.steps import step_costs

    with tempfile.TemporaryDirectory() as scratch:
        write_files(scratch, folder_files(plan, b"", kernels=Kernels(target)))
        library = TargetLibrary(core(CORE), chain, [plan], [Path(scratch)])
        found = step_costs(library, plan, ON_CORE[1])
        return float(found.instructions.mean()), float(found.cycles.mean())


def rows(chain) -> list[str]:
    """A line for each arithmetic: instructions / cycles."""
    lines = []
    samples = np.random.default_rng(5).integers(0, 1 << 12, 40).tolist()
    for arithmetic in TYPES:
        plan = build_plan(controller(LENGTH), arithmetic, name="ring")
        twice = mirrored(plan, chain, samples)
        costs = [generated(plan, chain, None), generated(plan, chain, CORE)]
        costs.append((twice.instructions, twice.cycles))
        cells = "".join(f"{f'{i:.0f} / {c:.0f}':>18}" for i, c in costs)
        ratios = "".join(f"{c / twice.cycles:>18.2f}" for _, c in costs[:2])
        lines.append(f"  {arithmetic:<6}{cells}{ratios}")
    return lines


def run() -> str:
    """Return the table."""
    try:
        import unicorn  # noqa: F401

        from focgen.targets.cores import core
        from focgen.targets.toolchains import toolchains

        chain = toolchains(core(CORE))[0]
    except ImportError:
        return "Rings on a core: not measured, pip install 'focgen[targets]'"
    heads = "portable", "for the core"
    return "\n".join([
        f"A step over {LENGTH} past samples, {CORE}, {chain.title}: instructions / cycles; and the cycles",
        "over those of the ring kept twice, which has no clamps, flags, integrator or guards.",
        f"  {'':<6}" + "".join(f"{w:>18}" for w in ("portable", "for the core", "kept twice", *heads)),
        *rows(chain),
    ])  # fmt: skip
