"""The steps of a chain that are a stage's own equation: a key of all that decides what comes of a signal,
what does it, and no effect."""

from __future__ import annotations

from collections.abc import Callable, Hashable

from focgen.arrays import Array
from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.rig import chamber, linear, uneven
from focgen.rig.dynamics import Dynamics, Pace
from focgen.rig.effects import Run
from focgen.rig.placed import Placed

Step = tuple[tuple[Hashable, ...], Callable[[Array, Run], Array], Placed | None]


def linear_step(transfer: TransferFunction, between: Between | bool, delay: float) -> Step:
    """A transfer function, its input as it runs ``between`` samples, later by ``delay`` s."""
    return (
        (transfer, between, delay),
        lambda x, run: linear.run(transfer, x, run.rest, run.h, run.duration, between, delay),
        None,
    )


def fed_step(transfer: TransferFunction, supply: float) -> Step:
    """What is asked of a volume whose ``supply`` is limited."""
    return ("fed", transfer, supply), lambda x, run: chamber.asked(transfer, x, supply), None


def uneven_step(transfer: TransferFunction, pace: Pace, between: Between | bool, delay: float) -> Step:
    """A transfer function of an uneven ``pace``."""
    return (
        (transfer, pace, between, delay),
        lambda x, run: uneven.run(transfer, x, run, pace, between, delay),
        None,
    )


def chamber_step(transfer: TransferFunction, own: Dynamics, between: Between | bool, delay: float) -> Step:
    """A volume that fills and vents by dynamics of its ``own``."""
    return (
        (transfer, own, between, delay),
        lambda x, run: chamber.run(transfer, x, run.rest, run.h, own, between, delay),
        None,
    )
