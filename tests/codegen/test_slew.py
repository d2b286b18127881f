"""``slew_limit``: the output moves no faster, in C, the reference, the ideal and the simulated loop alike.

Red when the output moves faster than allowed in one of the four.
"""

from dataclasses import replace

import numpy as np
import pytest

import focgen
from focgen.codegen.generate import generate
from focgen.control.controller import Tunable
from focgen.control.files import controller_text, read_controller
from focgen.errors import ControllerError, PlanError
from focgen.loop.plan_stepper import PlanStepper
from focgen.loop.stepper import FloatStepper
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.ideal import ideal
from focgen.plan.scenario import Reset, Scenario, physical_trace, to_raw
from tests.conftest import paper_controller

LIMIT = 10.0  # V/s: 0.1 V a sample
SLOW = replace(paper_controller(40), slew_limit=LIMIT)
ARITHMETICS = ("f64", "f32", "q31", "q15")


def _inputs(count: int = 300) -> Scenario:
    """Large errors that turn round."""
    rng = np.random.default_rng(5)
    ref = np.repeat(rng.uniform(0.0, 0.02, count // 15), 15)[None]
    sched = rng.uniform(0.05, 0.25, ref.shape)
    return Scenario(ref, np.full(ref.shape, 0.01), sched, (Reset(0, 0, 0.01, 0.01, 5.0),))


@pytest.mark.parametrize(
    "tunable, arithmetic",
    [
        pytest.param(tunable, arithmetic, marks=() if turn % 2 == tunable else pytest.mark.long)
        for tunable in (False, True)
        for turn, arithmetic in enumerate(ARITHMETICS)
    ],
)
def test_every_bit_is_the_references(arithmetic, tunable, tmp_path):
    box = Tunable((0.5, 2.0), (0.0, 1.0), (5.0, 10.0))
    generate(replace(SLOW, tunable=box), tmp_path, arithmetic, tunable=tunable, selftest=True)
    result = focgen.verify(tmp_path, samples=2000).targets["host"]
    assert result.first is None and result.sound and result.selftest == 0


@pytest.mark.parametrize("arithmetic", ["q31", "q15"])
def test_one_that_no_change_reaches_fits_its_type(arithmetic, tmp_path):
    """From -10 V to 10 V is more than the type of the integral holds: C took a constant of the other sign."""
    wide = replace(SLOW, ranges=replace(SLOW.ranges, output=(-10.0, 10.0)), slew_limit=1e9)
    made = generate(wide, tmp_path, arithmetic)
    state = made.plan.integrator.state
    assert state.high - state.low > made.plan.integrator.slew == 2 ** (state.bits - 1) - 1
    assert focgen.verify(tmp_path, samples=500).holds


@pytest.mark.parametrize("arithmetic", ["f32", "q15"])
def test_without_its_clamp_the_c_is_found_wrong(arithmetic, tmp_path):
    generate(SLOW, tmp_path, arithmetic)
    source = tmp_path / "spba.c"
    slew = build_plan(SLOW, arithmetic).integrator.slew
    assert source.read_text().count(f"({-slew}),") == 1
    source.write_text(source.read_text().replace(f"({-slew}),", f"({-2 * slew}),"))
    assert not focgen.verify(tmp_path, samples=1000, edited=True).agrees


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_the_output_moves_no_faster(arithmetic):
    """And turns at once when the error does: nothing has wound up."""
    plan, inputs = build_plan(SLOW, arithmetic), _inputs()
    seen = physical_trace(plan, execute(plan, to_raw(plan, inputs))).u[0]
    moves = np.diff(np.concatenate([[5.0], seen]))
    free = build_plan(replace(SLOW, slew_limit=None), arithmetic)
    freely = physical_trace(free, execute(free, to_raw(free, inputs))).u[0]
    most = LIMIT * 0.01 + 2.0 * plan.output.lsb * (arithmetic[0] == "q") + 1e-6
    assert np.abs(moves).max() <= most < 2.0 * np.abs(np.diff(freely)).max()
    assert np.mean(np.abs(moves) > 0.95 * LIMIT * 0.01) > 0.2
    turned = np.full((1, 80), 0.02)
    turned[0, 40:] = 0.0
    away = Scenario(turned, np.full((1, 80), 0.01), np.full((1, 80), 0.1), (Reset(0, 0, 0.01, 0.01, 2.0),))
    u = physical_trace(plan, execute(plan, to_raw(plan, away))).u[0]
    assert u[39] > u[0] and np.all(np.diff(u[40:60]) < 0.0)


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_the_steppers_of_the_loop_are_the_same(arithmetic):
    plan, inputs = build_plan(SLOW, arithmetic), _inputs()
    signals = list(zip(inputs.ref.T, inputs.meas.T, inputs.sched.T))
    exact = ideal(plan.controller, inputs, plan.length).u[0]
    own = physical_trace(plan, execute(plan, to_raw(plan, inputs))).u[0]
    stepped = {
        "plan": (PlanStepper(plan, 1, 5.0), own, 0.0),
        "float": (FloatStepper(SLOW, 300, 1, 5.0, SLOW.length), exact, 1e-11),
    }
    for stepper, expected, within in stepped.values():
        seen = np.array([stepper.step(*one)[0] for one in signals])
        assert np.abs(seen - expected).max() <= within
    assert np.abs(own - exact).max() <= 300 * plan.error_bound.output_per_sample


def test_the_file(tmp_path):
    (tmp_path / "c.toml").write_text(controller_text(SLOW))
    assert read_controller(tmp_path / "c.toml") == SLOW
    assert "slew_limit" not in controller_text(paper_controller(40))
    for text, said in (("slew_limit = 0", "above 0"), ("slew_limit = 1.0\nintegrator = false", "integrator")):
        lines = controller_text(replace(SLOW, slew_limit=None)).replace("integrator = true\n", "", 1)
        (tmp_path / "c.toml").write_text(f"{text}\n{'integrator = true' * ('= 0' in text)}\n{lines}")
        with pytest.raises(ControllerError, match=said):
            read_controller(tmp_path / "c.toml")


def test_one_that_cannot_be_counted_is_refused():
    with pytest.raises(PlanError, match=r"only \d+ counts a sample in q15"):
        build_plan(replace(SLOW, slew_limit=1e-5), "q15")
    with pytest.raises(PlanError, match="only an integrator"):
        build_plan(replace(SLOW, integrator=False), "q31")
