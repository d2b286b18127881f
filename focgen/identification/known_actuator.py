"""A known actuator's answer to an experiment that may begin anywhere."""

from __future__ import annotations

import math

import numpy as np

from focgen.arrays import Array
from focgen.identification.excitation import Excitation
from focgen.identification.kernel import kernels
from focgen.identification.past import EXACT, MOST_STEPS, asks_for_past, best_time, columns, times
from focgen.rig.rig import Actuator


def answer_from_its_past(x: Excitation, actuator: Actuator, delay: float = 0.0) -> Array:
    """The actuator's output (n,) for an experiment, with the offset that fits best, and from the initial
    state that the data ask for; ``delay`` in s.

    The past is one step, or a few, at times on a grid: the one that takes off most, then the next.
    """
    at = math.log(actuator.T) / actuator.alpha, actuator.alpha, x.step
    gain = np.array(actuator.gain)
    made = gain @ x.respond(kernels(*at, len(x), delay + x.late), 1)[0, : len(gain)]
    left: Array = x.measured - made
    chosen: list[Array] = []
    long = kernels(*at, x.stepped.count, delay + x.late)
    reach = float(np.ptp(x.measured))
    while len(chosen) < MOST_STEPS and np.std(left) > EXACT * x.spread:
        if not asks_for_past(left, columns(x, long, times(x), 1)[0], reach, made):
            break
        grid = columns(x, long, times(x, 4), 1)[0]
        chosen.append(grid[best_time(left, grid)])
        left = _without(x.measured - made, chosen)
    found: Array = x.measured - left + left.mean()
    return found


def _without(left: Array, chosen: list[Array]) -> Array:
    """What a past of these columns, beside an offset, leaves; the offset stays in."""
    basis = np.column_stack([np.ones(len(left)), *chosen])
    amounts = np.linalg.lstsq(basis, left, rcond=1e-8)[0]
    made: Array = left - basis[:, 1:] @ amounts[1:]
    return made
