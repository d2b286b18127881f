"""Floating inputs that can be computed with, and what becomes of a run in which some cannot.

NaN and infinity would poison a history for as long as its memory lasts, and an absurdly large input would
become infinite on its way. An input is usable where its magnitude is below 2^48 (float) or 2^512 (double);
:func:`check_room` proves that no usable input overflows anywhere in a plan. What a step does with any other
is told in :mod:`focgen.plan.plan`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Numbers
from focgen.errors import PlanError
from focgen.fractional.elementary import l1
from focgen.plan.counts import taken_in, values_of
from focgen.plan.plan import FLAG_HIGH, FLAG_INPUT, FLAG_INVALID, FLAG_LOW, Format, Plan, Sum
from focgen.plan.proofs import inverse_of_recursion
from focgen.plan.scenario import Reset, Scenario, Trace, Track, Tune
from focgen.plan.tuning import applied, courses, refused
from focgen.present import present

Held = TypeVar("Held", Reset, Track)

EXPONENT = {"float": 48, "double": 512}
"""log2 of the magnitude from which on an input is not used, by type."""


def usable(values: ArrayLike, form: Format) -> Numbers:
    """Whether raw values can be computed with, any shape; integers always can."""
    if not form.floating:
        return np.ones(np.shape(values), bool)
    made: Numbers = np.abs(np.asarray(values)) < 2.0 ** EXPONENT[form.ctype]
    return made


# ------------------------------------------------------------------------------------------------ the proof


def check_room(plan: Plan) -> None:
    """Raise PlanError where a range is not usable, or where usable inputs could overflow a floating plan."""
    if not plan.floating:
        return
    limit = 2.0 ** EXPONENT[plan.error.ctype]
    wide = [f for f in (plan.reference, plan.measurement, _signal(plan)) if f and _largest(f) >= limit]
    top = float(np.finfo(np.float32 if plan.error.ctype == "float" else np.float64).max)
    with np.errstate(over="ignore"):
        if not wide and reach(plan, 2.0 * limit) <= top / 4.0:
            return
    remedy = "give [ranges] in units that are nearer to 1" + (", or choose f64" if limit < 2.0**512 else "")
    what = "a range" if wide else "the gain for an input"
    raise PlanError(plan.name, f"{what} is too large for {plan.arithmetic}", remedy)


def reach(plan: Plan, error: float) -> float:
    """A bound on every intermediate magnitude of a floating plan for |e| ≤ ``error``, from l1 norms."""
    r = l1_of(plan.inner.rest) * error if plan.inner else 0.0
    z = _largest(plan.inner.state) * plan.inner.state.lsb if plan.inner else 0.0
    v = filtered_reach(plan, error)
    after = l1_of(plan.direct) * error + z + (l1_of(plan.feedback.table) * v if plan.feedback else 0.0)
    drives = [_drive(table) * (error if table.history == "error" else v) for table in plan.sums]
    gain = max(abs(plan.gain.low), abs(plan.gain.high))
    return max(after, z + 2.0 * r, v, _largest(plan.output) + 2.0 * gain * v, *drives)


def filtered_reach(plan: Plan, error: float) -> float:
    """A bound on |v| of a floating plan for |e| ≤ ``error``, and for what a reset makes of it."""
    p = l1_of(plan.direct) * error
    if plan.inner:
        p += _largest(plan.inner.state) * plan.inner.state.lsb
    if plan.feedback is None:
        return p
    own = inverse_of_recursion(plan)
    return max(own.norm * p, abs(plan.feedback.steady) * error) if own else np.inf


def l1_of(table: Sum | None) -> float:
    """Of taps, and of modes, whose drives reach 2 m times what drives them."""
    if table is None:
        return 0.0
    modes = sum(2.0 * bank.differences * l1(bank.values) for bank in table.banks)
    return l1(table.values) + modes


def _drive(table: Sum) -> float:
    """How far the drive of any mode can be, for a history of at most 1; 0 where there is none. A mean and
    what it still has to take up are less.
    """
    return max((2.0 * bank.differences for bank in table.banks), default=0.0)


def _largest(form: Format) -> float:
    return max(abs(form.low), abs(form.high))


def _signal(plan: Plan) -> Format | None:
    return plan.schedule.signal if plan.schedule else None


# -------------------------------------------------------------------------------------------- the reference


def invalid_samples(plan: Plan, scenario: Scenario) -> Numbers:
    """Which steps have an input that cannot be used; shape (lanes, samples)."""
    good = usable(scenario.ref, plan.reference) & usable(scenario.meas, plan.measurement)
    if plan.schedule:
        good = good & usable(present(scenario.sched), plan.schedule.signal)
    return ~good


def holding(
    plan: Plan, scenario: Scenario, invalid: Numbers, execute: Callable[[Plan, Scenario], Trace]
) -> Trace:
    """Run a scenario whose ``invalid`` samples are left out, and hold the output there.

    ``execute`` runs a scenario that has none. d is 0 where a step was left out.
    """
    order = _good_first(invalid)
    ran = execute(plan, good_samples(plan, scenario, invalid))
    low, high = limits_of(plan, scenario)
    u, d, flags = (np.zeros_like(part) for part in (ran.u, ran.d, ran.flags))
    for whole, part in ((u, ran.u), (d, ran.d), (flags, ran.flags)):
        np.put_along_axis(whole, order, present(part), axis=1)
    for lane in np.flatnonzero(invalid.any(axis=1)):
        _hold(plan, scenario, int(lane), invalid[lane], u[lane])
    ends = FLAG_HIGH * (u >= high) + FLAG_LOW * (u <= low)
    flags = np.where(invalid, ends + FLAG_INVALID, flags).astype(np.uint8)
    return Trace(u, np.where(invalid, d.dtype.type(0), d), flags)


def limits_of(plan: Plan, scenario: Scenario) -> tuple[Numbers, Numbers]:
    """The output's limits at every sample of a raw scenario, raw, shape (lanes, samples)."""
    low, high = (np.full(scenario.ref.shape, end, scenario.ref.dtype.type) for end in _ends(plan))
    for lane, course in (courses(plan, scenario) if plan.tuning else {}).items():
        for sample, now in course[1:]:
            low[lane, sample:], high[lane, sample:] = now.low, now.high
    return low, high


