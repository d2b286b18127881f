"""The closed loop of a rig that carries its effects: against loops worked out by hand, and exact margins.

Red when an effect acts otherwise in the loop than by hand, or a margin leaves it out.
"""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import cont2discrete

from focgen.cli.main import main
from focgen.control.controller import Controller, ControllerRanges
from focgen.control.equilibrium import rest
from focgen.control.files import write_controller
from focgen.errors import RigError
from focgen.fractional.transfer import TransferFunction
from focgen.loop import relaxation
from focgen.loop.chain import chain
from focgen.loop.design import design
from focgen.loop.frequency import shapes
from focgen.loop.linear_effects import linear_part
from focgen.loop.relaxation import Plant, run_with_effects
from focgen.loop.run import run_loop
from focgen.loop.simulate import simulate
from focgen.loop.stepper import FloatStepper
from focgen.plan.build import build_plan
from focgen.report.control import simulation_pictures
from focgen.report.control_summary import design_text, simulation_text
from focgen.rig.effects import Run, form_of, library
from focgen.rig.files import write_rig
from focgen.rig.rig import Ranges, Rig, Signals
from tests.conftest import paper_controller, paper_rig

TS = 0.05
NUM, DEN = [4.0], [1.0, 2.4, 4.0]  # the whole rig: a regulator of natural frequency 2 rad/s
SIGNALS = Signals("t", "y", command="u")
RANGES = Ranges((0.0, 10.0), (0.0, 10.0), (0.0, 10.0))


def bench(*effects, sensor=None):
    """A rig of one stage, whole orders, so that a matrix exponential is exact."""
    regulator = TransferFunction([(NUM[0], 0.0)], [(DEN[0], 2.0), (DEN[1], 1.0), (DEN[2], 0.0)])
    rig = Rig("bench", TS, SIGNALS, None, regulator, ranges=RANGES, effects=tuple(effects))
    return replace(rig, sensor=sensor) if sensor else rig


def pi_controller(gain=0.8):
    reach = (0.0, 10.0)
    transfer = TransferFunction([(0.6, 1.0), (1.0, 0.0)])
    return Controller("pi", TS, transfer, gain, True, ControllerRanges(reach, reach, reach, None), "f64", 50)


def by_hand(reference, gain, parts, reading):
    """The loop stepped by hand on ``parts`` of a sample: PI by the trapezoidal rule, matrix exponential, and
    ``reading(outputs so far on the fine grid)`` → what the controller sees."""
    h = TS / parts
    a, b = np.array([[0.0, 1.0], [-DEN[2], -DEN[1]]]), np.array([[0.0], [NUM[0]]])
    a, b, *_ = cont2discrete((a, b, np.eye(2), np.zeros((2, 1))), h)
    state, fine, u, waiting, before, last = np.zeros(2), [0.0], 0.0, 0.0, 0.0, 0.0
    seen, commands = [], []
    for r in reference:
        y = reading(fine)
        error = r - y
        rate = gain * (0.6 * (error - last) / TS + error)
        last = error
        u = min(max(u + 0.5 * TS * (rate + before), 0.0), 10.0)
        before = rate
        seen.append(y)
        commands.append(waiting)
        for _ in range(parts):
            state = a @ state + b[:, 0] * waiting
            fine.append(state[0])
        waiting = u
    return np.array(commands), np.array(seen)


def in_loop(rig, reference, controller=None):
    controller = controller or pi_controller()
    start = rest(rig, (0.0, 10.0))
    plant = Plant.of(rig, TS, start, len(reference))
    stepper = FloatStepper(controller, len(reference), 1, start.command)
    return plant, run_with_effects(plant, stepper, reference[:, None], start)


