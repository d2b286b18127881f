"""The controller's stage: departures of a running controller found from logs.

Red when a departure of the controller goes unseen, or what its file says counts as one.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.control.controller import Controller, ControllerRanges
from focgen.diagnosis.controller.check import check_controller
from focgen.diagnosis.controller.quantisation import count_of
from focgen.diagnosis.controller.stamps import lost, unsteadiness
from focgen.errors import ControllerError
from focgen.fractional.transfer import TransferFunction
from focgen.fractional.weights import gl_weights
from focgen.logs.experiment import Experiment
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.ideal import ideal
from focgen.plan.scenario import Reset, Scenario, physical_trace, to_raw

CONTROLLER = Controller(
    "foc",
    0.02,
    TransferFunction([(1.3, 0.6), (1.0, 0.0)]),
    40.0,
    True,
    ControllerRanges((0.0, 0.02), (0.0, 0.02), (0.0, 10.0)),
    length=1000,
)
N = 1500


def inputs(seed=0):
    rng = np.random.default_rng(seed)
    ref = np.repeat([0, 0.01, 0.004, 0.012, 0.0], N // 5)
    meas = np.convolve(ref, np.exp(-np.arange(200) / 40) / 40)[:N] * 0.95 + rng.normal(0, 2e-5, N)
    return ref, np.clip(meas, 0, 0.02)


def log_of(u, ref, meas, raw=None):
    return Experiment("loop", 0.02, {"reference": ref, "output": meas, "command": u}, raw_time=raw)


def command(controller=CONTROLLER, length=None):
    ref, meas = inputs()
    return ideal(controller, Scenario(ref[None], meas[None]), length).u[0], ref, meas


def effects(found):
    return [[d.effect for d in tied] for tied in found.causes]


def test_the_ideal_controller_departs_in_nothing():
    found = check_controller(CONTROLLER, [log_of(*command())])
    assert not found.causes and not found.resolved


def test_neither_does_one_that_began_with_its_first_error():
    ref, meas = inputs()
    ref = ref + 0.003
    begun = Scenario(ref[None], meas[None], resets=(Reset(0, 0, ref[0], meas[0], 2.0),))
    found = check_controller(CONTROLLER, [log_of(ideal(CONTROLLER, begun).u[0], ref, meas)])
    assert not found.causes and not found.resolved


@pytest.mark.parametrize("begins", [False, True])
@pytest.mark.parametrize(
    "length",
    [
        20,
        pytest.param(50, marks=pytest.mark.long),
        pytest.param(100, marks=pytest.mark.long),
        pytest.param(137, marks=pytest.mark.long),
        pytest.param(600, marks=pytest.mark.long),
    ],
)
def test_short_memory(length, begins):
    ref, meas = inputs()
    ref = ref + 0.003
    resets = (Reset(0, 0, ref[0], meas[0], 2.0),) if begins else ()
    u = ideal(CONTROLLER, Scenario(ref[None], meas[None], resets=resets), length).u[0]
    found = check_controller(CONTROLLER, [log_of(u, ref, meas)])
    assert effects(found) == [["short_memory"]]
    assert found.causes[0][0].value == pytest.approx(length, rel=0.05) and found.causes[0][0].share > 0.97


@pytest.mark.long
def test_a_long_memory_is_found_in_a_long_log():
    ref, meas = (np.tile(part, 10) for part in inputs())
    stated = replace(CONTROLLER, length=20000)
    u = ideal(stated, Scenario(ref[None], meas[None]), 5000).u[0]
    found = check_controller(stated, [log_of(u, ref, meas)])
    assert effects(found) == [["short_memory"]]
    assert found.causes[0][0].value == pytest.approx(5000, rel=0.05)


def test_a_memory_that_outlasts_most_of_the_log_is_an_infinite_one():
    ref, meas = inputs()
    stated = replace(CONTROLLER, length=1300)
    u = ideal(stated, Scenario(ref[None], meas[None]), 1300).u[0]
    assert not check_controller(stated, [log_of(u, ref, meas)]).causes


@pytest.mark.parametrize(
    "length", [20, pytest.param(50, marks=pytest.mark.long), pytest.param(137, marks=pytest.mark.long)]
)
def test_what_the_file_says_itself_is_no_departure(length):
    """A stated memory, a longer one than stated, and stated arithmetic; a shorter one than stated is one."""
    ref, meas = inputs()
    stated = replace(CONTROLLER, length=length)
    u = ideal(stated, Scenario(ref[None], meas[None]), length).u[0]
    assert not check_controller(stated, [log_of(u, ref, meas)]).causes
    assert not check_controller(stated, [log_of(command()[0], ref, meas)]).causes
    shorter = ideal(stated, Scenario(ref[None], meas[None]), length // 2).u[0]
    found = check_controller(stated, [log_of(shorter, ref, meas)])
    assert effects(found) == [["short_memory"]] and found.causes[0][0].value == pytest.approx(
        length // 2, abs=2
    )


def test_stated_arithmetic_is_no_departure():
    ref, meas = inputs()
    plan = build_plan(CONTROLLER, "q15")
    u = physical_trace(plan, execute(plan, to_raw(plan, Scenario(ref[None], meas[None])))).u[0]
    assert not check_controller(replace(CONTROLLER, arithmetic="q15"), [log_of(u, ref, meas)]).causes
    assert check_controller(replace(CONTROLLER, arithmetic="f64"), [log_of(u, ref, meas)]).causes


def test_fixed_point():
    ref, meas = inputs()
    plan = build_plan(replace(CONTROLLER, length=1000), "q15")
    u = physical_trace(plan, execute(plan, to_raw(plan, Scenario(ref[None], meas[None])))).u[0]
    found = check_controller(CONTROLLER, [log_of(u, ref, meas)])
    assert effects(found) == [["fixed_point"]] and found.causes[0][0].value == 16


def in_whole_numbers(ref, meas, bits, down):
    """The controller in integers: weights, errors and increments in counts of 2^-bits of their range."""
    nearest = 0.0 if down else 0.5
    counts = lambda v, lsb: int(np.floor(v / lsb + nearest))
    h, high = CONTROLLER.sample_time, CONTROLLER.ranges.output[1]
    (T, alpha), _ = [(t.coefficient, t.order) for t in CONTROLLER.transfer.num]
    real = gl_weights(alpha, 1000) * T * h**-alpha + np.eye(1, 1001)[0]
    of_weight, of_error, of_output = max(abs(real)) / 2**bits, 0.02 / 2**bits, high / 2**bits
    weights = [counts(w, of_weight) for w in real]
    errors = [counts(r - m, of_error) for r, m in zip(ref, meas)]
    total, before, out = 0, None, []
    for k in range(len(errors)):
        product = sum(w * e for w, e in zip(weights, errors[k::-1]))
        rise = counts(product * of_weight * of_error * CONTROLLER.gain * h, of_output)
        before = rise if before is None else before
        total = min(max(total + (rise + before) // 2, 0), 2**bits)
        before = rise
        out.append(total * of_output)
    return np.array(out)


@pytest.mark.parametrize("down", [False, True])
@pytest.mark.parametrize(
    "bits", [10, pytest.param(12, marks=pytest.mark.long), pytest.param(14, marks=pytest.mark.long)]
)
def test_words_of_other_lengths(bits, down):
    ref, meas = inputs()
    found = check_controller(CONTROLLER, [log_of(in_whole_numbers(ref, meas, bits, down), ref, meas)])
    assert effects(found) == [["fixed_point"]] and abs(found.causes[0][0].value - bits) <= 1


@pytest.mark.parametrize("told", [False, pytest.param(True, marks=pytest.mark.long)])
def test_output_saturation(told):
    limit = 0.6 * command()[0].max()
    tight = replace(CONTROLLER, ranges=replace(CONTROLLER.ranges, output=(0.0, limit)))
    u, ref, meas = command(tight) if told else command()
    found = check_controller(CONTROLLER, [log_of(np.minimum(u, limit), ref, meas)])
    assert effects(found) == [["output_saturation"]]
    assert found.causes[0][0].value == pytest.approx(limit, rel=1e-3)
    assert found.causes[0][0].share > 0.999


def test_lost_and_late_samples_from_raw_time():
    u, ref, meas = command()
    even = np.arange(N) * 0.02
    keep = np.random.default_rng(1).random(N) > 0.05
    assert effects(check_controller(CONTROLLER, [log_of(u, ref, meas, even[keep])])) == [["missed_samples"]]
    late = even + np.random.default_rng(2).normal(0, 0.002, N)
    assert effects(check_controller(CONTROLLER, [log_of(u, ref, meas, late)])) == [["sample_jitter"]]
    assert not check_controller(CONTROLLER, [log_of(u, ref, meas, even)]).causes


@pytest.mark.parametrize("seed", range(20))
def test_losses_are_counted_among_late_samples_and_a_clock_that_drifts(seed):
    rng = np.random.default_rng(seed)
    late = np.clip(rng.normal(0, 0.2, 4000), -0.45, 0.45)
    time = 0.02 * (np.arange(4000) * (1 + 2e-4) + late)
    log = log_of(*(np.zeros(4000),) * 3, time)
    assert lost([log], 0.02) == 0.0
    assert unsteadiness([log], 0.02) == pytest.approx(0.004, rel=0.1)
    kept = np.sort(rng.choice(4000, 3900, replace=False))
    kept = kept[kept < 1200 if seed % 2 else kept >= 0]
    count = kept[-1] - kept[0] + 1 - len(kept)
    found = lost([log_of(*(np.zeros(4000),) * 3, time[kept])], 0.02)
    assert found * (kept[-1] - kept[0] + 1) == pytest.approx(count, abs=0.06 * count + 1)


def test_rows_not_yet_resampled_are_what_the_controller_saw():
    """Late samples: only from the rows can a short memory be told, the resampled signals are others."""
    u, ref, meas = command(length=50)
    late = np.arange(N) * 0.02 + np.random.default_rng(2).normal(0, 0.003, N)
    signals = {"reference": ref, "output": meas, "command": u}
    even = {role: np.interp(np.arange(N) * 0.02, late, values) for role, values in signals.items()}
    found = check_controller(CONTROLLER, [Experiment("loop", 0.02, even, raw_time=late, rows=signals)])
    assert effects(found) == [["sample_jitter"], ["short_memory"]] and found.causes[1][0].value == 50


def test_of_several_rows_a_sample_those_count_in_which_the_command_changes():
    u, ref, meas = command(length=50)
    later = {role: np.repeat(v, 4) for role, v in (("command", u), ("reference", ref), ("output", meas))}
    later["output"][1::4] += 0.001  # between the samples
    shifted = {role: v[3:] for role, v in later.items()}
    found = check_controller(CONTROLLER, [Experiment("loop", 0.005, shifted)])
    assert effects(found) == [["short_memory"]] and found.causes[0][0].value == pytest.approx(50, abs=3)


def test_open_loop_logs_are_left_out():
    u, ref, meas = command(length=50)
    gaps = np.where(np.arange(N) < 10, np.nan, ref)
    found = check_controller(CONTROLLER, [log_of(u, ref, meas), log_of(u, gaps, meas)])
    assert effects(found) == [["short_memory"]]
    with pytest.raises(ControllerError, match="the logs lack reference or command"):
        check_controller(CONTROLLER, [log_of(u, gaps, meas)])


def test_a_log_without_all_samples_of_the_controller_is_refused():
    u, ref, meas = command()
    log = Experiment("loop", 0.04, {"reference": ref[::2], "output": meas[::2], "command": u[::2]})
    with pytest.raises(ControllerError, match="runs every 0.02 s, and loop has a row every 0.04 s"):
        check_controller(CONTROLLER, [log])


@pytest.mark.parametrize("seed", range(40))
def test_whole_counts_are_seen_and_only_they(seed):
    rng = np.random.default_rng(seed)
    smooth = np.cumsum(rng.normal(0, 1.0, 2000)) * rng.uniform(0.01, 30)
    count = rng.uniform(0.01, 0.8) * np.mean(np.abs(np.diff(smooth)))
    assert count_of([smooth]) is None
    found = count_of([count * np.round(part / count) for part in np.split(smooth, 4)])
    assert found == pytest.approx(count, rel=1e-4)


def test_counts_of_the_log_are_not_the_controllers():
    smooth = np.cumsum(np.random.default_rng(0).normal(0, 1.0, 2000))
    for digits in (0.1, 0.02, 0.05, 0.025, 1.0):
        assert count_of([digits * np.round(smooth / digits)]) is None
    assert count_of([np.zeros(100)]) is None


@pytest.mark.parametrize(
    "change, large",
    [({"gain": 80.0}, False), pytest.param({"integrator": False}, True, marks=pytest.mark.long)],
)
def test_another_controller_than_the_files_is_said_to_be_one(change, large):
    """No memory, arithmetic or limit of the file's controller makes these commands."""
    found = check_controller(CONTROLLER, [log_of(*command(replace(CONTROLLER, **change)))])
    assert found.unexplained and not found.causes and found.large == large
    assert not check_controller(CONTROLLER, [log_of(*command())]).unexplained


def test_a_command_that_is_a_sample_late_is_unexplained():
    u, ref, meas = command()
    found = check_controller(CONTROLLER, [log_of(np.r_[u[0], u[:-1]], ref, meas)])
    assert found.unexplained and not found.causes


def test_a_known_departure_is_not_unexplained():
    ref, meas = inputs()
    u = ideal(CONTROLLER, Scenario(ref[None], meas[None]), 50).u[0]
    assert not check_controller(CONTROLLER, [log_of(u, ref, meas)]).unexplained
