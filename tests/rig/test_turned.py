"""Rigs whose signals go below 0, against their inputs, or lie far from 0.

Red when turning a rig changes what it does, when it is not turned back to itself, when a rig is turned by a
gain that it has nowhere in its logs, or when an effect in a rig that works downwards acts where nothing is.
"""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import focgen
from focgen.errors import RigError
from focgen.fractional.transfer import TransferFunction
from focgen.logs.begin import Begin
from focgen.logs.experiment import ROLES, Experiment
from focgen.rig.replay import simulate_session
from focgen.rig.rig import UNITY, Actuator, Delays, LinearActuator, Origins, Ranges, Rig, Signals
from focgen.rig.turned import Turn, turn_of, with_its_way

H, SIGNALS = 0.05, Signals("t", "y", "u", "p", "k")
ACTUATORS = [
    Actuator(1.3, 0.6, (0.4, -0.1, 0.05), offset=0.2),
    LinearActuator(TransferFunction([(3.0, 0.0)], [(0.2, 2.0), (0.5, 1.0), (1.0, 0.0)]), 0.3, 0.1),
]


def lag(gain, time):
    return TransferFunction([(gain, 0.0)], [(time, 1.0), (1.0, 0.0)])


def rig_of(actuator):
    ranges = Ranges((0.0, 2.0), (-0.1, 1.0), (-1.0, 4.0))
    return Rig(
        "r", H, SIGNALS, actuator, lag(0.6, 0.1), lag(2.0, 0.2), ranges, (), Delays(0.0, 0.1), zero=0.05
    )


def logged(seed=1, **begins):
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(0.0, 2.0, 8), 40)
    signals = {role: rng.normal(size=len(u)) for role in ROLES} | {"command": u}
    return Experiment("e", H, signals, begins=begins)


