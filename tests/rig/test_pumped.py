"""Regulators that add up what they are told: a syringe pump, a stepper. They stay where they were left.

Red when a log that begins with some volume in the bladder, at rest or on its way, is taken for one that
begins empty, or when an earlier log's strokes are not put ahead of the next.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.changeable import fits_in
from focgen.rig.effects import Run, library
from focgen.rig.engine import Chain
from focgen.rig.initial import NOTE, begun
from focgen.rig.placed import Placed
from focgen.rig.recalled import with_recalled
from focgen.rig.replay import simulate_session
from focgen.rig.rig import Actuator, LinearActuator, Rig, Signals
from focgen.rig.stages import LEAVES

H = 0.05
PUMP = TransferFunction([(0.95, 0.0)], [(0.08, 2.0), (1.0, 1.0)])
SENSOR = TransferFunction([(0.35, 0.0)], [(0.1, 1.0), (1.0, 0.0)])
LINEAR = LinearActuator(TransferFunction([(0.9, 0.0)], [(0.2, 2.0), (1.0, 1.0), (1.0, 0.0)]))
RIGS = {
    "fractional": Rig("bladder", H, Signals("t", "c"), Actuator(1.2, 0.6, (0.86, 0.015)), PUMP, SENSOR),
    "whole": Rig("bladder", H, Signals("t", "c"), LINEAR, PUMP, SENSOR),
}
SETS = {"C": ("pressure", "curvature", "output"), "B": ("pressure", "output"), "A": ("output",)}
FLOW = np.concatenate(
    [np.full(n, q) for n, q in [(40, 0), (60, 5), (300, 0), (30, -5), (80, 0), (50, 4), (300, 0)]]
)


def logged(rig, roles, flow=FLOW, noise=0.002, seed=1, empty=True):
    """A session of one log that begins empty, a tenth of what the gauges show off by noise."""
    tap: dict = {}
    run = Run.of([len(flow)], [0.0], H)
    Chain(rig).run(np.asarray(flow, float), "regulator", "sensor", run, tap=tap)
    rng = np.random.default_rng(seed)
    made = {LEAVES[stage]: y for stage, y in tap.items()}
    signals = {r: made[r] + noise * np.ptp(made[r]) * rng.standard_normal(len(flow)) for r in roles}
    return Experiment("log1", H, {"command": np.asarray(flow, float), **signals}), made


def cut(log, first, last=None, name="log1"):
    """The log from its sample ``first`` on, by a clock of its own."""
    signals = {role: np.asarray(log[role])[first:last] for role in log.signals}
    return replace(log, name=name, signals=signals, start=0.0)


def left(rig, session):
    """The largest that is left of an output, over its range."""
    made = simulate_session(rig, session)
    off = [
        np.max(np.abs(m["output"] - log["output"])) / np.ptp(log["output"]) for m, log in zip(made, session)
    ]
    return max(off)


@pytest.mark.parametrize("roles", SETS.values(), ids=SETS)
@pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS)
def test_a_bladder_is_as_full_as_it_was_left(rig, roles):
    """By where it stood, or by a stroke that put it there, whichever the creep behind it shows."""
    whole, made = logged(rig, roles)
    log = cut(whole, 390)  # at rest since the first stroke
    found = begun(rig, [log])
    assert simulate_session(rig, found)[0]["pressure"][0] == pytest.approx(made["pressure"][390], rel=0.06)
    assert NOTE in found[0].notes
    assert left(rig, found) < 0.05 < 0.4 < left(rig, [log])


@pytest.mark.parametrize("roles", SETS.values(), ids=SETS)
@pytest.mark.parametrize("first", [75, pytest.param(405, marks=pytest.mark.long), 490])
def test_a_pump_may_be_on_its_way_as_a_log_begins(roles, first):
    """Filling from empty, venting, and filling from half; of strokes longer ago the silicone creeps on."""
    rig = RIGS["fractional"]
    log = cut(logged(rig, roles)[0], first)
    assert left(rig, begun(rig, [log])) < 0.15 * left(rig, [log])


@pytest.mark.parametrize(
    "flow", [pytest.param(4.0, marks=pytest.mark.long), pytest.param(-3.0, marks=pytest.mark.long), 1.5]
)
@pytest.mark.parametrize(
    "roles", [("output",), pytest.param(("pressure", "output"), marks=pytest.mark.long)], ids=["A", "B"]
)
def test_a_pump_that_starts_with_the_log_has_left_its_volume_before(roles, flow):
    """It stood there for long: no stroke just before the log has put that in."""
    rig, told = RIGS["whole"], []
    flows = np.r_[np.full(60, 5.0), np.zeros(600), np.full(30, flow), np.zeros(60), np.full(40, -flow)]
    for seed in range(8):
        whole, made = logged(rig, roles, flows, noise=0.01, seed=seed)
        (found,) = begun(rig, [cut(whole, 660)])
        assert found.stands == pytest.approx(made["pressure"][660], rel=0.1)
        told.append("command" in found.begins)
    assert sum(told) <= 1


@pytest.mark.parametrize(
    "roles", [("output",), pytest.param(("pressure", "output"), marks=pytest.mark.long)], ids=["A", "B"]
)
@pytest.mark.parametrize("since", [pytest.param(2, marks=pytest.mark.long), 8])
def test_a_pump_that_is_on_its_way_has_been_left_anywhere_before(roles, since):
    """It has stood at 14 for long; the last stroke began 0.1 or 0.4 s before the log, and shows no other."""
    rig = RIGS["whole"]
    flows = np.r_[
        np.full(60, 5.0), np.zeros(600), np.full(20, -3.0), np.zeros(60), np.full(40, 2.0), np.zeros(60)
    ]
    for seed in range(4):
        whole, _ = logged(rig, roles, flows, noise=0.005, seed=seed)
        log = cut(whole, 660 + since)
        assert left(rig, begun(rig, [log])) < 0.04 * left(rig, [log])


@pytest.mark.parametrize("roles", SETS.values(), ids=SETS)
def test_a_bladder_that_begins_empty_stands_at_0(roles):
    for seed in range(10):
        log, _ = logged(RIGS["fractional"], roles, noise=0.01, seed=seed)
        assert begun(RIGS["fractional"], [log])[0].stands == 0.0


def test_strokes_of_an_earlier_log_are_ahead_of_the_next():
    """A bladder that goes on creeping from many strokes, in a log without one at first."""
    rig = RIGS["fractional"]
    strokes = np.concatenate([np.zeros(20), np.repeat([6, -4, 5, -6, 3, -2.5], 25), np.zeros(20)])
    whole, _ = logged(rig, SETS["A"], np.concatenate([strokes, FLOW]), noise=0.001)
    session = [cut(whole, 0, 170), replace(cut(whole, 190, None, "log2"), start=190 * H)]
    told = begun(rig, session)

    def cost(of):
        pairs = zip(simulate_session(rig, of), of)
        return sum(float(np.mean((made["output"] - log["output"]) ** 2)) for made, log in pairs)

    recalled = with_recalled(rig, told, cost)
    assert recalled[1].before("command").known
    assert cost(recalled) < 0.3 * cost(told)


def placed(effect, form, *values, stage="regulator"):
    of = library()[effect]
    return Placed(effect, next(f for f in of.forms if f.name == form), stage, values)


def in_small_steps(flow, stood, act):
    """The volume of a pump without a lag, which runs in lines: 200 steps a sample."""
    volume, found = stood, [stood]
    for q, then in pairwise(flow):
        for j in range(200):
            volume = act(volume + 0.95 * (q + (then - q) * (j + 0.5) / 200) * H / 200, H / 200)
        found.append(volume)
    return np.array(found)


@pytest.mark.parametrize("stood", [pytest.param(0.0, marks=pytest.mark.long), 3.0])
@pytest.mark.parametrize(
    "lost, act",
    [
        (placed("leak", "running_out", 0.05), lambda v, h: v * np.exp(-0.05 * h)),
        (placed("supply_saturation", "spilt", 4.0), lambda v, h: min(v, 4.0)),
    ],
    ids=["leak", "relief"],
)
def test_what_a_pump_has_put_in_is_lost_for_good(lost, act, stood):
    """Red when a leak or a relief valve only bends what is read of a volume."""
    pump = replace(RIGS["whole"], regulator=TransferFunction([(0.95, 0.0)], [(1.0, 1.0)]))
    run = Run.of([len(FLOW)], [0.0], H, stands=[stood])
    made = Chain(pump, (lost,)).run(np.asarray(FLOW, float), "regulator", "regulator", run)
    assert np.max(np.abs(made - in_small_steps(FLOW, stood, act))) < 0.01
    assert fits_in(lost.form, "regulator", pump)
    assert not fits_in(lost.form, "regulator", replace(pump, regulator=SENSOR))


def moved_in_small_steps(flow, stood, asked, rate, gap):
    """The same of a pump that moves ``rate`` of what it is ``asked``, through a ``gap`` of its spindle."""
    volume, nut, found = 0.0, 0.0, [stood]
    for q, then in pairwise(flow):
        for j in range(200):
            volume += rate(0.95 * asked(q + (then - q) * (j + 0.5) / 200)) * H / 200
            nut = float(np.clip(nut, volume - gap, volume + gap))
        found.append(stood + nut)
    return np.array(found)


MOST, PACE = 0.6 * np.max(np.abs(FLOW)), 0.5 * np.max(np.abs(FLOW))


@pytest.mark.parametrize("stood", [pytest.param(0.0, marks=pytest.mark.long), 3.0])
@pytest.mark.parametrize(
    "less, asked, rate, gap",
    [
        (("flow_limit", "driven", MOST), lambda q: np.clip(q, -MOST, MOST), float, 0.0),
        (("flow_limit", "spent", PACE), float, lambda v: np.clip(v, -PACE, PACE), 0.0),
        (("valve_asymmetry", "back", 0.9), float, lambda v: v * (0.9 if v < 0.0 else 1.0), 0.0),
        (("valve_stiction", "lost_motion", 0.4), float, float, 0.4),
    ],
    ids=["driver", "speed", "way", "spindle"],
)
def test_what_a_pump_does_not_move_is_not_made_up_for(less, asked, rate, gap, stood):
    """Red when a pump that was too slow, or whose spindle turned free, comes to its place later."""
    pump = replace(RIGS["whole"], regulator=TransferFunction([(0.95, 0.0)], [(1.0, 1.0)]))
    effect, run = placed(*less), Run.of([len(FLOW)], [0.0], H, stands=[stood])
    made = Chain(pump, (effect,)).run(np.asarray(FLOW, float), "regulator", "regulator", run)
    whole = Chain(pump).run(np.asarray(FLOW, float), "regulator", "regulator", run)
    expected = moved_in_small_steps(FLOW, stood, asked, rate, gap)
    # a line from sample to sample that passes a limit is cut off at its end, not where it passes
    assert np.max(np.abs(made - expected)) < 0.06 < 0.2 * np.max(np.abs(whole - expected))
    assert fits_in(effect.form, "regulator", pump)
    assert not fits_in(effect.form, "regulator", replace(pump, regulator=SENSOR))


@pytest.mark.parametrize("lasts", [False, True])
def test_a_spindle_lies_in_its_gap_as_the_log_before_left_it(lasts):
    """A stroke up, and in the next log one down, of which the gap takes all of its width: the piston was
    pushed up last. Red when the next log's begin, which is told from where it stood, drags it back."""
    pump = replace(RIGS["whole"], regulator=TransferFunction([(1.0, 0.0)], [(1.0, 1.0)]))
    up = np.r_[np.zeros(5), np.full(20, 3.0), np.zeros(5)]
    run = Run.of([30, 30], [0.0, 30 * H], H, lasts=lasts, stands=[0.0, 2.6])
    lost = placed("valve_stiction", "lost_motion", 0.4)
    made = Chain(pump, (lost,)).run(np.r_[up, -up], "regulator", "regulator", run)
    stroke = 20 * H * 3.0
    np.testing.assert_allclose(made[[29, 30, 59]], [stroke - 0.4, 2.6, 2.6 - (stroke - 0.8)], atol=0.02)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_spindle_lies_as_what_moved_the_piston_between_two_logs_left_it(way):
    """The piston was brought back between two logs, from above or from below: the next stroke that way
    moves it at once, and the gap takes from one the other way. Red when the spindle is taken to lie where
    the log before left it, whatever has happened since."""
    pump = replace(RIGS["whole"], regulator=TransferFunction([(1.0, 0.0)], [(1.0, 1.0)]))
    stroke = np.r_[np.zeros(5), np.full(20, 3.0), np.zeros(5)]
    run = Run.of([30, 30, 30], [0.0, 90 * H, 180 * H], H, stands=[0.0, way * 20.0, -way * 20.0])
    lost = placed("valve_stiction", "lost_motion", 0.4)
    flow = np.r_[stroke, way * stroke, way * stroke]
    made = Chain(pump, (lost,)).run(flow, "regulator", "regulator", run)
    whole = way * 20 * H * 3.0
    expected = [way * 20.0, way * 20.0 + whole, -way * 20.0, -way * 20.0 + whole - way * 0.8]
    np.testing.assert_allclose(made[[30, 59, 60, 89]], expected, atol=0.02)