def steps(seed, count=400):
    rng = np.random.default_rng(seed)
    return np.repeat(rng.uniform(1.0, 8.0, 8), count // 8)


def test_without_effects_it_is_the_nominal_loop():
    """Of whole orders to rounding; of the paper's rig to the error of straight lines between substeps."""
    for seed in range(3):
        reference = steps(seed)
        _, found = in_loop(bench(), reference)
        start = rest(bench(), (0.0, 10.0))
        stepper = FloatStepper(pi_controller(), len(reference), 1, start.command)
        nominal = run_loop(chain(bench(), TS, len(reference)), stepper, reference[:, None], start)
        assert np.abs(found.output - nominal.output).max() < 1e-11
    rig, controller, points = paper_rig(), paper_controller(), (0.002, 0.014)
    nominal = simulate(rig, controller, points, duration=4.0)
    start, samples = rest(rig, (0.0, 10.0)), len(nominal.ideal.output)
    plant = Plant.of(rig, 0.01, start, samples)
    found = run_with_effects(plant, FloatStepper(controller, samples, 2), nominal.ideal.reference, start)
    for signal in ("command", "pressure", "curvature", "output"):
        truth = getattr(nominal.ideal, signal)
        assert np.abs(getattr(found, signal) - truth).max() < 3e-5 * np.abs(truth).max()


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(s, marks=pytest.mark.long) for s in range(2, 4))])
def test_transport_delay_is_the_loop_delayed_exactly(seed):
    """Three and a half samples of delay: the controller sees what was there then."""
    reference = steps(seed)
    rig = bench({"name": "transport_delay", "form": "delay", "stage": "regulator", "delay": 3.5 * TS})
    plant, found = in_loop(rig, reference)
    late = round(3.5 * plant.parts)
    command, seen = by_hand(reference, 0.8, plant.parts, lambda y: y[-1 - late] if len(y) > late else 0.0)
    assert np.abs(found.command[:, 0] - command).max() < 1e-9
    assert np.abs(found.output[:, 0] - seen).max() < 1e-9
    _, nominal = in_loop(bench(), reference)
    assert np.abs(found.output - nominal.output).max() > 0.1  # it does matter


@pytest.mark.parametrize("seed", range(4))
def test_sensor_quantization_is_rounding(seed):
    reference = steps(seed)
    rig = bench(
        {"name": "sensor_quantization", "form": "rounding", "stage": "sensor", "step": 0.5, "phase": 0.1}
    )
    plant, found = in_loop(rig, reference)

    def rounded(y):
        return 0.5 * np.round((y[-1] - 0.1) / 0.5) + 0.1

    command, seen = by_hand(reference, 0.8, plant.parts, rounded)
    assert np.abs(found.command[:, 0] - command).max() < 1e-9
    assert np.abs(found.output[:, 0] - seen).max() < 1e-9


@pytest.mark.parametrize("seed", range(4))
def test_hysteresis_of_the_sensor_is_a_play_stepped_by_hand(seed):
    reference = steps(seed)
    rig = bench({"name": "sensor_hysteresis", "form": "play", "stage": "sensor", "width": 0.4})
    plant, found = in_loop(rig, reference)
    slack = {"at": 0.0, "seen": 0}

    def play(y):
        for value in y[slack["seen"] :]:
            slack["at"] = min(max(slack["at"], value - 0.4), value + 0.4)
        slack["seen"] = len(y)
        return slack["at"]

    command, seen = by_hand(reference, 0.8, plant.parts, play)
    assert np.abs(found.command[:, 0] - command).max() < 1e-9
    assert np.abs(found.output[:, 0] - seen).max() < 1e-9


def test_sensor_lag_is_the_sensor_with_that_pole():
    lag = 0.3
    slow = bench(sensor=TransferFunction([(1.0, 0.0)], [(lag, 1.0), (1.0, 0.0)]))
    rig = bench({"name": "sensor_lag", "form": "one_lag", "stage": "sensor", "lag": lag})
    reference = steps(5)
    _, found = in_loop(rig, reference)
    stepper = FloatStepper(pi_controller(), len(reference), 1, 0.0)
    truth = run_loop(chain(slow, TS, len(reference)), stepper, reference[:, None], rest(slow, (0.0, 10.0)))
    assert np.abs(found.output - truth.output).max() < 2e-3


