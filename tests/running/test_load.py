"""``focgen.load``: the C of a folder as a Python object, against the bit-true reference.

Red when a loaded controller answers otherwise than the reference.
"""

import copy
import pickle
import time

import numpy as np
import pytest

import focgen
from focgen.codegen.generate import generate
from focgen.errors import InputError
from focgen.plan.execute import execute
from focgen.plan.scenario import nearest_raw, physical_trace, to_raw
from focgen.running.controller import Flags
from focgen.running.signals import Counts, Physical
from focgen.verification.scenarios import mixed
from tests.conftest import paper_controller
from tests.verification.test_mutations import filter_controller

ARITHMETICS = ("f64", "f32", "q31", "q15")
CONTROLLERS = {"spba": paper_controller(40), "filter": filter_controller()}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    root = tmp_path_factory.mktemp("folders")
    for name, controller in CONTROLLERS.items():
        for arithmetic in ARITHMETICS:
            generate(controller, root / f"{name}_{arithmetic}", arithmetic)
    generate(paper_controller(), root / "modes", "q31", memory="exponential")
    return root


@pytest.fixture(scope="module")
def load(folders):
    """``focgen.load`` of a folder's name, compiled once; each call gives another controller."""
    kept = {}

    def loaded(name, raw=False):
        if (name, raw) not in kept:
            kept[name, raw] = focgen.load(folders / name, raw=raw)
        return kept[name, raw].new()

    return loaded


def played(controller, scenario, lane):
    """What a loaded controller answers to a lane of a scenario, call by call."""
    controller.init()
    resets = {r.sample: r for r in scenario.resets if r.lane == lane}
    tracks = {t.sample: t for t in scenario.tracks if t.lane == lane}
    signals = [x[lane].tolist() for x in (scenario.ref, scenario.meas, scenario.sched) if x is not None]
    u, flags = [], []
    for k, inputs in enumerate(zip(*signals)):
        if k in resets:
            controller.reset(resets[k].ref, resets[k].meas, resets[k].u0)
        if k in tracks:
            controller.track(tracks[k].u)
        u.append(controller.step(*inputs))
        flags.append(int(controller.flags))
    return u, flags


@pytest.mark.parametrize(
    "name, arithmetic",
    [
        pytest.param(name, arithmetic, marks=() if 2 * i + 1 == j or (i, j) == (0, 2) else pytest.mark.long)
        for i, name in enumerate(CONTROLLERS)
        for j, arithmetic in enumerate(ARITHMETICS)
    ],
)
def test_every_call_gives_the_bits_of_the_reference(load, name, arithmetic):
    """In counts and in physical units, inside the ranges and beyond them."""
    raw = load(f"{name}_{arithmetic}", True)
    physical = load(f"{name}_{arithmetic}")
    for beyond in (False, True):
        given = mixed(CONTROLLERS[name], 1600, 5, beyond)
        counts = to_raw(raw.plan, given)
        expected = execute(raw.plan, counts)
        wanted = physical_trace(raw.plan, expected)
        for lane in (0, 1, 2):
            u, flags = played(raw, counts, lane)
            assert u == expected.u[lane].tolist() and flags == expected.flags[lane].tolist()
            u, flags = played(physical, given, lane)
            assert u == wanted.u[lane].tolist() and flags == expected.flags[lane].tolist()
            assert len(set(u)) > 5, "something has moved"


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize("raw", (True, pytest.param(False, marks=pytest.mark.long)))
def test_run_is_as_many_steps(load, arithmetic, raw):
    one = load(f"spba_{arithmetic}", raw)
    rng = np.random.default_rng(3)
    ref, meas, sched = (rng.uniform(0.0, top, 400) for top in (0.02, 0.02, 0.25))
    if raw:
        plan = one.plan
        ref, meas = nearest_raw(ref, plan.error), nearest_raw(meas, plan.error)
        sched = nearest_raw(sched, plan.schedule.signal)
    other = one.new()
    steps = [(one.step(*x), int(one.flags)) for x in zip(*(x.tolist() for x in (ref, meas, sched)))]
    head, seen = other.run(ref[:150], meas[:150], sched[:150], with_flags=True)
    tail = other.run(ref[150:], meas[150:], sched[150:])
    assert [*head.tolist(), *tail.tolist()] == [u for u, _ in steps], "it goes on from where it stands"
    assert seen.tolist() == [flags for _, flags in steps[:150]] and other.flags == one.flags
    held = one.new()
    held.run(ref, meas[0], sched[0])
    assert held.copy().run(ref[:3], meas[0], sched[0]).tolist() == [
        held.step(r, meas[0], sched[0]) for r in ref[:3]
    ]


