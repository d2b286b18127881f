"""What C leaves in its state is what the reference leaves, member by member, whatever the outputs say.

Red when a member of a state differs while outputs agree.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from focgen.codegen.generate import folder_files, generate
from focgen.codegen.kernels import Kernels
from focgen.codegen.state import members
from focgen.control.files import controller_text
from focgen.errors import PlanError
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.targets import avr
from focgen.verification.compare import answered, cases_of, judged
from focgen.verification.folder import read_folder
from focgen.verification.host import Library
from focgen.verification.verify import verify
from tests.controllers import random_controller
from tests.proofs.spread import ARITHMETICS, controllers

QUICKLY = ("-std=c99", "-O1", "-ffp-contract=off")  # compiled
FORMS = ((None, "short"), ("cortex-m4", "short"), (None, "exponential"))
MEMBERS = {"numerator_ahead", "denominator_ahead", "carry", "inner", "resting", "output", "denominator_means"}


@pytest.mark.parametrize("forms", [1, pytest.param(3, marks=pytest.mark.long)])
def test_random_controllers_leave_the_state_of_the_reference(forms, tmp_path):
    """Every form of the sums, every kind of controller, of which each takes one form here; on this computer,
    so what the sums do in C.
    """
    plans = {}
    for seed in range(3000, 3010):
        for form, (target, memory) in enumerate(FORMS):
            arithmetic, name = ARITHMETICS[(seed + form) % 4], f"c{seed}_{form}"
            if (seed + form + 1) % len(FORMS) >= forms:
                continue
            try:
                plan = build_plan(random_controller(seed, 70), arithmetic, name=name, memory=memory)
            except PlanError:
                continue
            text, plans[name] = controller_text(plan.controller).encode(), (plan, Kernels(target))
            write_files(tmp_path, folder_files(plan, text, kernels=Kernels(target)))
    library = Library([plan for plan, _ in plans.values()], [tmp_path] * len(plans), QUICKLY)
    for name, (plan, kernels) in plans.items():
        cases = cases_of(plan, 200, 7, 300)
        seen, scales = answered(library, plan, cases)
        result = judged(plan, cases, seen, scales, None, kernels, library.alignment)
        assert result.sound and result.states >= 8, f"{name}: {result.first}"
    assert len(plans) > 8 * forms
    assert MEMBERS <= {m.name for plan, kernels in plans.values() for m in members(plan, kernels)}


OLDEST = "[(s->{0}_now + 1u) % 31u]"  # the slot that the next sample takes
AHEAD = "((int32_t *)s->numerator_ahead)[s->error_now & 3u]"  # a sum that has been made use of
MUTATIONS = {  # every output stays right: what is changed is not looked at any more
    "resting": ("inverse", "q15", None, r"s->starting = 0;", "s->starting = 0; s->resting ^= 1;"),
    "error": (
        "filter",
        "q31",
        None,
        r"    return v;",
        f"    s->error{OLDEST.format('error')} = 1; return v;",
    ),
    "filtered": (
        "all",
        "f64",
        None,
        r"    return v;",
        f"    s->filtered{OLDEST.format('filtered')} += 1; return v;",
    ),
    "flags": ("filter", "f32", None, r"return s->flags;", "return s->flags & 31u;"),
    "numerator_ahead": ("inverse", "q15", "cortex-m4", r"    return sum;", f"    {AHEAD} ^= 1; return sum;"),
}


def mutated(folder: Path, member: str) -> Path:
    """A folder with a change that only its state shows."""
    name, arithmetic, target, pattern, by = MUTATIONS[member]
    generate(controllers(30)[name], folder, arithmetic, target=target)
    path = folder / f"{name}.c"
    text, places = re.subn(pattern, by, path.read_text())
    if member == "flags":
        text = text.replace("s->flags = filter_ends(u);", "s->flags = filter_ends(u) | 64u;")
    assert places
    path.write_text(text)
    return folder


@pytest.mark.parametrize(
    "member",
    [pytest.param(m, marks=pytest.mark.long if turn % 2 else ()) for turn, m in enumerate(MUTATIONS)],
)
def test_a_member_that_no_output_shows(member, tmp_path):
    found = verify(mutated(tmp_path, member), 300, edited=True).targets["host"]
    assert found.mismatches > 0 and not found.sound
    assert re.search(rf"after run \d+: state\.{member}\b.* is .*, the reference's ", found.first), found.first


def test_it_shows_on_an_emulated_core_and_on_an_avr(tmp_path):
    pytest.importorskip("unicorn")
    folder = mutated(tmp_path, "resting")
    targets = ["cortex-m3"] + ["avr"] * (avr.missing(read_folder(folder).plan) is None)
    for result in verify(folder, 200, target=targets, edited=True).targets.values():
        assert result.mismatches > 0 and "state.resting" in result.first, result.first
