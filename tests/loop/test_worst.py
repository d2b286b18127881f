"""The worst within a rig's uncertainty: by hand, against the rig in a corner, never better than given.

Red when a corner is left out, or the worst is better than the rig as given.
"""

import json
import math
from dataclasses import replace
from itertools import pairwise, product

import pytest

from focgen.cli.main import main
from focgen.control.controller import Controller, ControllerRanges
from focgen.control.files import write_controller
from focgen.loop.design import design
from focgen.loop.frequency import margins_at, shapes
from focgen.loop.simulate import simulate
from focgen.plan.build import build_plan
from focgen.report.control_summary import design_text, simulation_text
from focgen.rig import write_rig
from focgen.rig.corners import EXACT, moved
from focgen.rig.rig import UNITY, Delays, LinearActuator, Ranges, Relative, Rig, Signals, Uncertainty
from tests.conftest import paper_controller, paper_rig

H, DEAD, GAIN = 0.01, 0.3, 2.0
KNOWN = Uncertainty(*[Relative(0.0, 0.0)] * 3)
MARGINS, STEPS = ("phase_deg", "gain_db", "delay_s"), ("overshoot_pct", "settling_s")
SPAN = (0.0, 10.0)


def late(gain, time):
    """A rig of one delay of 0.3 s, whose gain and time may be off by so much."""
    uncertainty = Uncertainty(sensor=Relative(gain, time))
    signals, ranges = Signals("t", "y", "u"), Ranges(SPAN, SPAN, SPAN)
    plain = LinearActuator(UNITY)
    return Rig("late", H, signals, plain, ranges=ranges, delays=Delays(sensor=DEAD), uncertainty=uncertainty)


def integral(gain=GAIN):
    ranges = ControllerRanges(SPAN, SPAN, SPAN)
    return Controller("i", H, UNITY, gain, True, ranges, length=1, arithmetic="f64")


def by_hand(gain, dead_time):
    """Phase margin (°), gain margin (dB) and delay margin (s) of y_k = u_(k−n−1), u = gain ∫ by the
    trapezoidal rule and a sample late: its phase is −90° − (n + 2) ωh."""
    late_by = round(dead_time / H) + 2
    crossover = 2.0 / H * math.atan(gain * H / 2.0)
    limit = 2.0 / H * math.tan(math.pi / 4 / late_by)
    phase = math.pi / 2 - late_by * crossover * H
    return math.degrees(phase), 20.0 * math.log10(limit / gain), phase / crossover


def test_the_worst_margins_of_an_integrator_and_a_delay_by_hand():
    found = simulate(late(0.1, 0.2), integral(), [5.0], duration=8.0).worst
    assert found.corners == 4 and found.stable
    for name, worst, nominal in zip(MARGINS, by_hand(1.1 * GAIN, 1.2 * DEAD), by_hand(GAIN, DEAD)):
        extreme = getattr(found, name)
        assert extreme.value == pytest.approx(worst, rel=2e-3), name
        assert extreme.nominal == pytest.approx(nominal, rel=2e-3), name
        assert extreme.off == replace(EXACT, sensor=Relative(0.1, 0.2)) and extreme.at == 5.0


def test_a_corner_that_is_not_stable_is_said_and_does_not_settle():
    found = simulate(late(0.5, 0.9), integral(2.5), [5.0], duration=20.0)
    assert found.holds and not found.worst.stable
    assert found.worst.phase_deg.value < 0.0 < found.worst.phase_deg.nominal
    assert found.worst.gain_db.value < 0.0 and found.worst.delay_s.value == 0.0
    assert math.isnan(found.worst.settling_s.value) and found.worst.settling_s.nominal > 0.0
    assert "not stable in every corner" in simulation_text(found)


def test_a_rig_that_is_known_reports_what_it_does_as_given():
    rig = replace(paper_rig(), uncertainty=KNOWN)
    found = simulate(rig, paper_controller(200), [0.004, 0.008])
    worst = found.worst
    assert worst.corners == 0 and worst.simulated == () and worst.beyond == ()
    for name in (*MARGINS, *STEPS):
        extreme = getattr(worst, name)
        assert extreme.value == extreme.nominal and extreme.off == EXACT
    assert worst.overshoot_pct.value == max(r.overshoot_pct for r in found.setpoints)
    assert worst.settling_s.value == max(r.settling_s for r in found.setpoints)


@pytest.fixture(scope="module")
def made():
    return design(paper_rig(), settling=2.0, setpoints=[0.004, 0.009, 0.014])


def test_a_designs_worst_is_never_better_than_the_rig_as_given(made):
    worst = made.worst
    for name in MARGINS:
        nominal = min(getattr(point.running, name) for point in made.margins)
        assert getattr(worst, name).nominal == pytest.approx(nominal, rel=1e-9)
        assert getattr(worst, name).value < nominal
    assert worst.overshoot_pct.nominal == made.overshoot_pct < worst.overshoot_pct.value
    assert worst.settling_s.nominal == max(p.running.settling_s for p in made.points) < worst.settling_s.value
    assert made.holds and worst.stable  # the specification is judged by the rig as given


def test_the_worst_margin_is_that_of_the_rig_in_that_corner(made):
    plan = build_plan(made.controller)
    for name in MARGINS:
        extreme = getattr(made.worst, name)
        there = moved(paper_rig(), extreme.off)
        loops = shapes(there, made.controller, plan, 1)
        found = margins_at(there, made.controller, plan, loops, extreme.at).running
        assert extreme.value == pytest.approx(getattr(found, name), rel=1e-3), name


