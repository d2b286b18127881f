"""K_o(p) found in simulation: the line with which steps from rest to the operating points meet the
specification.

A step to a high set point passes through all lower pressures, so its response depends on the whole line,
and the line is sought as a whole: its level c and its ratio ρ = K_o(highest)/K_o(lowest operating point).
Of all lines that meet the specification the one is taken whose operating points settle most alike.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Array
from focgen.control.controller import Controller
from focgen.control.inversion import Inversion, invert
from focgen.control.measures import StepMeasures, measure_step
from focgen.control.schedule import Line
from focgen.errors import DesignError
from focgen.loop.bench import Bench
from focgen.loop.chain import Chain, chain, substeps
from focgen.loop.run import run_loop
from focgen.loop.stepper import FloatStepper
from focgen.present import present

OVERSHOOT = 5.0  # %, where nothing is specified
HORIZON = 5.0  # specified settling times that a step is followed for
_SAMPLES = 150  # samples in a specified settling time: finer sampling is searched at this
# levels of K_o: 1 is where the loop with frozen gain settles in the time aimed at
_LEVELS = np.geomspace(0.05, 6.0, 18)
_COARSE_RATIOS = (0.6, 1.0, 1.7)
_RATIOS = (0.5, 0.7, 0.85, 1.0, 1.2, 1.5, 2.0)
_CLOSE = 1.1
_ATTEMPTS = 9
_PARTS = 2  # substeps during the search; what it finds is checked with as many as the chain needs
_MOST_SAMPLES = 60_000
_MARGIN = 0.98  # of the specification that is aimed at, so that the fitted line keeps it


@dataclass(frozen=True)
class Specification:
    """What the loop shall do: ``settling`` the mean settling time (5 %) over the operating points in s, None
    for as fast as possible; ``overshoot`` the largest overshoot at any of them, %.
    """

    settling: float | None
    overshoot: float


@dataclass(frozen=True)
class Tuned:
    """The line found, its inversion, and what the steps do with it (infinite memory, float64)."""

    line: Line
    inversion: Inversion
    measures: tuple[StepMeasures, ...]

    @property
    def mean_settling(self) -> float:
        """Mean settling time over the operating points, s; infinite where one does not settle."""
        mean = float(np.mean([m.settling_s for m in self.measures]))
        return mean if math.isfinite(mean) else math.inf

    @property
    def overshoot(self) -> float:
        """The largest overshoot, %."""
        return max(m.overshoot_pct for m in self.measures)


@dataclass(frozen=True, eq=False)
class _Trials:
    """Results of many lines, arrays of shape (lines,) but ``lines`` (lines, 2): level and ratio."""

    lines: Array
    mean: Array
    spread: Array
    overshoot: Array


class _Search:
    """Simulates lines. The sampling interval resolves ``scale``, the settling time aimed at (s), with few
    substeps; where ``step`` (s) is given, that is the interval, with as many substeps as the chain needs.
    """

    def __init__(self, bench: Bench, scale: float, step: float | None = None) -> None:
        own = bench.rig.sample_time
        self.bench, self.scale = bench, scale
        self.step = step or max(own, scale / _SAMPLES)
        self.samples = max(20, math.ceil(HORIZON * scale / self.step))
        if HORIZON * scale / own > _MOST_SAMPLES:
            raise DesignError(
                bench.rig.name,
                f"a settling time of {scale:.3g} s is {scale / own:.0f} samples",
                f"ask for a faster loop, or raise the rig's sample_time ({own:g} s)",
            )
        exact = substeps(bench.rig, self.step)
        self.chain = chain(bench.rig, self.step, self.samples, exact if step else min(exact, _PARTS))
        self.inversion = invert(bench.rig, 3.0 / scale)
        static = bench.rig.regulator.dc_gain * bench.rig.sensor.dc_gain
        self.unit = 3.0 / (scale * static)

    def ratios(self, wanted: ArrayLike) -> Array:
        """The ratios worth trying: 1 where nothing is scheduled or there is one operating point."""
        several = self.inversion.scheduled and np.ptp(self.bench.pressures) > 0.0
        return np.asarray(wanted) if several else np.ones(1)

    def at(self, step: float) -> _Search:
        """The same search at another sampling interval."""
        return _Search(self.bench, self.scale, step)

    def line(self, level: float, ratio: float) -> Line:
        low, high = self.bench.pressures[0], self.bench.pressures[-1]
        first = float(level * self.unit)
        slope = first * (ratio - 1.0) / (high - low) if ratio != 1.0 else 0.0  # one point has ratio 1
        return Line(_certain(float(first - slope * low)), _certain(float(slope)))

    def measures(self, lines: list[Line]) -> list[tuple[StepMeasures, ...]]:
        """Return what each line makes of each operating point."""
        return simulate_lines(self.bench, self.inversion, lines, self.chain)

    def trials(self, levels: Array, ratios: Array) -> _Trials:
        pairs = np.array([(level, ratio) for ratio in ratios for level in levels])
        found = self.measures([self.line(*pair) for pair in pairs])
        times = np.array([[m.settling_s for m in each] for each in found])
        times = np.where(np.isfinite(times), times, np.inf)
        overshoot = np.array([max(m.overshoot_pct for m in each) for each in found])
        with np.errstate(invalid="ignore"):
            spread = times.max(axis=1) - times.min(axis=1)
        return _Trials(pairs, times.mean(axis=1), np.nan_to_num(spread, nan=np.inf), overshoot)


def _certain(found: float) -> float:
    """Round to six digits, as many as a schedule is written with. Settling times in simulation, and the
    levels that follow from them, agree to ten or more between processors: six are the same on all."""
    return float(f"{found:.6g}")


def simulate_lines(
    bench: Bench, inversion: Inversion, lines: list[Line], prepared: Chain
) -> list[tuple[StepMeasures, ...]]:
    """Step the loop from rest to every operating point with every line, all at once."""
    count, samples, h = len(bench.points), prepared.samples, prepared.sample_time
    level = np.repeat([line.intercept for line in lines], count)
    slope = np.repeat([line.slope for line in lines], count)

    def gain(pressure: Array) -> Array:
        held = np.clip(pressure, *bench.span)
        made: Array = (level + slope * held) / inversion.K(held)
        return made

    controller = Controller("search", h, inversion.transfer, 1.0, inversion.integrator, bench.ranges)
    stepper = FloatStepper(controller, samples, count * len(lines), bench.start.command, gain=gain)
    reference = np.tile(np.tile(bench.references, len(lines)), (samples, 1))
    run = run_loop(
        prepared, stepper, reference, bench.start, bench.delay, bench.pressure_known, curvature=False
    )
    found = [
        measure_step(run.output[:, i], h, bench.start.output, reference[0, i])
        for i in range(reference.shape[1])
    ]
    return [tuple(found[i : i + count]) for i in range(0, len(found), count)]


def tune(bench: Bench, specification: Specification) -> Tuned:
    """Return the line that meets ``specification``. Raises DesignError naming what is feasible."""
    if specification.settling is None:
        return fastest(bench, specification.overshoot)
    found = meeting(bench, specification) or fastest(bench, specification.overshoot)
    if found.mean_settling > specification.settling:
        raise DesignError(
            bench.rig.name,
            f"no K_o(p) settles in {specification.settling:g} s on average with at most "
            f"{specification.overshoot:g} % overshoot; feasible is {found.mean_settling:.3g} s",
            f"ask for --settling {_upward(found.mean_settling):g} or more, or allow more --overshoot",
        )
    return found


def meeting(bench: Bench, specification: Specification) -> Tuned | None:
    """Return the line whose mean settling time is the specified one, None where none was found."""
    search = _Search(bench, present(specification.settling))
    pair = _matching(search, specification)
    return None if pair is None else _at_own_rate(bench, search, pair, specification)


def _upward(value: float) -> float:
    """Round up to two digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / unit) * unit


