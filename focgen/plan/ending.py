"""What a run of the reference leaves behind in a controller's state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from focgen.arrays import Numbers
from focgen.plan.counts import taken_in
from focgen.plan.damage import mended
from focgen.plan.execute import Run, execute
from focgen.plan.plan import Plan
from focgen.plan.scenario import Reset, Scenario, Trace, Track, Tune
from focgen.plan.setpoint import begun
from focgen.plan.tuning import Applied, applied, refused
from focgen.plan.usable import good_samples, invalid_samples, usable
from focgen.present import present

Event = TypeVar("Event", Reset, Track, Tune)


@dataclass(frozen=True, eq=False)
class Ending:
    """Raw values after a lane's last sample, by what :mod:`focgen.plan.plan` calls them.

    ``error`` and ``filtered``: the samples since init or the latest reset, oldest first; before them each was
    ``error_rest`` and ``filtered_rest`` for ever. ``r``: the inner integral's latest addend. ``starting``:
    no step has been made since. ``means`` and ``rests``: of every mode, by the name of its sum and the
    number of its bank. ``applied``: of the parameters. ``aim``: of the set-point
    filter, by the names of its members. What a plan does not have is 0.
    """

    error: Numbers
    filtered: Numbers
    error_rest: Any
    filtered_rest: Any
    carry: Any
    inner: Any
    r: Any
    integral: Any
    increment: Any
    starting: bool
    means: dict[tuple[str, int], Numbers]
    rests: dict[tuple[str, int], Numbers]
    output: Any
    flags: int
    applied: Applied | None = None
    aim: dict[str, Any] = field(default_factory=dict)


def endings(plan: Plan, scenario: Scenario) -> tuple[Trace, tuple[Ending, ...]]:
    """Run a plan as :func:`focgen.plan.execute.execute` does; what it answers, and how each lane ends."""
    scenario = mended(plan, scenario, execute)
    invalid = invalid_samples(plan, scenario)
    if not invalid.any():
        run = Run(plan, scenario)
        return run.trace, tuple(_ended(run, lane, run.trace, lane) for lane in range(scenario.lanes))
    trace, packed = execute(plan, scenario), good_samples(plan, scenario, invalid)
    counts = np.count_nonzero(~invalid, axis=1)
    return trace, tuple(_lane(plan, packed, lane, int(n), trace) for lane, n in enumerate(counts))


def _lane(plan: Plan, packed: Scenario, lane: int, count: int, trace: Trace) -> Ending:
    """A lane that ends after ``count`` good samples, and what has been called after the last of them."""
    resets, tracks, tunes = (
        _of_lane(packed.resets, lane, count),
        _of_lane(packed.tracks, lane, count),
        _of_lane(packed.tunes, lane, count),
    )
    reset = any(r.sample == count for r in resets)
    last = count + 1 if reset or not count else count  # a sample to begin with: only its beginning counts
    part = _part(packed, lane, last, resets, [t for t in tracks if t.sample < last])
    run = Run(plan, replace(part, tunes=tuple(t for t in tunes if t.sample < last)))
    found = _begun(run, count, trace, lane) if last > count else _ended(run, 0, trace, lane)
    for tune in tunes if last == count else ():
        if tune.sample == count and not refused(plan, tune.params):
            found = _taken(plan, found, applied(plan, tune.params))
    for track in tracks:
        if track.sample == count and usable(track.u, plan.output) and plan.integrator:
            found = replace(found, integral=_within(plan, found, run.kind(track.u)))
    return found


def _of_lane(events: Sequence[Event], lane: int, last: int) -> list[Event]:
    """Those of a lane up to a sample, as events of the only lane."""
    return [replace(event, lane=0) for event in events if event.lane == lane and event.sample <= last]


def _taken(plan: Plan, found: Ending, now: Applied) -> Ending:
    """With other parameters."""
    found = replace(found, applied=now)
    return replace(found, integral=_within(plan, found, found.integral)) if plan.integrator else found


def _within(plan: Plan, found: Ending, u: Any) -> Any:
    """A floating output, or integral in counts, as an integral within the limits that hold; in integers no
    sample is ever left out."""
    low, high = (
        (present(found.applied).low, present(found.applied).high)
        if plan.tuning
        else (plan.output.low, plan.output.high)
    )
    state = present(plan.integrator).state
    if not state.floating:
        u, low, high = (taken_in(value, state) for value in (u, np.float32(low), np.float32(high)))
    return np.asarray(min(max(u, low), high)).astype(np.asarray(u).dtype)[()]


def _part(packed: Scenario, lane: int, samples: int, resets: list[Reset], tracks: list[Track]) -> Scenario:
    def cut(x: Numbers) -> Numbers:
        return np.pad(x[lane : lane + 1], ((0, 0), (0, 1)))[:, :samples]

    sched = None if packed.sched is None else cut(packed.sched)
    return Scenario(cut(packed.ref), cut(packed.meas), sched, tuple(resets), tuple(tracks))


def _ended(run: Run, lane: int, trace: Trace, of: int) -> Ending:
    """After the run's last sample."""
    start = max(sample for at, sample in run.starts if at == lane)
    banks = {(name, i): one for name, memory in run.memory.items() for i, one in enumerate(memory)}
    return Ending(
        error=run.e[lane, start:],
        filtered=run.v[lane, start:],
        error_rest=run.starts[lane, start].constant,
        filtered_rest=run.v_rest[lane, start],
        carry=run.carry[lane],
        inner=run.inner[lane],
        r=run.r[lane, -1] if run.plan.inner else run.kind(0),
        integral=run.integral[lane],
        increment=run.d[lane, -1],
        starting=False,
        means={key: one.mean[lane] for key, one in banks.items()},
        rests={key: one.rest[lane] for key, one in banks.items()},
        output=trace.u[of, -1],
        flags=int(present(trace.flags)[of, -1]),
        applied=run.tuned[lane][-1][1] if run.tuned else None,
        aim={name: values[lane] for name, values in run.aim.items()},
    )


def _begun(run: Run, start: int, trace: Trace, of: int) -> Ending:
    """Ahead of a segment's first sample."""
    plan, rest, zero = run.plan, run.starts[0, start], run.kind(0)
    v = run.v_rest[0, start]
    for memory, past in ((m, v if name == "feedback" else rest.constant) for name, m in run.memory.items()):
        for one in memory:
            one.settle(0, past)
    scheduled = plan.schedule is not None or plan.tuning is not None
    increment = zero if scheduled else run.increment(run.kind(plan.constant_gain) * v)
    return replace(
        _ended(run, 0, trace, of),
        error=run.e[0, :0],
        filtered=run.v[0, :0],
        carry=zero,
        inner=zero,
        r=run.r_rest[0, start] if plan.inner else zero,
        integral=run.wide(rest.u0),
        increment=increment,
        starting=scheduled,
        aim=begun(plan, run.scenario, run.kind, 0, start),
    )
