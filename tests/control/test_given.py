"""Controllers that are given as objects, held to what their files are held to.

Red when an object takes a way around a rule of the file, or comes out as another controller.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import focgen
from focgen.control.controller import Controller, GainSchedule, Source, Tunable, Units
from focgen.control.files import controller_from, controller_table, write_controller
from focgen.errors import ControllerError, InputError
from focgen.fractional.transfer import TransferFunction
from focgen.testing import assert_equivalent
from tests.conftest import paper_controller
from tests.controllers import random_controller, seed_controller, simple

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
NAN, SEED = float("nan"), seed_controller(length=20)
RANGES = SEED.ranges
ODD = {
    "no time": dict(sample_time=0.0),
    "a time that runs backwards": dict(sample_time=-0.01),
    "a time in text": dict(sample_time="0.01"),
    "limits that are swapped": dict(ranges=replace(RANGES, output=(10.0, 0.0))),
    "limits that are one": dict(ranges=replace(RANGES, output=(5.0, 5.0))),
    "three limits": dict(ranges=replace(RANGES, output=(0.0, 5.0, 10.0))),
    "a limit that is none": dict(ranges=replace(RANGES, output=(0.0, NAN))),
    "no limits": dict(ranges=replace(RANGES, output=None)),
    "no measurement": dict(ranges=replace(RANGES, measurement=None)),
    "no schedule's range": dict(ranges=replace(RANGES, schedule=None)),
    "a schedule's range of nothing": dict(gain=2.0),
    "breakpoints that fall": dict(gain=GainSchedule((0.2, 0.1), (1.0, 2.0))),
    "a gain too many": dict(gain=GainSchedule((0.1, 0.2), (1.0, 2.0, 3.0))),
    "too many breakpoints": dict(gain=GainSchedule(tuple(map(float, range(5000))), (1.0,) * 5000)),
    "a gain that is none": dict(gain=GainSchedule((0.1, 0.2), (1.0, NAN))),
    "half a length": dict(length=2.5),
    "a length that is a truth": dict(length=True),
    "a memory": dict(memory="x"),
    "an arithmetic": dict(arithmetic=None),
    "an integrator in text": dict(integrator="no"),
    "a negative slew": dict(slew_limit=-1.0),
    "a slew without an integrator": dict(slew_limit=1.0, integrator=False),
    "a negative lag": dict(setpoint_filter=-0.2),
    "a tolerance that is none": dict(tolerance=NAN),
    "a horizon": dict(horizon=-5),
    "a horizon of another operator": dict(memory="exponential", operator="continuous", horizon=1.5),
    "an operator": dict(operator="x"),
    "a band of another operator": dict(band=(0.01, 10.0)),
    "no name": dict(name=None),
    "half a character": dict(name="\ud800"),
    "a unit of half a character": dict(units=Units("\udfff")),
    "units in numbers": dict(units=Units(1, 2, 3)),
    "no units": dict(units=None),
    "a transfer function in text": dict(transfer="s"),
    "a box without 1": dict(tunable=Tunable((2.0, 3.0), (0.0, 0.0), (10.0, 10.0))),
    "a box of other limits": dict(tunable=Tunable()),
    "limits that cross": dict(tunable=Tunable((0.5, 2.0), (0.0, 8.0), (5.0, 10.0))),
    "a source in text": dict(designed_from="rig.toml"),
    "a source's options": dict(designed_from=Source("rig.toml", "0", ("settling",))),
    "a source's option of half a character": dict(designed_from=Source("rig.toml", "0", (("\ud800", 1),))),
}


@pytest.mark.parametrize("odd", ODD)
def test_what_no_file_may_say_no_object_may(tmp_path, odd):
    """In each function that takes one."""
    given = replace(SEED, **ODD[odd])
    calls = (
        lambda: focgen.generate(given, tmp_path / "folder"),
        lambda: focgen.simulate(EXAMPLES / "rig.toml", given),
        lambda: focgen.study("memory", given),
        lambda: write_controller(given, tmp_path / "controller.toml"),
        lambda: assert_equivalent(given, lambda: None),
    )
    for call in calls:
        with pytest.raises(ControllerError) as caught:
            call()
        assert caught.value.remedy
    assert not list(tmp_path.iterdir())


def test_dictionaries_hold_no_half_characters(tmp_path):
    with pytest.raises(InputError, match="half a character"):
        focgen.generate({**controller_table(SEED), "name": "\ud800"}, tmp_path)


CASES = {f"random {seed}": random_controller(seed) for seed in range(20)}
CASES["paper"] = paper_controller()
CASES["a band"] = simple(
    TransferFunction([(1.0, 0.5)]), memory="exponential", operator="continuous", band=(0.1, 9.0), horizon=500
)
CASES["unused"] = replace(SEED, tolerance=1e-6, horizon=777)
CASES["a box"] = replace(SEED, tunable=Tunable((1.0, 2.0), (0.0, 0.0), (5.0, 10.0)))
CASES["a source"] = replace(SEED, designed_from=Source("rig.toml", "0", (("a", 1), ("b", (1.0, 2.0)))))


@pytest.mark.parametrize("case", CASES)
def test_one_that_can_be_used_comes_out_as_it_is(case):
    assert controller_from(CASES[case]) == CASES[case]


def test_numbers_of_other_kinds_are_those_of_the_file(tmp_path):
    """A folder of whole numbers was "edited" as soon as its controller had been read again."""
    ranges = replace(RANGES, output=(0, 10), schedule=np.array([0.0, 0.25]))
    gain = GainSchedule(np.array([0.1, 0.2]), [np.float32(400), 300])
    given = replace(SEED, ranges=ranges, gain=gain, length=np.int64(20), integrator=np.True_)
    made = controller_from(given)
    assert isinstance(made, Controller) and made.gain == GainSchedule((0.1, 0.2), (400.0, 300.0))
    assert type(made.length) is int and made.integrator is True and made.ranges == RANGES
    focgen.generate(given, tmp_path)
    assert focgen.verify(tmp_path, samples=300).holds
