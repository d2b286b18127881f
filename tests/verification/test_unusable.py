"""Floating inputs that cannot be used: held outputs, flags, recovery, and nothing of them in the state.

Red when NaN or infinity enters a history, or an output does not hold.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cffi import FFI

from focgen.codegen.generate import folder_files, generate
from focgen.compiler import compile_shared
from focgen.control.controller import ControllerRanges
from focgen.control.files import controller_text
from focgen.errors import PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.histories import BankRun, Latest
from focgen.plan.scenario import Reset, Scenario, Track, to_raw
from focgen.plan.usable import reach, usable
from focgen.verification.scenarios import mixed, raw_scenarios
from focgen.verification.unusable import strewn
from tests.c_code import compiler, run
from tests.controllers import random_controller, seed_controller, simple

NAN, INF = float("nan"), float("inf")
BAD = (NAN, INF, -INF, 2.0**520, -(2.0**512))
LAST_GOOD = {"f32": np.nextafter(np.float32(2.0**48), np.float32(0)), "f64": np.nextafter(2.0**512, 0.0)}


def lead(**changes):
    """A recursion and no integrator."""
    transfer = TransferFunction([(0.3, 0.5), (1.0, 0.0), (0.8, -0.7)], [(0.2, 0.9), (1.0, 0.0)])
    return simple(transfer, name="lead", **{"length": 12, "gain": 2.5, **changes})


@pytest.fixture(scope="module", params=["f64", "f32"])
def c(request, tmp_path_factory):
    """The paper's controller as C, with its state in reach: (ffi, library, plan)."""
    folder = tmp_path_factory.mktemp("unusable")
    plan = generate(seed_controller(20), folder, request.param).plan
    ctype = plan.output.ctype
    compile_shared([folder / "spba.c"], folder / "spba.so", ["-std=c99", "-ffp-contract=off"])
    ffi, header = FFI(), (folder / "spba.h").read_text()
    members = header.split("typedef struct {")[1].split("}")[0].replace("SPBA_ERRORS", "21")
    ffi.cdef(
        f"typedef {ctype} spba_sig; typedef struct {{ {members} }} spba_state;"
        "void spba_init(spba_state *); void spba_reset(spba_state *, spba_sig, spba_sig, spba_sig);"
        "spba_sig spba_step(spba_state *, spba_sig, spba_sig, spba_sig);"
        "void spba_track(spba_state *, spba_sig); uint8_t spba_flags(const spba_state *);"
    )
    return ffi, ffi.dlopen(str(folder / "spba.so")), plan


def warm(c):
    """A state after a few steps."""
    ffi, library, _ = c
    state = ffi.new("spba_state *")
    library.spba_reset(state, 0.01, 0.004, 1.5)
    for k in range(30):
        library.spba_step(state, 0.01, 0.004 + 0.0001 * k, 0.1)
    return state


def content(ffi, state) -> dict[str, bytes]:
    """Every member but the flags, bit for bit."""
    names = [name for name, _ in ffi.typeof(state[0]).fields if name != "flags"]
    return {name: bytes(ffi.buffer(ffi.addressof(state, name))) for name in names}


@pytest.mark.parametrize("bad", BAD)
@pytest.mark.parametrize("place", range(3))
def test_a_step_that_is_left_out_changes_the_flags_only(c, bad, place):
    ffi, library, _ = c
    state = warm(c)
    u = library.spba_step(state, 0.01, 0.004, 0.1)
    before, inputs = content(ffi, state), [0.01, 0.004, 0.1]
    inputs[place] = bad
    assert library.spba_step(state, *inputs) == u
    assert content(ffi, state) == before and library.spba_flags(state) == 16
    good = library.spba_step(state, 0.01, 0.004, 0.1)
    other = warm(c)
    assert library.spba_step(other, 0.01, 0.004, 0.1) == u != good
    assert library.spba_step(other, 0.01, 0.004, 0.1) == good and library.spba_flags(state) == 0