def test_the_worst_step_is_that_of_the_rig_in_that_corner(made):
    for name in STEPS:
        extreme = getattr(made.worst, name)
        rig = replace(moved(paper_rig(), extreme.off), uncertainty=KNOWN)
        run = simulate(rig, made.controller, [extreme.at], duration=10.0)
        assert extreme.value == pytest.approx(getattr(run.setpoints[0], name), rel=1e-6), name
    simulated = simulate(paper_rig(), made.controller, [0.004, 0.009, 0.014], duration=10.0).worst
    for name in (*MARGINS, *STEPS):
        assert getattr(simulated, name).value == pytest.approx(getattr(made.worst, name).value, rel=1e-6)


@pytest.mark.long
def test_more_uncertainty_is_worse(made):
    """Of the same controller."""
    found = []
    for size in (0.1, 0.3, 0.5):
        rig = replace(paper_rig(), uncertainty=Uncertainty(actuator=Relative(size, size, 0.0)))
        found.append(simulate(rig, made.controller, [0.014], duration=5.0).worst)
    for less, more in pairwise(found):
        assert more.phase_deg.value < less.phase_deg.value and more.gain_db.value < less.gain_db.value
        assert more.overshoot_pct.value > less.overshoot_pct.value
        assert more.settling_s.value > less.settling_s.value


@pytest.mark.long
def test_the_simulated_corners_hold_the_worst_of_all(made):
    """All that the actuator may be off by: none settles later than what is reported, or overshoots more."""
    given = paper_rig().uncertainty.actuator
    rows = []
    for gain, time, alpha in product((-1, 1), repeat=3):
        actuator = Relative(gain * given.gain, time * given.time, alpha * given.alpha)
        off = Uncertainty(Relative(0.02 * gain, 0.1), actuator, Relative(0.02 * gain, 0.1))
        rig = replace(moved(paper_rig(), off), uncertainty=KNOWN)
        rows += simulate(rig, made.controller, [0.004, 0.014], duration=8.0).setpoints
    assert made.worst.overshoot_pct.value > max(r.overshoot_pct for r in rows) - 0.2
    assert made.worst.settling_s.value > 0.99 * max(r.settling_s for r in rows)


@pytest.mark.long
def test_set_points_one_after_the_other_are_judged_as_they_follow():
    order = [0.004, 0.012, 0.006]
    found = simulate(paper_rig(), paper_controller(200), order, consecutive=True)
    extreme = found.worst.overshoot_pct
    rig = replace(moved(paper_rig(), extreme.off), uncertainty=KNOWN)
    there = simulate(rig, paper_controller(200), order, consecutive=True, duration=found.duration)
    assert extreme.value == max(r.overshoot_pct for r in there.setpoints)


def test_a_set_point_out_of_reach_in_a_corner_is_left_out_there_and_said():
    rig = replace(paper_rig(), uncertainty=Uncertainty(actuator=Relative(0.5, 0.0, 0.0)))
    low = replace(paper_controller(200), ranges=replace(paper_controller().ranges, output=(0.0, 3.0)))
    found = simulate(rig, low, [0.002, 0.02])
    assert found.worst.beyond == (0.02,)
    assert "left out there: 0.02" in simulation_text(found)


def test_a_rigs_linear_effects_are_in_its_worst_margins():
    controller, effect = paper_controller(200), {"name": "transport_delay", "form": "delay", "delay": 0.08}
    bare = replace(paper_rig(), uncertainty=KNOWN)
    soon = simulate(bare, controller, [0.004], duration=2.0).worst
    behind = simulate(replace(bare, effects=(effect,)), controller, [0.004], duration=2.0).worst
    assert soon.delay_s.value - behind.delay_s.value == pytest.approx(0.08, abs=2e-4)


def test_the_command_that_simulates_reports_it(tmp_path, capsys):
    rig = replace(paper_rig(), uncertainty=Uncertainty(sensor=Relative(0.02, 0.3)))
    write_rig(rig, tmp_path / "rig.toml")
    write_controller(paper_controller(200), tmp_path / "controller.toml")
    files = [str(tmp_path / "rig.toml"), str(tmp_path / "controller.toml")]
    assert main(["simulate", *files, "--setpoints", "0.004", "--duration", "3", "--json"]) == 0
    worst = json.loads(capsys.readouterr().out)["worst"]
    assert worst["phase_deg"] < worst["nominal"]["phase_deg"] and worst["corners"] == 32
    assert abs(worst["at"]["phase_deg"]["off"]["sensor"]["time"]) == 0.3
    assert worst["at"]["overshoot_pct"]["setpoint"] == 0.004


@pytest.mark.long
def test_the_command_that_designs_reports_it(tmp_path, capsys):
    write_rig(
        replace(paper_rig(), uncertainty=Uncertainty(sensor=Relative(0.02, 0.3))), tmp_path / "rig.toml"
    )
    files = [str(tmp_path / "rig.toml"), str(tmp_path / "controller.toml")]
    assert main(["design", files[0], "--out", files[1], "--setpoints", "0.004", "0.01", "--json"]) == 0
    worst = json.loads(capsys.readouterr().out)["worst"]
    assert set(worst) == {
        *MARGINS, *STEPS, "stable", "nominal", "at", "corners", "simulated", "out_of_reach"
    }  # fmt: skip


def test_the_text_names_the_corners(made):
    text = design_text(made)
    assert "The worst within the rig's uncertainty: margins in 32 corners" in text
    assert "A: regulator gain +2 %" in text and "actuator gain +20 %" in text
