"""Columns out of step by a part of a sample, where samples are few in a time constant.

Red when a command that was sent ahead of its row is called a fault of the rig.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.hypotheses.nuisances import problem_of
from focgen.diagnosis.problem.segments import make
from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, Delays, Rig, Signals
from tests.identification.test_out_of_step import FINE, GAIN, TAU, H, T, lag, moved, steps

PLANT = TransferFunction([(1.0, 0.0)], [(T, 0.8), (1.0, 0.0)])
REGULATOR = TransferFunction([(1.1, 0.0)], [(TAU, 1.0), (1.0, 0.0)])
RIG = Rig("finger", H, Signals("t", "y", "u"), Actuator(T, 0.8, (GAIN,)), regulator=REGULATOR)


def logs_of(lead, noise, limit=np.inf, count=600):
    """Two logs of steps, the command ``lead`` samples ahead of its rows and limited by the supply."""
    rng, logs = np.random.default_rng(7), []
    for number in range(2):
        command = steps(rng, count)
        pressure = lag(np.minimum(1.1 * moved(command, lead), limit), TAU)
        made = GAIN * Convolution(PLANT, H / FINE, "linear").run(pressure)[::FINE]
        signals = {"command": command, "output": made + rng.normal(0.0, noise, count)}
        logs.append(Experiment(f"e{number}", H, signals, start=900.0 * number))
    return logs


@pytest.mark.parametrize("lead", [-0.4, -0.1, 0.0, 0.1, 0.5, 0.9, 1.0])
def test_a_staircase_out_of_step_is_simulated_as_it_was(lead):
    logs = logs_of(lead, 0.0)
    problem = problem_of(RIG, make(logs, "command", "output"), logs)
    vector = problem.nominal()
    vector[len(problem.nominal_start)] = -lead
    low, high = problem.bounds()
    assert np.all(low <= vector) and np.all(vector <= high)
    left = problem.residual(vector)
    assert np.max(np.abs(left)) < 2e-3 * np.ptp(problem.segment.y)


@pytest.mark.parametrize("count", [613, 614, 615])
def test_logs_that_end_behind_a_jump_are_healthy(count):
    """What comes behind the last reading was guessed, many times the noise off, and counted."""
    found = diagnose(RIG, logs_of(0.3, 0.002, count=count), pictures=False)
    assert found.verdict in ("none", "parameters") and not found.causes


def test_a_dead_time_that_was_refitted_makes_no_jump_where_columns_meet():
    logs = logs_of(0.5, 0.0)
    late = replace(RIG, delays=Delays(regulator=0.1))
    problem = problem_of(late, make(logs, "command", "output"), logs)
    place, steps_by = len(problem.nominal_start), 0.1 * np.eye(len(problem.nominal()))
    (delay,) = [i for i in range(place) if problem.rig(problem.nominal() + steps_by[i]).delays != late.delays]
    for off in (-0.2, -0.05, 0.0, 0.05, 0.1):
        vector = problem.nominal()
        vector[delay] += off
        meet = problem.rig(vector).delays.regulator / H  # samples: by as much the output is early
        made = []
        for shift in (-meet - 1e-3, -meet + 1e-3, -0.499, -0.501):
            vector[place] = shift
            made.append(problem.simulate(vector))
        for one, other in (made[:2], made[2:]):
            assert np.max(np.abs(one - other)) < 0.005 * np.ptp(one)


@pytest.mark.parametrize("lead", [0.1, 0.4, 0.9])
def test_a_healthy_rig_is_healthy(lead):
    found = diagnose(RIG, logs_of(lead, 0.004), pictures=False)
    assert found.verdict in ("none", "parameters") and not found.causes


def test_what_is_there_is_found_beside_it():
    found = diagnose(RIG, logs_of(0.4, 0.004, limit=2.6), pictures=False)
    assert [c.candidates[0].effect for c in found.causes] == ["supply_saturation"]
    assert found.causes[0].candidates[0].confidence > 0.5


def test_only_a_staircase_of_commands_is_ahead_of_its_rows():
    logs = logs_of(0.0, 0.0)
    smooth = [replace(log, signals={**log.signals, "command": np.sin(log.time)}) for log in logs]
    for log, ahead in ((smooth, False), (logs, True)):
        problem = problem_of(RIG, make(log, "command", "output").anew(between=Between.HELD), log)
        assert (problem.lead > problem.slack) == ahead
