"""design: the specification is kept in a loop simulated anew, the schedule is the formula, faults refused.

Red when a design misses its specification in a loop simulated anew, or its schedule leaves the formula.
"""

import hashlib
import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import gamma

import focgen
from focgen.cli.main import main
from focgen.control.equilibrium import derived_ranges
from focgen.control.files import read_controller
from focgen.control.inversion import invert
from focgen.control.schedule import gain_table
from focgen.errors import DesignError, FocgenError
from focgen.fractional.transfer import TransferFunction
from focgen.loop.design import design
from focgen.loop.frequency import margins_at, shapes
from focgen.loop.memory import choose_memory
from focgen.loop.simulate import simulate
from focgen.plan.build import build_plan
from focgen.plan.canonical import tables
from focgen.plan.stability import inverse
from focgen.rig.files import write_rig
from focgen.rig.rig import UNITY, Actuator, LinearActuator, Ranges
from tests.conftest import paper_controller, paper_rig

REACH = Ranges((0.0, 10.0), (0.0, 0.25), (0.0, 0.015))


def linear_rig(num, den, **changes):
    """The paper's regulator and sensor around any actuator."""
    values = {"actuator": LinearActuator(TransferFunction(num, den)), "ranges": REACH} | changes
    return replace(paper_rig(), **values)


