"""Which variants are looked at."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from focgen.control.controller import ARITHMETICS, MEMORIES, Controller
from focgen.errors import InputError, check_choice
from focgen.fractional.exponential import HORIZONS
from focgen.fractional.exponential import TOLERANCES as SPAN
from focgen.plan.plan import LONGEST
from focgen.studies.results import Variant

LENGTHS = (10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
TOLERANCES = (0.1, 0.03, 0.01, 1e-3, 1e-4, 1e-5, 1e-6)
_FACTORS = (0.5, 1.0, 2.0)  # of the sample time
_PLANT_LENGTHS = (100, 1000, 10_000)
_PLANT_TOLERANCE = 1e-4


@dataclass(frozen=True)
class Grid:
    """What is swept: every memory in every arithmetic at the controller's own sample time, and in the
    controller's arithmetic at the others.
    """

    memories: tuple[str, ...]
    lengths: tuple[int, ...]
    tolerances: tuple[float, ...]
    horizon: int
    arithmetics: tuple[str, ...]
    sample_times: tuple[float, ...]

    def variants(self, controller: Controller) -> list[Variant]:
        """All of them, the controller's own sample time first."""
        own, found = controller.sample_time, []
        first = controller.arithmetic if controller.arithmetic in self.arithmetics else self.arithmetics[0]
        for h in sorted(self.sample_times, key=lambda h: (h != own, h)):
            for arithmetic in self.arithmetics if h == own else (first,):
                found += [self.short(arithmetic, h, length) for length in self._lengths()]
                found += [self.exponential(arithmetic, h, e, own) for e in self._tolerances()]
        return found

    def _lengths(self) -> tuple[int, ...]:
        return self.lengths if "short" in self.memories else ()

    def _tolerances(self) -> tuple[float, ...]:
        return self.tolerances if "exponential" in self.memories else ()

    def short(self, arithmetic: str, sample_time: float, length: int) -> Variant:
        """A short memory."""
        return Variant("short", arithmetic, sample_time, length=length)

    def exponential(self, arithmetic: str, sample_time: float, tolerance: float, own: float) -> Variant:
        """An exponential memory that reaches as many seconds at every sample time."""
        reach = round(self.horizon * own / sample_time)
        return Variant(
            "exponential",
            arithmetic,
            sample_time,
            tolerance=tolerance,
            horizon=min(max(reach, HORIZONS[0]), HORIZONS[1]),
        )

    def of_the_plant(self, sample_time: float) -> list[Variant]:
        """The memories that the plant is simulated with, in float64."""
        longer = min(max(self.horizon, 10_000), HORIZONS[1])
        found = [self.short("f64", sample_time, length) for length in _PLANT_LENGTHS]
        return [
            *found,
            Variant("exponential", "f64", sample_time, tolerance=_PLANT_TOLERANCE, horizon=longer),
        ]


def grid_of(
    controller: Controller,
    memories: Sequence[str] | None = None,
    lengths: Sequence[int] | None = None,
    tolerances: Sequence[float] | None = None,
    horizon: int | None = None,
    arithmetics: Sequence[str] | None = None,
    sample_times: Sequence[float] | None = None,
) -> Grid:
    """Fill in what is not given. Raises InputError for what cannot be swept."""
    own = controller.sample_time
    grid = Grid(
        tuple(memories or MEMORIES),
        tuple(sorted(set(lengths or (*LENGTHS, controller.length)))),
        tuple(sorted(set(tolerances or (*TOLERANCES, *_own(controller))), reverse=True)),
        controller.horizon if horizon is None else horizon,
        tuple(arithmetics or ARITHMETICS),
        tuple(dict.fromkeys(sample_times or (own * factor for factor in _FACTORS))),
    )
    _check(grid)
    return grid


def _own(controller: Controller) -> tuple[float, ...]:
    """The tolerance that the controller itself asks for."""
    return (controller.tolerance,) if controller.memory == "exponential" else ()


def _check(grid: Grid) -> None:
    for memory in grid.memories:
        check_choice("--memory", memory, MEMORIES)
    for arithmetic in grid.arithmetics:
        check_choice("--arithmetic", arithmetic, ARITHMETICS)
    _each(
        "--lengths",
        grid.lengths,
        lambda n: isinstance(n, int) and 1 <= n <= LONGEST,
        f"give 1 … {LONGEST} past samples",
    )
    _each("--tolerances", grid.tolerances, lambda e: SPAN[0] <= e <= SPAN[1], "give 1e-8 … 0.1")
    _each("--sample-times", grid.sample_times, lambda h: math.isfinite(h) and h > 0.0, "give times above 0 s")
    _each("--horizon", (grid.horizon,), lambda n: HORIZONS[0] <= n <= HORIZONS[1], "give 100 … 1e8 samples")


def _each(option: str, values: Iterable[Any], fits: Callable[[Any], bool], remedy: str) -> None:
    for value in values:
        if not fits(value):
            raise InputError(option, f"is {value!r}", remedy)
