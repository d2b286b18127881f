"""C that runs a plan's controller over arrays, on any machine, and the arrays it takes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from focgen.arrays import Kind, Numbers
from focgen.codegen.conversions import period_us, tried_conversions
from focgen.codegen.manifest import lsbs
from focgen.codegen.render import render
from focgen.codegen.state import counts_limits
from focgen.plan.plan import Plan
from focgen.plan.scenario import Scenario, Trace
from focgen.plan.tuning import default_params, refused
from focgen.present import present

DTYPES: dict[str, Kind] = {
    "double": np.float64,
    "float": np.float32,
    "int64_t": np.int64,
    "int32_t": np.int32,
    "int16_t": np.int16,
}
_RESET, _TRACK, _SAVE, _TUNE = 1, 2, 64, 128
_DAMAGES = {"error": 16, "all": 32, "integral": 48, "limits": 48, "gains": 48}
REFUSED = 128
"""Beside the flags of a step: a reset or a track ahead of it has raised INPUT or INVALID."""
UNTUNED = 64
"""Beside them, too: of parameters something else has been said than :func:`refused` does."""
CALLS = ("init", "reset", "track", "save", "restore", "tune")
"""The calls that NAME_call makes, by number."""
PREPARE = len(CALLS)
"""The number for which it takes parameters ready, so that ``tune`` is nothing but the call."""
RESUME = 4
"""Event of a first sample: go on from the state that is there, without init."""


@dataclass(frozen=True)
class DriverContext:
    """Everything ``driver.c.jinja`` asks for."""

    name: str
    increment: str
    scheduled: bool
    integral: bool
    held: str
    scales: tuple[str, ...]
    conversions: tuple[str, ...]
    fixed: bool
    refusing: str
    left: str
    tunable: bool
    width: int
    beyond: str


def driver(plan: Plan) -> str:
    """C that runs a plan's controller over arrays."""
    return render("driver.c.jinja", driver_context(plan))


def driver_context(plan: Plan) -> DriverContext:
    """What a driver asks for of a plan."""
    scheduled, integral = plan.schedule is not None, plan.integrator is not None
    held = f"({plan.name}_flags(state) & {plan.name.upper()}_FLAG_INVALID) ? 0 : " if plan.floating else ""
    scales = tuple(call or f"{plan.name.upper()}_{macro}" for macro, (call, _) in _calls(plan).items())
    tried = tuple(expression for expression, _ in tried_conversions(plan).values())
    refusing = f"{plan.name.upper()}_FLAG_{'INVALID' if plan.floating else 'INPUT'}"
    fixed = not plan.floating
    high, low = f"{plan.name.upper()}_U_MAX", f"{plan.name.upper()}_U_MIN"
    left = "INT64_MAX" if plan.counted else f"{high} + ({high} - {low})"
    return DriverContext(
        plan.name, plan.increment.ctype, scheduled, integral, held, scales, tried, fixed, refusing, left,
        plan.tuning is not None, given_width(plan), _beyond(plan),
    )  # fmt: skip


def _beyond(plan: Plan) -> str:
    """C that takes the upper limit of a tunable state beyond its box, as it is held in counts where it is."""
    name = plan.name.upper()
    if counts_limits(plan):
        return "state->high = (int64_t)1 << 62"
    return f"state->u_max = {name}_U_MAX + ({name}_U_MAX - {name}_U_MIN)"


def given_width(plan: Plan) -> int:
    """How many values go with the events of a sample: ref, meas, u0, u; then parameters, and what is said of
    them.
    """
    return 4 + (len(plan.tuning.nominal) + 3 if plan.tuning else 0)


def header_scales(plan: Plan) -> dict[str, float]:
    """The values that the header's macros for LSBs, sample time and period must have, by name; and what its
    conversions must give, which are NaN in a header that has none.
    """
    scales = {name: value for name, (_, value) in _calls(plan).items()}
    return {**scales, **{call: value for call, (_, value) in tried_conversions(plan).items()}}


def _calls(plan: Plan) -> dict[str, tuple[str, float]]:
    """By name, the C that gives a number of the header, where it is no macro of that name, and its value."""
    found = {name: ("", value) for name, value in _scales(plan).items()}
    if plan.tuning:
        found["GAIN_LSB"] = "", plan.tuning.factor.lsb
        default = default_params(plan)
        numbers = (*default.gain, default.u_min, default.u_max)
        found |= {f"default {i}": (f"by_default({i})", float(x)) for i, x in enumerate(numbers)}
    return found


def _scales(plan: Plan) -> dict[str, float]:
    exact = plan.arithmetic == "f64"
    time = plan.sample_time if exact else float(np.float32(plan.sample_time))
    period = period_us(plan)
    periods = {} if period is None else {"PERIOD_US": float(period)}
    return {**lsbs(plan), "SAMPLE_TIME": time, **periods}


@dataclass(frozen=True, eq=False)
class Answers:
    """What C gave for a scenario: ``trace``, and the bytes of the state after each lane."""

    trace: Trace
    states: tuple[bytes, ...]


def steps_alone(trace: Trace) -> Trace:
    """A trace from C with the flags of its steps, without what resets and tracks have raised."""
    return replace(trace, flags=present(trace.flags) & np.uint8(UNTUNED - 1))


@dataclass(frozen=True, eq=False)
class Lane:
    """One lane of a scenario as C takes it, in the order of NAME_run's arguments."""

    ref: Numbers
    meas: Numbers
    sched: Numbers
    event: Numbers
    given: Numbers


def lane_of(plan: Plan, scenario: Scenario, lane: int) -> Lane:
    """The arrays of one lane; where nothing is scheduled ``sched`` is there and not looked at."""
    signal = DTYPES[plan.output.ctype]
    sched = scenario.ref if scenario.sched is None else scenario.sched
    ref, meas, by = (
        np.ascontiguousarray(x[lane], dtype=signal) for x in (scenario.ref, scenario.meas, sched)
    )
    return Lane(ref, meas, by, *_events(plan, scenario, lane, signal))


def _events(plan: Plan, scenario: Scenario, lane: int, signal: type) -> tuple[Numbers, Numbers]:
    """What happens ahead of each sample, and its values (ref, meas, u0, u applied; parameters)."""
    event = np.zeros(scenario.samples, np.uint8)
    given: Numbers = np.zeros((scenario.samples, given_width(plan)), signal)
    for at in (scenario.samples // 3, 2 * scenario.samples // 3):
        event[at] |= _SAVE if at else 0
    for r in scenario.resets:
        if r.lane == lane:
            event[r.sample] |= _RESET
            given[r.sample, :3] = r.ref, r.meas, r.u0
    for t in scenario.tracks:
        if t.lane == lane:
            event[t.sample] |= _TRACK
            given[t.sample, 3] = t.u
    for tune in scenario.tunes:
        if tune.lane == lane:
            event[tune.sample] |= _TUNE
            p = tune.params
            given[tune.sample, 4:] = (*p.gain, p.u_min, p.u_max, refused(plan, p))
    for d in scenario.damages:
        if d.lane == lane:
            event[d.sample] |= _DAMAGES[d.what]
            given[d.sample, 0] = {"limits": 1.0, "gains": 2.0}.get(d.what, np.nan)
    return event, given
