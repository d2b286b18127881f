"""Work on all cores: the same as one after another.

Red when threads change an order, a bit or numpy's settings, or go on after one of them failed.
"""

import threading
import time

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.hypotheses import abreast, search
from focgen.diagnosis.hypotheses.abreast import abreast as at_once
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.replay import replay
from focgen.rig.rig import LinearActuator, Rig, Signals

MASS = Rig(
    "mass",
    0.05,
    Signals("t", "y", "u"),
    LinearActuator(TransferFunction([(1.0, 0.0)], [(0.2, 2.0), (0.5, 1.0), (1.0, 0.0)])),
)


@pytest.fixture
def cores(monkeypatch):
    """As if there were so many."""
    return lambda count: monkeypatch.setattr(abreast, "cores", lambda: count)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_the_order_is_kept(cores, count):
    cores(count)
    assert at_once(lambda i: (time.sleep(0.002 * (7 - i)), i)[1], range(7)) == list(range(7))


def test_threads_have_the_settings_of_who_asks(cores):
    cores(3)
    with np.errstate(over="raise"), pytest.raises(FloatingPointError):
        at_once(lambda x: np.float64(x) * 1e308, [1.0, 1e10, 1.0])
    with np.errstate(over="ignore"):
        assert at_once(lambda x: np.float64(x) * 1e308, [1.0, 1e10]) == [1e308, np.inf]


def test_what_has_not_begun_never_does(cores):
    cores(2)
    begun = []

    def act(i):
        begun.append(i)
        time.sleep(0.01)
        if i == 0:
            raise ValueError(i)
        return i

    with pytest.raises(ValueError):
        at_once(act, range(50))
    assert len(begun) < 25 and threading.active_count() < 10


def test_a_diagnosis_is_the_same_by_any_number_of_threads(cores, monkeypatch):
    """A mass that sticks now and then."""
    rng, steps = np.random.default_rng(1), np.repeat([0.0, 2.0, 3.0, 0.5, 2.5, 1.0], 80)
    asked = Experiment("steps", 0.05, {"command": steps, "output": steps})
    moved = replay(MASS, [asked]).simulated["steps"]["output"]
    seen = np.round(moved / 0.4) * 0.4 + 0.01 * rng.normal(size=480)
    log = Experiment("steps", 0.05, {"command": steps, "output": seen})
    monkeypatch.setattr(search, "_LONG", 100)
    found = []
    for count in (1, 3):
        cores(count)
        found.append(repr(diagnose(MASS, [log], pictures=False, only=("friction", "creep"))))
    assert found[0] == found[1]
