"""The memory length: chosen where its error at the crossover is small, and what it costs at rest."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from focgen.control.controller import Controller
from focgen.errors import DesignError, PlanError
from focgen.loop.frequency import sampled_response
from focgen.plan.canonical import memory_bias, tables
from focgen.plan.stability import check_stable

TOLERANCE = 0.01
_SERIES = tuple(m * 10**e for e in range(5) for m in (1, 2, 5) if m * 10**e <= 20_000)


@dataclass(frozen=True)
class TermBias:
    """What short memory adds at rest to a term ``coefficient`` · s^``order`` (0 with infinite memory)."""

    coefficient: float
    order: float
    bias: float


@dataclass(frozen=True)
class MemoryChoice:
    """``length`` past samples, ``seconds`` of memory, and ``reason`` for them.

    ``crossover_error``: relative error of the controller's response at ``crossover_rad_s``, against
    infinite memory. ``bias``: of each fractional term at rest, e.g. T (L h)^−α / Γ(1−α) nearly; the
    integrator keeps it from the steady state, but slow disturbances meet a controller with that much more
    gain.
    """

    length: int
    seconds: float
    reason: str
    crossover_rad_s: float
    crossover_error: float
    bias: tuple[TermBias, ...]

    @property
    def rest_gain(self) -> float:
        """1 + the largest bias."""
        return 1.0 + max((b.bias for b in self.bias), default=0.0, key=abs)


def choose_memory(controller: Controller, crossover: float, length: int | None) -> MemoryChoice:
    """Judge ``length``, or choose the shortest of 1, 2, 5, 10 … 20 000 whose error at ``crossover`` is below
    1 %.

    Raises DesignError where none does or the truncated recursion is unstable.
    """
    if length is not None:
        error = _error(controller, crossover, length)
        return _choice(controller, length, "as asked", crossover, error)
    for tried in _SERIES:
        error = _error(controller, crossover, tried)
        if error <= TOLERANCE and _is_stable(controller, tried):
            reason = (
                f"the shortest of 1, 2, 5, 10, … whose error at the crossover is below {100 * TOLERANCE:g} %"
            )
            return _choice(controller, tried, reason, crossover, error)
    raise DesignError(
        controller.name,
        f"even {_SERIES[-1]} samples of memory are not enough at {crossover:.3g} rad/s",
        "raise the rig's sample_time, or choose --length yourself",
    )


def _error(controller: Controller, crossover: float, length: int) -> float:
    place = np.array([crossover])
    return float(
        abs(sampled_response(controller, place, length) / sampled_response(controller, place) - 1.0)[0]
    )


def _is_stable(controller: Controller, length: int) -> bool:
    try:
        check_stable(replace(controller, length=length), tables(controller, length), length)
    except PlanError:
        return False
    return True


def _choice(controller: Controller, length: int, reason: str, crossover: float, error: float) -> MemoryChoice:
    bias = tuple(
        TermBias(*term) for term in memory_bias(controller, length) if not float(term[1]).is_integer()
    )
    return MemoryChoice(length, length * controller.sample_time, reason, crossover, error, bias)
