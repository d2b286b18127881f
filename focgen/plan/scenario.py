"""What a controller is fed with, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from focgen.plan.model import Format, Plan


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

    ref: np.ndarray
    meas: np.ndarray
    sched: np.ndarray | None = None
    resets: tuple[Reset, ...] = ()
    tracks: tuple[Track, ...] = ()
    damages: tuple[Damage, ...] = ()
    tunes: tuple[Tune, ...] = ()

    @property
    def lanes(self) -> int:
        """How many runs there are."""
        return self.ref.shape[0]

    @property
    def samples(self) -> int:
        """How many samples each has."""
        return self.ref.shape[1]


@dataclass(frozen=True)
class Trace:
    """Answers to a scenario, shape (lanes, samples).

    ``u`` the output and ``d`` the increment, raw counts or physical like the scenario; ``flags`` uint8 (None
    from the ideal). Physical ``d`` is the signal ahead of the integrator: h/2 taken out.
    """

    u: np.ndarray
    d: np.ndarray
    flags: np.ndarray | None = None


def nearest_raw(values, form: Format) -> np.ndarray:
    """Physical values as raw ones, any shape: the nearest count of the type, halves away from zero, or the
    floating value.
    """
    if form.floating:
        return np.asarray(values, dtype=np.float32 if form.ctype == "float" else np.float64)
    top = 1 << (form.bits - 1)
    scaled = np.clip(np.asarray(values, dtype=float) / form.lsb, -top, top)
    whole = np.floor(np.abs(scaled))
    nearest = np.copysign(whole + (np.abs(scaled) - whole >= 0.5), scaled)
    return np.clip(nearest, -top, top - 1).astype(np.int64)


def to_raw(plan: Plan, physical: Scenario) -> Scenario:
    """The raw inputs nearest to physical ones."""
    e, u = plan.error, plan.output
    one = lambda value, form: nearest_raw(value, form)[()]  # noqa: E731
    return Scenario(
        nearest_raw(physical.ref, e),
        nearest_raw(physical.meas, e),
        None if plan.schedule is None else nearest_raw(physical.sched, plan.schedule.signal),
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
    one = lambda value, form: nearest_raw(value, form)[()].item()  # noqa: E731
    gain = tuple(one(factor, plan.tuning.factor) for factor in params.gain)
    return Params(gain, one(params.u_min, plan.output), one(params.u_max, plan.output))


def physical_params(plan: Plan, params: Params) -> Params:
    """The physical parameters that raw ones stand for, exactly."""
    factor, u = plan.tuning.factor.lsb, plan.output.lsb
    gain = tuple(float(count) * factor for count in params.gain)
    return Params(gain, float(params.u_min) * u, float(params.u_max) * u)


def physical_trace(plan: Plan, trace: Trace) -> Trace:
    """A raw trace in physical units, for comparison with the ideal one."""
    half_step = 0.5 * plan.sample_time if plan.integrator else 1.0
    d = np.asarray(trace.d, dtype=float) * (plan.increment.lsb / half_step)
    return Trace(np.asarray(trace.u, dtype=float) * plan.output.lsb, d, trace.flags)
