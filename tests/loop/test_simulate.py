"""simulate: what it reports is what the loop does, and what cannot be simulated is refused.

Red when a figure in the report is not what the loop did.
"""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import focgen
from focgen.cli.main import main
from focgen.control.controller import Source, Units
from focgen.control.equilibrium import derived_ranges
from focgen.control.files import write_controller
from focgen.errors import ControllerError, DesignError, FocgenError, PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.loop.simulate import simulate
from focgen.report.control import simulation_pictures
from focgen.report.control_summary import simulation_text
from focgen.rig.files import write_rig
from focgen.rig.rig import UNITY, Actuator, Ranges
from tests.conftest import paper_controller, paper_rig

POINTS = (0.002, 0.008, 0.014)


@pytest.fixture(scope="module")
def steps():
    """The paper's controller, eq. (6) and (7), on the loop with K(p)p."""
    return simulate(paper_rig(), paper_controller(), POINTS)


@pytest.fixture
def files(tmp_path):
    write_rig(paper_rig(), tmp_path / "rig.toml")
    write_controller(paper_controller(), tmp_path / "controller.toml")
    return tmp_path


def test_the_integrator_leaves_no_steady_error(steps):
    assert steps.holds and [r.verdict for r in steps.setpoints] == ["settles"] * 3
    for result in steps.setpoints:
        assert abs(result.steady_error) < 0.01 * result.reference
    longer = simulate(paper_rig(), paper_controller(), POINTS, duration=4.0 * steps.duration)
    for late, early in zip(longer.setpoints, steps.setpoints):
        assert abs(late.steady_error) < 0.5 * abs(early.steady_error)


@pytest.mark.parametrize(
    "arithmetic", ["f32", "q15", *(pytest.param(a, marks=pytest.mark.long) for a in ("f64", "q31"))]
)
def test_an_exponential_memory_runs_like_an_infinite_one(arithmetic):
    """In every arithmetic the loop is the ideal one's, which no exponentials are in."""
    controller = paper_controller(memory="exponential", tolerance=1e-3, arithmetic=arithmetic)
    found = simulate(paper_rig(), controller, POINTS)
    step = found.ideal.output[-1]
    near = 5e-3 if arithmetic == "q15" else 5e-4
    assert np.abs(found.running.output - found.ideal.output).max() < near * step.max()
    assert found.states == 13 and "13 exponentials" in simulation_text(found)


def test_the_frozen_loop_stands_beside_it(steps):
    """At the set points' pressures (0.074 … 0.199 bar) the frozen loop is the paper's, between 1.98 and 0.91
    s.
    """
    for result, settling in zip(steps.setpoints, (1.98, 1.20, 0.91)):
        assert result.frozen.settling_s == pytest.approx(settling, rel=0.02)
        assert result.frozen.overshoot_pct < 0.1


def test_what_is_reported_is_in_the_signals(steps):
    time = steps.running.time
    for i, result in enumerate(steps.setpoints):
        output = steps.running.output[:, i]
        off = np.abs(output - result.reference) > 0.05 * result.reference
        assert off[time < result.settling_s - 0.011].any() and not off[time > result.settling_s + 0.011].any()
        assert result.overshoot_pct == pytest.approx(
            100 * max(0.0, output.max() / result.reference - 1), abs=1e-9
        )
        assert result.peak_pressure >= steps.running.pressure[:, i].max()


def test_q31_is_close_to_the_ideal_and_q15_less(steps):
    """From rest and within the memory, only quantisation is left between the two."""

    def gap(simulation):
        samples = min(simulation.length, len(simulation.running.output))
        return np.abs(simulation.running.output - simulation.ideal.output)[:samples].max()

    coarse = simulate(paper_rig(), paper_controller(), POINTS, arithmetic="q15")
    assert 0.0 < gap(steps) < 1e-8 < gap(coarse) < 1e-4


def test_a_short_memory_shows_in_the_response():
    short = simulate(paper_rig(), paper_controller(), POINTS, length=40)
    gap = np.abs(short.running.output - short.ideal.output)
    assert short.length == 40 and gap[:40].max() < 1e-8 < 1e-4 < gap.max()


