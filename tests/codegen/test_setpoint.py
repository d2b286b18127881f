"""``setpoint_filter``: a lag ahead of the error, in C, reference, ideal and loop alike.

Red when one of the four filters otherwise than the others, or a constant does not pass exactly.
"""

import functools
import subprocess
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
from focgen.plan.execute import Run, execute
from focgen.plan.ideal import ideal
from focgen.plan.scenario import Reset, Scenario, Track, physical_trace, to_raw
from focgen.plan.setpoint import Aim, set_point_error
from focgen.plan.values import kind_of
from tests.c_code import EXACT, SANITISERS, compiler
from tests.conftest import paper_controller

SECONDS = 0.2  # 20 samples
SOFT = replace(paper_controller(40), setpoint_filter=SECONDS)
MODES = replace(SOFT, memory="exponential", tolerance=1e-2, horizon=2000)
ARITHMETICS = ("f64", "f32", "q31", "q15")


def _inputs(count: int = 300) -> Scenario:
    """Set points that jump; the reset is at the first."""
    rng = np.random.default_rng(7)
    ref = np.repeat(rng.uniform(0.0, 0.02, count // 15), 15)[None]
    sched = rng.uniform(0.05, 0.25, ref.shape)
    meas = rng.uniform(0.0, 0.02, ref.shape)
    return Scenario(ref, meas, sched, (Reset(0, 0, 0.005, 0.01, 5.0), Reset(0, 170, 0.019, 0.01, 2.0)))


@functools.cache
def _plan(arithmetic: str, seconds: float):
    return build_plan(replace(SOFT, setpoint_filter=seconds), arithmetic)


def _aimed(plan, ref, start: float) -> np.ndarray:
    """y of raw references of one lane, by the filter alone."""
    aim = Aim(plan, kind_of(plan.error), 1)
    aim.settle(0, start)
    return np.array([aim.step(np.array([r], kind_of(plan.error)))[0] for r in ref])


@pytest.mark.parametrize(
    ("arithmetic", "controller", "tunable"),
    [
        ("f64", SOFT, False),
        ("f32", MODES, True),
        ("q31", MODES, False),
        pytest.param("q15", SOFT, True, marks=pytest.mark.long),
        *(
            pytest.param(a, c, t, marks=pytest.mark.long)
            for a in ARITHMETICS
            for c in (SOFT, MODES)
            for t in (0, 1)
        ),
    ],
)
def test_every_bit_is_the_references(arithmetic, controller, tunable, tmp_path):
    box = Tunable((0.5, 2.0), (0.0, 1.0), (5.0, 10.0))
    generate(replace(controller, tunable=box), tmp_path, arithmetic, tunable=bool(tunable), selftest=True)
    result = focgen.verify(tmp_path, samples=1000).targets["host"]
    assert result.first is None and result.sound and result.selftest == 0


@pytest.mark.parametrize(
    ("arithmetic", "right", "wrong"),
    [
        ("q15", "before + SPBA", "s->set_point + 1 + SPBA"),
        ("f32", "aim_at(s, known ? ref", "aim_at(s, known ? meas"),
    ],
)
def test_an_edited_filter_is_found_wrong(arithmetic, right, wrong, tmp_path):
    generate(SOFT, tmp_path, arithmetic)
    source = tmp_path / "spba.c"
    assert source.read_text().count(right) == 1
    source.write_text(source.read_text().replace(right, wrong))
    assert not focgen.verify(tmp_path, samples=500, edited=True).agrees


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize("seconds", [0.003, 0.2, 2.0])
def test_a_constant_is_reached_and_held_in_every_bit(arithmetic, seconds):
    """From either side, without overshoot, about when what is missing is less than half its last digit."""
    plan = _plan(arithmetic, seconds)
    low, high = plan.reference.low, plan.reference.high
    bits = {"q15": 15, "q31": 31, "f32": 25, "f64": 54}[arithmetic]
    settled = int(100.0 * seconds * (bits + 2.0) * np.log(2.0)) + 2
    kind = kind_of(plan.error)
    for start, goal in ((low, high), (high, kind(high) / 3)):
        seen = _aimed(plan, np.full(settled + 20, kind(goal)), start)
        assert np.all(seen[settled:] == kind(goal))
        assert np.all(np.diff(seen.astype(float)) * np.sign(float(goal) - float(start)) >= 0.0)
        assert seen[0] != kind(goal)


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_zero_is_reached_too(arithmetic):
    """It has no last digit in floating point: there the lag ends where it no longer counts."""
    seen = _aimed(_plan(arithmetic, 0.02), np.zeros(2000), _plan(arithmetic, 0.02).reference.high)
    assert seen[0] > 0 and np.all(seen[1500:] == 0) and np.all(np.diff(seen.astype(float)) <= 0.0)


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_within_its_bound_of_the_exact_lag(arithmetic):
    """A ramp too slow for a count a sample, noise and jumps; exact: by its own sum of weights in float64."""
    plan = _plan(arithmetic, 1.0)
    kind, high = kind_of(plan.error), plan.controller.ranges.reference[1]
    lsb = plan.reference.lsb
    least = 1e-7 if plan.floating else lsb
    jumps = np.random.default_rng(3).uniform(0, high, 400)
    ref = np.concatenate([np.linspace(0, 40 * least, 800), jumps, [high] * 300])
    raw = ref.astype(kind) if plan.floating else np.round(ref / lsb).astype(kind)
    p = np.exp(-0.01)
    exact = np.convolve((1.0 - p) * p ** np.arange(len(ref)), raw * lsb)[: len(ref)]
    off = np.abs(_aimed(plan, raw, 0) * lsb - exact).max()
    assert 0.0 < off <= set_point_error(plan) < 1e-3 * high


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_the_steppers_of_the_loop_and_the_ideal_are_the_same(arithmetic):
    plan, inputs = build_plan(SOFT, arithmetic), _inputs()
    inputs = replace(inputs, resets=(Reset(0, 0, 0.01, 0.01, 5.0),))
    signals = list(zip(inputs.ref.T, inputs.meas.T, inputs.sched.T))
    exact = ideal(plan.controller, inputs, plan.length).u[0]
    own = physical_trace(plan, execute(plan, to_raw(plan, inputs))).u[0]
    planned = PlanStepper(plan, 1, 5.0, reference=0.01)
    assert np.array_equal([planned.step(*one)[0] for one in signals], own)
    floating = FloatStepper(SOFT, 300, 1, 5.0, SOFT.length, reference=0.01)
    assert np.abs([floating.step(*one)[0] for one in signals] - exact).max() <= 1e-11
    bare = ideal(replace(SOFT, setpoint_filter=None), inputs, plan.length).u[0]
    assert np.abs(bare - exact).max() > 0.1


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_resets_start_it_and_tracks_leave_it(arithmetic):
    plan, inputs = build_plan(SOFT, arithmetic), _inputs()
    seen = physical_trace(plan, execute(plan, to_raw(plan, inputs)))
    exact = ideal(plan.controller, inputs, plan.length)
    assert np.abs(seen.d - exact.d).max() <= plan.error_bound.operator
    tracked = replace(inputs, tracks=(Track(0, 40, 1.0),))
    runs = [Run(plan, to_raw(plan, each)) for each in (inputs, tracked)]
    assert np.array_equal(runs[0].e, runs[1].e) and not np.array_equal(runs[0].trace.u, runs[1].trace.u)


_LOST = """
#include <stdio.h>
#include "spba.c"
#define tried(damage) \\
    spba_reset(&s, 0.01f, 0.01f, 5.0f); \\
    (void)spba_step(&s, 0.01f, 0.01f, 0.1f); \\
    damage; \\
    u = spba_step(&s, 0.02f, 0.01f, 0.1f); \\
    printf("%%d %%g %%g %%.9g\\n", spba_flags(&s), u, (double)s.lag, (double)s.latest);
int main(void)
{
    spba_state s;
    double u;
%s    return 0;
}
"""
_ANY = """
#include <stdio.h>
#include "spba.c"
int main(void)
{
    spba_state s;
    uint64_t bits = 1u;
    int i, outside = 0;
    spba_init(&s);
    for (i = 0; i < 100000; i++) {
        int16_t y;
        bits = bits * 6364136223846793005u + 1442695040888963407u;
        memcpy(&s.set_point, &bits, sizeof bits);
        y = spba_aim(&s, (int16_t)(i % (SPBA_REF_MAX + 1)));
        outside += y < SPBA_REF_MIN || y > SPBA_REF_MAX;
    }
    printf("%d", outside);
    return 0;
}
"""


def _printed(folder, program: str) -> str:
    """What a program beside a generated controller prints; it fails on undefined behaviour."""
    (folder / "try.c").write_text("#include <string.h>\n" + program)
    flags = [*EXACT, "-DFOC_FLAGS_CHECKED", *SANITISERS]
    command = [*compiler("gcc", *flags), *flags, str(folder / "try.c"), "-o", str(folder / "try")]
    subprocess.run(command, check=True, capture_output=True)
    return subprocess.run([folder / "try"], check=True, capture_output=True, text=True).stdout


def test_a_damaged_filter_begins_anew(tmp_path):
    """The one step that finds it is left out, and y is this sample's reference after it."""
    generate(SOFT, tmp_path, "f32")
    lost = ("lag = 1e30f", "latest = -1e30f", "lag = 0.0f / 0.0f", "latest = 1.0f / 0.0f")
    seen = _printed(tmp_path, _LOST % "".join(f"    tried(s.{one})\n" for one in lost)).splitlines()
    assert len(seen) == 4 and set(seen) == {f"16 5 0 {np.float32(0.02):.9g}"}


def test_a_damaged_filter_in_fixed_point_stays_in_its_range(tmp_path):
    generate(SOFT, tmp_path, "q15")
    assert _printed(tmp_path, _ANY) == "0"


def test_the_file(tmp_path):
    (tmp_path / "c.toml").write_text(controller_text(SOFT))
    assert read_controller(tmp_path / "c.toml") == SOFT
    bare = replace(SOFT, setpoint_filter=None)
    assert "setpoint_filter" not in controller_text(bare)
    (tmp_path / "c.toml").write_text("setpoint_filter = 0\n" + controller_text(bare))
    assert read_controller(tmp_path / "c.toml") == bare
    (tmp_path / "c.toml").write_text("setpoint_filter = -1\n" + controller_text(bare))
    with pytest.raises(ControllerError, match="setpoint_filter.*is -1"):
        read_controller(tmp_path / "c.toml")


def test_one_that_is_too_slow_is_refused():
    with pytest.raises(PlanError, match="at most 65536 samples"):
        build_plan(replace(SOFT, setpoint_filter=700.0), "f32")


def test_without_it_no_code_is_left(tmp_path):
    generate(replace(SOFT, setpoint_filter=None), tmp_path, "q15")
    assert "set_point" not in (tmp_path / "spba.c").read_text() + (tmp_path / "spba.h").read_text()
    assert "aim" not in (tmp_path / "spba.c").read_text()
