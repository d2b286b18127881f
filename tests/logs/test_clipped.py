"""A gauge whose range ends too early is told of as it is read; nothing else that repeats a number is.

Red when an output that is cut off has no note, so that a bent sensor is all that a diagnosis says; or when
rest, rounding, a rectified gauge or a simulation without noise get one.
"""

import numpy as np
import pytest

from focgen.logs import read_logs
from focgen.logs.clipped import end_of_range
from focgen.rig.rig import Signals
from tests.diagnosis_rig import H, session

LOGS = session(1, roles=("pressure",))
EXACT = session(0, noise=0.0, roles=("pressure",))


def written(path, log, output):
    columns = zip(H * np.arange(len(log)), log["command"], log["pressure"], output)
    rows = [f"{t:.2f},{u:.4f},{p:.6f},{y:.7f}" for t, u, p, y in columns]
    path.write_text("\n".join(["t,u,p,y", *rows, ""]), encoding="utf-8")
    return path


@pytest.mark.parametrize("share", [0.6, 0.8])
@pytest.mark.parametrize("sign", [1, -1])
def test_an_output_that_is_cut_off_has_a_note(tmp_path, share, sign):
    """It was a bent sensor at 95 %, without a word."""
    log = LOGS[0]
    output = sign * np.minimum(log["output"], share * log["output"].max())
    (found,) = read_logs(written(tmp_path / "cut.csv", log, output), Signals("t", "y", "u", "p"), H)
    assert any("output ends at" in note for note in found.notes)
    (found,) = read_logs(
        written(tmp_path / "all.csv", log, sign * log["output"]), Signals("t", "y", "u", "p"), H
    )
    assert not found.notes


@pytest.mark.parametrize("role", ["pressure", "output"])
@pytest.mark.parametrize("logs", [LOGS, EXACT], ids=["noise", "no noise"])
@pytest.mark.parametrize("digit", [0.0, 1e-2, 2e-3, 1e-4])
def test_rest_and_rounding_are_no_end(logs, role, digit):
    for log in logs:
        y = log[role] / np.ptp(log[role])
        y = np.round(y / digit) * digit if digit else y
        assert end_of_range(y) is None and end_of_range(np.maximum(y, 0.0)) is None, log.name


def test_a_command_may_stand_where_it_likes(tmp_path):
    log = LOGS[0]
    path = written(tmp_path / "log.csv", log, log["output"])
    (found,) = read_logs(path, Signals("t", "y", "u", "p"), H)
    assert end_of_range(np.r_[0.0, np.arange(1.0, 5.0), np.full(99, 5.0)]) and not found.notes