@pytest.mark.parametrize(
    "effect",
    [
        {"name": "valve_stiction", "form": "stick_slip", "stage": "regulator", "band": 0.4, "left": 0.5},
        {"name": "valve_asymmetry", "form": "two_lags", "stage": "regulator", "fill": 0.1, "vent": 0.6},
        {"name": "hysteresis", "form": "bouc_wen", "stage": "actuator", "size": 0.5, "width": 0.6},
    ],
)
def test_windows_give_what_sample_by_sample_gives_bit_for_bit(effect, monkeypatch):
    reference = steps(6, 160)
    _, found = in_loop(bench(effect), reference)
    monkeypatch.setattr(relaxation, "_WINDOWS", 10**6)
    _, one_by_one = in_loop(bench(effect), reference)
    assert np.array_equal(found.command, one_by_one.command)
    assert np.array_equal(found.output, one_by_one.output)


def test_what_outlives_a_rest_is_carried_on_and_columns_are_apart():
    """The largest load of the session counts from the first sample; one column's load is not another's."""
    softening = {"name": "softening", "form": "largest", "stage": "actuator", "growth": 0.5, "scale": 8.0}
    fresh, used = bench(softening), bench({**softening, "carried": {"largest": 8.0}})
    command = np.full(200, 3.0)
    for rig, largest in ((fresh, 3.0), (used, 8.0)):
        plant = Plant.of(rig, TS, rest(rig, (0.0, 10.0)), 200)
        settled = plant.signals(command, 0.0)["output"][-1]
        assert settled == pytest.approx(3.0 * (1.0 + 0.5 * largest / 8.0), rel=0.02)  # it overshoots a little
    low, both = ((np.tile(r, (200, 1))) for r in ([2.0], [2.0, 7.0]))
    plant = Plant.of(fresh, TS, rest(fresh, (0.0, 10.0)), 200)
    runs = [
        run_with_effects(plant, FloatStepper(pi_controller(), 200, r.shape[1]), r, rest(fresh, (0.0, 10.0)))
        for r in (low, both)
    ]
    assert np.array_equal(runs[0].output[:, 0], runs[1].output[:, 0])


def test_simulate_shows_what_an_effect_does():
    """A late response overshoots more; the loop without the effect stands beside it as it was."""
    rig = replace(paper_rig(), effects=({"name": "transport_delay", "form": "delay", "delay": 0.1},))
    bare = simulate(paper_rig(), paper_controller(), (0.002, 0.014))
    found = simulate(rig, paper_controller(), (0.002, 0.014))
    assert bare.nominal is None and found.effects == ("transport_delay",)
    assert np.array_equal(found.nominal.output, bare.running.output)
    for worse, better in zip(found.setpoints, bare.setpoints):
        assert worse.overshoot_pct > better.overshoot_pct + 10.0
        assert worse.nominal.settling_s == better.settling_s
    text = simulation_text(found)
    assert "without effects (s)" in text and "transport_delay" in text
    assert set(simulation_pictures(found)) == {"setpoints.png"}
    with pytest.raises(RigError):
        simulate(replace(rig, effects=({"name": "gremlins"},)), paper_controller(), (0.002,))


def test_simulate_command_takes_an_augmented_rig(tmp_path, capsys):
    rig = replace(paper_rig(), effects=({"name": "sensor_lag", "form": "one_lag", "lag": 0.2},))
    write_rig(rig, tmp_path / "rig.toml")
    write_controller(paper_controller(), tmp_path / "controller.toml")
    main(
        [
            "simulate",
            str(tmp_path / "rig.toml"),
            str(tmp_path / "controller.toml"),
            "--setpoints",
            "0.004",
            "--consecutive",
            "--json",
        ]
    )
    payload = json.loads(capsys.readouterr().out)
    assert payload["effects"] == ["sensor_lag"]
    assert payload["setpoints"][0]["overshoot_pct"] > payload["setpoints"][0]["nominal"]["overshoot_pct"]