@pytest.mark.parametrize("bad", BAD)
def test_a_track_of_nothing_known_changes_the_flags_only(c, bad):
    ffi, library, _ = c
    state = warm(c)
    before = content(ffi, state)
    library.spba_track(state, bad)
    assert content(ffi, state) == before and library.spba_flags(state) == 16


@pytest.mark.parametrize("bad", BAD)
@pytest.mark.parametrize("place", range(3))
def test_a_reset_takes_nought_for_what_it_cannot_use(c, bad, place):
    """The other arguments count; and a state that nothing has initialised is one afterwards."""
    ffi, library, _ = c
    given = [0.01, 0.004, 1.5]
    given[place] = bad
    instead = (0.01, 0.004, 0.0) if place == 2 else (0.0, 0.0, 1.5)
    expected, state = ffi.new("spba_state *"), ffi.new("spba_state *")
    ffi.memmove(state, b"\xff" * ffi.sizeof("spba_state"), ffi.sizeof("spba_state"))
    library.spba_reset(expected, *instead)
    library.spba_reset(state, *given)
    assert content(ffi, state) == content(ffi, expected)
    assert (library.spba_flags(state), library.spba_flags(expected)) == (16, 0)


def test_the_limit_is_where_it_is_said_to_be(c):
    _ffi, library, plan = c
    state, last = warm(c), LAST_GOOD[plan.arithmetic]
    for value, flags in ((last, 0), (-last, 0), (2.0 * float(last), 16), (5e-324, 0), (-0.0, 0)):
        library.spba_step(state, 0.01, value, 0.1)
        assert library.spba_flags(state) & 16 == flags, value
        assert bool(usable(value, plan.measurement)) == (not flags)
    assert all(math.isfinite(x) for x in state.error)


# ---------------------------------------------------------------------------------------- the reference


@pytest.mark.parametrize("arithmetic", ["f64", "f32"])
@pytest.mark.parametrize("scheduled", [True, False])
def test_the_reference_is_the_run_without_the_bad_samples(arithmetic, scheduled):
    """Samples taken out by hand; between them the output stands."""
    controller = seed_controller(20) if scheduled else lead()
    plan = build_plan(controller, arithmetic)
    scenario = to_raw(plan, mixed(controller, 800, 3))
    scenario = Scenario(scenario.ref, scenario.meas, scenario.sched)
    rng = np.random.default_rng(4)
    bad = rng.random(scenario.ref.shape) < 0.3
    ref = np.where(bad, np.float32(NAN) if arithmetic == "f32" else NAN, scenario.ref)
    seen = execute(plan, Scenario(ref, scenario.meas, scenario.sched))
    for lane, gone in enumerate(bad):
        inputs = ref, scenario.meas, scenario.sched
        kept = [None if s is None else s[lane : lane + 1, ~gone] for s in inputs]
        alone = execute(plan, Scenario(*kept))
        latest = np.cumsum(~gone) - 1  # index of the latest good sample
        expected = np.where(latest < 0, 0.0, alone.u[0][np.maximum(latest, 0)])
        assert np.array_equal(seen.u[lane], expected)
        assert np.array_equal(seen.flags[lane] & 16 > 0, gone)
        assert np.array_equal(seen.flags[lane][~gone], alone.flags[0])


def test_events_while_nothing_can_be_measured():
    """What stands is what the latest reset or track has said; an earlier track is forgotten by a reset."""
    plan = build_plan(seed_controller(20), "f64")
    still, none = np.full((1, 8), 0.01), np.full((1, 8), NAN)
    sched = np.full((1, 8), 0.1)
    resets = Reset(0, 2, 0.01, 0.01, 3.0), Reset(0, 5, NAN, 0.0, 20.0)
    tracks = Track(0, 1, 2.0), Track(0, 3, 4.0), Track(0, 4, NAN), Track(0, 6, -1.0)
    seen = execute(plan, Scenario(none, still, sched, resets, tracks))
    assert seen.u[0].tolist() == [0.0, 2.0, 3.0, 4.0, 4.0, 10.0, 0.0, 0.0]
    assert seen.flags[0].tolist() == [18, 16, 16, 16, 16, 17, 18, 18]
    after = none.copy()
    after[0, 7] = 0.01
    seen = execute(plan, Scenario(after, still, sched, resets[:1], tracks[:2]))
    assert seen.u[0, 7] == 4.0 and not seen.d.any()
    seen = execute(plan, Scenario(after, still, sched, (), (Track(0, 1, 2.0), Track(0, 3, INF))))
    assert seen.u[0, 6:].tolist() == [2.0, 2.0]


