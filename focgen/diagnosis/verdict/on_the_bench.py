"""The sizes of an effect that was found, as one would measure them on the rig, with their intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from focgen.control.units import units_of_rig
from focgen.diagnosis.fitting.fit import Fit
from focgen.diagnosis.model import Estimate
from focgen.diagnosis.verdict.sizes import spread
from focgen.rig.bench import Bench
from focgen.rig.effects import Size, library
from focgen.rig.engine import Chain
from focgen.rig.rig import Rig
from focgen.rig.stages import ENTERS, LEAVES, STAGES

# of a size: of those that the writer of blind rigs measured, whose forms are none of the library's, four in
# five are as near; the second of a parameter, as a ceiling, that is none of a form's shape
_FORMS, _PLAIN = 0.05, 0.02
_SAMPLE = 0.3  # of a sample: a fit on the log's grid is as far off in time
_NUDGE = 0.3  # of a standard deviation: by so much a parameter is moved to see what a size makes of it


@dataclass(frozen=True, eq=False)
class _Found:
    """A family that was ``found`` by a fit: its candidates are those ``which``, on their ``bench``."""

    of: Fit
    which: Sequence[int]
    bench: Bench

    def read(self, size: Size, vector: np.ndarray | None = None) -> float:
        """A size, with the numbers found or those of a ``vector``."""
        bench, problem = self.bench, self.of.problem
        if vector is not None:
            values = problem.values(vector)
            bench = bench.of(problem.rig(vector), [values[i] for i in self.which])
        with np.errstate(all="ignore"):
            return float(size.read(bench)) if size.read else np.nan

    def half(self, size: Size, value: float) -> float:
        """Half of a size's 95 % interval, from the covariance of its parameters with the rig's own: a curve
        that is steeper behind a smaller gain bends as far."""
        places, covariance = spread(self.of, self.which, own=True)
        low, high = self.of.problem.bounds()
        slopes = np.zeros(len(places))
        for i, (place, variance) in enumerate(zip(places, np.diag(covariance))):
            if variance > 0.0:
                moved, step = self.of.vector.copy(), _NUDGE * float(np.sqrt(variance))
                above, below = high[place] - moved[place], moved[place] - low[place]
                step = min(step, above) if above >= min(step, below) else -min(step, below)
                moved[place] += step
                slopes[i] = (self.read(size, moved) - value) / step if step else 0.0
        return float(1.96 * np.sqrt(max(slopes @ covariance @ slopes, 0.0)))


def measured(of: Fit, effect: str, parameters: Mapping[str, Estimate], rig: Rig) -> dict[str, Estimate]:
    """By what they are, the sizes of an ``effect`` of a fit, of which the ``parameters`` are known. None of
    those that its form or this rig does not have."""
    which = [i for i, c in enumerate(of.problem.candidates) if c.effect == effect]
    found, made = _Found(of, which, _bench(of, which)), {}
    for size in library()[effect].sizes:
        own = next((parameters[name] for name in size.own if name in parameters), None)
        if own is not None:
            estimate: Estimate | None = _no_nearer(own, _PLAIN, _timing(own.unit, found))
        else:
            estimate = _read(found, size, rig) if _at_rest_anywhere(found) else None
        if estimate is not None:
            early, late = found.bench.hold
            made[size.what.format(early=early, late=late)] = estimate
    return made


def _read(found: _Found, size: Size, rig: Rig) -> Estimate | None:
    value = found.read(size)
    if not np.isfinite(value):
        return None
    half = found.half(size, value)
    scale, unit = _seen_in(size.unit, found.bench.stage, rig)
    value, half = value * scale, half * abs(scale)
    made = Estimate(value, (value - half, value + half), unit)
    return _no_nearer(made, _FORMS, _timing(unit, found)) if half < abs(value) else None


def _timing(unit: str, found: _Found) -> float:
    """What samples leave open of a size in s."""
    return _SAMPLE * found.of.problem.segment.fed.run.h if unit == "s" else 0.0


def _no_nearer(known: Estimate, share: float, least: float) -> Estimate:
    """An estimate that is known to no less than a ``share`` of itself, for no form is quite the rig's, and
    to no less than the ``least``."""
    off = float(np.hypot(share * known.value, least))
    low, high = (float(np.hypot(end - known.value, off)) for end in known.ci95)
    return Estimate(known.value, (known.value - low, known.value + high), known.unit)


def _at_rest_anywhere(found: _Found) -> bool:
    """Whether the stage comes to rest at every input: one that integrates has no response to read."""
    return found.bench.rig.integrator != found.bench.stage


def _bench(of: Fit, which: Sequence[int]) -> Bench:
    problem = of.problem.at_every_row
    placed, segment = problem.placed(of.vector), problem.segment
    rig, mine = problem.rig(of.vector), tuple(placed[i] for i in which)
    x, ahead = segment.x, STAGES[: STAGES.index(mine[0].stage)]
    if before := [stage for stage in segment.stages if stage in ahead]:
        chain = Chain(rig, tuple(p for p in placed if p.stage in before))
        x = chain.run(x, before[0], before[-1], segment.run, segment.between)
    clock, h = segment.run.clock, segment.run.h
    response = problem.references.clocks["response"]
    return Bench(rig, mine, x, h, float(clock[0]), float(clock[-1]), response)


def _seen_in(of: str, stage: str, rig: Rig) -> tuple[float, str]:
    """What a size is multiplied by, and its unit then: "in" and "out" are those of what enters the stage and
    leaves it. What leaves an actuator is told as the sensor reads it, where nothing else does."""
    kind, _, per = of.partition("/")
    if kind not in ("in", "out"):
        return 1.0, of
    role = LEAVES[stage] if kind == "out" else next(role for role, into in ENTERS.items() if into == stage)
    seen = seen_as(role, rig)
    unit = units_of_rig(rig)[seen] or f"{seen} unit"
    return rig.sensor.dc_gain if seen != role else 1.0, f"{unit}/{per}" if per else unit


def seen_as(role: str, rig: Rig | None) -> str:
    """The role of the signal that shows what is of ``role``: the output, for a curvature that is not logged
    and comes to rest behind its sensor."""
    if rig is None or role != "curvature" or rig.signals.curvature is not None:
        return role
    return "output" if np.isfinite(rig.sensor.dc_gain) else role