@pytest.mark.long
def test_a_delay_takes_itself_from_the_delay_margin():
    made = design(paper_rig(), arithmetic="f64", setpoints=(0.006, 0.014))
    late = replace(paper_rig(), effects=({"name": "transport_delay", "form": "delay", "delay": 0.08},))
    found = design(late, arithmetic="f64", setpoints=(0.006, 0.014))
    assert found.schedule == made.schedule  # designed for the nominal chain
    for with_delay, without in zip(found.margins, made.margins):
        for loop, tolerance in (("ideal", 1e-4), ("running", 2e-3)):
            a, b = getattr(with_delay, loop), getattr(without, loop)
            assert b.delay_s - a.delay_s == pytest.approx(0.08, rel=tolerance)
            assert b.phase_deg - a.phase_deg == pytest.approx(
                math.degrees(0.08 * b.crossover_rad_s), rel=tolerance
            )
    for point, bare in zip(found.points, made.points):
        assert point.running == bare.running and bare.effects is None
        assert point.proof is point.effects and point.effects.overshoot_pct > bare.running.overshoot_pct
    assert found.overshoot_pct == max(p.effects.overshoot_pct for p in found.points)


@pytest.mark.long
def test_design_says_what_the_margins_lack():
    loose = (
        {"name": "transport_delay", "form": "delay", "delay": 0.02},
        {"name": "hysteresis", "form": "play", "width": 1e-4},
    )
    found = design(replace(paper_rig(), effects=loose), arithmetic="f64", setpoints=(0.006, 0.014))
    text = design_text(found)
    assert "in the margins: transport_delay" in text and "not in the margins: hysteresis" in text
    assert "with effects (s)" in text and "with the rig's effects" in text


@pytest.mark.parametrize(
    "effect, form", [(e.name, f.name) for e in library().values() for f in e.forms if f.response]
)
def test_linear_parts_are_what_the_simulator_does(effect, form):
    """A sine through the simulated effect comes out as its frequency response says."""
    chosen = {"delay": 0.35, "lag": 0.2, "share": 0.4, "time": 1.2, "quick": 0.3, "slow": 0.2, "period": 0.8}
    shape = form_of(effect, form)
    values = tuple(chosen.get(p.name, 0.25) for p in shape.parameters)
    table = {"name": effect, "form": form, **dict(zip((p.name for p in shape.parameters), values))}
    response, inside, others = linear_part(bench(table))
    assert inside == (effect,) and others == ()
    h, omega = 1e-3, 3.0
    period = 2.0 * np.pi / omega
    t = np.arange(round(40 * period / h)) * h
    run = Run.of([len(t)], [0.0], h)
    answer = shape.act(np.sin(omega * t), values, run)
    last = t > 20 * period
    basis = np.stack([np.sin(omega * t[last]), np.cos(omega * t[last])], axis=1)
    re, im = np.linalg.lstsq(basis, answer[last], rcond=None)[0]
    assert complex(re, im) == pytest.approx(complex(response(np.array([omega]))[0]), abs=3e-3)


def test_margins_without_effects_are_as_they_were():
    """A response of 1 everywhere changes nothing but the far side bands, which do not count."""
    controller = paper_controller()
    plan = build_plan(controller)
    bare = shapes(paper_rig(), controller, plan, 1)
    idle = ({"name": "transport_delay", "form": "delay", "delay": 0.0},)
    with_idle = shapes(replace(paper_rig(), effects=idle), controller, plan, 1)
    seen = bare.running.omega < 0.5 * math.pi / 0.01
    other = np.interp(bare.running.omega[seen], with_idle.running.omega, np.abs(with_idle.running.values))
    assert np.abs(other / np.abs(bare.running.values[seen]) - 1.0).max() < 1e-3
