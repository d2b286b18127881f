"""Where a stage that integrates stood, told without telling the pasts of experiments anew.

Red when a run that stood elsewhere has other pasts than one whose pasts are told from the start.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.logs.begin import Begin
from focgen.rig.begun import past_of, with_past, with_stands
from focgen.rig.effects import Run

H = 0.1
ALONE = Begin((0.0, 1.5), (3.0,))
AFTER = Begin((1.5,), after=0.35)


@pytest.mark.parametrize("second, starts", [(AFTER, (0.0, 4.25)), (ALONE, (0.0, 90.0))])
def test_where_it_stood_changes_no_past(second, starts):
    """The second experiment goes on from the first, or has a past of its own, with where it stood."""
    run = Run.of([40, 30], starts, H, [ALONE, second], stands=[2.0, -1.0])
    x = np.linspace(1.0, 2.0, 70)
    past_of(run)
    moved = with_stands(run, (5.0, 0.5))
    anew = replace(run, stands=(5.0, 0.5))

    (whole, kept), (expected, where) = past_of(moved), past_of(anew)

    assert moved.stands == anew.stands and moved.spans == anew.spans
    assert whole.stands == expected.stands == ((5.0,) if second is AFTER else (5.0, 0.5))
    assert whole.spans == expected.spans and whole.duration == expected.duration
    assert np.array_equal(kept, where) and np.array_equal(whole.clock, expected.clock)
    assert np.array_equal(whole.rest, expected.rest)
    assert np.array_equal(with_past(x, moved), with_past(x, anew))


def test_experiments_at_rest_begin_in_equilibrium_where_they_were_and_nowhere_else():
    run = Run.of([4, 3], [0.0, 9.0], H, stands=[0.0, 3.0])
    assert run.stood.spans == run.spans == ((0, 4), (4, 7))
    assert run.stood.rest.tolist() == [1, 0, 0, 0, 2, 0, 0] and run.stood.stands == ()
    lying = run.lying(np.array([1.0, 2, 3, 4, 7, 8, 9]), 7.0)
    assert lying.spans == run.spans and lying.rest.tolist() == [1, 0, 0, 0, 2, 0, 0]
