"""Floating states that no step has left: finite outputs within their limits, a flag, a good state again.

Red when a damaged state gives an output beyond its limits, or does not recover.
"""

from dataclasses import replace

import numpy as np
import pytest

import focgen
from focgen.codegen.generate import generate
from focgen.control.controller import Tunable
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.ending import endings
from focgen.plan.execute import execute
from focgen.plan.plan import FLAG_INVALID
from focgen.plan.scenario import Damage, Reset, Scenario, to_raw
from focgen.verification.scenarios import mixed
from focgen.verification.unusable import strewn
from focgen.verification.verify import verify
from tests.conftest import paper_controller
from tests.controllers import seed_controller, simple
from tests.verification.test_mutations import Fault, copied, filter_controller, sow

FORMS = {
    "spba": (paper_controller(40), {}),
    "filter": (filter_controller(), {}),
    "modes": (paper_controller(), {"memory": "exponential", "tolerance": 1e-3, "horizon": 10_000}),
    "ahead": (paper_controller(64), {"target": "cortex-m4"}),
    "tuned": (
        replace(paper_controller(40), tunable=Tunable((0.5, 2.0), (0.0, 1.0), (5.0, 10.0))),
        {"tunable": True},
    ),
    "plain": (simple(TransferFunction([(1.0, 0.0)]), integrator=True), {}),
}


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    root = tmp_path_factory.mktemp("sound")
    for name, (controller, options) in FORMS.items():
        for arithmetic in ("f32", "f64"):
            generate(controller, root / f"{name}_{arithmetic}", arithmetic, **options)
    return root


def stepped(one, rng, count):
    """Some steps with good inputs; (outputs, flags)."""
    top = one.plan.controller.ranges.reference[1]
    inputs = [rng.uniform(0.0, top, count) for _ in range(2)]
    inputs += [rng.uniform(0.05, 0.25, count)] if one.scheduled else []
    return one.run(*inputs, with_flags=True)


def fill(one, content: bytes):
    """Put any bytes into a state."""
    made = one.copy()
    made._state = made._machine.state(content)
    return made


@pytest.mark.parametrize(
    "name, arithmetic",
    [
        pytest.param(name, arithmetic, marks=() if (i + j) % 2 == 0 else pytest.mark.long)
        for i, name in enumerate(FORMS)
        for j, arithmetic in enumerate(("f32", "f64"))
    ],
)
def test_whatever_is_in_the_state_outputs_are_within_their_limits(sound, name, arithmetic):
    """Random bits, single bits of a good state flipped, everything 0xff or 0."""
    one, rng = focgen.load(sound / f"{name}_{arithmetic}"), np.random.default_rng(7)
    low, high = one.plan.controller.ranges.output
    stepped(one, rng, 80)
    good = one._machine.content(one._state)
    states = [rng.bytes(len(good)) for _ in range(60)] + [b"\xff" * len(good), b"\0" * len(good)]
    for _ in range(150):
        flipped = bytearray(good)
        flipped[rng.integers(len(good))] ^= 1 << int(rng.integers(8))
        states.append(bytes(flipped))
    invalid = 0
    for content in states:
        u, flags = stepped(fill(one, content), rng, 150)
        assert np.all(np.isfinite(u)) and u.min() >= low and u.max() <= high
        assert not flags[-1] & FLAG_INVALID
        invalid += int(np.any(flags & FLAG_INVALID))
    assert 1 <= invalid < len(states)


@pytest.mark.parametrize(
    "name, arithmetic",
    [
        pytest.param(name, arithmetic, marks=() if i < 3 and (i + j) % 2 == 0 else pytest.mark.long)
        for i, name in enumerate(FORMS)
        for j, arithmetic in enumerate(("f32", "f64"))
    ],
)
def test_it_recovers_by_itself(sound, name, arithmetic):
    """From NaN everywhere: one step is left out, then it is what a reset would have left."""
    one = focgen.load(sound / f"{name}_{arithmetic}")
    size = one._machine.bytes
    wrecked, reset = fill(one, b"\xff" * size), one.new()
    sched = (0.1,) if one.scheduled else ()
    inputs = (0.01, 0.004, *sched)
    u = wrecked.step(*inputs)
    assert wrecked.flags & FLAG_INVALID and u == min(max(0.0, one.plan.output.low), one.plan.output.high)
    reset.reset(0.01, 0.004, u)
    for _ in range(5):
        assert wrecked.step(*inputs) == reset.step(*inputs) and not wrecked.flags & FLAG_INVALID
    held = fill(one, b"\xff" * size)
    assert held.step(float("nan"), *inputs[1:]) == u and held.flags & FLAG_INVALID


