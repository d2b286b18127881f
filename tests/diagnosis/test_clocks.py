"""Two loggers whose clocks run apart, and what drifts in a session that one of them took.

Red when a drift, or a lag, stands for columns that go by clocks of their own, or the other way round.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import LinearActuator, Rig, Signals
from tests.diagnosis_rig import RIG, session


def two_loggers(logs, roles, rate):
    """The ``roles`` taken by a clock that gains a part ``rate`` on the others', right in the middle."""
    middle = 0.5 * logs[-1].start

    def taken(log):
        at = log.start + log.sample_time * np.arange(len(log))
        later = at + rate * (at - middle)
        return replace(log, signals={**log.signals, **{r: np.interp(later, at, log[r]) for r in roles}})

    return [taken(log) for log in logs]


def said(found):
    return [note for note in found.notes if "clocks of their own" in note]


@pytest.mark.long
@pytest.mark.parametrize(
    "rate, roles, seed",
    [
        (0.004, (), 1),
        (-0.004, (), 2),
        (0.004, ("pressure",), 3),
        (-0.004, ("pressure", "curvature"), 4),
    ],
)
def test_columns_of_two_loggers_are_no_drift(rate, roles, seed):
    other = [role for role in roles if role != "pressure"] + ["output"]
    found = diagnose(RIG, two_loggers(session(seed, roles=roles), other, rate), pictures=False)
    assert found.verdict == "unknown" and not found.causes
    (note,) = said(found)
    assert float(note.split("%")[-2].split("(")[-1]) == pytest.approx(0.4, abs=0.02)


@pytest.mark.parametrize(
    "effect",
    [
        pytest.param({"drift": 4e-4}, marks=pytest.mark.long),
        pytest.param({"vent": 0.8}, marks=pytest.mark.long),
        {"delay": 6},
    ],
)
def test_what_lies_in_the_rig_is_not_taken_for_it(effect):
    found = diagnose(RIG, session(5, roles=("pressure",), **effect), pictures=False)
    assert found.verdict in ("named", "set") and not said(found)


@pytest.mark.long
def test_a_command_that_stands_still_tells_no_clock():
    """Sooner or later it is the same: the division by what another clock changes ended the diagnosis."""
    t, rng = 0.01 * np.arange(1500), np.random.default_rng(0)
    lag, quick = (TransferFunction([(1.0, 0.0)], [(T, 1.0), (1.0, 0.0)]) for T in (0.3, 0.05))
    rig = Rig("still", 0.01, Signals("t", "y", command="u"), LinearActuator(lag), quick)
    y = 0.3 + np.exp(-t) + 0.01 * rng.normal(size=len(t))
    found = diagnose(rig, [Experiment("still", 0.01, {"command": np.full(len(t), 0.3), "output": y})])
    assert found.gap.floor < 0.02 and not said(found)
