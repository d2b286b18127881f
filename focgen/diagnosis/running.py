"""The controller's stage: how the running one departs from the ideal one, from closed-loop logs.

The controller is replayed on the logged reference and measurement. What it should have commanded is compared
with the logged command, sample by sample in steps (an integrator would keep every small error for ever).
Lost and late samples are read off the raw time stamps, which no resampling has touched.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from focgen.control.controller import Controller
from focgen.errors import ControllerError, PlanError
from focgen.logs.experiment import Experiment
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.ideal import ideal
from focgen.plan.scenario import Scenario, physical_trace, to_raw

CONTROLLER_EFFECTS = ("short_memory", "fixed_point", "sample_jitter", "missed_samples", "output_saturation")
_LENGTHS = (10, 20, 35, 50, 75, 100, 150, 250, 400, 700, 1000, 2000)
_GOOD = 0.5  # of the command's mean square departure that a cause has to explain
_RESOLVED = 5e-5  # of the command's range: departures below are the log's resolution
_STEADY = 0.2  # what a departure that stays counts beside one from sample to sample
_JITTER = 0.03  # of a sample, standard deviation of the raw time stamps
_FREE = 0.02  # of the samples at one end of the range make a limit


@dataclass(frozen=True)
class Departure:
    """One cause: ``share`` of the departure it explains, its parameter with unit."""

    effect: str
    share: float
    parameter: str
    value: float
    unit: str


@dataclass(frozen=True)
class Running:
    """``departure``: root-mean-square of logged less ideal command, per sample, in its unit; ``causes`` best
    first."""

    departure: float
    resolved: bool
    causes: tuple[Departure, ...]


def running(controller: Controller, logs: Sequence[Experiment]) -> Running:
    """Compare the logged command with the ideal controller's.

    Raises ControllerError where the logs lack reference or command, or a scheduling signal.
    """
    logged = [log for log in logs if "reference" in log and "command" in log]
    if not logged:
        raise ControllerError(
            controller.name, "the logs lack reference or command", "name both columns in [signals]"
        )
    command = [np.asarray(log["command"], float) for log in logged]
    best = _commands(logged, lambda s: ideal(controller, s).u, controller)
    before = _departure(command, best)
    span = max(float(np.ptp(np.concatenate(command))), 1e-300)
    stamps = list(_stamps(logged))
    away = max(float(np.sqrt(np.mean((a - b) ** 2))) for a, b in zip(command, best))
    resolved = max(np.sqrt(before), _STEADY * away) >= _RESOLVED * span
    if not resolved:
        return Running(float(np.sqrt(before)), False, tuple(stamps))
    found = []
    for departure, made in _rivals(controller, logged, command):
        after = _departure(command, made)
        found.append(replace(departure, share=float(1.0 - after / before) if before > 0 else 0.0))
    found = sorted((d for d in found if d.share > _GOOD), key=lambda d: -d.share)[:1]
    return Running(float(np.sqrt(before)), True, (*stamps, *found))


def _scenario(controller: Controller, log: Experiment) -> Scenario:
    sched = None
    if controller.scheduled:
        role = "pressure" if "pressure" in log else None
        if role is None:
            raise ControllerError(
                controller.name, "is scheduled, and the logs lack the pressure", "log the pressure"
            )
        sched = np.asarray(log[role], float)[None]
    return Scenario(np.asarray(log["reference"], float)[None], np.asarray(log["output"], float)[None], sched)


def _commands(logs, run, controller: Controller) -> list[np.ndarray]:
    return [np.asarray(run(_scenario(controller, log)), float)[0] for log in logs]


def _departure(command, made) -> float:
    """Mean square difference of the steps from sample to sample."""
    return float(np.mean(np.concatenate([np.diff(a - b) for a, b in zip(command, made)]) ** 2))


def _rivals(controller: Controller, logs, command) -> Iterator[tuple[Departure, list[np.ndarray]]]:
    for length in sorted({*_LENGTHS, controller.length}):
        if length < max(map(len, logs)):
            made = _commands(logs, lambda s, n=length: ideal(controller, s, n).u, controller)
            yield Departure("short_memory", 0.0, "length", float(length), "samples"), made
    for arithmetic in ("q31", "q15"):
        try:
            plan = build_plan(controller, arithmetic)
            made = _commands(
                logs, lambda s, p=plan: physical_trace(p, execute(p, to_raw(p, s))).u, controller
            )
        except PlanError:
            continue
        yield Departure("fixed_point", 0.0, "bits", float(arithmetic[1:]) + 1, "bit"), made
    yield from _limits(controller, logs, command)


def _limits(controller: Controller, logs, command) -> Iterator[tuple[Departure, list[np.ndarray]]]:
    joined = np.concatenate(command)
    low, high = controller.ranges.output
    span = high - low
    for end, own in ((float(joined.max()), high), (float(joined.min()), low)):
        stays = np.mean(np.abs(joined - end) < 1e-4 * span)
        if stays > _FREE and abs(end - own) > 2e-3 * span:
            output = (low, end) if own == high else (end, high)
            tight = replace(controller, ranges=replace(controller.ranges, output=output))
            made = _commands(logs, lambda s, c=tight: ideal(c, s).u, controller)
            yield Departure("output_saturation", 0.0, "limit", end, "command unit"), made


def _stamps(logs: Sequence[Experiment]) -> Iterator[Departure]:
    """What the raw time stamps show: samples left out, and samples early or late."""
    steps = [
        np.diff(log.raw_time) / log.sample_time
        for log in logs
        if log.raw_time is not None and len(log.raw_time) > 2
    ]
    if not steps:
        return
    joined = np.concatenate(steps)
    missed = float(np.sum(np.maximum(np.round(joined) - 1, 0)) / len(joined))
    if missed > 1e-3:
        yield Departure("missed_samples", 1.0, "share", missed, "")
    kept = joined[np.round(joined) == 1]
    jitter = float(np.std(kept)) if len(kept) else 0.0
    if jitter > _JITTER:
        yield Departure("sample_jitter", 1.0, "deviation", jitter * logs[0].sample_time, "s")