FRACTIONAL = ([(0.07, 0.0)], [(1.32, 0.6), (1.0, 0.0)])
SECOND_ORDER = ([(0.07, 0.0)], [(0.03, 2.0), (0.5, 1.0), (1.0, 0.0)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A rig file, and the controller that the command makes of it with no specification at all."""
    folder = tmp_path_factory.mktemp("design")
    write_rig(paper_rig(), folder / "rig.toml")
    return folder


@pytest.fixture(scope="module")
def made(folder):
    return design(folder / "rig.toml", folder / "controller.toml")


def test_the_default_keeps_the_papers_result_in_a_new_simulation(made, folder):
    """Fig. 10: 1.5 s on average, less than 5 % overshoot, over 0.002 … 0.014 1/mm."""
    found = simulate(folder / "rig.toml", folder / "controller.toml")
    assert [r.reference for r in found.setpoints] == pytest.approx([0.002 * i for i in range(1, 8)])
    assert np.mean([r.settling_s for r in found.setpoints]) == pytest.approx(1.5, rel=0.03)
    assert max(r.overshoot_pct for r in found.setpoints) < 5.0
    assert made.settling_s == pytest.approx(np.mean([r.settling_s for r in found.setpoints]), rel=1e-3)
    assert made.holds and found.holds


def test_the_schedule_is_the_formula_down_to_its_limit(made):
    line, table = made.schedule, made.controller.gain
    p = np.linspace(table.breakpoints[0], table.breakpoints[-1], 5000)
    formula = (line.intercept + line.slope * p) / (0.0015 + 0.345 * p)
    error = np.abs(table(p) / formula - 1.0).max()
    assert 0.5 * line.error < error <= line.error * 1.001 and line.error < line.tolerance
    assert line.lower_limit == pytest.approx(made.points[0].pressure, rel=1e-6)
    assert table(0.0) == table.gains[0] < 0.1 * line.formula_at_rest
    assert line.K_zero == pytest.approx(-0.0015 / 0.345)


def test_the_controller_is_the_inverse_and_says_where_it_is_from(made, folder):
    written = read_controller(folder / "controller.toml")
    assert written == made.controller
    assert written.transfer == TransferFunction([(1.32, 0.6), (1.0, 0.0)]) and written.integrator
    assert written.designed_from.file == "rig.toml"
    assert written.designed_from.sha256 == hashlib.sha256((folder / "rig.toml").read_bytes()).hexdigest()
    assert written.ranges.output == (0.0, 10.0) and written.units.output == "V"


def test_the_short_memory_bias_is_shown_where_the_length_is_chosen(made):
    L, (term,) = made.memory.length, made.memory.bias
    from scipy.special import gammaln

    exact = 1.32 * 0.01**-0.6 * math.exp(gammaln(L + 0.4) - gammaln(L + 1)) / gamma(0.4)
    assert term.bias == pytest.approx(exact, rel=1e-9)
    assert term.bias == pytest.approx(1.32 * (L * 0.01) ** -0.6 / gamma(0.4), rel=1e-2)
    assert made.memory.crossover_error < 0.01


def test_margins_shrink_on_the_way_to_what_runs(made):
    for point in made.margins:
        assert point.frozen.phase_deg > point.ideal.phase_deg > point.sampled.phase_deg
        assert point.sampled.phase_deg == pytest.approx(point.running.phase_deg, abs=1.0)
        assert point.ideal.delay_s > point.running.delay_s > 0.0 and point.running.stable


def test_small_set_points_are_what_the_frozen_loop_with_the_true_slope_does(made):
    """Margins are for the slope of K(p)p, about twice K: so is the speed of the loop."""
    for point, margin in zip(made.points, made.margins):
        slope = (0.0015 + 2 * 0.345 * point.pressure) / (0.0015 + 0.345 * point.pressure)
        assert margin.ideal.crossover_rad_s == pytest.approx(slope * margin.frozen.crossover_rad_s, rel=0.03)


@pytest.mark.parametrize("arithmetic", [pytest.param("q31", marks=pytest.mark.long), "q15"])
def test_the_gain_margin_is_where_the_running_loop_starts_to_swing(arithmetic):
    """The margin as it will run, against the loop as it runs: 2 % below it swings die out, 2 % above they
    grow.
    """
    rig = linear_rig(*FRACTIONAL)
    made = design(rig, settling=1.0, arithmetic=arithmetic, length=200)
    margin = 10.0 ** (made.margins[0].running.gain_db / 20.0)
    free = replace(
        made.controller.ranges, reference=(-0.015, 0.015), measurement=(-0.015, 0.015), output=(-50.0, 50.0)
    )
    for factor, grows in ((0.98, False), (1.02, True)):
        louder = replace(made.controller, ranges=free, gain=made.controller.gain * margin * factor)
        output = simulate(rig, louder, [0.0005], duration=12.0).running.output[:, 0]
        early, late = np.ptp(output[300:600]), np.ptp(output[900:])
        assert (late > 1.1 * early) if grows else (late < 0.9 * early), (early, late)


def test_margins_follow_gain_and_delay_exactly():
    rig = linear_rig(*FRACTIONAL)
    controller = design(rig, settling=1.0, arithmetic="f64").controller
    plan = build_plan(controller)
    now, late = (
        margins_at(rig, controller, plan, shapes(rig, controller, plan, d), 0.1).running for d in (0, 1)
    )
    assert now.delay_s - late.delay_s == pytest.approx(controller.sample_time, rel=1e-4)
    assert now.crossover_rad_s == pytest.approx(late.crossover_rad_s, rel=1e-9)


@pytest.mark.parametrize("specification", [0.8, pytest.param(3.0, marks=pytest.mark.long)])
def test_a_linear_rig_settles_as_wished_at_every_point(specification):
    made = design(linear_rig(*FRACTIONAL), settling=specification)
    assert not made.controller.scheduled
    for point in made.points:
        assert specification * 0.95 < point.running.settling_s <= specification


def test_an_integer_second_order_actuator_gets_a_roll_off():
    made = design(linear_rig(*SECOND_ORDER), settling=1.0)
    num, den = made.controller.transfer.num, made.controller.transfer.den
    assert np.allclose(num, SECOND_ORDER[1], rtol=1e-12) and [term.order for term in den] == [1.0, 0.0]
    assert made.holds and made.memory.length == 2 and any("roll-off" in note for note in made.notes)


def test_an_actuator_that_integrates_gets_no_second_integrator():
    made = design(linear_rig([(0.05, 0.0)], [(0.4, 2.0), (1.0, 1.0)]), settling=2.0)
    assert not made.controller.integrator and made.holds
    assert all(abs(point.running.steady_error) < 1e-3 * point.reference for point in made.points)


def test_an_overshoot_alone_gives_the_fastest_that_keeps_it():
    careful, bold = (design(linear_rig(*FRACTIONAL), overshoot=pct) for pct in (0.5, 5.0))
    assert careful.overshoot_pct <= 0.5 and 3.0 < bold.overshoot_pct <= 5.0
    assert bold.settling_s < 0.9 * careful.settling_s
    assert bold.margins[0].running.phase_deg < careful.margins[0].running.phase_deg - 3.0


def test_an_impossible_wish_names_a_feasible_one():
    rig = linear_rig(*FRACTIONAL)
    with pytest.raises(DesignError) as caught:
        design(rig, settling=0.2)
    feasible = float(caught.value.remedy.split("--settling ")[1].split()[0])
    assert 0.3 < feasible < 1.0
    assert design(rig, settling=feasible).settling_s <= feasible * 1.02


def test_a_memory_too_short_for_the_wish_is_said():
    made = design(linear_rig(*FRACTIONAL), settling=1.5, length=5)
    assert not made.holds and made.memory.bias[0].bias > 1.0


def test_the_length_chosen_is_one_whose_recursion_is_stable():
    """1/(10 s^1.2 + 1) cut off at 64 samples of 10 ms is unstable, small as its error at the crossover is."""
    controller = replace(
        paper_controller(), transfer=TransferFunction([(1.0, 0.0)], [(10.0, 1.2), (1.0, 0.0)])
    )
    chosen = choose_memory(controller, 30.0, None)
    assert inverse(tables(controller, 64).feedback.weights) is None
    assert inverse(tables(controller, chosen.length).feedback.weights) is not None
    short = choose_memory(controller, 30.0, 50)
    assert short.crossover_error < 0.01  # it is not the error that ruled it out


def test_a_rig_without_pressure_is_scheduled_by_its_command(made):
    blind = replace(paper_rig(), signals=replace(paper_rig().signals, pressure=None))
    found = simulate(blind, made.controller)
    assert any("logs no pressure" in note for note in found.notes)
    assert found.setpoints[3].settling_s != pytest.approx(made.points[3].running.settling_s, rel=1e-3)


def test_absent_ranges_are_derived_and_said():
    ranges, notes = derived_ranges(replace(paper_rig(), ranges=Ranges()))
    top = 10.0 * 152.48 / 1528.0
    assert ranges.command == (0.0, 10.0) and ranges.pressure == pytest.approx((0.0, top))
    assert ranges.output == pytest.approx((0.0, 0.0015 * top + 0.345 * top**2)) and len(notes) == 3


def test_breakpoints_are_as_few_as_the_tolerance_allows():
    """1/p: a chord from a to b is off by (b − a)²/4ab at most, so n pieces reach a ratio that is known."""
    for tolerance in (0.01, 0.001):
        table = gain_table(lambda p: 1.0 / p, 0.05, 0.5, tolerance)
        pieces = len(table.schedule.breakpoints) - 1
        widest = 1.0 + 2.0 * tolerance + 2.0 * math.sqrt(tolerance + tolerance**2)
        assert table.error <= tolerance
        assert (
            math.ceil(math.log(10.0) / math.log(widest))
            <= pieces
            <= 1.1 * math.log(10.0) / math.log(widest) + 1
        )


# ------------------------------------------------------------------------------------------------- faults


def actuator(*gain, alpha=0.6):
    return replace(paper_rig(), actuator=Actuator(1.32, alpha, gain))


FAULTS = {
    "no actuator": (replace(paper_rig(), actuator=None), {}, "nothing to invert"),
    "K changes sign": (actuator(-0.03, 0.345), {"lowest": 0.05}, "changes sign at p = 0.087"),
    "output turns back": (actuator(0.2, -2.5, 9.26), {}, "turns back at p = 0.06"),
    "output saturates": (actuator(0.1, -0.3), {}, "0.01 is out of reach; reachable is -0.199 … 0.00833"),
    "non-minimum phase": (
        linear_rig([(-1.0, 1.0), (1.0, 0.0)], [(1.0, 1.0), (1.0, 0.0)]),
        {},
        "zero at 1 rad/s",
    ),
    "fractional zero": (
        linear_rig([(-1.0, 0.5), (2.0, 0.0)], [(1.0, 1.0), (1.0, 0.0)]),
        {},
        "zero at 4 rad/s",
    ),
    "unstable": (linear_rig([(1.0, 0.0)], [(1.0, 1.0), (-2.0, 0.0)]), {}, "pole at 2 rad/s"),
    "double integrator": (linear_rig([(1.0, 0.0)], [(1.0, 2.0)]), {}, "integrates more than once"),
    "no static gain": (linear_rig([(1.0, 1.0)], [(1.0, 1.0), (1.0, 0.0)]), {}, "static gain is 0"),
    "regulator integrates": (
        replace(paper_rig(), regulator=TransferFunction([(1, 0)], [(1, 1)])),
        {},
        "[regulator]: has the static gain inf, so the loop could not hold",
    ),
    "out of reach": (paper_rig(), {"setpoints": [0.01, 0.5]}, "0.5 is out of reach; reachable is 0 … 0.345"),
    "at rest": (paper_rig(), {"setpoints": [0.0]}, "the rest itself"),
    "NaN set point": (paper_rig(), {"setpoints": [math.nan]}, "not finite"),
    "no set point": (paper_rig(), {"setpoints": []}, "are none"),
    "a regulator that grows": (
        replace(paper_rig(), regulator=TransferFunction([(0.5, 0)], [(0.3, 1), (-1.0, 0)])),
        {},
        "grows by itself, by a factor of e every 0.3 s",
    ),
    "settling NaN": (paper_rig(), {"settling": math.nan}, "above 0 s"),
    "settling 0": (paper_rig(), {"settling": 0.0}, "above 0 s"),
    "settling next to 0": (paper_rig(), {"settling": 1e-320}, "above 0 s"),
    "overshoot negative": (paper_rig(), {"overshoot": -1.0}, "0 or more"),
    "length 0": (paper_rig(), {"length": 0}, "give 1 to"),
    "length beyond the ring": (paper_rig(), {"length": 10**8}, "give 1 to 65534"),
    "arithmetic": (paper_rig(), {"arithmetic": "q7"}, "choose one of"),
    "delay": (paper_rig(), {"delay": 2}, "0 or 1 sample"),
    "T of no size": (replace(paper_rig(), actuator=Actuator(1e-300, 0.6, (0.345,))), {}, "1e-502 to"),
    "a regulator of no size": (
        replace(
            paper_rig(), regulator=TransferFunction([(152.48, 0)], [(1, 2), (53.39, 1), (1.528e-140, 0)])
        ),
        {},
        "too far apart",
    ),
    "an actuator of no size": (
        linear_rig([(1.0, 0.0)], [(1.0, 2.0), (5.0, 0.001), (1e-5, 0.0)]),
        {},
        "cannot be inverted (its time constants are too far apart",
    ),
    "slower than can be simulated": (paper_rig(), {"settling": 5000.0}, "raise the rig's sample_time"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_name_where_what_and_remedy(fault):
    rig, options, expected = FAULTS[fault]
    with pytest.raises(FocgenError) as caught:
        design(rig, **options)
    assert expected in str(caught.value)
    assert caught.value.remedy and "\n" not in str(caught.value)


def test_a_zero_of_the_regulator_or_sensor_does_not_matter():
    """Only the actuator is inverted."""
    rig = linear_rig(
        *FRACTIONAL, sensor=TransferFunction([(-0.01, 1.0), (1.0, 0.0)], [(0.1, 1.0), (1.0, 0.0)])
    )
    assert invert(rig, 1.0).transfer == TransferFunction([(1.32, 0.6), (1.0, 0.0)])


# ------------------------------------------------------------------------------------------------ command


def test_the_command_prints_json_and_writes_the_controller(tmp_path, capsys):
    write_rig(linear_rig(*FRACTIONAL), tmp_path / "rig.toml")
    out = tmp_path / "new" / "controller.toml"
    status = main(
        [
            "design",
            str(tmp_path / "rig.toml"),
            "--out",
            str(out),
            "--settling",
            "1",
            "--json",
            "--report",
            str(tmp_path / "pictures"),
        ]
    )
    found = json.loads(capsys.readouterr().out)
    assert status == 0 and read_controller(out).arithmetic == "q31"
    assert len(found["settling_s"]) == len(found["overshoot_pct"]) == len(found["operating_points"]) == 7
    assert all(0.9 < seconds <= 1.0 for seconds in found["settling_s"].values())
    assert found["margins"]["ideal"]["phase_deg"] > found["margins"]["running"]["phase_deg"] > 45.0
    assert {"gain_db", "delay_s", "by_operating_point"} <= set(found["margins"]["truncated"])
    assert (tmp_path / "pictures" / "margins.png").read_bytes().startswith(b"\x89PNG")


def test_the_command_refuses_in_one_line_and_writes_nothing(tmp_path, capsys):
    write_rig(replace(paper_rig(), actuator=None), tmp_path / "rig.toml")
    status = main(["design", str(tmp_path / "rig.toml"), "--out", str(tmp_path / "deep" / "controller.toml")])
    lines = capsys.readouterr()
    assert status == 2 and lines.out == "" and lines.err.count("\n") == 1
    assert lines.err.startswith("focgen: error: ") and not (tmp_path / "deep").exists()


def test_the_package_offers_the_function():
    assert focgen.design is design and UNITY.is_proper