def _ends(plan: Plan) -> tuple[float, float]:
    return plan.output.low, plan.output.high


def _good_first(invalid: Numbers) -> Numbers:
    """The order of samples in which the good ones come first, as they stand."""
    return np.argsort(invalid, axis=1, kind="stable")


def good_samples(plan: Plan, scenario: Scenario, invalid: Numbers) -> Scenario:
    """The good samples of each lane, then zeros; an event comes before the next good sample.

    Parameters are taken ahead of a reset and a track there, so where these came first the values that they
    set are limited as the parameters would have.
    """
    order = _good_first(invalid)
    signals: dict[str, Any] = {
        name: np.take_along_axis(np.where(invalid, values.dtype.type(0), values), order, axis=1)
        for name in ("ref", "meas", "sched")
        if (values := getattr(scenario, name)) is not None
    }
    place = np.cumsum(~invalid, axis=1) - ~invalid
    resets: dict[tuple[int, int], Reset] = {}
    tracks: dict[tuple[int, int], Track] = {}
    tunes: list[Tune] = []
    ends = dict.fromkeys(range(scenario.lanes), _ends(plan))
    for event in events(scenario):
        at = event.lane, int(place[event.lane, event.sample])
        if isinstance(event, Track) and not usable(event.u, plan.output):
            continue  # and must not displace one that is usable
        if isinstance(event, Reset):
            tracks.pop(at, None)  # what was tracked before is forgotten
        if isinstance(event, Tune):
            tunes.append(replace(event, sample=at[1]))
            ends[event.lane] = _taken(plan, event, ends[event.lane])
            if at in resets:
                resets[at] = _limited(plan, resets[at], "u0", ends[event.lane])
            if at in tracks:
                tracks[at] = _limited(plan, tracks[at], "u", ends[event.lane])
        elif isinstance(event, Reset):
            resets[at] = _limited(plan, replace(event, sample=at[1]), "u0", ends[event.lane])
        else:
            tracks[at] = _limited(plan, replace(event, sample=at[1]), "u", ends[event.lane])
    return Scenario(
        **signals, resets=tuple(resets.values()), tracks=tuple(tracks.values()), tunes=tuple(tunes)
    )


