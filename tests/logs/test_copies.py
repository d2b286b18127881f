"""An experiment that is copied, or handed to another process.

Red when it cannot be, when its copy is another, or when a copy may be written to.
"""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest

import focgen

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
COPIES = {"pickled": lambda x: pickle.loads(pickle.dumps(x)), "deep": copy.deepcopy, "shallow": copy.copy}


@pytest.mark.parametrize("how", COPIES)
def test_a_copy_of_an_experiment_is_the_same(how):
    for one in focgen.read_logs(EXAMPLES / "rig.toml", EXAMPLES / "logs" / "steps.csv", to=40.0):
        other = COPIES[how](one)
        assert (
            repr(other) == repr(one) and other.notes == one.notes and dict(other.begins) == dict(one.begins)
        )
        assert all(np.array_equal(other[role], one[role]) for role in one.signals)
        assert (other.rows is None) == (one.rows is None)
        with pytest.raises(TypeError):
            other.signals["output"] = one["output"]
