"""Ranges that a rig leaves open: from the logs, with room, and said.

Red when a range is derived that the logs leave, or nobody is told that it was.
"""

import numpy as np
import pytest

from focgen.identification.ranges import seen_ranges
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Ranges


def experiment(**signals):
    return Experiment("e", 0.01, {role: np.array(values) for role, values in signals.items()})


@pytest.mark.parametrize(
    "seen, span",
    [
        ([0.0, 0.2], (0.0, 0.25)),
        ([0.001, 0.16], (0.0, 0.2)),
        ([-0.001, 0.161], (0.0, 0.21)),  # noise below zero is no reach; 0.20125 is rounded outwards
        ([-3.0, 1.0], (-3.8, 1.3)),
        ([2.0, 812.0], (0.0, 1100.0)),
        ([-812.0, -5.0], (-1100.0, 0.0)),
    ],
)
def test_a_range_spans_zero_and_what_was_seen_with_room(seen, span):
    ranges, notes = seen_ranges(Ranges(), [experiment(command=[0.0, 1.0], output=seen)])
    assert ranges == Ranges(output=span)
    assert len(notes) == 1 and f"output is not given: {span[0]:g} … {span[1]:g}," in notes[0]


def test_what_is_given_stays_and_all_experiments_count():
    logs = [
        experiment(pressure=[0.0, 0.1], output=[0.0, 1.0]),
        experiment(pressure=[0.0, 0.2], output=[0.0, 4.0]),
    ]
    ranges, notes = seen_ranges(Ranges(output=(0.0, 2.0)), logs)
    assert ranges == Ranges(pressure=(0.0, 0.25), output=(0.0, 2.0))
    assert len(notes) == 1