def _at_own_rate(
    bench: Bench, search: _Search, pair: tuple[float, float, float], specification: Specification
) -> Tuned | None:
    """Return the line at the rig's own sample time, its level corrected where the search ran at a coarser
    one.
    """
    own = search.at(bench.rig.sample_time)
    level, ratio, safe = pair
    factors = (1.0,) if own.step == search.step else (1.0, 1.03, 0.97, 1.07, 0.93)
    levels = [between * factor for factor in factors for between in (level, math.sqrt(level * safe), safe)]
    lines = [own.line(each, ratio) for each in levels]
    for line, measures in zip(lines, own.measures(lines)):
        tuned = Tuned(line, own.inversion, measures)
        if (
            tuned.mean_settling <= (specification.settling or math.inf)
            and tuned.overshoot <= specification.overshoot
        ):
            return tuned
    return None


def fastest(bench: Bench, overshoot: float) -> Tuned:
    """Return the line with the shortest mean settling time found whose overshoot stays within ``overshoot``
    (%).

    Raises DesignError where none settles.
    """
    scale = _guess(bench)
    for _ in range(_ATTEMPTS):
        search = _Search(bench, scale)
        best = _quickest(search.trials(np.geomspace(0.1, 3.0, 24), search.ratios(_COARSE_RATIOS)), overshoot)
        if best is None:
            scale *= 3.0
        elif not scale / 3.0 <= best[0] <= 1.5 * scale:
            scale = best[0]
        else:
            found = _refined(bench, search, best, overshoot)
            if found is not None:
                return found
            scale = 1.2 * best[0]
    raise DesignError(
        bench.rig.name,
        f"no K_o(p) was found that settles with at most {overshoot:g} % overshoot",
        "allow more --overshoot, or check the rig and its sample_time",
    )


