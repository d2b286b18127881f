"""What a pump held as its logs began, told through its actuator: asked of all logs as soon as one begins
on its way, of none where all begin empty and at rest.

Red when a fit of the one account of a session is taken to the other with numbers that are not there.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.fitting.fit import WHITE, fit, known_at
from focgen.diagnosis.hypotheses.between_samples import moved_to
from focgen.diagnosis.hypotheses.nuisances import problem_of
from focgen.diagnosis.problem.segments import make
from focgen.logs.begin import Begin
from focgen.rig.session import run_of
from tests.diagnosis.test_held import RIG
from tests.diagnosis.test_pumps import session

LOGS = [replace(log, signals={n: log[n] for n in ("command", "output")}) for log in session(1)]
ON_ITS_WAY = [LOGS[0], replace(LOGS[1], begins={"command": Begin((0.0, 2.0), (0.3,))})]


def fitted(logs):
    """The session's one segment without effects."""
    problem = problem_of(RIG, make(logs, "command", "output", None, None), logs)
    return fit(problem, problem.nominal(), WHITE, 4)


@pytest.mark.parametrize("first, then, stands", [(LOGS, ON_ITS_WAY, 2), (ON_ITS_WAY, LOGS, 0)])
def test_a_fit_is_moved_to_logs_that_begin_elsewise(first, then, stands):
    of = fitted(first)
    _, jacobian = known_at(of.problem, of.vector, WHITE)
    moved = moved_to(of, of.problem.segment.anew(run=run_of(then, "command")), WHITE, jacobian)
    assert moved.problem.stood == stands
    assert len(moved.vector) == len(of.vector) - of.problem.stood + stands
    own = fitted(then)
    assert np.mean(moved.weighed**2) < 1.02 * np.mean(own.weighed**2)