def test_consecutive_steps_start_where_the_last_one_ended():
    found = simulate(paper_rig(), paper_controller(), (0.004, 0.01, 0.006), consecutive=True, duration=3.0)
    assert found.running.output.shape == (900, 1)
    assert [r.start for r in found.setpoints] == pytest.approx([0.0, 0.004, 0.01])
    reference = found.running.reference[:, 0]
    assert reference[299] == 0.004 and reference[300] == 0.01 and reference[-1] == 0.006
    alone = simulate(paper_rig(), paper_controller(), (0.004,), duration=3.0)
    assert np.abs(found.running.output[:300, 0] - alone.running.output[:, 0]).max() < 1e-12


def test_limits_hold_the_command():
    tight = replace(paper_controller(), ranges=replace(paper_controller().ranges, output=(0.0, 2.2)))
    found = simulate(paper_rig(), tight, (0.014,))
    assert found.running.command.max() == pytest.approx(2.2, rel=1e-6)
    assert found.setpoints[0].overshoot_pct < 20.0  # without anti-windup it would be far more


@pytest.mark.long
def test_an_unstable_loop_is_said():
    louder = replace(
        paper_controller(), gain=6000.0, ranges=replace(paper_controller().ranges, schedule=None)
    )
    found = simulate(paper_rig(), louder, (0.008,), duration=10.0)
    (result,) = found.setpoints
    assert not found.holds and result.verdict == "oscillates" and math.isnan(result.settling_s)
    assert result.frozen is None


def test_a_rig_of_one_stage():
    """What is absent is 1: an integrator around a lag, settled after ln 20 / k at k well below the lag's
    corner.
    """
    rig = replace(
        paper_rig(),
        regulator=UNITY,
        actuator=None,
        sensor=TransferFunction([(1.0, 0.0)], [(0.001, 1.0), (1.0, 0.0)]),
        ranges=Ranges((0, 5), (0, 5), (0, 5)),
    )
    ranges = replace(paper_controller().ranges, reference=(0.0, 5.0), measurement=(0.0, 5.0), schedule=None)
    controller = replace(paper_controller(), transfer=UNITY, gain=0.5, ranges=ranges, arithmetic="f64")
    found = simulate(rig, controller, (1.0,), duration=20.0)
    assert found.setpoints[0].settling_s == pytest.approx(math.log(20.0) / 0.5, rel=0.01)


def test_default_set_points_are_those_of_fig_10():
    found = simulate(paper_rig(), paper_controller(), duration=0.1)
    assert [r.reference for r in found.setpoints] == pytest.approx([0.002 * i for i in range(1, 8)])


# -------------------------------------------------------------------------------------------------- faults


def other(**changes):
    return replace(paper_controller(), ranges=replace(paper_controller().ranges, **changes))


