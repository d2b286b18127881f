"""Sessions whose logs are not alike, and staircases in one log.

Red when a staircase counts as one level, a log without a signal that others have is fitted by another
quantity, or a sensor that is a mere gain is a fault of the program.
"""

import numpy as np
import pytest

import focgen
from focgen.errors import FitError, LogError
from focgen.fractional import Convolution, TransferFunction
from focgen.identification.excitation import prepare
from focgen.identification.gain import feasible_degree
from focgen.identification.identify import identify
from focgen.identification.projected import Problem, uncertainty
from focgen.identification.rational import Record, Shape
from focgen.identification.single import is_step
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, Rig, Signals
from tests.conftest import paper_rig

STEP = 0.05
MODEL = TransferFunction([(1.0, 0.0)], [(1.32, 0.6), (1.0, 0.0)])
PLAIN = {
    "name": "bench",
    "sample_time": STEP,
    "signals": {"time": "t", "command": "u", "pressure": "p", "curvature": "k", "output": "y"},
}


def log(levels, seconds=8.0, noise=0.002):
    """Levels of pressure one after the other, with K(p) = 0.03 + 0.2 p; the command is 40 times as large, the
    output 300 times the curvature."""
    p = np.concatenate([np.zeros(20), np.repeat(levels, round(seconds / STEP))])
    k = Convolution(MODEL, STEP, hold="zero").run((0.03 + 0.2 * p) * p)
    k = k + noise * np.abs(k).max() * np.random.default_rng(len(p)).standard_normal(len(p))
    return {"t": STEP * np.arange(len(p)), "u": 40.0 * p, "p": p, "k": k, "y": 300.0 * k}


def without(given, *names):
    return {name: values for name, values in given.items() if name not in names}


@pytest.mark.parametrize("levels", [(0.1, 0.0, 0.2, 0.05, 0.15, 0.0), (0.1, 0.2, 0.05, 0.15, 0.0)])
def test_a_staircase_in_one_log_shows_all_its_levels(levels):
    """It was "1 distinct level", K a number, and so refused: T to ±232 %."""
    found = identify(PLAIN, log(levels), integer=False)
    assert not any("distinct level" in note for note in found.notes)
    assert found.joint.T == pytest.approx(1.32, rel=0.03)
    assert found.joint.gain == pytest.approx((0.03, 0.2), rel=0.03)


@pytest.mark.parametrize("rise", [0.0, 0.3, 2.0])
def test_a_step_and_its_release_are_one_level_however_slow(rise):
    """p and p² differ on the way, but tell no two levels apart."""
    wanted = np.concatenate([np.zeros(20), np.full(300, 0.1), np.zeros(300)])
    p = wanted if not rise else Convolution(TransferFunction([(1, 0)], [(rise, 1), (1, 0)]), STEP).run(wanted)
    noisy = p + 0.0005 * np.random.default_rng(1).standard_normal(len(p))
    excitation = prepare(Experiment("one", STEP, {"pressure": noisy, "output": 0.05 * p}), paper_rig(), 2)
    assert is_step(excitation)
    assert feasible_degree([excitation], 1)[0] == 0


@pytest.mark.parametrize("signal, stage", [("p", "regulator"), ("k", "sensor")])
def test_a_log_that_lacks_what_others_have_is_not_fitted_by_another_quantity(signal, stage):
    """A command in volts as a pressure in bar gave K(p) = 0.058 − 0.009 p, and a warning of hysteresis."""
    logs = [log((level, 0.0)) for level in (0.1, 0.2, 0.15)]
    mixed = [logs[0], logs[1], without(logs[2], signal)]
    with pytest.raises(FitError, match=rf"log 3: lacks the .* and no \[{stage}\]"):
        identify(PLAIN, mixed, integer=False)


def test_a_command_that_is_the_pressure_stands_for_it():
    logs = [log((level, 0.0)) | {"u": log((level, 0.0))["p"]} for level in (0.1, 0.2)]
    found = identify(PLAIN, [logs[0], without(logs[1], "p")], integer=False)
    assert found.joint.gain == pytest.approx((0.03, 0.2), rel=0.05)


def test_a_gain_without_a_dead_time_has_a_derivative_by_one():
    """A sensor that is a mere gain was a fault of the program: at a dead time of 0 a record has a row less
    than behind it."""
    drive = np.cumsum(np.random.default_rng(1).standard_normal(200))
    noise = 1e-3 * np.random.default_rng(2).standard_normal(200)
    problem = Problem(Shape(0, 0, True), [Record("one", drive, 300.0 * drive + noise, "linear", moves=True)])
    spread, _ = uncertainty(problem, problem.solved(np.array([0.0])))
    assert spread.shape == (2, 2) and np.all(np.diag(spread) > 0.0)


@pytest.mark.parametrize("asked", [focgen.identify, focgen.replay, focgen.diagnose])
def test_a_log_in_memory_without_an_output_is_refused_in_one_line(asked):
    command = np.repeat(np.random.default_rng(0).uniform(0.0, 2.0, 20), 20)
    whole = Experiment("whole", 0.1, {"command": command, "output": 0.9 * command})
    rig = Rig("r", 0.1, Signals("t", "y", "u"), Actuator(1.0, 0.9, (1.0,)))
    with pytest.raises(LogError, match="blind: has no output; name its column in"):
        asked(rig, [whole, Experiment("blind", 0.1, {"command": command})])