@pytest.mark.parametrize(
    "effect",
    [
        ("valve_stiction", "lost_motion", 0.4),
        ("leak", "running_out", 0.05),
        ("supply_saturation", "spilt", 9.0),
    ],
    ids=lambda effect: effect[1],
)
def test_a_chain_that_remembers_asks_where_a_pump_stood(effect):
    """Red when a fit gets what an effect made of the pump where it stood before."""
    pump = replace(RIGS["whole"], regulator=TransferFunction([(1.0, 0.0)], [(1.0, 1.0)]))
    flow, run = (
        np.tile(np.asarray(FLOW, float), 2),
        Run.of([len(FLOW)] * 2, [0.0, 99.0], H, stands=[0.0, 2.6]),
    )
    memory: dict = {}
    for stands in ((0.0, 60.0), (0.0, -7.0)):
        made = [
            Chain(pump, (placed(*effect),), remember).run(
                flow, "regulator", "regulator", replace(run, stands=stands)
            )
            for remember in (memory, None)
        ]
        np.testing.assert_array_equal(*made)


def test_a_volume_is_told_through_a_curve():
    """Red when what a pump held is told as if the actuator did not bend what it makes of it."""
    rig, curve = RIGS["whole"], placed("gain_nonlinearity", "force_factor", 0.5, 0.0, 12.0, stage="actuator")
    tap: dict = {}
    Chain(rig, (curve,)).run(
        np.asarray(FLOW, float), "regulator", "sensor", Run.of([len(FLOW)], [0.0], H), tap=tap
    )
    log = cut(Experiment("log1", H, {"command": np.asarray(FLOW, float), "output": tap["sensor"]}), 390)
    volume = tap["regulator"][390]
    bent, even = (begun(rig, [log], of)[0].stands for of in ((curve,), ()))
    assert abs(bent - volume) < 0.2 * abs(even - volume)