def test_what_is_strewn_is_of_every_kind():
    """Otherwise the comparison with the C would be of little worth."""
    controller = seed_controller(20)
    plan = build_plan(controller, "f32")
    scenario = strewn(plan, to_raw(plan, mixed(controller, 4000, 0, True)), 0)
    inputs = np.stack([scenario.ref, scenario.meas, scenario.sched])
    bad = ~(np.abs(inputs) < 2.0**48)
    assert all(0.02 < share < 0.3 for share in bad.mean(axis=(1, 2)))
    assert np.isnan(inputs).any() and (inputs == INF).any() and (inputs == -INF).any()
    assert (np.abs(inputs) == 2.0**48).any() and (np.abs(inputs) == LAST_GOOD["f32"]).any()
    assert any(not usable(r.u0, plan.output) for r in scenario.resets) and bad[:, :, 0].any()
    assert any(not usable(t.u, plan.output) for t in scenario.tracks)


# -------------------------------------------------------------------------------------------- the room


@pytest.mark.parametrize(
    "seed", [*range(500, 506), *(pytest.param(s, marks=pytest.mark.long) for s in range(506, 600))]
)
def test_no_usable_input_overflows(seed):
    """The largest usable inputs, with the signs that are worst and at random: all stays finite; and nothing
    reaches what is proved to be the most. Every other controller remembers by modes."""
    controller, memory = random_controller(seed, 40), ("short", "exponential")[seed % 2]
    try:
        plan = build_plan(controller, "f32", memory=memory)
    except PlanError:
        pytest.skip("not to be realised as float")
    rng, last = np.random.default_rng(seed), LAST_GOOD["f32"]
    signs = rng.choice([-1, 1], (6, 200)).astype(np.float32)
    signs[0] = np.where(np.arange(200) % 2, 1, -1)
    sched = None if plan.schedule is None else (rng.choice([-1, 1], signs.shape) * last).astype(np.float32)
    with np.errstate(over="raise", invalid="raise"):
        seen = execute(plan, Scenario(signs * last, -signs * last, sched))
    assert np.isfinite(seen.u).all() and np.isfinite(seen.d).all() and not (seen.flags & 16).any()
    assert np.abs(seen.d * plan.increment.lsb).max() <= reach(plan, 2.0**49)


@pytest.mark.parametrize("order", [0.3, 0.6, pytest.param(0.9, marks=pytest.mark.long)])
def test_the_room_counts_what_modes_can_add(order):
    """A long past at one end, then the other: every drive is twice the input. In the bound, which takes twice
    the sum for the output, modes have the room for it and no more."""
    plan = build_plan(simple(TransferFunction([(1.0, order)]), memory="exponential"), "f32")
    last, added, most = np.float32(LAST_GOOD["f32"]), 0.0, 2.0**49
    for bank in plan.direct.banks:
        past, memory = Latest(1, np.float32), BankRun(bank, np.float32, 1)
        memory.settle(0, last + last)
        past.settle(0, -last - last)
        added += abs(float(memory.step(past)[0]))
    taps = replace(plan, direct=replace(plan.direct, banks=()))
    assert 0.999 < 2.0 * added / (reach(plan, most) - reach(taps, most)) < 1.0 + 1e-6


