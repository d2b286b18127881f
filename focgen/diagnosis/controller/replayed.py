"""The controller as described run on what the logs say that the running one saw.

Nobody logs what a controller held when the log began, nor whether the log's rows are its samples. Each of the
few ways there are is tried, and the one taken whose commands come closest to those logged.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from focgen.control.controller import Controller
from focgen.errors import ControllerError
from focgen.logs.experiment import Experiment
from focgen.plan.ideal import ideal
from focgen.plan.scenario import Reset, Scenario
from focgen.present import present

LASTING = 0.5  # of the longest experiment: a memory of that length is as good as an infinite one
_SLOWER = 1.4  # times the controller's sample time: rows this far apart are not all of its samples


@dataclass(frozen=True, eq=False)
class Replayed:
    """``scenarios``: what the controller saw, by experiment, two lanes each: from nothing, and as if the
    first error had been for ever; ``commands`` (n,): what it was logged to answer; ``length``: the memory
    length of the one it is compared with, None for infinite memory, else the controller's own."""

    controller: Controller
    scenarios: tuple[Scenario, ...]
    commands: tuple[np.ndarray, ...]
    length: int | None = None

    @cached_property
    def span(self) -> float:
        """What the logged command runs over, in its unit."""
        return max(float(np.ptp(np.concatenate(self.commands))), 1e-300)

    @cached_property
    def ideal(self) -> list[np.ndarray]:
        """The ideal controller's output (2, n) in every experiment."""
        return self.with_memory(self.length)

    @cached_property
    def apart(self) -> list[np.ndarray]:
        """Logged less ideal command (n,), by experiment."""
        return self.away(self.ideal)

    @cached_property
    def gap(self) -> float:
        """Mean square departure of the logged command from the ideal one."""
        return self.departure(self.ideal)

    def with_memory(self, length: int | None, controller: Controller | None = None) -> list[np.ndarray]:
        """The same with another memory length, or another controller's."""
        return [ideal(controller or self.controller, s, length).u for s in self.scenarios]

    def away(self, made: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Logged less ``made`` command (n,), by experiment, from the start that brings them closest."""
        apart = [u - m for u, m in zip(self.commands, made)]
        return [a[np.argmin(np.sum(np.diff(a) ** 2, axis=1))] for a in apart]

    def departure(self, made: Sequence[np.ndarray]) -> float:
        """Mean square difference of the logged steps from sample to sample and those ``made`` (2, n): an
        integrator would keep every small error for ever."""
        return float(np.mean(np.concatenate([np.diff(a) for a in self.away(made)]) ** 2))


def replayed(controller: Controller, logs: Sequence[Experiment]) -> Replayed:
    """The replay that comes closest. Raises ControllerError where a controller cannot be run on the logs."""
    return min(_ways(controller, logs), key=lambda r: r.gap)


def _ways(controller: Controller, logs: Sequence[Experiment]) -> Iterator[Replayed]:
    for rows in [False] + [True] * any(log.rows is not None for log in logs):
        parts = [_samples(controller, log, rows) for log in logs]
        seen = tuple(_scenario(controller, log, p) for log, p in zip(logs, parts))
        commands = tuple(p["command"] for p in parts)
        for length in (
            None,
            controller.length,
        ):  # a memory that is stated is no departure, nor is a longer one
            yield Replayed(controller, seen, commands, length)


def _samples(controller: Controller, log: Experiment, rows: bool) -> dict[str, np.ndarray]:
    """The signals at the controller's samples. A log with several rows a sample is taken where the command
    changes."""
    as_logged = log.rows if rows else None
    signals = dict(log.signals if as_logged is None else as_logged)
    apart = log.sample_time if as_logged is None else float(np.median(np.diff(present(log.raw_time))))
    if apart > _SLOWER * controller.sample_time:
        raise ControllerError(
            controller.name,
            f"runs every {controller.sample_time:g} s, and {log.name} has a row every {apart:g} s",
            "log every sample of the controller, or correct its sample_time",
        )
    every = max(1, round(controller.sample_time / apart))
    changes = np.abs(np.diff(signals["command"], prepend=signals["command"][0]))
    first = int(np.argmax([changes[k::every].sum() for k in range(every)]))
    return {role: np.asarray(values, float)[first::every] for role, values in signals.items()}


def _scenario(controller: Controller, log: Experiment, signals: dict[str, np.ndarray]) -> Scenario:
    if controller.scheduled and "pressure" not in signals:
        raise ControllerError(
            controller.name, f"is scheduled, and {log.name} lacks the pressure", "log the pressure"
        )
    first, whole = (_twice(controller, signals, slice(n)) for n in (1, None))
    reference, output, command = (float(signals[role][0]) for role in ("reference", "output", "command"))
    begun = Reset(1, 0, reference, output, command)
    if controller.integrator:  # the first increment has led to the first command
        increment = ideal(controller, replace(first, resets=(begun,))).d[1, 0]
        begun = replace(begun, u0=begun.u0 - controller.sample_time * float(increment))
    return replace(whole, resets=(begun,))


def _twice(controller: Controller, signals: dict[str, np.ndarray], part: slice) -> Scenario:
    """Part of the samples in both lanes."""
    seen = {role: np.stack([values[part]] * 2) for role, values in signals.items()}
    return Scenario(seen["reference"], seen["output"], seen["pressure"] if controller.scheduled else None)
