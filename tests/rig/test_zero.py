"""Where a rig rests that has an offset: at it, from the first sample on; and a sensor that has one.

Red when what is behind an offset starts from 0, when a reading lacks its zero, or when a design does.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focgen.control.equilibrium import derived_ranges, holding, rest, static_output
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig import read_rig, write_rig
from focgen.rig.effects import Run
from focgen.rig.engine import Chain
from focgen.rig.replay import replay
from focgen.rig.rig import Actuator, Rig, Signals

H = 0.05
SLOW = TransferFunction([(2.0, 0.0)], [(3.0, 1.0), (1.0, 0.0)])
RIG = Rig("r", H, Signals("t", "y", "u"), Actuator(1.3, 0.6, (0.5,), 0.4), sensor=SLOW, zero=-0.3)
STEP = np.repeat([0.0, 1.0, 0.0], 100)


def run(rig, x, **changed):
    return Chain(rig).run(x, "regulator", "sensor", replace(Run.of([len(x)], [0.0], H), **changed))


def test_a_rig_at_rest_reads_what_its_offsets_make():
    assert np.allclose(run(RIG, np.zeros(200)), 2.0 * 0.4 - 0.3, atol=1e-12)


def test_offsets_change_nothing_of_how_a_linear_rig_moves():
    bare = replace(RIG, actuator=replace(RIG.actuator, offset=0.0), zero=0.0)
    assert np.allclose(run(RIG, STEP) - run(bare, STEP), 0.5, atol=1e-9)


def test_an_offset_is_no_step_where_the_actuator_does_not_begin_at_rest():
    """It passes its input on at once, so that its first sample is no rest to be in equilibrium with."""
    at_once = replace(RIG, actuator=replace(RIG.actuator, T=1e-9, alpha=1.0))
    moved, bare = np.ones(100), replace(at_once, actuator=replace(at_once.actuator, offset=0.0))
    assert run(bare, moved)[0] == pytest.approx(run(at_once, moved)[0], abs=0.1)


def test_equilibria_have_the_zero():
    ranges, _ = derived_ranges(RIG)
    assert rest(RIG, (0.0, 1.0)).output == pytest.approx(0.5)
    assert static_output(RIG, 1.0) == pytest.approx(2.0 * (0.5 + 0.4) - 0.3)
    assert holding(RIG, 1.5, replace(ranges, output=(0.5, 1.5))).pressure == pytest.approx(1.0)


@pytest.mark.parametrize("sensor", ("", "num = [[2.0, 0.0]]\nden = [[3.0, 1.0], [1.0, 0.0]]\n"))
def test_a_sensor_may_be_an_offset_alone(tmp_path, sensor):
    path = tmp_path / "rig.toml"
    write_rig(replace(RIG, sensor=TransferFunction([(1.0, 0.0)], [(1.0, 0.0)])), path)
    text = path.read_text()
    assert "[sensor]\noffset = -0.3\n" in text
    path.write_text(text.replace("[sensor]\n", f"[sensor]\n{sensor}"))
    rig = read_rig(path)
    assert rig.zero == -0.3 and rig.sensor.dc_gain == (2.0 if sensor else 1.0)


def test_a_replay_begins_where_the_rig_rests():
    log = Experiment("steps", H, {"command": STEP, "output": run(RIG, STEP)}, 0.0)
    (result,) = replay(RIG, [log]).logs.values()
    assert result.gof == pytest.approx(1.0, abs=1e-6)