def _taken(plan: Plan, event: Tune, ends: tuple[float, float]) -> tuple[float, float]:
    """The limits after an event that may change them."""
    if refused(plan, event.params):
        return ends
    now = applied(plan, event.params)
    return now.low, now.high


def _limited(plan: Plan, event: Held, name: str, ends: tuple[float, float]) -> Held:
    """An event whose output is within limits; one that cannot be used stands for 0."""
    value = getattr(event, name)
    if plan.tuning is None:
        return event
    value = value if usable(value, plan.output) else type(value)(0)
    kept: dict[str, Any] = {name: type(value)(min(max(value, ends[0]), ends[1]))}
    return replace(event, **kept)


def events(scenario: Scenario) -> list[Reset | Track | Tune]:
    """Tunes, resets and tracks in the order in which they happen."""
    found: list[Reset | Track | Tune] = [
        *scenario.tunes,
        *scenario.resets,
        *scenario.tracks,
    ]  # the sort keeps it within a sample
    return sorted(found, key=lambda event: event.sample)


def standing(plan: Plan, u: np.floating, ends: tuple[float, float]) -> np.floating:
    """The output that stands once ``u`` is kept within the limits ``ends``. Kept in counts, a limit that is
    no whole number of them is not met exactly.
    """
    kind = type(u)
    kept = limited = min(max(u, kind(ends[0])), kind(ends[1]))
    if plan.integrator and not plan.integrator.state.floating:
        kept = kind(values_of(taken_in(limited, plan.integrator.state), plan.integrator.state))
    return min(max(kept, kind(ends[0])), kind(ends[1]))


def _hold(plan: Plan, scenario: Scenario, lane: int, invalid: Numbers, u: Numbers) -> None:
    """Fill in the outputs of steps that were left out, in place."""
    kind, ends = u.dtype.type, _ends(plan)

    def limited(value: Any) -> Any:
        return standing(plan, kind(value), ends)

    happening: dict[int, list[Any]] = {}
    for event in events(scenario):
        if event.lane == lane:
            happening.setdefault(event.sample, []).append(event)
    now = limited(0)
    for k in range(len(u)):
        returned = None
        for event in happening.get(k, ()):
            if isinstance(event, Tune):
                ends = _taken(plan, event, ends)
                now = limited(now)
                continue
            if isinstance(event, Reset):
                now = limited(0)
            given, keeps = (event.u0, event.keeps) if isinstance(event, Reset) else (event.u, False)
            if (plan.integrator or keeps) and usable(given, plan.output):
                now = limited(given)
                returned = kind(given) if keeps else None  # and kept after that
        if invalid[k]:
            u[k] = now if returned is None else returned
        else:
            now = u[k]


def refused_events(plan: Plan, scenario: Scenario, flags: Numbers) -> Numbers:
    """Ahead of which samples a reset or a track has left INPUT or INVALID raised; ``flags`` of every step and
    the result have the shape (lanes, samples).

    A track leaves what the step before has raised, a reset does not.
    """
    raised, found = FLAG_INVALID | FLAG_INPUT, np.zeros(flags.shape, bool)
    ends = dict.fromkeys(range(scenario.lanes), _ends(plan))
    begun = {(r.lane, r.sample) for r in scenario.resets}
    for event in events(scenario):
        at = event.lane, event.sample
        if isinstance(event, Tune):
            ends[event.lane] = _taken(plan, event, ends[event.lane])
            continue
        output = replace(plan.output, low=ends[event.lane][0], high=ends[event.lane][1])
        if isinstance(event, Reset):
            found[at] = _refused(plan, (event.ref, plan.reference), (event.meas, plan.measurement))
            given = event.u0
        else:
            found[at] |= (
                at not in begun and event.sample > 0 and bool(flags[event.lane, event.sample - 1] & raised)
            )
            given = event.u
        found[at] |= plan.integrator is not None and _refused(plan, (given, output))
    return found


def _refused(plan: Plan, *values: tuple[float, Format]) -> bool:
    if plan.floating:
        return not all(usable(value, form) for value, form in values)
    return not all(form.low <= value <= form.high for value, form in values)
