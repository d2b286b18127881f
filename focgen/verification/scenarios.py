"""What a controller is tried with: steps, noise, saturation, schedule ends, resets, tracking, worst cases."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from focgen.arrays import Numbers
from focgen.control.controller import Controller
from focgen.plan.plan import Plan
from focgen.plan.scenario import Params, Reset, Scenario, Track, Tune, to_raw
from focgen.plan.worst import worst_case_input
from focgen.present import present
from focgen.verification.unusable import strewn

LANES = 8
_TUNED = 5  # changes of the parameters in a lane
_BEYOND = 0.15  # of a range: how far lanes that leave their ranges go beyond them


def mixed(controller: Controller, samples: int, seed: int, beyond: bool = False) -> Scenario:
    """Physical inputs: each lane another kind of signal, with resets and tracks at random.

    ``beyond`` leaves the ranges. ``samples`` are in all, split among the lanes.
    """
    rng = np.random.default_rng([seed, int(beyond)])
    each = -(-samples // LANES)
    ranges = controller.ranges
    ref, meas = (_signals(rng, span, each, beyond) for span in (ranges.reference, ranges.measurement))
    sched = _signals(rng, present(ranges.schedule), each, beyond) if controller.scheduled else None
    events = _resets(rng, controller, each, beyond), _tracks(rng, controller, each)
    tunes = tunes_of(rng, controller, each) if controller.tunable else ()
    return Scenario(ref, meas, sched, *events, tunes=tunes)


def _signals(rng: np.random.Generator, span: tuple[float, float], count: int, beyond: bool) -> Numbers:
    kinds = rng.permutation(len(_KINDS))
    rows = np.stack([_KINDS[kinds[lane % len(_KINDS)]](rng, count) for lane in range(LANES)])
    if beyond:
        rows = rows * (1.0 + 2.0 * _BEYOND) - _BEYOND
    return span[0] + (span[1] - span[0]) * rows


def _noise(rng: np.random.Generator, count: int) -> Numbers:
    return rng.uniform(0.0, 1.0, count)


def _steps(rng: np.random.Generator, count: int) -> Numbers:
    return np.repeat(rng.uniform(0.0, 1.0, count), int(rng.integers(10, 120)))[:count]


def _extremes(rng: np.random.Generator, count: int) -> Numbers:
    """From end to end: the worst for derivatives, and saturation."""
    return np.repeat(rng.integers(0, 2, count), int(rng.integers(1, 40)))[:count].astype(float)


def _sine(rng: np.random.Generator, count: int) -> Numbers:
    made: Numbers = 0.5 + 0.5 * np.sin(np.arange(count) * 10.0 ** rng.uniform(-3.0, 0.0))
    return made


def _wander(rng: np.random.Generator, count: int) -> Numbers:
    return np.clip(rng.uniform() + np.cumsum(rng.normal(0.0, 0.01, count)), 0.0, 1.0)


def _held(rng: np.random.Generator, count: int) -> Numbers:
    """An end for ever: integrators run into their limits and stay."""
    return np.full(count, float(rng.integers(0, 2)))


_KINDS = (_noise, _steps, _extremes, _sine, _wander, _held)


def _resets(rng: np.random.Generator, controller: Controller, count: int, beyond: bool) -> tuple[Reset, ...]:
    inputs = controller.ranges.reference, controller.ranges.measurement
    spans = *((_wider(span) for span in inputs) if beyond else inputs), controller.ranges.output
    places = [
        (lane, int(at)) for lane in range(1, LANES) for at in rng.choice(count, min(2, count), replace=False)
    ]
    drawn = ((lane, at, [float(rng.uniform(*span)) for span in spans]) for lane, at in places)
    return tuple(Reset(lane, at, ref, meas, u0) for lane, at, (ref, meas, u0) in drawn)


def _wider(span: tuple[float, float]) -> tuple[float, float]:
    margin = _BEYOND * (span[1] - span[0])
    return span[0] - margin, span[1] + margin


def _tracks(rng: np.random.Generator, controller: Controller, count: int) -> tuple[Track, ...]:
    low, high = controller.ranges.output
    margin = 0.3 * (high - low)  # an outer limiter may well be wider
    places = {(lane, int(rng.integers(count))) for lane in range(0, LANES, 2) for _ in range(6)}
    return tuple(
        Track(lane, at, float(rng.uniform(low - margin, high + margin))) for lane, at in sorted(places)
    )


def tunes_of(rng: np.random.Generator, controller: Controller, count: int) -> tuple[Tune, ...]:
    """Physical parameters from all over the box, its corners among them, at random moments of every lane but
    the first.
    """
    box, found = present(controller.tunable), []
    for lane in range(1, LANES):
        for at in sorted(rng.choice(count, min(_TUNED, count), replace=False).tolist()):
            corners = lane % 2 == 0
            gain = tuple(_inside(rng, box.gain, corners) for _ in controller.gains)
            ends = (_inside(rng, span, corners) for span in (box.output_low, box.output_high))
            found.append(Tune(lane, at, Params(gain, *ends)))
    return tuple(found)


def _inside(rng: np.random.Generator, span: tuple[float, float], corner: bool) -> float:
    return float(rng.choice(span) if corner else rng.uniform(*span))


def mistuned(plan: Plan, scenario: Scenario, seed: int) -> Scenario:
    """A raw scenario of a tunable plan in which every third set of parameters is refused: one number is just
    outside its box, far outside, or, floating, no number.
    """
    if plan.tuning is None:
        return scenario
    rng, made = np.random.default_rng([seed, 17]), []
    for i, tune in enumerate(scenario.tunes):
        made.append(replace(tune, params=_outside(plan, tune.params, rng)) if i % 3 == 2 else tune)
    return replace(scenario, tunes=tuple(made))


def _outside(plan: Plan, params: Params, rng: np.random.Generator) -> Params:
    box, which = present(plan.tuning), int(rng.integers(len(params.gain) + 2))
    ends = [(box.factor.low, box.factor.high)] * len(params.gain) + [box.low, box.high]
    low, high = ends[which]
    top = (1 << (plan.output.bits - 1)) - 1
    if plan.floating:
        kind = np.float32 if plan.arithmetic == "f32" else np.float64
        beside = [float(np.nextafter(kind(end), kind(to))) for end, to in ((low, -np.inf), (high, np.inf))]
        far = (end + sign * max(1e3, abs(end)) for end, sign in ((low, -1.0), (high, 1.0)))
        choices = [*beside, *(float(kind(x)) for x in far), np.nan, np.inf, -np.inf]  # as the type has them
    else:
        choices = [x for x in (low - 1, high + 1, -top - 1, top) if not low <= x <= high and abs(x) <= top]
    values = [*params.gain, params.u_min, params.u_max]
    values[which] = choices[int(rng.integers(len(choices)))]
    return Params(tuple(values[:-2]), *values[-2:])


def worst_cases(plan: Plan) -> Scenario:
    """Raw inputs that take each node to its proved worst case, two lanes a node, up and down.

    They stand in the order of the proofs, those that are alike once. The floating forms have no proofs;
    theirs take the filtered error to its largest.
    """
    nodes = ["v"] if plan.floating else [proof.node for proof in plan.proofs]
    made = [worst_case_input(plan, node) for node in nodes]
    return side_by_side(list({_content(scenario): scenario for scenario in made}.values()))


def _content(scenario: Scenario) -> tuple[Any, ...]:
    """What tells scenarios apart."""
    signals = scenario.ref, scenario.meas, scenario.sched
    return (
        *(None if x is None else x.tobytes() for x in signals),
        scenario.resets,
        scenario.tracks,
        scenario.tunes,
    )


def side_by_side(scenarios: list[Scenario]) -> Scenario:
    """All lanes in one scenario; shorter ones go on with their last inputs."""
    longest = max(s.samples for s in scenarios)

    def stacked(parts: list[Numbers]) -> Numbers:
        return np.concatenate([_prolonged(p, longest) for p in parts])

    begins = np.cumsum([0, *(s.lanes for s in scenarios)])
    return Scenario(
        stacked([s.ref for s in scenarios]),
        stacked([s.meas for s in scenarios]),
        None if scenarios[0].sched is None else stacked([present(s.sched) for s in scenarios]),
        tuple(replace(r, lane=r.lane + int(b)) for s, b in zip(scenarios, begins) for r in s.resets),
        tuple(replace(t, lane=t.lane + int(b)) for s, b in zip(scenarios, begins) for t in s.tracks),
        tunes=tuple(replace(t, lane=t.lane + int(b)) for s, b in zip(scenarios, begins) for t in s.tunes),
    )


def _prolonged(values: Numbers, samples: int) -> Numbers:
    return np.pad(values, ((0, 0), (0, samples - values.shape[1])), mode="edge")


def thinned(scenario: Scenario, samples: int) -> Scenario | None:
    """Some of the lanes, evenly taken, of at most that many samples in all; None where not even one fits."""
    keep = min(samples // scenario.samples, scenario.lanes)
    if not keep:
        return None
    chosen = [int(lane) for lane in np.linspace(0, scenario.lanes - 1, keep).round()]
    place = {lane: i for i, lane in enumerate(chosen)}
    return Scenario(
        scenario.ref[chosen],
        scenario.meas[chosen],
        None if scenario.sched is None else scenario.sched[chosen],
        tuple(replace(r, lane=place[r.lane]) for r in scenario.resets if r.lane in place),
        tuple(replace(t, lane=place[t.lane]) for t in scenario.tracks if t.lane in place),
        tunes=tuple(replace(t, lane=place[t.lane]) for t in scenario.tunes if t.lane in place),
    )


def raw_scenarios(plan: Plan, samples: int, seed: int) -> dict[str, Scenario]:
    """Everything a plan is compared in, by name; raw inputs."""
    inside, outside = (
        mixed(plan.controller, samples, seed),
        mixed(plan.controller, max(samples // 8, 1), seed, True),
    )
    found = {
        "mixed": mistuned(plan, to_raw(plan, inside), seed),
        "beyond the ranges": mistuned(plan, to_raw(plan, outside), seed),
        "worst cases": worst_cases(plan),
    }
    if plan.floating:
        found["unusable inputs"] = strewn(plan, found["beyond the ranges"], seed)
    return {**found, "breakpoints": at_breakpoints(plan)} if plan.schedule else found


def at_breakpoints(plan: Plan) -> Scenario:
    """Raw inputs: the schedule at each breakpoint and next to it on both sides; an error up, down, small."""
    form, points = present(plan.schedule).signal, np.asarray(present(plan.schedule).breakpoints)
    if plan.floating:
        points = points.astype(np.float32 if form.ctype == "float" else np.float64)
        beside = [np.nextafter(points, points.dtype.type(end)) for end in (-np.inf, np.inf)]
    else:
        beside = [np.clip(points + step, int(form.low), int(form.high)) for step in (-1, 1)]
    sched = np.stack([beside[0], points, beside[1]], axis=1).ravel()
    ref, meas = plan.reference, plan.measurement
    pairs = [(ref.high, meas.low), (ref.low, meas.high), (ref.high, meas.high - (meas.high - meas.low) / 16)]
    held = np.asarray(pairs).astype(sched.dtype).T[:, :, None] * np.ones(sched.size, sched.dtype)
    return Scenario(held[0], held[1], np.tile(sched, (len(pairs), 1)))