def test_each_has_a_state_of_its_own(load, folders):
    first = load("spba_q31")
    others = [focgen.load(folders / name) for name in ("spba_q31", "spba_f32", "spba_q31")]
    first.run(np.full(50, 0.01), 0.0, 0.1)
    second, twin = first.new(), copy.deepcopy(first)
    alone = load("spba_q31").step(0.002, 0.001, 0.1)
    assert second.step(0.002, 0.001, 0.1) == others[0].step(0.002, 0.001, 0.1) == alone
    went_on = first.step(0.002, 0.001, 0.1)
    assert went_on == twin.step(0.002, 0.001, 0.1) != alone
    assert twin.step(0.02, 0.0, 0.1) == first.step(0.02, 0.0, 0.1)
    with pytest.raises(TypeError, match="load the folder in each process"):
        pickle.dumps(first)


def test_where_nothing_is_scheduled_there_is_no_argument_for_it(load):
    one = load("filter_q31")
    assert not one.scheduled and np.isfinite(one.step(0.5, 0.1)) and one.run([0.5], [0.1]).shape == (1,)
    with pytest.raises(TypeError):
        one.step(0.5, 0.1, 0.2)
    with pytest.raises(TypeError):
        load("spba_q31").step(0.01, 0.0)


def test_flags_are_names(load):
    one = load("spba_q31")
    assert one.flags == Flags(0)
    one.reset(0.01, 0.0, 10.0)
    one.step(0.03, 0.0, 0.1)
    assert one.flags == Flags.HIGH | Flags.INPUT
    floating = load("spba_f32")
    floating.step(float("nan"), 0.0, 0.1)
    assert floating.flags == Flags.LOW | Flags.INVALID
    floating.step(1e300, 0.0, 0.1)
    assert floating.flags == Flags.LOW | Flags.INVALID, "infinite as a float"


@pytest.mark.parametrize(
    "call, said",
    (
        (lambda c: c.step(float("nan"), 0.0, 0.1), "ref: is NaN"),
        (lambda c: c.step(0.0, "much", 0.1), "meas: is 'much'"),
        (lambda c: c.counts().step(1.5, 0, 0), "ref: is 1.5"),
        (lambda c: c.counts().step(0, 1 << 31, 0), "meas: is 2147483648"),
        (lambda c: c.counts().run(np.array([0, -(1 << 31) - 1]), 0, 0), "whole numbers from -2147483648"),
        (lambda c: c.counts().run(np.array([0.5]), 0, 0), "counts are whole"),
        (lambda c: c.run([0.0, 0.1], [0.0, 0.1, 0.2], 0.1), "ref 2, meas 3, sched 1"),
        (lambda c: c.run([[0.0]], 0.0, 0.1), "2 dimensions"),
        (lambda c: c.run([0.0, float("nan")], 0.0, 0.1), "ref: is NaN"),
        (lambda c: c.run(["a"], 0.0, 0.1), "no number"),
        (lambda c: c.track(None), "u: is None"),
        (lambda c: c.reset(0.0, 0.0, float("nan")), "u0: is NaN"),
    ),
)
def test_what_cannot_be_used_is_named_and_changes_nothing(load, call, said):
    one = load("spba_q31")
    one.run(np.full(9, 0.01), 0.0, 0.1)
    twin = one.copy()
    with pytest.raises(InputError, match=said):
        call(one)
    assert one.step(0.01, 0.0, 0.1) == twin.step(0.01, 0.0, 0.1)


@pytest.mark.parametrize("arithmetic", ("q31", "q15"))
def test_one_value_becomes_the_count_that_many_become(load, arithmetic):
    plan = load(f"spba_{arithmetic}").plan
    form, rng = plan.error, np.random.default_rng(1)
    top = (1 << (form.bits - 1)) * form.lsb
    halves = (rng.integers(-9, 9, 60) + 0.5) * form.lsb
    values = [*rng.uniform(-2 * top, 2 * top, 200), *halves, *np.nextafter(halves, 0.0), np.inf, -np.inf, 0.0]
    found = [Physical().one("x", value, form) for value in values]
    assert found == nearest_raw(values, form).tolist() == Physical().many("x", values, form).tolist()
    assert Counts().many("x", found, form).tolist() == found


def test_an_edited_folder_is_refused_unless_asked_for(load, tmp_path):
    generate(CONTROLLERS["spba"], tmp_path, "q31")
    source = tmp_path / "spba.c"
    source.write_text(source.read_text().replace("return s->flags;", "return 255u;"))
    with pytest.raises(InputError, match="has been edited: spba.c.*edited=True"):
        focgen.load(tmp_path)
    one = focgen.load(tmp_path, edited=True)
    assert one.flags == 255 and one.differences and "edited" in repr(one)
    sound = load("spba_q31")
    assert repr(sound) == "<ScheduledController spba: q31, 40 past samples, 0.01 s, 1/mm -> V>"


def test_a_million_steps_a_second(load):
    """Conversions included."""
    one, ref = load("modes"), np.random.default_rng(0).uniform(0.0, 0.02, 100_000)
    times = []
    for _ in range(5):
        begin = time.perf_counter()
        one.run(ref, 0.01, 0.1)
        times.append(time.perf_counter() - begin)
    assert ref.size / min(times) > 1e6
