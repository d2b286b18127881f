"""What a controller is compared on: very many lanes side by side, which is what makes the reference fast.

Besides the inputs of ``verify`` there are driven ones: they take the error of the weights to its worst, as
far as a finite past can, and round every input away from the side that would help. A bound is compared with
the largest error that these find.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from focgen.plan.ideal import ideal
from focgen.plan.plan import Format, Plan
from focgen.plan.scenario import Params, Scenario, Tune, nearest_raw, to_raw
from focgen.plan.worst import _filtered, worst_case_input
from focgen.verification.scenarios import LANES, mistuned, mixed, side_by_side
from focgen.verification.unusable import strewn

DRIVEN = 32
_DITHER = (0.0, 1e-4, 1e-2, 0.2)  # of a range: how far driven inputs stay from its ends


def wide(plan: Plan, lanes: int, samples: int, seed: int) -> Scenario:
    """Raw inputs inside the ranges, of the kinds that ``verify`` mixes, in many lanes."""
    parts = [mixed(plan.controller, LANES * samples, seed * 1000 + i) for i in range(max(1, lanes // LANES))]
    return mistuned(plan, to_raw(plan, side_by_side(parts)), seed)


def others(plan: Plan, samples: int, seed: int) -> dict[str, Scenario]:
    """Raw inputs beyond the ranges, and of a floating plan such as cannot be used."""
    beyond = mistuned(plan, to_raw(plan, mixed(plan.controller, LANES * samples, seed, True)), seed)
    found = {"beyond the ranges": beyond}
    return {**found, "unusable inputs": strewn(plan, beyond, seed)} if plan.floating else found


def measured(plan: Plan, samples: int, seed: int) -> Scenario:
    """Physical inputs whose errors are measured: driven ones, and some of the others."""
    return side_by_side([driven(plan, samples, seed), mixed(plan.controller, LANES * samples, seed)])


def driven(plan: Plan, samples: int, seed: int) -> Scenario:
    """Physical inputs that drive the error to its worst, ``DRIVEN`` lanes: the past that does it, over and
    over, each time with another dither. The upper half goes through the schedule and the box of parameters.
    """
    rng, worst = np.random.default_rng([seed, 5]), worst_case_input(plan, "v")
    made = _of_unit(_filtered(plan, "v"), worst.samples)
    signs = [np.where(x[::-1] > 0.0, 1, -1) for x in (made - exactly(plan, worst.samples), made)]
    ranges, ref, meas = plan.controller.ranges, np.empty((DRIVEN, samples)), np.empty((DRIVEN, samples))
    for lane in range(DRIVEN):
        towards = (1 - 2 * (lane & 1)) * np.resize(signs[lane >> 1 & 1], samples)
        rounded = (1 - 2 * (lane >> 2 & 1)) * np.resize(signs[1], samples)
        dither = _DITHER[lane >> 2 & 3] * rng.uniform(0.0, 1.0, (2, samples))
        ref[lane] = _beside(plan.reference, ranges.reference, towards, rounded, dither[0])
        meas[lane] = _beside(plan.measurement, ranges.measurement, -towards, -rounded, dither[1])
    return Scenario(ref, meas, _schedule(rng, plan, worst, ref.shape), tunes=_tunes(rng, plan))


def _schedule(
    rng: np.random.Generator, plan: Plan, worst: Scenario, shape: tuple[int, int]
) -> np.ndarray | None:
    """At its largest gain, then anywhere."""
    if plan.schedule is None:
        return None
    low, high = plan.controller.ranges.schedule
    sched = rng.uniform(low, high, shape)
    largest = float(worst.sched[0, 0]) * plan.schedule.signal.lsb
    sched[: shape[0] // 2] = min(max(largest, low), high)
    return sched


def _tunes(rng: np.random.Generator, plan: Plan) -> tuple[Tune, ...]:
    """The largest factors that the box has; then any, rounded by as much as can be."""
    if plan.tuning is None:
        return ()
    box, lsb = plan.controller.tunable, 0.0 if plan.floating else 0.49 * plan.tuning.factor.lsb
    ends = box.output_low[0], box.output_high[1]
    found = []
    for lane in range(DRIVEN):
        most = np.full(len(plan.controller.gains), box.gain[1])
        any_ = rng.uniform(*box.gain, len(most)) if lane % 3 else most
        gain = most if lane < DRIVEN // 2 else np.clip(any_ + lsb * rng.choice([-1.0, 1.0]), *box.gain)
        found.append(Tune(lane, 0, Params(tuple(map(float, gain)), *ends)))
    return tuple(found)


def _of_unit(found: np.ndarray, count: int) -> np.ndarray:
    return np.pad(found[:count], (0, max(0, count - len(found))))


def exactly(plan: Plan, count: int) -> np.ndarray:
    """How the filtered error answers a unit error in exact arithmetic, (count,)."""
    bare = replace(plan.controller, setpoint_filter=None, tunable=None)
    size = 1e-3 * max(map(abs, (plan.error.low, plan.error.high))) * plan.error.lsb
    pulse = np.zeros((1, count))
    pulse[0, 0] = size
    sched = None if plan.schedule is None else np.full((1, count), plan.controller.gain.breakpoints[0])
    gain = float(bare.gain_at(None if sched is None else sched[0, 0]))
    found = ideal(bare, Scenario(pulse, np.zeros((1, count)), sched), plan.length, plan.memories).d[0]
    return found / (gain * size or 1.0)


def _beside(
    form: Format, span: tuple[float, float], towards: np.ndarray, rounded: np.ndarray, dither: np.ndarray
) -> np.ndarray:
    """Physical values near the end of a range that ``towards`` points to, each as far beside its raw value as
    rounding allows, so that it rounds the way ``rounded`` points; within the range all the same."""
    low, high = span
    ends = np.where(towards > 0, high, low)
    raw = nearest_raw(ends - np.sign(towards) * dither * (high - low), form)
    gap = np.spacing(np.abs(raw)).astype(float) if form.floating else form.lsb
    return np.clip(np.asarray(raw, float) * form.lsb - 0.49 * gap * rounded, low, high)