def test_by_hand():
    """The reference: the output stands at the damage, and what follows is a run after a reset to that
    sample.
    """
    plan = build_plan(seed_controller(20), "f64")
    whole = to_raw(plan, mixed(plan.controller, 400, 3))
    signals = [x[:1] for x in (whole.ref, whole.meas, whole.sched)]
    plain, at = execute(plan, Scenario(*signals)), 20
    for what in ("error", "integral", "all"):
        seen = execute(plan, Scenario(*signals, damages=(Damage(0, at, what),)))
        stands = plain.u[0, at - 1] if what == "error" else 0.0
        assert seen.u[0, :at].tolist() == plain.u[0, :at].tolist()
        assert seen.u[0, at] == stands and seen.flags[0, at] & FLAG_INVALID
        after = Scenario(*(x[:, at + 1 :] for x in signals))
        reset = Reset(0, 0, *(x[0, at] for x in signals[:2]), stands)
        expected = execute(plan, Scenario(after.ref, after.meas, after.sched, (reset,)))
        assert seen.u[0, at + 1 :].tolist() == expected.u[0].tolist() != plain.u[0, at + 1 :].tolist()


def test_every_lane_is_damaged_and_the_reference_ends_where_the_c_does():
    plan = build_plan(seed_controller(20), "f32")
    strewed = strewn(plan, to_raw(plan, mixed(plan.controller, 800, 1)), 1)
    assert {d.lane for d in strewed.damages} == set(range(strewed.lanes))
    assert {d.what for d in strewed.damages} == {"error", "integral", "all"}
    trace, ends = endings(plan, strewed)
    assert np.all(np.isfinite(trace.u)) and len(ends) == strewed.lanes
    integer = build_plan(seed_controller(20), "q31")
    assert not to_raw(integer, mixed(integer.controller, 800, 1)).damages


GUARDS = (
    ("spba", "f64", r"if \(!foc_finite_f64\(s->integral \+ .*\) \{\n", "if (0) {\n"),
    ("spba", "f64", r"!foc_finite_f64\(s->integral [^|]*\|\| ", ""),
    ("spba", "f64", r" \|\| !spba_within\(s\)", ""),
    ("spba", "f32", r"if \(!spba_within\(s\)\)", "if (0)"),
    ("plain", "f32", r"s->error_now < SIMPLE_ERRORS\s+&& ", ""),
    ("spba", "f32", r"if \(!foc_held\(d\) ", "if (0 && !foc_held(d) "),
    ("filter", "f32", r"if \(!foc_finite_f32\(d\)\)", "if (0)"),
    ("spba", "f32", r"(spba_recover(.|\n)*?)    spba_settle\(s, e\);\n", r"\1"),
    (
        "spba",
        "f32",
        r"    s->integral = foc_counts_f32\(u, 57\);\n    s->flags = flags;",
        "    s->flags = flags;",
    ),
    ("filter", "f32", r"    s->output = u;\n    s->flags = flags;", "    s->flags = flags;"),
    ("modes", "f32", r"    s->flags = flags;\n", ""),
)


@pytest.mark.parametrize(
    "name, arithmetic, pattern, by",
    [pytest.param(*one, marks=pytest.mark.long if turn % 2 else ()) for turn, one in enumerate(GUARDS)],
)
def test_verify_sees_a_guard_that_is_lost(sound, tmp_path, name, arithmetic, pattern, by):
    folder = copied(sound, tmp_path, name, arithmetic)
    sow(folder, {"filter": "filter", "plain": "simple"}.get(name, "spba"), Fault("guard", "@.c", pattern, by))
    assert verify(folder, 3000, edited=True).targets["host"].mismatches
