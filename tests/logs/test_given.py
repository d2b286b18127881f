"""Experiments that a program made by itself are looked at like a file.

Red when one that no rig can be run on goes through, or is refused without its name, what is wrong and
a remedy, when a whole one is changed or copied, and when two of one name give one result.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen import replay
from focgen.errors import LogError
from focgen.logs.experiment import Experiment
from focgen.logs.given import checked_in_memory, with_names_apart
from focgen.rig.rig import Actuator, Rig, Signals

U = np.repeat([0.0, 0.5, 0.2], 100)
RIG = Rig("finger", 0.02, Signals("t", "y", command="u"), Actuator(0.5, 0.8, (1.0,)))


def logged(h=0.02, **signals):
    return Experiment("e7", h, {"command": U, "output": U} | signals)


def with_at(sample, value):
    return np.where(np.arange(len(U)) == sample, value, U)


BAD = {
    "300 samples of command and 295 of output": logged(output=U[5:]),
    "has the shape (300, 1)": logged(output=U[:, None]),
    "has no signals": Experiment("e7", 0.02, {}),
    "has no samples": Experiment("e7", 0.02, {"command": U[:0], "output": U[:0]}),
    "has a signal 'comand'": logged(comand=U),
    "output: is not a series of real numbers": logged(output=np.array(["a"] * len(U))),
    "command: is not a series of real numbers": logged(command=U + 1j),
    "has gaps, the first at sample 40": logged(output=with_at(40, np.nan)),
    "is inf at sample 50": logged(command=with_at(50, np.inf)),
    "is 1e+200 at sample 3": logged(output=with_at(3, 1e200)),
    "has the sample time 0": logged(h=0),
    "has the start nan": Experiment("e7", 0.02, {"command": U, "output": U}, start=float("nan")),
    "output: has gaps, the first at sample 3": logged(output=np.ma.masked_inside(U + np.arange(300), 3, 4)),
    "has the sample time nan": logged(h=float("nan")),
    "has the sample time '0.02'": logged(h="0.02"),
    "has the sample time True": logged(h=True),
}


@pytest.mark.parametrize("said", BAD)
def test_what_no_rig_can_be_run_on_is_refused(said):
    with pytest.raises(LogError, match="e7") as refused:
        replay(RIG, [BAD[said]])
    assert said in str(refused.value) and "; " in str(refused.value)


def test_a_whole_one_is_itself():
    log = logged(reference=with_at(3, np.nan))
    assert checked_in_memory(log) is log


def test_lists_and_whole_numbers_will_do():
    made = checked_in_memory(logged(command=list(U), output=(10.0 * U).astype(int)))
    np.testing.assert_array_equal(made["command"], U)
    np.testing.assert_array_equal(made["output"], 10.0 * U)
    assert made["output"].dtype == float
    objects = checked_in_memory(logged(command=np.array(list(U), object)))
    np.testing.assert_array_equal(objects["command"], U)


def test_experiments_of_one_name_are_told_apart():
    """Results are told by name: of two of one name the first was lost."""
    first, second, other = (replace(logged(), name=name) for name in ("e7", "e7", "e7 (1)"))
    found = replay(RIG, [first, second, other])
    assert list(found.logs) == ["e7 (2)", "e7 (3)", "e7 (1)"]
    assert [log.name for log in with_names_apart(found.experiments)] == list(found.logs)
    numbers = replay(RIG, [replace(logged(), name=name) for name in (1, "1", ["a"])])
    assert list(numbers.logs) == ["1 (1)", "1 (2)", "['a']"]
    alone = (first, other)
    assert all(a is b for a, b in zip(with_names_apart(alone), alone))
