"""A command that was sent ahead of its rows, as its rig says, against one run at many parts of a sample.

Red where the jumps of such a command lie anywhere but where they were, in any experiment, up to its last row.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
from focgen.rig.ahead import in_step, longer
from focgen.rig.effects import Run, form_of
from focgen.rig.engine import Chain
from focgen.rig.placed import Placed
from focgen.rig.replay import replay
from focgen.rig.rig import Actuator, Delays, LinearActuator, Rig, Signals

H, MANY = 0.2, 50
LAG = TransferFunction([(1.1, 0.0)], [(0.3, 1.0), (1.0, 0.0)])
SWING = TransferFunction([(2.0, 0.0)], [(0.4, 2.0), (0.2, 1.0), (1.0, 0.0)])
PLANTS = {
    "regulator": {"regulator": LAG},
    "fractional": {"actuator": Actuator(0.7, 0.6, (0.6, 0.05))},
    "both": {"regulator": LAG, "actuator": Actuator(0.7, 0.8, (0.6,)), "delays": Delays(regulator=0.07)},
    "swings": {
        "actuator": LinearActuator(TransferFunction([(2.0, 0.0)], [(0.4, 2.0), (0.2, 1.0), (1.0, 0.0)]))
    },
}


def rig_of(plant, h=H):
    return Rig("finger", h, Signals("t", "y", "u"), between=Between.HELD, **PLANTS[plant])


def steps(count=3):
    """Levels from one row to a few rows long, so that experiments end right behind a jump."""
    rng = np.random.default_rng(1)
    return [np.repeat(rng.uniform(0.0, 3.0, 30), rng.integers(1, 9, 30)) for _ in range(count)]


def sent(x, lead):
    """A staircase (n,) at MANY parts of a sample, ``lead`` s ahead of its rows."""
    fine, parts = np.repeat(x, MANY), round(lead / H * MANY)
    return (
        np.r_[fine[parts:], np.full(parts, fine[-1])] if parts >= 0 else np.r_[np.zeros(-parts), fine[:parts]]
    )


def run(rig, parts, h, placed=(), begins=1):
    made = Run.of([len(x) for x in parts], [0.0] * len(parts), h)
    made.rest[made.rest > 0] = begins
    return Chain(rig, placed).run(np.concatenate(parts), "regulator", "sensor", made, Between.HELD)


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("lead", [0.02, 0.1, 0.2, 0.24, 0.4, -0.06, -0.3])
def test_a_command_acts_when_it_was_sent(plant, lead):
    commands = [np.r_[np.zeros(3), x] for x in steps()]
    fine = run(rig_of(plant, H / MANY), [sent(x, lead) for x in commands], H / MANY)
    made = run(replace(rig_of(plant), lead=lead), commands, H)
    ends = np.cumsum([MANY * len(x) for x in commands])[:-1]
    exact = np.concatenate([part[::MANY] for part in np.split(fine, ends)])
    assert np.max(np.abs(made - exact)) < 2e-3 * np.ptp(exact)


def test_an_effect_sees_the_same_command():
    """A supply that ends at 1.2 bar."""
    limit = Placed("supply_saturation", form_of("supply_saturation", "hard"), "regulator", (1.2,))
    commands = [np.r_[np.zeros(3), x] for x in steps(1)]
    fine = run(rig_of("both", H / MANY), [sent(commands[0], 0.1)], H / MANY, (limit,))[::MANY]
    made = run(replace(rig_of("both"), lead=0.1), commands, H, (limit,))
    assert np.max(np.abs(made - fine)) < 2e-3 * np.ptp(fine) and np.max(fine) < 1.3


@pytest.mark.parametrize(
    "lead, delay, count", [(0.1, 0.1, 1), (0.2, 0.0, 1), (0.25, 0.15, 2), (-0.1, 0.1, 0), (0.0, 0.0, 0)]
)
def test_whole_samples_and_a_dead_time_make_a_lead(lead, delay, count):
    found, samples, _ = in_step(replace(rig_of("regulator"), lead=lead), "regulator", "sensor", H)
    assert samples == count and found.lead == 0.0
    assert found.delays.regulator == pytest.approx(delay, abs=1e-12)


def test_a_run_goes_on_behind_each_experiment():
    run = Run.of([3, 2], [0.0, 10.0], 0.5)
    long = longer(run, 2)
    assert longer(run, 2) is long and long.run.spans == ((0, 5), (5, 9))
    np.testing.assert_array_equal(long.rows, [0, 1, 2, 2, 2, 3, 4, 4, 4])
    np.testing.assert_array_equal(long.kept, [2, 3, 4, 7, 8])
    np.testing.assert_allclose(long.run.clock, [-1.0, -0.5, 0.0, 0.5, 1.0, 9.0, 9.5, 10.0, 10.5])


def test_a_log_is_replayed_as_far_ahead_as_the_rig_says():
    command = np.r_[np.zeros(3), steps(1)[0]]
    y = run(rig_of("both", H / MANY), [sent(command, 0.12)], H / MANY)[::MANY]
    log = Experiment("e", H, {"command": command, "output": y})
    left = {lead: replay(replace(rig_of("both"), lead=lead), [log]).logs["e"].rmse for lead in (0.0, 0.12)}
    assert left[0.12] < 0.02 * left[0.0]


@pytest.mark.parametrize("lead, sooner", [(0.1, 0), (0.24, 1)])
def test_what_answers_at_once_is_the_command_that_acts(lead, sooner):
    command, tap = np.r_[np.zeros(3), steps(1)[0]], {}
    made = Run.of([len(command)], [0.0], H)
    chain = Chain(replace(rig_of("fractional"), lead=lead))
    chain.run(command, "regulator", "sensor", made, Between.HELD, tap)
    np.testing.assert_allclose(tap["regulator"], np.r_[command[sooner:], np.full(sooner, command[-1])])