@pytest.mark.parametrize("actuator", ACTUATORS)
@pytest.mark.parametrize("signs", list(product((1, -1), repeat=4)))
def test_a_turned_rig_makes_the_turned_signals_and_turns_back(actuator, signs):
    turn = Turn(dict(zip(ROLES, (*signs, signs[-1]))))
    rig, log = replace(rig_of(actuator), downwards=turn.roles), logged(command=Begin((0.4,)))
    other, turned = turn.rig(rig), turn.log(log, rig)
    assert turn.back.rig(other) == rig and other.turned == turn.roles
    for role, values in turn.back.log(turned, rig).signals.items():
        np.testing.assert_array_equal(values, log[role])
    made, mirrored = simulate_session(rig, [log])[0], simulate_session(other, [turned])[0]
    for role, values in turn.signals(made).items():
        np.testing.assert_allclose(mirrored[role], values, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("actuator", ACTUATORS)
@pytest.mark.parametrize("signs", [(1, 1, 1, 1), (1, 1, -1, 1), (-1, 1, 1, -1)])
def test_a_rig_far_from_0_is_run_from_where_it_rests(actuator, signs):
    lies = Origins(curvature=8.0, output=20.0)
    turn = Turn(dict(zip(ROLES, (*signs, signs[-1]))), lies)
    far = replace(rig_of(replace(actuator, offset=8.2)), downwards=turn.roles, origins=lies)
    log = logged(command=Begin((0.4,)), output=Begin((21.0,)))
    other, turned = turn.rig(far), turn.log(log, far)
    assert other.moved == lies and not other.origins
    back = turn.back.rig(other)
    assert (back.zero, back.actuator.offset) == pytest.approx((far.zero, far.actuator.offset))
    assert back.ranges.output == pytest.approx(far.ranges.output)
    assert replace(back, zero=far.zero, actuator=far.actuator, ranges=far.ranges) == far
    assert turn.back.log(turned, far).begins["output"].levels == pytest.approx((21.0,))
    assert turned.begins["output"].levels == pytest.approx((signs[3] * 1.0,))
    np.testing.assert_allclose(turned["reference"], signs[3] * (log["reference"] - 20.0))
    for role, values in turn.back.log(turned, far).signals.items():
        np.testing.assert_allclose(values, log[role], atol=1e-12)
    made, moved = simulate_session(far, [log])[0], simulate_session(other, [turned])[0]
    for role, values in turn.signals(made).items():
        np.testing.assert_allclose(moved[role], values, rtol=1e-9, atol=1e-9)


def test_an_effect_s_outputs_are_turned_with_it():
    rig = replace(rig_of(ACTUATORS[0]), effects=({"name": "creep", "learned": [-0.5, 2.0]},))
    turn = Turn(dict.fromkeys(ROLES, 1) | {"output": -1})
    assert turn.rig(rig).effects[0]["learned"] == [-2.0, 0.5]
    assert turn.back.rig(turn.rig(rig)).effects == rig.effects
    far = replace(turn, origins=Origins(output=300.0))
    assert far.rig(rig).effects[0]["learned"] == [298.0, 300.5]


@pytest.mark.parametrize("learned", [3.0, [1.0], ["a", "b"], None])
def test_a_learned_range_that_is_none_is_left_to_whoever_reads_it(learned):
    rig = replace(ceiling(downwards=frozenset(ROLES)), ranges=Ranges())
    rig = replace(rig, effects=({**rig.effects[0], "learned": learned},))
    assert focgen.replay(rig, [logged()]).rig.effects == rig.effects


U = np.r_[0.0, 1.0, 0.3, 2.0, 0.0]
LOGS = {"up": U, "down": -U, "either": U - 1.0, "a little below": U - 0.2, "rests at 0": 0.0 * U}


def logs_of(u):
    return [Experiment("e", H, {"command": u, "output": np.zeros(len(u))})]


@pytest.mark.parametrize(
    "u, downwards",
    [
        ("up", []),
        ("down", [*ROLES]),
        ("either", []),
        ("a little below", []),
        ("rests at 0", []),
    ],
)
def test_an_input_that_works_from_0_down_turns_all(u, downwards):
    assert with_its_way(rig_of(ACTUATORS[1]), logs_of(LOGS[u])).downwards == frozenset(downwards)


@pytest.mark.parametrize("u", ["up", "either"])
def test_a_gain_below_0_turns_what_is_behind_it(u):
    rig = rig_of(ACTUATORS[1])
    turned = {
        "regulator": replace(rig, regulator=rig.regulator * -1.0),
        "actuator": replace(rig, actuator=replace(rig.actuator, dynamics=rig.actuator.dynamics * -1.0)),
        "sensor": replace(rig, sensor=rig.sensor * -1.0),
    }
    found = {stage: with_its_way(one, logs_of(LOGS[u])).downwards for stage, one in turned.items()}
    assert found["regulator"] == {"pressure", "curvature", "output", "reference"}
    assert found["actuator"] == {"curvature", "output", "reference"}
    assert found["sensor"] == {"output", "reference"}


def test_an_axis_is_turned_by_its_rate():
    axis = LinearActuator(TransferFunction([(-2.0, 0.0)], [(0.1, 2.0), (1.0, 1.0)]))
    rig = Rig("axis", H, Signals("t", "y", "u"), axis)
    assert with_its_way(rig, logs_of(LOGS["either"])).downwards == {"curvature", "output", "reference"}


@pytest.mark.parametrize("gain, down", [((-0.05, 0.4), False), ((0.05, -0.4), True), ((0.0, 0.3), False)])
def test_the_gain_counts_where_the_logs_are(gain, down):
    rig = replace(rig_of(Actuator(1.3, 0.6, gain)), ranges=Ranges())
    assert ("output" in with_its_way(rig, logs_of(LOGS["up"])).downwards) == down


def test_a_rig_with_effects_says_by_itself_how_they_count():
    rig = replace(rig_of(ACTUATORS[1]), effects=({"name": "contact", "form": "stop", "place": 0.5},))
    assert with_its_way(rig, logs_of(LOGS["down"])) is rig
    stated = replace(rig_of(ACTUATORS[1]), downwards=frozenset(ROLES))
    assert not with_its_way(stated, logs_of(LOGS["up"])).downwards  # without effects it is another session's


@pytest.mark.parametrize(
    "offset, zero, sensor, lies",
    [
        (0.0, 293.0, 1.0, Origins(output=293.0)),
        (293.0, 0.0, 1.0, Origins(293.0, 293.0)),
        (293.0, 0.0, -0.01, Origins(293.0, -2.93)),
        (293.0, 3.0, -0.01, Origins(293.0)),
        (-293.0, 293.0, 1.0, Origins(curvature=-293.0)),
        (293.15, 0.0, 0.1, Origins(293.15, 29.315)),  # and not 29.314999999999998
        (0.0, 1.5, 1.0, Origins()),
        (1.5, 0.0, 1.0, Origins()),
    ],
)
def test_where_a_rig_rests_counts_where_it_is_farther_from_0_than_the_output_moves(
    offset, zero, sensor, lies
):
    read = TransferFunction([(sensor, 0.0)], [(0.2, 1.0), (1.0, 0.0)])
    rig = replace(rig_of(replace(ACTUATORS[1], offset=offset)), zero=zero, sensor=read)
    rests = zero + sensor * offset
    logs = [Experiment("e", H, {"command": U, "output": rests + np.r_[0.0, 2.0, 1.0, 0.5, 0.0]})]
    assert with_its_way(rig, logs).origins == lies
    assert not with_its_way(rig, [logs[0].without("output", "left out")]).origins


def test_an_axis_has_a_zero_and_a_sensor_that_integrates_none():
    moves = TransferFunction([(2.0, 0.0)], [(0.1, 2.0), (1.0, 1.0)])
    axis = Rig("axis", H, Signals("t", "y", "u"), LinearActuator(moves, offset=50.0), zero=0.2)
    stands = [replace(log, signals=log.signals | {"output": 50.0 + U}) for log in logs_of(LOGS["up"])]
    assert with_its_way(axis, stands).origins == Origins(50.0, 50.2)
    counter = TransferFunction([(1.0, 0.0)], [(1.0, 1.0)])
    rig = replace(rig_of(replace(ACTUATORS[1], offset=50.0)), sensor=counter)
    assert not with_its_way(rig, logs_of(LOGS["up"])).origins


def test_a_purge_is_no_other_way():
    purged = [*logs_of(np.tile(LOGS["down"], 20)), *logs_of(np.r_[0.0, 2.0, 0.0, 0.0, 0.0])]
    assert with_its_way(rig_of(ACTUATORS[1]), purged).downwards == frozenset(ROLES)


def ceiling(**more):
    table = {"name": "supply_saturation", "form": "hard", "stage": "regulator", "ceiling": 0.6}
    return replace(rig_of(LinearActuator(lag(2.0, 0.3))), ranges=Ranges(), effects=(table,), **more)


def test_a_ceiling_downwards_is_a_floor():
    log = logged()
    down = Turn(dict.fromkeys(ROLES, -1)).log(log, rig_of(ACTUATORS[1]))
    up = focgen.replay(ceiling(), [log]).simulated["e"]
    found = focgen.replay(ceiling(downwards=frozenset(ROLES)), [down])
    assert np.max(up["pressure"]) == pytest.approx(0.6)
    for role, values in up.items():
        zero = 0.1 if role == "output" else 0.0  # the sensor's own is not turned: 0.05 there and back
        np.testing.assert_allclose(found.simulated["e"][role], zero - values, atol=1e-9)
    assert found.rig.downwards == frozenset(ROLES)
    np.testing.assert_array_equal(found.experiments[0]["command"], down["command"])
    assert np.min(focgen.replay(ceiling(), [down]).simulated["e"]["pressure"]) < -1.0


def test_a_limit_counts_from_where_the_output_rests():
    """An oven in kelvin whose thermometer ends 1.1 K above its room."""
    ends = {"name": "sensor_saturation", "form": "hard", "stage": "sensor", "limit": 1.1}
    up = replace(ceiling(), sensor=UNITY, zero=0.0, effects=(ends,))
    oven = replace(up.actuator, offset=293.0)
    kelvin = replace(up, actuator=oven, origins=Origins(293.0, 293.0))
    log = logged()
    made, found = (focgen.replay(rig, [log]) for rig in (up, kelvin))
    assert np.max(made.simulated["e"]["output"]) == pytest.approx(1.1)
    for role, values in made.simulated["e"].items():
        zero = 293.0 if role in ("curvature", "output") else 0.0
        np.testing.assert_allclose(found.simulated["e"][role], zero + values, atol=1e-9)
    assert found.rig.origins == kelvin.origins and found.rig.actuator.offset == 293.0
    from_0 = focgen.replay(replace(kelvin, origins=Origins()), [log]).simulated["e"]
    assert np.max(from_0["output"]) == pytest.approx(1.1)
    np.testing.assert_array_equal(found.experiments[0]["output"], log["output"])


def test_what_is_said_of_a_log_is_said_in_its_own_signals():
    """An output above 0, of a rig whose range is below, was said to be negative."""
    ranges = Ranges((-2.0, 0.0), (-2.0, 0.0), (-4.0, 0.0))
    log = logged()
    u, up = -log["command"], replace(ceiling(downwards=frozenset(ROLES)), ranges=ranges)
    made = focgen.replay(up, [replace(log, signals={"command": u, "output": u})]).simulated["e"]["output"]
    wrong = replace(log, signals={"command": u, "output": -made})
    bare = replace(up, effects=(), downwards=frozenset())
    assert focgen.replay(up, [wrong]).warnings == focgen.replay(bare, [wrong]).warnings != ()


def test_the_file_says_which_go_downwards(tmp_path):
    rig = ceiling(downwards=frozenset({"pressure", "output"}))
    focgen.write_rig(rig, tmp_path / "rig.toml")
    assert 'downwards = ["pressure", "output"]' in (tmp_path / "rig.toml").read_text()
    assert focgen.read_rig(tmp_path / "rig.toml") == rig


def test_the_file_says_where_effects_count_from(tmp_path):
    rig = ceiling(origins=Origins(output=293.15))
    focgen.write_rig(rig, tmp_path / "rig.toml")
    assert "[signals.origins]\noutput = 293.15" in (tmp_path / "rig.toml").read_text()
    assert focgen.read_rig(tmp_path / "rig.toml") == rig


@pytest.mark.parametrize(
    "changed, said",
    [
        ({"actuator": None, "delays": Delays()}, r"no \[actuator\]"),
        ({"sensor": TransferFunction([(1.0, 0.0)], [(1.0, 1.0)])}, "the sensor integrates"),
    ],
)
def test_a_file_that_counts_the_curvature_from_nowhere_is_refused(changed, said, tmp_path):
    focgen.write_rig(replace(ceiling(origins=Origins(curvature=3.0)), **changed), tmp_path / "rig.toml")
    with pytest.raises(RigError, match=said):
        focgen.read_rig(tmp_path / "rig.toml")


@pytest.mark.parametrize(
    "key, said",
    [
        *(("downwards", said) for said in ('"output"', "true", '["outputs"]', "[1]")),
        *(("origins", said) for said in ("293.15", '{ output = "room" }', "{ pressure = 1.0 }", "[293.15]")),
    ],
)
def test_a_file_that_says_something_else_is_refused(tmp_path, key, said):
    focgen.write_rig(ceiling(), tmp_path / "rig.toml")
    text = (tmp_path / "rig.toml").read_text().replace("[signals]\n", f"[signals]\n{key} = {said}\n")
    (tmp_path / "rig.toml").write_text(text)
    with pytest.raises(RigError, match=key):
        focgen.read_rig(tmp_path / "rig.toml")


def test_nothing_is_turned_where_nothing_is_said():
    assert not turn_of(rig_of(ACTUATORS[0]))
