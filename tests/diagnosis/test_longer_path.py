"""Explanations of one session, of which one was found on a longer path of a pump.

Red when what each leaves on a path of its own is compared: a longer one adds up to more, and whatever is
found on the shorter one would be better.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from focgen.diagnosis.findings import _left_by
from focgen.diagnosis.fitting.fit import WHITE, fit
from focgen.diagnosis.fitting.integrating import settled
from focgen.diagnosis.hypotheses.nuisances import uncertain
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.segments import make
from tests.diagnosis.test_held import RIG
from tests.diagnosis.test_pumps import session


def explained(times):
    """A pump that gives a little less on the way back, explained without that, on a path so many times as
    long as usual."""
    logs = session(1, back=0.98)
    problem = uncertain(RIG, make(logs, "command", "pressure", None, None), logs)
    path = replace(problem.segment, pace=times * problem.segment.pace)
    best = settled(fit(replace(problem, segment=path, memory={}), problem.nominal(), WHITE, 12))
    return SimpleNamespace(best=best)


@pytest.fixture(scope="module")
def usual():
    return explained(1.0)


@pytest.fixture(scope="module")
def longer():
    return explained(10.0)


def test_a_longer_path_leaves_more(usual, longer):
    assert np.mean(longer.best.weighed**2) > 1.1 * np.mean(usual.best.weighed**2)


def test_two_explanations_are_compared_on_paths_of_one_length(usual, longer):
    assert _left_by([longer], [usual]) == pytest.approx(_left_by([usual], [longer]), abs=1.0)
    assert _left_by([longer], [longer]) > _left_by([usual], [usual]) + NUMBERS.nats
