"""What a controller is fed with, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Numbers
from focgen.plan.plan import Format, Plan
from focgen.present import present


@dataclass(frozen=True)
class Reset:
    """``reset(ref, meas, u0)`` of one lane before sample ``sample``; the values like the scenario's.

    ``keeps``, of the reference alone: it has begun anew by itself, and the output that stands is ``u0``
    without an integrator, too.
    """

    lane: int
    sample: int
    ref: float
    meas: float
    u0: float
    keeps: bool = False


@dataclass(frozen=True)
class Track:
    """``track(u)`` of one lane before sample ``sample``; at the same sample it comes after a reset."""

    lane: int
    sample: int
    u: float


@dataclass(frozen=True)
class Params:
    """What NAME_params holds, raw or physical: a factor on each gain, and the output's limits."""

    gain: tuple[float, ...]
    u_min: float
    u_max: float


@dataclass(frozen=True)
class Tune:
    """``tune(params)`` of one lane before sample ``sample``; there it comes before a reset, and after tunes
    that stand before it.
    """

    lane: int
    sample: int
    params: Params


@dataclass(frozen=True)
class Damage:
    """What a run cannot do, in a floating state before sample ``sample``, whose inputs can be used: ``what``
    is the latest "error", which becomes NaN, the "integral", which leaves its limits, the "limits" or the
    "gains" of a tunable plan, which leave their box, or "all", every byte becoming 0xff.
    """

    lane: int
    sample: int
    what: str = "error"


@dataclass(frozen=True)
class Scenario:
    """Inputs of several independent runs ("lanes"), shape (lanes, samples), each starting from init.

    Raw: counts (integers) or the type's floating values, as the C takes them. Physical: the same in physical
    units. ``sched`` is None where nothing is scheduled. At most one reset and one track a lane and sample;
    at most one damage, without a reset.
    """

    ref: Numbers
    meas: Numbers
    sched: Numbers | None = None
    resets: tuple[Reset, ...] = ()
    tracks: tuple[Track, ...] = ()
    damages: tuple[Damage, ...] = ()
    tunes: tuple[Tune, ...] = ()

    @property
    def lanes(self) -> int:
        """How many runs there are."""
        made: int = self.ref.shape[0]
        return made

    @property
    def samples(self) -> int:
        """How many samples each has."""
        made: int = self.ref.shape[1]
        return made


@dataclass(frozen=True)
class Trace:
    """Answers to a scenario, shape (lanes, samples).

    ``u`` the output and ``d`` the increment, raw counts or physical like the scenario; ``flags`` uint8 (None
    from the ideal). Physical ``d`` is the signal ahead of the integrator: h/2 taken out.
    """

    u: Numbers
    d: Numbers
    flags: Numbers | None = None


def nearest_raw(values: ArrayLike, form: Format) -> Numbers:
    """Physical values as raw ones, any shape: the nearest count of the type, halves away from zero, or the
    floating value.
    """
    if form.floating:
        return np.asarray(values, dtype=np.float32 if form.ctype == "float" else np.float64)
    top = 1 << (form.bits - 1)
    scaled = np.clip(np.asarray(values, dtype=float) / form.lsb, -top, top)
    whole = np.floor(np.abs(scaled))
    nearest = np.copysign(whole + (np.abs(scaled) - whole >= 0.5), scaled)
    made: Numbers = np.clip(nearest, -top, top - 1).astype(np.int64)
    return made


def _nearest_one(value: float, form: Format) -> Any:
    """The nearest raw value of one physical value, of the type's own kind."""
    return nearest_raw(value, form)[()]


def to_raw(plan: Plan, physical: Scenario) -> Scenario:
    """The raw inputs nearest to physical ones."""
    e, u, one = plan.error, plan.output, _nearest_one
    return Scenario(
        nearest_raw(physical.ref, e),
        nearest_raw(physical.meas, e),
        None if plan.schedule is None else nearest_raw(present(physical.sched), plan.schedule.signal),
        tuple(Reset(r.lane, r.sample, one(r.ref, e), one(r.meas, e), one(r.u0, u)) for r in physical.resets),
        tuple(Track(t.lane, t.sample, one(t.u, u)) for t in physical.tracks),
        tunes=tuple(replace(t, params=raw_params(plan, t.params)) for t in physical.tunes),
    )


def to_physical(plan: Plan, raw: Scenario) -> Scenario:
    """The physical inputs that raw ones stand for, exactly."""
    e, u = plan.error.lsb, plan.output.lsb
    sched = None if plan.schedule is None else np.asarray(raw.sched, dtype=float) * plan.schedule.signal.lsb
    return Scenario(
        np.asarray(raw.ref, dtype=float) * e,
        np.asarray(raw.meas, dtype=float) * e,
        sched,
        tuple(
            Reset(r.lane, r.sample, float(r.ref) * e, float(r.meas) * e, float(r.u0) * u) for r in raw.resets
        ),
        tuple(Track(t.lane, t.sample, float(t.u) * u) for t in raw.tracks),
        tunes=tuple(replace(t, params=physical_params(plan, t.params)) for t in raw.tunes),
    )


def raw_params(plan: Plan, params: Params) -> Params:
    """The raw parameters nearest to physical ones."""
    gain = tuple(_nearest_one(factor, plan.box.factor).item() for factor in params.gain)
    low, high = (_nearest_one(end, plan.output).item() for end in (params.u_min, params.u_max))
    return Params(gain, low, high)


def physical_params(plan: Plan, params: Params) -> Params:
    """The physical parameters that raw ones stand for, exactly."""
    factor, u = present(plan.tuning).factor.lsb, plan.output.lsb
    gain = tuple(float(count) * factor for count in params.gain)
    return Params(gain, float(params.u_min) * u, float(params.u_max) * u)


def physical_trace(plan: Plan, trace: Trace) -> Trace:
    """A raw trace in physical units, for comparison with the ideal one."""
    half_step = 0.5 * plan.sample_time if plan.integrator else 1.0
    d = np.asarray(trace.d, dtype=float) * (plan.increment.lsb / half_step)
    return Trace(np.asarray(trace.u, dtype=float) * plan.output.lsb, d, trace.flags)
