"""Every core's own kernels, emulated: the bits of the reference, aligned accesses, a step without bursts.

Red when a core's kernel gives another bit, an access that is not aligned, or a burst.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focgen.codegen.generate import folder_files
from focgen.codegen.kernels import Kernels
from focgen.control.files import controller_text
from focgen.errors import PlanError
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.scenario import Reset, to_raw
from focgen.targets import toolchains
from focgen.targets.cores import CORES, core
from focgen.targets.emulator import TargetFault
from focgen.targets.library import TargetLibrary
from focgen.targets.steps import step_costs
from focgen.verification.compare import compare
from tests.conftest import paper_controller
from tests.controllers import random_controller, random_scenario

pytest.importorskip("unicorn")
pytest.importorskip("ziglang")

NAMES = [one.name for one in CORES]
CHAINS = ("zig cc", "arm-none-eabi-gcc")
OWN = [(name, a) for name in NAMES for a in ("q15", "q31", "f32") if Kernels(name).own(a)]
ALIKE = {("cortex-m4", "q31"), *(("cortex-m7", a) for a in ("q15", "q31", "f32"))}
"""Whose kernel is, text for text, that of a smaller core: the Cortex-M3's q31, the Cortex-M4's."""


def chain_of(name: str, compiler: str):
    """A core's cross compiler; skips the test, saying so, where it is not there."""
    found = [chain for chain in toolchains.toolchains(core(name)) if chain.name == compiler]
    if not found:
        pytest.skip(f"{compiler} is not installed for {name}")
    return found[0]


def on_core(name: str, chain, plans, folder) -> TargetLibrary:
    for plan in plans:
        kernels = Kernels(name)
        write_files(folder, folder_files(plan, controller_text(plan.controller).encode(), kernels=kernels))
    library = TargetLibrary(core(name), chain, plans, [folder] * len(plans))
    assert library.illegal() == ()
    return library


def planned(name: str, arithmetic: str, seeds, lengths):
    """Random controllers of given lengths whose sums take the core's own form."""
    found = []
    for seed, length in zip(seeds, lengths):
        controller = replace(random_controller(seed, 300), length=length)
        try:
            plan = build_plan(controller, arithmetic, name=f"t{seed}")
        except PlanError:
            continue
        if Kernels(name).headers(plan):
            found.append(plan)
    return found


def test_whose_kernel_is_a_smaller_cores():
    """What is left to the long suite below has been tried on the core that it is written for."""
    for name, arithmetic in ALIKE:
        smaller = "cortex-m3" if arithmetic == "q31" else "cortex-m4"
        (plan,) = planned(name, arithmetic, (0,), (63,))
        own, other = (folder_files(plan, b"", kernels=Kernels(core)) for core in (name, smaller))
        headers = {file for file in own if file.startswith("foc_m")}
        assert headers and all(own[file] == other[file] for file in headers)


SEEDS, LENGTHS = (0, 1, 14, 25, 36), (63, 130, 23, 26, 97)


@pytest.mark.parametrize("compiler", CHAINS)
@pytest.mark.parametrize(
    ("name", "arithmetic", "count"),
    [
        *((*one, 2) for one in OWN if one not in ALIKE),
        *(pytest.param(*one, len(SEEDS), marks=pytest.mark.long) for one in OWN),
    ],
)
def test_the_bits_of_the_reference(name, arithmetic, count, compiler, tmp_path):
    """Remainders of every unrolled loop, both ends of the ring, resets and tracks; here two lengths of the
    five."""
    chain = chain_of(name, compiler)
    plans = planned(name, arithmetic, SEEDS, LENGTHS)[:count]
    assert len(plans) >= min(count, 3)
    library = on_core(name, chain, plans, tmp_path)
    for plan in plans:
        agrees(plan, library, seed=4)