def test_a_memory_without_room_is_refused_and_one_with_room_does_not_overflow():
    """The largest gain that is taken, tried with what is worst."""
    memory = dict(memory="exponential", tolerance=0.05, horizon=1000)
    transfer = TransferFunction([(1.0, 1.3), (1.0, 0.0)], [(0.05, 0.8), (1.0, 0.0)])
    steps = np.repeat(np.random.default_rng(3).choice([-1, 1], (8, 40)), 9, axis=1).astype(np.float32)
    taken, refused = 10.0, 30.0
    while refused - taken > 0.05:
        gain = 10.0 ** (0.5 * (taken + refused))
        try:
            plan = build_plan(simple(transfer, gain=gain, **memory), "f32")
            taken = 0.5 * (taken + refused)
        except PlanError as why:
            assert "too large for f32" in str(why)
            refused = 0.5 * (taken + refused)
    plan = build_plan(simple(transfer, gain=10.0**taken, **memory), "f32")
    with np.errstate(over="raise", invalid="raise"):
        seen = execute(plan, Scenario(steps * LAST_GOOD["f32"], -steps * LAST_GOOD["f32"], None))
    assert np.isfinite(seen.d).all() and np.abs(seen.d).max() > 1e-3 * np.finfo(np.float32).max


def test_a_range_or_a_gain_without_room_is_refused():
    wide = ControllerRanges((-(2.0**48), 1.0), (-1.0, 1.0), (-10.0, 10.0))
    with pytest.raises(PlanError, match="a range is too large for f32.*choose f64"):
        build_plan(lead(ranges=wide), "f32")
    assert build_plan(lead(ranges=wide), "f64")
    with pytest.raises(PlanError, match="the gain for an input is too large for f32"):
        build_plan(lead(gain=1e30), "f32")
    for beyond in (lead(gain=1e60), lead(ranges=ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (0.0, 1e60)))):
        with pytest.raises(PlanError, match="(too large for f32|beyond float32).*choose f64"):
            build_plan(beyond, "f32")


# -------------------------------------------------------------------------------------- compilers' flags

_FAST = """#include <stdio.h>
#include "lead.h"

int main(int count, char **arguments)
{
    static lead_state s;
    volatile lead_sig nought = 0;
    const lead_sig bad[] = {nought / nought, 1 / nought, -1 / nought, 0.5};
    int k;

    (void)arguments;
    lead_init(&s);
    for (k = 0; k < 4; k++) {
        lead_step(&s, bad[(k + count - 1) % 4], 0);
        printf("%u ", (unsigned)(lead_flags(&s) & 16u));
        lead_step(&s, 0, bad[(k + count - 1) % 4]);
        printf("%u ", (unsigned)(lead_flags(&s) & 16u));
    }
    return 0;
}
"""


@pytest.mark.parametrize(
    "arithmetic, name, flags",
    [
        pytest.param(
            arithmetic,
            name,
            flags,
            id=f"{arithmetic}-{name}-{' '.join(flags)}",
            marks=() if j == turn + i else pytest.mark.long,
        )
        for turn, arithmetic in enumerate(["f32", "f64"])
        for i, name in enumerate(["gcc", "clang"])
        for j, flags in enumerate([["-O2"], ["-O3", "-ffast-math"], ["-Ofast", "-flto"]])
    ],
)
def test_the_test_survives_fast_math(arithmetic, name, flags, tmp_path: Path):
    """Its compilers may take comparisons of NaN for granted; this one is of bits."""
    plan = build_plan(lead(), arithmetic)
    write_files(tmp_path, {**folder_files(plan, controller_text(plan.controller).encode()), "fast.c": _FAST})
    sources = [tmp_path / "fast.c", tmp_path / "lead.c"]
    options = ["-std=c99", "-DFOC_FLAGS_CHECKED", *flags]
    run(*compiler(name, *flags), *options, *sources, "-o", tmp_path / "fast.exe", "-lm")
    assert run(tmp_path / "fast.exe").split() == ["16"] * 6 + ["0"] * 2


def test_one_sample_is_enough_to_strew():
    plan = build_plan(seed_controller(8), "f32")
    found = raw_scenarios(plan, 1, 0)["unusable inputs"]
    assert found.samples == 1 and math.isnan(found.ref[0, 0])