def _refined(
    bench: Bench, search: _Search, best: tuple[float, float, float], overshoot: float
) -> Tuned | None:
    """Look around the best line of the coarse grid twice, ever closer."""
    for width in (1.0, 0.3):
        levels = best[1] * np.exp(0.25 * width * np.linspace(-1.0, 1.0, 9))
        ratios = search.ratios(best[2] * np.exp(0.4 * width * np.linspace(-1.0, 1.0, 7)))
        best = min(best, _quickest(search.trials(levels, ratios), overshoot) or best)
    _, level, ratio = best
    return _at_own_rate(bench, search, (level, ratio, level), Specification(None, overshoot))


def _quickest(trials: _Trials, overshoot: float) -> tuple[float, float, float] | None:
    """Return mean settling time, level and ratio of the quickest line that keeps the overshoot."""
    mean = np.where(trials.overshoot <= _MARGIN * overshoot, trials.mean, np.inf)
    best = int(mean.argmin())
    level, ratio = map(float, trials.lines[best])
    return None if math.isinf(mean[best]) else (float(mean[best]), level, ratio)


def _guess(bench: Bench) -> float:
    """Return a settling time (s) that regulator, sensor, sampling and delays should allow: 45° of lag at
    crossover.
    """
    h = bench.rig.sample_time
    omega = np.geomspace(1e-6, math.pi, 4000) / h
    around = bench.rig.regulator * bench.rig.sensor
    lag = -np.unwrap(np.angle(around.frequency_response(omega) / around.dc_gain)) + omega * h * (
        0.5 + bench.delay
    )
    lag += omega * bench.rig.delays.total
    late = np.flatnonzero(lag > 0.25 * math.pi)
    return 3.0 / float(omega[late[0] if len(late) else -1])


def _matching(search: _Search, specification: Specification) -> tuple[float, float, float] | None:
    """Return level and ratio whose mean settling time is the specified one, with the smallest spread, and a
    level tried nearby.

    None where there is none.
    """
    levels = _promising(search.trials(_LEVELS, search.ratios(_COARSE_RATIOS)), specification)
    if levels is None:
        return None
    ratios = search.ratios(_RATIOS)
    pairs = _crossings(search.trials(levels, ratios), specification, len(levels))
    if not pairs or len(ratios) == 1:
        return pairs[0] if pairs else None
    level, ratio, _ = pairs[0]
    near = ratio * np.linspace(0.88, 1.12, 7)
    fine = search.trials(level * np.geomspace(0.85, 1.2, 10), near)
    return (_crossings(fine, specification, 10) or pairs)[0]


def _promising(trials: _Trials, specification: Specification) -> Array | None:
    """Return levels to look at closely: around those that come near to the specification."""
    near = (trials.mean <= 1.6 * present(specification.settling)) & (
        trials.overshoot <= 3.0 * specification.overshoot + 5.0
    )
    if not near.any():
        return None
    step = _LEVELS[1] / _LEVELS[0]
    low, high = trials.lines[near, 0].min() / step, trials.lines[near, 0].max() * step
    return np.geomspace(low, high, max(8, math.ceil(math.log(high / low) / math.log(_CLOSE))))


def _crossings(
    trials: _Trials, specification: Specification, levels: int
) -> list[tuple[float, float, float]]:
    """Return, for each ratio, the lowest level at which the mean settling time falls to the specification,
    best spread first.

    Level between those tried, ratio, and the tried level that meets the specification.
    """
    target, found = _MARGIN * present(specification.settling), []
    for start in range(0, len(trials.mean), levels):
        mean = trials.mean[start : start + levels]
        fits = (mean <= target) & (trials.overshoot[start : start + levels] <= specification.overshoot)
        if not fits.any():
            continue
        i = start + int(fits.argmax())
        level = safe = trials.lines[i, 0]
        if i > start and math.isfinite(trials.mean[i - 1]) and trials.mean[i - 1] > target:
            share = (trials.mean[i - 1] - target) / (trials.mean[i - 1] - trials.mean[i])
            level = trials.lines[i - 1, 0] * (level / trials.lines[i - 1, 0]) ** share
        found.append((trials.spread[i], level, trials.lines[i, 1], safe))
    return [found_one[1:] for found_one in sorted(found)]