def agrees(plan, library, seed: int) -> None:
    """Two runs of 300 samples, resets and tracks at any step of a group, in u, d and flags."""
    physical = random_scenario(plan.controller, seed, lanes=2, samples=300)
    many = [Reset(lane, at, *physical.ref[lane, :2], physical.ref[lane, 2]) for lane, at in RESETS]
    scenario = to_raw(plan, replace(physical, resets=tuple(many)))
    seen, expected = library.run(plan, scenario), execute(plan, scenario)
    parts = ("u", "flags", "d") if plan.integrator else ("u", "flags")
    for part in parts:
        same = np.array_equal(getattr(seen, part), getattr(expected, part))
        assert same, f"{plan.name}, {plan.length}: {part}"


RESETS = [(0, 133), (0, 134), (0, 171), (0, 240), (1, 7), (1, 150), (1, 213)]


@pytest.mark.long
@pytest.mark.parametrize("compiler", CHAINS)
@pytest.mark.parametrize(("name", "arithmetic"), OWN)
def test_many_controllers_on_the_core(name, arithmetic, compiler, tmp_path):
    chain = chain_of(name, compiler)
    seeds, lengths = range(40), [40 + 7 * i for i in range(40)]
    plans = planned(name, arithmetic, seeds, lengths)
    library = on_core(name, chain, plans, tmp_path)
    for plan in plans:
        result = compare(plan, library, 4000, seed=5, kernels=Kernels(name))
        assert result.mismatches == 0, f"{plan.name}, {plan.length}: {result.first}"


REACH = {  # cycles of the model a tap, the loop included
    ("cortex-m4", "q15"): 1.6,
    ("cortex-m4", "q31"): 2.9,
    ("cortex-m4", "f32"): 3.1,
    ("cortex-m3", "q15"): 3.1,
    ("cortex-m0plus", "q15"): 5.6,
    ("cortex-m0plus", "q31"): 45.0,
}


@pytest.mark.parametrize(
    ("name", "arithmetic"),
    [pytest.param(*one, marks=pytest.mark.long if turn % 2 else ()) for turn, one in enumerate(REACH)],
)
def test_the_step_is_flat_and_near_the_limit(name, arithmetic, tmp_path):
    """One more past sample costs no more than that, and no step 1.3 times the mean, at L = 1024."""
    plans = [build_plan(paper_controller(length), arithmetic, name=f"l{length}") for length in (64, 1024)]
    library = on_core(name, chain_of(name, "zig cc"), plans, tmp_path)
    short, long = (step_costs(library, plan, 12) for plan in plans)
    assert long.cycles.max() <= 1.3 * long.cycles.mean()
    assert (long.cycles.mean() - short.cycles.mean()) / 960 <= REACH[name, arithmetic]


FAULTS = {  # in the assembly of each core: what is changed
    ("cortex-m4", "q15"): ("smladx r5, r0, r9, r5", "smlad r5, r0, r9, r5"),
    ("cortex-m4", "q31"): ("beq 2f", "beq 1f"),
    ("cortex-m4", "f32"): ("vmov s10, s14", "vmov s10, s13"),
    ("cortex-m3", "q15"): ("and r12, r12, #7", "and r12, r12, #3"),
    ("cortex-m0plus", "q15"): ("movs r6, #8", "movs r6, #4"),
    ("cortex-m0plus", "q31"): ("uxth r7, r3", "sxth r7, r3"),
}


@pytest.mark.parametrize(
    ("name", "arithmetic"),
    [pytest.param(*one, marks=() if turn % 2 else pytest.mark.long) for turn, one in enumerate(FAULTS)],
)
def test_a_fault_in_the_assembly_is_seen(name, arithmetic, tmp_path):
    old, new = FAULTS[name, arithmetic]
    plan = build_plan(paper_controller(78), arithmetic, name="k")
    write_files(tmp_path, folder_files(plan, b"", kernels=Kernels(name)))
    changed = 0
    for file in tmp_path.glob("foc_m*.h"):
        text = file.read_text()
        changed += text.count(old)
        file.write_text(text.replace(old, new))
    assert changed
    library = TargetLibrary(core(name), chain_of(name, "zig cc"), [plan], [tmp_path])
    with pytest.raises((AssertionError, TargetFault)):
        agrees(plan, library, seed=0)
