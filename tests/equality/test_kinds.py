"""As few controllers as take every turn of the templates: their C is the reference's, in every bit.

Red when a line of a template is wrong, or a template can take a turn that none of these controllers takes.
"""

from __future__ import annotations

import jinja2
import pytest
from jinja2 import nodes

from focgen.codegen import generate, render
from focgen.codegen.kernels import Kernels
from focgen.control.files import controller_text
from focgen.output import write_files
from focgen.verification.compare import judged
from focgen.verification.host import Library
from tests.equality.drawn import drawn
from tests.equality.one import cases

M4, M0 = "cortex-m4", "cortex-m0plus"
SEEDS = {
    35: None, 68: None, 47: M0, 138: None, 33: None, 149: None, 123: None, 90: M4, 20: M4, 13: None, 79: None,
    82: M4, 61: None, 70: None, 132: None, 122: None, 30: None, 8: None, 9: None, 28: None, 118: None,
    108: None, 81: None, 62: None, 97: None, 152: None,
}  # fmt: skip
"""Seeds of controllers, and the core whose form their sums take (in C, on this computer)."""


def printed(seed: int) -> tuple:
    """A seed's plan, its kernels and its folder."""
    plan, kernels = drawn(seed).plan, Kernels(SEEDS[seed])
    text = controller_text(plan.controller).encode()
    return plan, kernels, generate.folder_files(plan, text, selftest=True, kernels=kernels)


@pytest.mark.parametrize(
    "seed", [pytest.param(s, marks=pytest.mark.long if turn % 2 else ()) for turn, s in enumerate(SEEDS)]
)
def test_every_bit_is_the_references(seed, tmp_path):
    """Output, increment, flags, state after each run, macros, and what the self-test says."""
    plan, kernels, files = printed(seed)
    write_files(tmp_path, files)
    library = Library([plan], [tmp_path], ("-std=c99", "-O1", "-ffp-contract=off"), selftest=True)
    given, share = cases(plan, 8, 120, seed)
    answers = [library.answers(plan, case.scenario) for case in given.cases]
    found = judged(plan, given, answers, library.scales(plan), None, kernels, library.alignment)
    assert found.mismatches == 0 and not found.header, found.first
    assert found.within and share <= 1.0 and library.selftest(plan) == 0


PRINTED = ("controller.c", "controller.h", "memory_exponential.c", "setpoint.c", "tuned.c", "selftest.c")
NEVER = ("{% if conversions %}", "{% if aliases %}", "if feedback.about }}")
"""False by an option or a name that no seed has (``--no-float``, a name in capitals); and a comment."""


def test_every_turn_of_the_templates_is_taken(monkeypatch):
    """A turn that is not taken above could hold anything."""
    taken: set[tuple[str, bool]] = set()
    noting = noting_environment(taken)
    monkeypatch.setattr(render, "_environment", lambda: noting)
    for seed in SEEDS:
        printed(seed)
    asked = {place for place, _ in taken if place.startswith(PRINTED)}
    missed = {(place, way) for place in asked for way in (True, False) if (place, way) not in taken}
    wrong = {one for one in missed if not one[0].endswith(NEVER)}
    assert len(asked) > 100 and wrong == set(), sorted(wrong)


def noting_environment(taken: set[tuple[str, bool]]) -> jinja2.Environment:
    """That of the package, in which each condition notes its place and which way it went."""

    def went_(place: str, value: object) -> object:
        taken.add((place, bool(value)))
        return value

    class Noting(jinja2.Environment):
        def _parse(self, source, name, filename):
            tree = super()._parse(source, name, filename)
            lines = source.splitlines()
            for node in tree.find_all((nodes.If, nodes.CondExpr)):
                place = f"{name}:{node.lineno} {lines[node.lineno - 1].strip()}"
                asked = [nodes.Const(place), node.test]
                node.test = nodes.Call(nodes.Name("went_", "load"), asked, [], None, None, lineno=node.lineno)
            return tree

    own = render._environment()
    options = {"undefined": own.undefined, "keep_trailing_newline": True, "autoescape": False}
    noting = Noting(loader=own.loader, trim_blocks=True, lstrip_blocks=True, **options)
    noting.filters.update(own.filters)
    noting.globals["went_"] = went_
    return noting