FAULTS = {
    "out of reach": (
        paper_rig(),
        other(reference=(0.0, 0.5)),
        {"setpoints": [0.45]},
        DesignError,
        "reachable is 0 … 0.345",
    ),
    "outside the controller's range": (
        paper_rig(),
        paper_controller(),
        {"setpoints": [0.03]},
        DesignError,
        "outside",
    ),
    "units": (paper_rig(), other(measurement=(0.0, 20.0)), {}, ControllerError, "a factor of 1e+03"),
    "pressure units": (paper_rig(), other(schedule=(0.0, 25.0)), {}, ControllerError, "same unit"),
    "NaN": (paper_rig(), paper_controller(), {"setpoints": [math.nan]}, DesignError, "not finite"),
    "no step": (paper_rig(), paper_controller(), {"setpoints": [0.0]}, DesignError, "where the step starts"),
    "no step between": (
        paper_rig(),
        paper_controller(),
        {"setpoints": [0.01, 0.01], "consecutive": True},
        DesignError,
        "where the step starts",
    ),
    "duration": (paper_rig(), paper_controller(), {"duration": -1.0}, DesignError, "above 0 s"),
    "too long": (paper_rig(), paper_controller(), {"duration": 1e6}, DesignError, "give 0.02 … 600 s"),
    "delay": (paper_rig(), paper_controller(), {"delay": 3}, DesignError, "0 or 1"),
    "length": (paper_rig(), paper_controller(), {"length": 0}, PlanError, "memory length"),
    "zero numerator": (
        paper_rig(),
        replace(paper_controller(), transfer=TransferFunction([(0.0, 0.0)])),
        {},
        PlanError,
        "zero numerator",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_name_where_what_and_remedy(fault):
    rig, controller, options, kind, expected = FAULTS[fault]
    with pytest.raises(FocgenError) as caught:
        simulate(rig, controller, **options)
    assert isinstance(caught.value, kind) and expected in str(caught.value) and caught.value.remedy


def test_another_rig_and_another_rate_are_noted(files):
    stranger = replace(paper_controller(), sample_time=0.02, designed_from=Source("old.toml", "0" * 64))
    write_controller(stranger, files / "controller.toml")
    notes = simulate(files / "rig.toml", files / "controller.toml", POINTS, duration=1.0).notes
    assert any("another state of the rig" in note for note in notes) and any(
        "0.02 s" in note for note in notes
    )


# ------------------------------------------------------------------------------------------------- command


def test_json_carries_every_set_point(files, capsys):
    status = main(
        [
            "simulate",
            str(files / "rig.toml"),
            str(files / "controller.toml"),
            "--setpoints",
            "0.004",
            "0.01",
            "--json",
            "--report",
            str(files / "pictures"),
        ]
    )
    found = json.loads(capsys.readouterr().out)
    assert status == 0 and [s["reference"] for s in found["setpoints"]] == [0.004, 0.01]
    assert all({"settling_s", "overshoot_pct", "steady_error"} <= set(s) for s in found["setpoints"])
    assert (files / "pictures" / "setpoints.png").read_bytes().startswith(b"\x89PNG")


def test_a_loop_that_does_not_hold_gives_status_1_and_null(files, capsys):
    louder = replace(
        paper_controller(), gain=6000.0, ranges=replace(paper_controller().ranges, schedule=None)
    )
    write_controller(louder, files / "controller.toml")
    arguments = ["simulate", str(files / "rig.toml"), str(files / "controller.toml"), "--setpoints", "0.008"]
    assert main([*arguments, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["setpoints"][0]["settling_s"] is None
    assert main(arguments) == 1
    assert "0.008 oscillates" in capsys.readouterr().out


def test_bad_arguments_give_status_2_and_one_line(files, capsys):
    assert main(["simulate", str(files / "none.toml"), str(files / "controller.toml")]) == 2
    lines = capsys.readouterr()
    assert lines.out == "" and lines.err.startswith("focgen: error: ") and lines.err.count("\n") == 1


def test_pictures_are_the_same_every_time(steps):
    assert simulation_pictures(steps) == simulation_pictures(steps)
    assert focgen.simulate is simulate


def test_a_rig_whose_gain_vanishes_at_rest_still_simulates():
    rig = replace(paper_rig(), actuator=Actuator(1.32, 0.6, (0.0, 0.35)))
    assert simulate(rig, paper_controller(), (0.01,)).setpoints[0].verdict == "settles"


def test_a_rig_and_a_controller_in_different_units_are_refused():
    """Ranges in bar and in psi differ by 14.5, which may be two rigs; by their units they may not."""
    signals = replace(paper_rig().signals, units={"pressure": "psi", "command": "V", "output": "1/mm"})
    rig = replace(paper_rig(), signals=signals)
    units = Units("1/mm", "V", "bar")
    for function in (simulate, lambda rig, controller: focgen.study("memory", controller, rig=rig)):
        with pytest.raises(ControllerError, match=r"schedule: is 'bar', the rig has 'psi'"):
            function(rig, paper_controller(units=units))
    assert simulate(rig, paper_controller(units=replace(units, schedule="lbf/in**2")), POINTS[:1]).setpoints


def test_a_curvature_in_another_unit_than_the_output_is_told_of_without_a_sensor():
    """The command beside the pressure was told of; this was a controller a thousand times off."""
    signals = replace(paper_rig().signals, curvature="k", units={"curvature": "1/m", "output": "1/mm"})
    rig = replace(paper_rig(), signals=signals, sensor=UNITY)
    said = derived_ranges(rig)[1]
    assert any("a curvature in 1/m counts as an output in 1/mm" in note for note in said)
    one = replace(signals, units={"curvature": "1/mm", "output": "1/mm"})
    assert not any("counts as an output" in note for note in derived_ranges(replace(rig, signals=one))[1])


def test_no_set_points_are_not_numbers_that_are_infinite():
    with pytest.raises(DesignError, match="are none"):
        simulate(paper_rig(), paper_controller(40), setpoints=[])


def test_a_rig_that_grows_by_itself_is_told_by_its_stage():
    grows = TransferFunction([(0.5, 0)], [(0.3, 1), (-1.0, 0)])
    with pytest.raises(FocgenError, match="regulator.*grows by itself"):
        simulate(replace(paper_rig(), regulator=grows), paper_controller(40), setpoints=[0.004])
