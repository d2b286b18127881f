"""What comments and defines of the C say of a controller.

Red when a formula has a factor of one, or an end that no count meets is said to be met.
"""

from __future__ import annotations

import pytest

from focgen.codegen.formulas import step_formulas, weights_about
from focgen.codegen.header import header_context
from focgen.control.controller import ControllerRanges
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.canonical import realise
from tests.controllers import simple


def test_factors_of_one_are_left_out():
    pi = TransferFunction([(1.0, 0.0), (1.0, -1.0)])
    for integrator, last in ((True, "d = v h/2"), (False, "u = v, clamped to -10 ... 10")):
        lines = step_formulas(build_plan(simple(pi, integrator=integrator), "f64"))
        assert lines[:3] == ["e = ref - meas", "z = 1/s e, a trapezoid, clamped", "v = e + z"]
        assert lines[3] == last
    lines = step_formulas(build_plan(simple(TransferFunction([(2.0, 0.0)]), gain=3.0), "f64"))
    assert lines[1:] == ["v = (2) e", "u = 3 v, clamped to -10 ... 10"]


def test_the_taps_of_an_exponential_memory_have_their_formula():
    plan = build_plan(simple(TransferFunction([(1.0, 0.5)]), memory="exponential"), "f64")
    about = " ".join(weights_about(plan, realise(plan.controller).direct, plan.direct, "Numerator"))
    assert "c h^-b (1 - 1/z)^n with n = b rounded up" in about


@pytest.mark.parametrize(("end", "said"), [(12.7, "the count nearest to 12.7"), (12.5, "12.5")])
def test_an_end_between_two_counts_says_so(end, said):
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-12.5, end))
    transfer = TransferFunction([(1.0, 0.0)])
    for arithmetic, about in (("q15", said), ("f32", f"{end}")):
        plan = build_plan(simple(transfer, integrator=True, ranges=ranges), arithmetic)
        limits = {d.name: d.about for d in header_context(plan, "a", "0" * 64).limits}
        assert limits["U_MAX"] == about and limits["U_MIN"] == "-12.5"
